// SPDX-License-Identifier: Apache-2.0
#include "services/cli/models/table.h"

#include <cmath>
#include <ostream>

#include "experiments/csv.h"
#include "services/cli/subcommand.h"

namespace tandem::cli {

Table::Table(std::ostream& out, std::vector<std::string> names, bool json)
    : out_(out), names_(std::move(names)), json_(json) {
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
      object[names_[i]] = numbers[i];
    object["status"] = status;
    rows_.push_back(object);
    return;
  }
  for (std::size_t i = 0; i < names_.size(); ++i)
    out_ << (numbers.empty() ? "" : experiments::number(numbers[i])) << ',';
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
