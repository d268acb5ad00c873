// SPDX-License-Identifier: Apache-2.0
/** @file Comma separated values: SI, one header line, numbers as the shortest text that reads back to the same value.
 */
#pragma once

#include <iosfwd>
#include <span>
#include <string>
#include <vector>

#include "config/csv_header.h"
#include "experiments/run_record.h"

namespace tandem::experiments {

/// Shortest text that reads back to the same double; "" for NaN, "inf" and "-inf".
std::string number(double value);

/** A row of numbers. Blank lines are kept as rows that cannot be answered. */
struct CsvRow {
  int line = 0;  ///< counts from 1
  std::vector<double> values;
  std::string error;  ///< not empty: what is wrong with this row
};
/// @param columns  how many numbers a row has. Throws nothing about contents: every bad row says why in `error`.
std::vector<CsvRow> readRows(std::istream& in, int columns);

/// Rows of a table in SI, in the order of `columns`. Its first line may name the columns, in any order, with units
/// ("beta_1_mm") and among others; without such a line the columns follow one another in SI.
/// @throw config::Error for a header without one of them
std::vector<CsvRow> readRows(std::istream& in, const std::vector<config::CsvColumn>& columns, const std::string& file);

/// Names of all joints in tables: beta_a1 of arm_a, beta_left_1 of left.
std::vector<std::string> jointNames(const config::Robot& robot);

/// <trajectory>-<configuration>-<method>.csv: a row an iteration.
void writeRun(std::ostream& out, const RunRecord& record, const config::Robot& robot);

/// summary.csv: a row a run; errors in mm.
void writeSummary(std::ostream& out, std::span<const RunSummary> runs, bool gate = true);

}  // namespace tandem::experiments
