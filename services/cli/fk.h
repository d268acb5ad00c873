// SPDX-License-Identifier: Apache-2.0
/** @file What the parts of `tandem fk` share. */
#pragma once

#include <filesystem>
#include <string>

#include "services/cli/table.h"

namespace tandem::cli {

struct FkOptions {
  std::string robot = "ark2024", arm = "a", model = "rigid", csv = "-", wrench;
  bool jacobian = false, compliance = false, branch = false, follow = false, end_angles = false;
  bool shape_details = false, json = false;
  int shape = 0;
};

/// A row without an answer; among points of a shape it has its number.
void addUnanswered(const FkOptions& options, int row, const std::string& why, Table& table);

/// Forward kinematics of a catheter of a cooperative robot: rows of insertion (m), roll, bend (rad).
/// @throw Failure(kUsage) for an option that a catheter does not have.
int catheterFk(const FkOptions& options, const std::filesystem::path& file);

}  // namespace tandem::cli
