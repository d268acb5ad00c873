// SPDX-License-Identifier: Apache-2.0
/** @file Arms by what people call them. */
#pragma once

#include <optional>
#include <string>

#include "config/config.h"

namespace tandem::config {

/// Index of the arm of that name, or of arm_NAME.
std::optional<std::size_t> findArm(const Robot& robot, const std::string& name);

/// "arm_a, arm_b", for errors.
std::string armNames(const Robot& robot);

}  // namespace tandem::config
