// SPDX-License-Identifier: Apache-2.0
#include "services/cli/legend.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

namespace tandem::cli {
namespace {

constexpr std::array<std::pair<std::string_view, std::string_view>, 9> kMeanings{{
    {"converged", "points that were left with all errors within the tolerance, of all points"},
    {"outside", "control periods after which a joint was outside a limit"},
    {"gate", "interventions: setpoints of joints that the gate, the last check before the drives, changed"},
    {"guards", "checks of the gate that have intervened since the start, with how often; none: it changed no setpoint"},
    {"margin", "smallest elastic stability of an arm in all runs: 1 without load, 0 where a tube snaps"},
    {"no reach", "tasks out of reach that ended as such, of all those tasks"},
    {"snaps", "jumps of the simulated arms to another equilibrium"},
    {"contact", "runs in which the arms touched"},
    {"restricted", "limits that held a task back, with the share of the control periods"},
}};

}  // namespace

std::string legend(std::initializer_list<std::string_view> words) {
  std::string text = "What is printed:\n";
  for (const std::string_view word : words) {
    const auto* const found = std::ranges::find(kMeanings, word, &decltype(kMeanings)::value_type::first);
    if (found == kMeanings.end())
      throw std::logic_error("no meaning of " + std::string(word));
    text += "  " + std::string(word) + std::string(12 - std::min<std::size_t>(word.size(), 11), ' ') +
            std::string(found->second) + '\n';
  }
  return text;
}

}  // namespace tandem::cli
