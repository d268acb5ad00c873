// SPDX-License-Identifier: Apache-2.0
#include "services/cli/models/table.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <ostream>

#include "experiments/csv.h"
#include "services/cli/subcommand.h"

namespace tandem::cli {

namespace {

constexpr double kMillimetresPerMetre = 1e3, kDegreesPerRadian = 180.0 / std::numbers::pi;

/// Factor from SI to mm or degrees for what a column has; 1 for others. Ends their names with the unit.
double toMillimetres(std::string& name) {
  const auto is = [&](std::initializer_list<const char*> all) { return std::ranges::find(all, name) != all.end(); };
  const auto begins = [&](const char* start) { return name.starts_with(start); };
  const bool length = is({"x", "y", "z", "s", "stability_at"});
  const bool angle = begins("alpha_") || begins("theta_") || begins("psi_");
  name += length ? "_mm" : angle ? "_deg" : "";
  return length ? kMillimetresPerMetre : angle ? kDegreesPerRadian : 1.0;
}

}  // namespace

Table::Table(std::ostream& out, std::vector<std::string> names, bool json, bool millimetres)
    : out_(out), names_(std::move(names)), json_(json) {
  for (std::string& name : names_)
    factors_.push_back(millimetres ? toMillimetres(name) : 1.0);
  if (json_)
    return;
  for (const std::string& name : names_)
    out_ << name << ',';
  out_ << "status\n";
}

void Table::add(const std::vector<double>& numbers, const std::string& status) {
  if (json_) {
    nlohmann::ordered_json object;
    for (std::size_t i = 0; i < numbers.size(); ++i)
      object[names_[i]] = factors_[i] * numbers[i];
    object["status"] = status;
    rows_.push_back(object);
    return;
  }
  for (std::size_t i = 0; i < names_.size(); ++i)
    out_ << (numbers.empty() ? "" : experiments::number(factors_[i] * numbers[i])) << ',';
  out_ << statusField(status) << '\n';
}

bool Table::finish() {
  if (json_)
    out_ << rows_.dump(2) << '\n';
  return static_cast<bool>(out_.flush());
}

std::vector<std::string> numbered(const std::string& name, int count) {
  std::vector<std::string> names;
  for (int i = 1; i <= count; ++i)
    names.push_back(name + "_" + std::to_string(i));
  return names;
}

std::vector<std::string> numbered(const std::string& name, int rows, int columns) {
  std::vector<std::string> names;
  for (int i = 1; i <= rows; ++i) {
    for (int j = 1; j <= columns; ++j)
      names.push_back(name + std::to_string(i) + std::to_string(j));
  }
  return names;
}

}  // namespace tandem::cli
