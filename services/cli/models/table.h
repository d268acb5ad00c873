// SPDX-License-Identifier: Apache-2.0
/** @file Rows of named numbers, written as CSV or JSON. */
#pragma once

#include <iosfwd>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace tandem::cli {

/** Rows of numbers with a status at the end: CSV with one header line, or a list of JSON objects. */
class Table {
 public:
  /// Writes the header of a CSV. @param names of the columns before `status`
  /// @param millimetres  places, arc lengths and angles in mm and degrees, with names that say so ("x_mm", "psi_1_deg")
  Table(std::ostream& out, std::vector<std::string> names, bool json, bool millimetres = false);
  /// A row, SI; without numbers their fields stay empty. NaN is an empty field, or null.
  void add(const std::vector<double>& numbers, const std::string& status);
  /// Ends the output. @return false where it could not be written.
  bool finish();

  const std::vector<std::string>& names() const { return names_; }

 private:
  std::ostream& out_;
  std::vector<std::string> names_;
  std::vector<double> factors_;  ///< of the columns, to what is written
  bool json_;
  nlohmann::ordered_json rows_ = nlohmann::ordered_json::array();
};

/// "name_1", ..., "name_n".
std::vector<std::string> numbered(const std::string& name, int count);

/// "name11", "name12", ... of a matrix, by rows.
std::vector<std::string> numbered(const std::string& name, int rows, int columns);

/// Appends a list to a list.
template <class T>
void append(std::vector<T>& list, const std::vector<T>& more) {
  list.insert(list.end(), more.begin(), more.end());
}

}  // namespace tandem::cli
