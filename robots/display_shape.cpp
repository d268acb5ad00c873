// SPDX-License-Identifier: Apache-2.0
#include "robots/display_shape.h"

namespace tandem::robots {
namespace {

constexpr int kDisplayPoints = 60;

}  // namespace

bool displayShape(const kinematics::ArmModel& model,
                  const kinematics::JointsRef& q,
                  kinematics::Branch& branch,
                  std::vector<kinematics::ShapePoint>& buffer,
                  DisplayShape& shape) {
  if (model.shape(q, kinematics::Wrench::Zero(), branch, kDisplayPoints, buffer) != kinematics::ModelStatus::kOk)
    return false;
  shape = {};
  kinematics::BodySections sections;
  const int count = model.sections(q, sections);
  std::size_t section = 0;
  for (const kinematics::ShapePoint& point : buffer) {
    for (double x : point.pose.translation())
      shape.points.push_back(static_cast<float>(x));
    shape.tubes.push_back(static_cast<std::uint8_t>(point.outermost_tube));
    while (static_cast<int>(section) + 1 < count && point.s > sections[section].end)
      ++section;
    shape.outer_radius.push_back(static_cast<float>(sections[section].radius));
  }
  return true;
}

}  // namespace tandem::robots
