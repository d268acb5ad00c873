// SPDX-License-Identifier: Apache-2.0
/** @file Export of tables to files for spreadsheets, MATLAB and Python. All values in SI units.
 *
 * Beside the members of a message each table has time_s (s since `start`), log_time_ns and publish_time_ns (ns since
 * the epoch) and sequence_of_writer. The aligned table has time_s and log_time_ns.
 */
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "recording/table.h"

namespace tandem::recording {

struct ExportSet {
  std::vector<Table> tables;
  std::optional<AlignedTable> aligned;
  std::uint64_t start = 0;                   ///< ns since the epoch, origin of time_s
  std::map<std::string, std::string> about;  ///< metadata; not exported to CSV
};

/// Creates a folder with one file per table: "actuation_state.csv", "aligned.csv". An array becomes one column per
/// element, "position[0]" (nameColumns() gives each a name); numbers have full precision. @throw std::runtime_error
/// that names the file.
void exportCsv(const ExportSet& set, const std::filesystem::path& folder);

/// One MATLAB file (version 5, compressed) with a struct per table, "actuation_state"; its fields are matrices with one
/// row per message, texts are cell arrays. 64-bit integers keep their type. @throw as exportCsv()
void exportMat(const ExportSet& set, const std::filesystem::path& file);

/// One HDF5 file with a group per table, "/actuation_state", and a data set per member. @throw as exportCsv()
void exportHdf5(const ExportSet& set, const std::filesystem::path& file);

/// Name that is valid in all formats: "arm_a/measured_js" -> "arm_a_measured_js", "tasks[0].kind" -> "tasks_0_kind".
std::string plainName(const std::string& name);

}  // namespace tandem::recording
