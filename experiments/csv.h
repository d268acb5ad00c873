// SPDX-License-Identifier: Apache-2.0
/** @file Comma separated values: SI, one header line, numbers as the shortest text that reads back to the same value.
 */
#pragma once

#include <iosfwd>
#include <span>
#include <string>
#include <vector>

#include "experiments/run_record.h"

namespace tandem::experiments {

/// Shortest text that reads back to the same double; "" for NaN, "inf" and "-inf".
std::string number(double value);

/** Reads rows of numbers without header. Blank lines are kept as rows that cannot be answered. */
struct CsvRow {
  int line = 0;  ///< counts from 1
  std::vector<double> values;
  std::string error;  ///< not empty: what is wrong with this row
};
/// @param columns  how many numbers a row has. Throws nothing about contents: every bad row says why in `error`.
std::vector<CsvRow> readRows(std::istream& in, int columns);

/// <trajectory>-<configuration>-<method>.csv: a row an iteration.
void writeRun(std::ostream& out, const RunRecord& record, const config::Robot& robot);

/// summary.csv: a row a run; errors in mm.
void writeSummary(std::ostream& out, std::span<const RunSummary> runs, bool gate = true);

}  // namespace tandem::experiments
