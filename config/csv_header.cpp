// SPDX-License-Identifier: Apache-2.0
#include "config/csv_header.h"

#include <algorithm>
#include <charconv>

#include "config/config.h"

namespace tandem::config {
namespace {

bool isNumber(const std::string& field) {
  double value = 0.0;
  const char* begin = field.data() + (field.starts_with('+') ? 1 : 0);
  const auto [end, status] = std::from_chars(begin, field.data() + field.size(), value);
  return status == std::errc() && end == field.data() + field.size();
}

/// Whether a header names this column, and with which unit.
struct Match {
  bool is_it = false;
  const Unit* unit = nullptr;
};

Match match(const std::string& field, const CsvColumn& column) {
  if (field == column.name)
    return {true, nullptr};
  for (const Unit* unit : unitsOf(column.quantity)) {
    if (field == column.name + '_' + std::string(unit->suffix))
      return {true, unit};
  }
  return {};
}

/// "beta_1_mm, beta_1_m".
std::string spellings(const CsvColumn& column) {
  std::string text;
  for (const Unit* unit : unitsOf(column.quantity))
    text += (text.empty() ? "" : ", ") + column.name + '_' + std::string(unit->suffix);
  return text.empty() ? column.name : text;
}

}  // namespace

std::vector<std::string> csvFields(const std::string& line) {
  std::vector<std::string> fields;
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    const std::size_t first = std::min(line.find_first_not_of(" \t\r", begin), end);
    std::size_t last = end;
    while (last > first && std::string(" \t\r").find(line[last - 1]) != std::string::npos)
      --last;
    fields.push_back(line.substr(first, last - first));
    begin = end + 1;
  }
  return fields;
}

std::optional<CsvLayout> readCsvHeader(const std::string& line,
                                       const std::vector<CsvColumn>& wanted,
                                       const std::string& file) {
  const std::vector<std::string> fields = csvFields(line);
  const bool has_names = std::ranges::any_of(fields, [](const std::string& field) {
    return !field.empty() && !isNumber(field) && std::isalpha(static_cast<unsigned char>(field[0])) != 0;
  });
  if (!has_names || std::ranges::any_of(fields, isNumber))
    return std::nullopt;
  CsvLayout layout;
  layout.fields = fields.size();
  for (const CsvColumn& column : wanted) {
    std::optional<CsvLayout::Place> found;
    for (std::size_t i = 0; i < fields.size(); ++i) {
      const Match here = match(fields[i], column);
      if (!here.is_it)
        continue;
      if (found)
        throw Error(file, 1, 1, "", "found column " + column.name + " twice, expected it once");
      found = {i, here.unit};
    }
    if (!found)
      throw Error(file, 1, 1, "",
                  "found no column " + column.name + " in '" + line.substr(0, 80) + "', expected " + spellings(column));
    layout.places.push_back(*found);
  }
  return layout;
}

}  // namespace tandem::config
