// SPDX-License-Identifier: Apache-2.0
/** @file Body of an arm for display. */
#pragma once

#include <cstdint>
#include <vector>

#include "kinematics/arm_model.h"

namespace tandem::robots {

/** Points along a backbone, evenly spaced from the entry point to the tip; the members of a message Shape. */
struct DisplayShape {
  std::vector<float> points;        ///< x y z of each, m, robot base frame
  std::vector<std::uint8_t> tubes;  ///< outermost tube, from 1
  std::vector<float> outer_radius;  ///< m
};

/// Shape without a load. @param q  joints of the arm, m, rad @param branch  of an elastic model; it is updated
/// @param buffer  reused memory @return false, with `shape` unchanged, if the model has no solution at q
bool displayShape(const kinematics::ArmModel& model,
                  const kinematics::JointsRef& q,
                  kinematics::Branch& branch,
                  std::vector<kinematics::ShapePoint>& buffer,
                  DisplayShape& shape);

}  // namespace tandem::robots
