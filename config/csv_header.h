// SPDX-License-Identifier: Apache-2.0
/** @file Optional header of a CSV table: names and units of its columns. */
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "config/units.h"

namespace tandem::config {

/** A column that a table must have. */
struct CsvColumn {
  std::string name;  ///< "beta_1"; a header may end it with a unit: "beta_1_mm"
  Quantity quantity;
};

/** Positions of the columns of a table. */
struct CsvLayout {
  struct Place {
    std::size_t field;  ///< counts from 0
    const Unit* unit;   ///< null: SI
  };
  std::vector<Place> places;  ///< of each column that is wanted, in their order
  std::size_t fields = 0;     ///< of a row; others than the wanted ones are not read
};

/// Fields of a line, without blanks around them.
std::vector<std::string> csvFields(const std::string& line);

/// Layout of the table whose first line this is; nothing for a line of numbers: the wanted columns then follow one
/// another in SI. @throw Error where a column is missing or there twice, or its unit does not fit.
std::optional<CsvLayout> readCsvHeader(const std::string& line,
                                       const std::vector<CsvColumn>& wanted,
                                       const std::string& file);

}  // namespace tandem::config
