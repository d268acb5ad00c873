// SPDX-License-Identifier: Apache-2.0
#include "sim/drives/faults.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace tandem::sim::drives {
namespace {

constexpr std::array<std::string_view, kFaultKinds> kNames{
    "off",          "stuck",        "garbage",          "wrong",         "slow",           "delayed",
    "intermittent", "over_current", "over_temperature", "encoder_alarm", "frame_loss",     "byte_flips",
    "bus_off",      "babbling",     "runaway",          "brake_failure", "emergency_stop", "overload"};

constexpr double kLongest = 1e6;  // s
constexpr double kLargest = 1e9;  // of a value: all times that follow from it are counted in ns

std::string allNames() {
  std::string text;
  for (const std::string_view one : kNames)
    text += (text.empty() ? "" : ", ") + std::string(one);
  return text;
}

FaultKind requireFault(const std::string& word) {
  const auto kind = faultFromName(word);
  if (!kind)
    throw std::invalid_argument("fault '" + word + "', expected one of " + allNames());
  return *kind;
}

/// @throw std::invalid_argument unless it is a number of at most this magnitude
double requireNumber(const std::string& word, const char* what, double most) {
  std::size_t used = 0;
  double value = 0.0;
  try {
    value = std::stod(word, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (used == 0 || used != word.size() || !(std::abs(value) <= most)) {
    std::ostringstream text;
    text << what << " '" << word << "', expected a number, at most " << most;
    throw std::invalid_argument(text.str());
  }
  return value;
}

std::uint8_t requireNode(std::istringstream& in) {
  std::string word;
  if (!(in >> word))
    throw std::invalid_argument("expected a node id, 0 for the bus");
  const double id = requireNumber(word, "node", 127);
  if (id < 0 || id > 127 || id != std::floor(id))
    throw std::invalid_argument("node '" + word + "', expected 0 to 127");
  return static_cast<std::uint8_t>(id);
}

void readInjection(std::istringstream& in, Injection& injection) {
  std::string word;
  injection.node = requireNode(in);
  if (!(in >> word))
    throw std::invalid_argument("expected a fault, one of " + allNames());
  injection.kind = requireFault(word);
  while (in >> word) {
    if (word == "for") {
      if (!(in >> word))
        throw std::invalid_argument("expected a number of seconds after 'for'");
      injection.duration = requireNumber(word, "duration", kLongest);
      if (injection.duration <= 0.0)
        throw std::invalid_argument("duration '" + word + "', expected more than 0 s");
    } else {
      injection.value = requireNumber(word, "value", kLargest);
    }
  }
}

}  // namespace

std::string_view name(FaultKind kind) { return kNames[static_cast<std::size_t>(kind)]; }

std::optional<FaultKind> faultFromName(std::string_view name) {
  const auto* found = std::ranges::find(kNames, name);
  if (found == kNames.end())
    return std::nullopt;
  return static_cast<FaultKind>(found - kNames.begin());
}

FaultCommand parseFaultCommand(const std::string& line) {
  std::istringstream in(line);
  std::string word;
  in >> word;
  FaultCommand command;
  if (word == "inject") {
    command.kind = FaultCommand::Kind::kInject;
    readInjection(in, command.injection);
  } else if (word == "clear") {
    command.kind = FaultCommand::Kind::kClear;
    command.node = requireNode(in);
    if (in >> word)
      command.fault = requireFault(word);
  } else if (word == "turn") {
    command.kind = FaultCommand::Kind::kTurn;
    command.node = requireNode(in);
    if (!(in >> word))
      throw std::invalid_argument("expected a number of counts");
    const bool back = word.starts_with('-');
    command.counts = (back ? -1.0 : 1.0) * requireNumber(back ? word.substr(1) : word, "counts", kLargest);
  } else if (word == "mark") {
    command.kind = FaultCommand::Kind::kMark;
  } else if (word != "state") {
    throw std::invalid_argument("'" + word + "', expected inject, clear, turn, state or mark");
  }
  if (in >> word)
    throw std::invalid_argument("'" + word + "' after a complete command, expected the end of the line");
  return command;
}

}  // namespace tandem::sim::drives
