// SPDX-License-Identifier: Apache-2.0
/** @file Declarations of all RobotType implementations; only for the table in robot_type.cpp. */
#pragma once

#include "robots/robot_type.h"

namespace tandem::robots {

const RobotType& tubeType();
const RobotType& catheterType();
const RobotType& planarType();

}  // namespace tandem::robots
