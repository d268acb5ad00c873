// SPDX-License-Identifier: Apache-2.0
/** @file Implementations of RobotType, for its table alone. */
#pragma once

#include "robots/robot_type.h"

namespace tandem::robots {

const RobotType& tubeType();
const RobotType& catheterType();
const RobotType& planarType();

}  // namespace tandem::robots
