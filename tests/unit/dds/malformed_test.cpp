// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "services/dds/validate.h"

namespace tandem::dds {
namespace {

/// Sets one member to each value from 0 to 255: well-formed up to `last`, or at `also`; malformed elsewhere.
template <class M, class Set>
void checkCount(Set set, int last, int also = -1) {
  for (int count = 0; count <= 255; ++count) {
    auto message = std::make_unique<M>();
    set(*message, static_cast<std::uint8_t>(count));
    EXPECT_EQ(malformed(*message) == nullptr, count <= last || count == also) << count;
  }
}

TEST(Malformed, CountsBeyondCapacity) {
  checkCount<ActuationState>([](auto& m, auto n) { m.arm_count = n; }, 8);
  checkCount<ActuationState>([](auto& m, auto n) { m.joint_count[7] = n; }, 8);
  checkCount<ActuationCommand>([](auto& m, auto n) { m.arm_count = n; }, 8);
  checkCount<ActuationLimits>([](auto& m, auto n) { m.arm_count = n; }, 8);
  checkCount<ActuationLimits>([](auto& m, auto n) { m.joint_count[0] = n; }, 8);
  checkCount<PlanningReference>([](auto& m, auto n) { m.task_count = n; }, 4);
  checkCount<TipPoses>([](auto& m, auto n) { m.arm_count = n; }, 8);
  checkCount<ControlStatus>([](auto& m, auto n) { m.arm_count = n; }, 8);
  checkCount<ControlStatus>([](auto& m, auto n) { m.task_count = n; }, 4);
  checkCount<ControlStatus>([](auto& m, auto n) { m.limit_count = n; }, 8);
  checkCount<Clearances>([](auto& m, auto n) { m.bodies.resize(n); }, 64);
  checkCount<ControlRequest>([](auto& m, auto n) { m.joint_count = n; }, 8);
  checkCount<SimRequest>([](auto& m, auto n) { m.arm_count = n; }, 8);
  checkCount<HalStatus>([](auto& m, auto n) { m.arm_count = n; }, 8);
  checkCount<HalStatus>([](auto& m, auto n) { m.bus_count = n; }, 8);
}

TEST(Malformed, IndicesBeyondArrays) {
  checkCount<PlanningReference>([](auto& m, auto n) { m.tasks[3].arm = n; }, 7);
  checkCount<PlanningReference>([](auto& m, auto n) { m.tasks[0].other_arm = n; }, 7);
  checkCount<ControlRequest>([](auto& m, auto n) { m.arm = n; }, 7, kAllArms);
  checkCount<SimRequest>([](auto& m, auto n) { m.arm = n; }, 7);
  checkCount<HalRequest>([](auto& m, auto n) { m.arm = n; }, 7, kAllArms);
  checkCount<SimRequest>([](auto& m, auto n) { m.joint = n; }, 7);
}

TEST(Malformed, TextsAndListsBeyondReason) {
  PlanningRequest request;
  request.trajectory.assign(1024 * 1024, 'x');
  EXPECT_EQ(malformed(request), nullptr);
  request.trajectory += 'x';
  EXPECT_NE(malformed(request), nullptr);

  Stop stop;
  stop.reason.assign(kMaxText, 'x');
  EXPECT_EQ(malformed(stop), nullptr);
  stop.reason += 'x';
  EXPECT_NE(malformed(stop), nullptr);
  stop.reason = std::string("a\0b", 3);
  EXPECT_NE(malformed(stop), nullptr);

  ComputationRequest computation;
  computation.trajectory.assign(1024 * 1024 + 1, 'x');  // planning replies to it
  EXPECT_EQ(malformed(computation), nullptr);
  computation.targets.resize(kMaxList + 1);
  EXPECT_NE(malformed(computation), nullptr);
  ComputationResult result;
  EXPECT_EQ(malformed(result), nullptr);
  result.report.points.resize(1);
  result.report.points[0].joints.resize(64 + 1);
  EXPECT_NE(malformed(result), nullptr);
  result.report.points[0] = {};
  result.repair.before.points.resize(kMaxList + 1);
  EXPECT_NE(malformed(result), nullptr);

  JointState joints;
  joints.effort.resize(kMaxList + 1);
  EXPECT_NE(malformed(joints), nullptr);
  Path path;
  path.poses.resize(kMaxList + 1);
  EXPECT_NE(malformed(path), nullptr);
}

TEST(Malformed, ShapesWhoseListsDiffer) {
  Shape shape;
  shape.points.resize(6);
  shape.tubes.resize(2);
  shape.outer_radius.resize(2);
  EXPECT_EQ(malformed(shape), nullptr);
  shape.points.resize(5);
  EXPECT_NE(malformed(shape), nullptr);
  shape.points.resize(6);
  shape.outer_radius.resize(3);
  EXPECT_NE(malformed(shape), nullptr);
}

}  // namespace
}  // namespace tandem::dds
