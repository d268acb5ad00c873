// SPDX-License-Identifier: Apache-2.0
/** @file Helpers shared by the parts of `tandem fk`. */
#pragma once

#include <filesystem>
#include <functional>
#include <istream>
#include <string>

#include "experiments/csv.h"
#include "services/cli/models/table.h"

namespace tandem::cli {

struct FkOptions {
  std::string robot = "ark2024", arm = "a", model = "rigid", csv = "-", wrench;
  bool jacobian = false, compliance = false, branch = false, follow = false, end_angles = false;
  bool shape_details = false, json = false, millimetres = false;
  int shape = 0;
};

/// Adds what there is to say of a row, counted from 1. @return why it has no answer; empty where it has one
using AnswerRow = std::function<std::string(const experiments::CsvRow& row, int index, Table& table)>;
/// Answers all rows of a file; one without an answer has blanks and the reason, and among points of a shape its number.
/// @return whether all have an answer
/// @param columns  joints of a row
bool answerRows(const FkOptions& options,
                const std::vector<config::CsvColumn>& columns,
                const AnswerRow& answer,
                Table& table);

/// Forward kinematics of a catheter of a cooperative robot: rows of insertion (m), roll, bend (rad).
/// @throw Failure(kUsage) for an option that a catheter does not have.
int catheterFk(const FkOptions& options, const std::filesystem::path& file);

}  // namespace tandem::cli
