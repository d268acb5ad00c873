// SPDX-License-Identifier: Apache-2.0
/** @file Names of joint limits for all robot types. */
#pragma once

#include <string>

#include "config/config.h"
#include "control/conflict.h"

namespace tandem::robots {

/// "rotation limit of tube 2 of arm a"; for a catheter "rotation limit of bend of arm a".
std::string describeLimit(const config::Robot& robot, const control::NamedLimit& limit);

}  // namespace tandem::robots
