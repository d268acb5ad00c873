// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>

#include "config/config.h"
#include "support.h"
#include "tests/unit/safety/random_arm.h"

namespace tandem::config::test {
namespace {

using planning::TrajectorySpec;
using Dice = tandem::test::Random;

TrajectorySpec parsedTrajectory(const std::string& text) { return parseTrajectory(text, "text", {}); }

TEST(FurtherTasks, ReachTheirFields) {
  using planning::Heading;
  using planning::TaskKind;
  const TrajectorySpec spec = parsedTrajectory(
      "tandem: trajectory/1\nname: x\nshape: {line: {displacement_mm: [1, 0, 0]}}\ntasks:\n"
      "  - look_at: {arm: b, target_mm: [1, 2, 300], tolerance_deg: 2}\n"
      "  - relative: [a, b]\n"
      "  - tip: a\n"
      "  - relative_orientation:\n"
      "      arms: [a, b]\n"
      "      desired: waypoints\n"
      "      waypoints: [{at: 0.5, rotation_deg: [0, 0, 30]}, {at: 1, rotation_deg: [90, 0, 0]}]\n");
  EXPECT_EQ(spec.arm, 0);
  EXPECT_EQ(spec.other_arm, 1);
  ASSERT_EQ(spec.further.size(), 2u);
  const planning::FurtherTask &first = spec.further[0], &last = spec.further[1];
  EXPECT_EQ(first.kind, TaskKind::kLookAt);
  EXPECT_EQ(first.priority, 0);
  EXPECT_EQ(first.arm, 1);
  EXPECT_TRUE(first.target.isApprox(Eigen::Vector3d(1e-3, 2e-3, 0.3)));
  EXPECT_DOUBLE_EQ(first.tolerance, 2 * std::numbers::pi / 180);
  EXPECT_EQ(last.kind, TaskKind::kRelativeOrientation);
  EXPECT_EQ(last.priority, 3);
  EXPECT_EQ(std::pair(last.arm, last.other_arm), (std::pair{0, 1}));
  EXPECT_EQ(last.heading, Heading::kWaypoints);
  ASSERT_EQ(last.waypoints.size(), 2u);
  EXPECT_EQ(last.waypoints[0].at, 0.5);
  EXPECT_TRUE(last.waypoints[1].rotation.isApprox(Eigen::Vector3d(std::numbers::pi / 2, 0, 0)));
  EXPECT_TRUE(std::isinf(last.tolerance));
  const TrajectorySpec centre = parsedTrajectory(
      "tandem: trajectory/1\nname: x\nshape: {line: {displacement_mm: [1, 0, 0]}}\n"
      "tasks: [{remote_centre: {arm: a, point_mm: [1, 2, 30], tolerance_mm: 0.5}}, {tip: a}]\n");
  ASSERT_EQ(centre.further.size(), 1u);
  EXPECT_EQ(centre.further[0].kind, TaskKind::kRemoteCentre);
  EXPECT_TRUE(centre.further[0].target.isApprox(Eigen::Vector3d(1e-3, 2e-3, 0.03)));
  EXPECT_DOUBLE_EQ(centre.further[0].tolerance, 0.5e-3);
  const TrajectorySpec follower = parsedTrajectory(
      "tandem: trajectory/1\nname: x\nshape: {insertion: {stages: [{tubes: 2, length_mm: 5}, {tubes: 1, length_mm: "
      "3}]}}\ntasks: [{tip: b}, {follow_the_leader: {arm: b, tolerance_mm: 0.5}}]\n");
  ASSERT_EQ(follower.further.size(), 1u);
  EXPECT_EQ(follower.further[0].kind, TaskKind::kRemoteCentre);
  EXPECT_TRUE(follower.further[0].follows_leader);
  EXPECT_EQ(follower.further[0].arm, 1);
  EXPECT_DOUBLE_EQ(follower.further[0].tolerance, 0.5e-3);
  const auto& stages = std::get<planning::Insertion>(follower.shape).stages;
  ASSERT_EQ(stages.size(), 2u);
  EXPECT_EQ(stages[0].tubes, 2);
  EXPECT_DOUBLE_EQ(stages[1].length, 3e-3);
  const TrajectorySpec poses = parsedTrajectory(
      "tandem: trajectory/1\nname: x\nshape: {line: {displacement_mm: [1, 0, 0]}}\n"
      "tasks: [{relative_pose: {arms: [b, a], tolerance_mm: 1}}, {pose: {arm: b, desired: tangent}}]\n");
  EXPECT_EQ(poses.arm, 1) << "the pose takes the place of the tip";
  EXPECT_FALSE(poses.tip_task);
  EXPECT_FALSE(poses.hasRelative());
  ASSERT_EQ(poses.further.size(), 2u);
  EXPECT_EQ(poses.further[0].kind, TaskKind::kRelativePose);
  EXPECT_EQ(std::pair(poses.further[0].arm, poses.further[0].other_arm), (std::pair{1, 0}));
  EXPECT_DOUBLE_EQ(poses.further[0].tolerance, 1e-3);
  EXPECT_EQ(poses.further[1].kind, TaskKind::kTipPose);
  EXPECT_EQ(poses.further[1].heading, Heading::kTangent);
  const TrajectorySpec kept = parsedTrajectory(
      "tandem: trajectory/1\nname: x\nshape: {line: {displacement_mm: [1, 0, 0]}}\n"
      "tasks: [{tip: a}, {axis: {arm: a}}, {orientation: {arm: a, desired: tangent}}]\n");
  ASSERT_EQ(kept.further.size(), 2u);
  EXPECT_EQ(kept.further[0].kind, TaskKind::kTipAxis);
  EXPECT_EQ(kept.further[0].heading, Heading::kStart);
  EXPECT_EQ(kept.further[1].kind, TaskKind::kTipOrientation);
  EXPECT_EQ(kept.further[1].heading, Heading::kTangent);
}

TEST(FurtherTasks, SoftOnesHaveADistance) {
  const TrajectorySpec spec = parsedTrajectory(
      "tandem: trajectory/1\nname: x\nshape: {line: {displacement_mm: [1, 0, 0]}}\ntasks:\n"
      "  - elastic_stability: {arm: b, above: 0.3, tolerance: 0.01}\n"
      "  - tip: a\n"
      "  - joint_limits: {arm: a, distance_mm: 2, tolerance_mm: 0.5}\n");
  ASSERT_EQ(spec.further.size(), 2u);
  EXPECT_EQ(spec.further[0].kind, planning::TaskKind::kElasticStability);
  EXPECT_EQ(std::pair(spec.further[0].priority, spec.further[0].arm), (std::pair{0, 1}));
  EXPECT_EQ(spec.further[0].target, Eigen::Vector3d(0.3, 0, 0));
  EXPECT_DOUBLE_EQ(spec.further[0].tolerance, 0.01);
  EXPECT_EQ(spec.further[1].kind, planning::TaskKind::kJointLimits);
  EXPECT_EQ(spec.further[1].priority, 2);
  EXPECT_TRUE(spec.further[1].target.isApprox(Eigen::Vector3d(2e-3, 0, 0)));
  EXPECT_DOUBLE_EQ(spec.further[1].tolerance, 0.5e-3);
}

TEST(FurtherTasks, ThatMakeNoSenseAreRefusedAtTheirPlace) {
  const std::string tasks = "tasks: [{tip: a}, {axis: {arm: a}}]";
  const std::string text =
      "tandem: trajectory/1\nname: x\nshape: {line: {displacement_mm: [1, 0, 0]}}\n" + tasks + "\n";
  const auto with = [](const std::string& task) { return "tasks: [{tip: a}, " + task + "]"; };
  const std::string turn = "{at: 1, rotation_deg: [0, 0, 1]}";
  const Refusal refusals[] = {
      {tasks, with("{axis: {}}"), "{}", 0, "tasks[1].axis.arm", "the key is missing"},
      {tasks, with("{axis: {arm: a, desired: along}}"), "along", 0, "tasks[1].axis.desired",
       "expected one of start, tangent, waypoints"},
      {tasks, with("{axis: {arm: a, desired: waypoints}}"), "{arm", 0, "tasks[1].axis.waypoints", "found none"},
      {tasks, with("{axis: {arm: a, waypoints: [" + turn + "]}}"), "[{at", 0, "tasks[1].axis.waypoints",
       "found waypoints without `desired: waypoints`"},
      {tasks, with("{axis: {arm: a, desired: waypoints, waypoints: [" + turn + ", " + turn + "]}}"), "[{at", 0,
       "tasks[1].axis.waypoints", "expected ascending values"},
      {tasks, with("{axis: {arm: a, desired: waypoints, waypoints: [{at: 2, rotation_deg: [0, 0, 1]}]}}"), "2, rot", 0,
       "tasks[1].axis.waypoints[0].at", "found 2, expected"},
      {tasks, with("{axis: {arm: a, tolerance_deg: 0}}"), "0}}", 0, "tasks[1].axis.tolerance_deg", "found 0"},
      {tasks, with("{relative_orientation: {arms: [a]}}"), "[a]", 0, "tasks[1].relative_orientation.arms",
       "found a list of 1, expected a list of 2"},
      {tasks, with("{relative_orientation: {arms: [a, b], desired: tangent}}"), "tangent", 0,
       "tasks[1].relative_orientation.desired", "expected one of start, waypoints"},
      {tasks, with("{look_at: {arm: a}}"), "{arm", 0, "tasks[1].look_at.target_mm", "the key is missing"},
      {tasks, with("{remote_centre: {arm: a}}"), "{arm", 0, "tasks[1].remote_centre.point_mm", "the key is missing"},
      {tasks, with("{remote_centre: {arm: a, point_mm: [1, 2]}}"), "[1, 2]", 0, "tasks[1].remote_centre.point_mm",
       "found a list of 2, expected"},
      {tasks, with("{remote_centre: {arm: a, point_mm: [1, 2, 3], tolerance_deg: 1}}"), "tolerance", 0,
       "tasks[1].remote_centre.tolerance_deg", "expected tolerance_mm or tolerance_m"},
      {tasks, with("{follow_the_leader: {arm: b}}"), "b}}", 0, "tasks[1].follow_the_leader.arm",
       "found another arm than the one that follows the shape"},
      {tasks, with("{follow_the_leader: {arm: a}}, {follow_the_leader: {arm: a}}"), "{follow_the_leader: {arm: a}}]", 0,
       "tasks[2]", "found `follow_the_leader` twice"},
      {tasks, with("{joint_limits: {arm: a}}"), "{arm", 0, "tasks[1].joint_limits.distance_mm", "the key is missing"},
      {tasks, with("{elastic_stability: {arm: a, above: 2}}"), "2}}", 0, "tasks[1].elastic_stability.above", "found 2"},
      {tasks, with("{look: {arm: a}}"), "{look", 0, "tasks[1]", "tasks[1].look: unknown key"},
      {tasks, with("{pose: {arm: a, desired: waypoints}}"), "{arm", 0, "tasks[1].pose.waypoints", "found none"},
      {tasks, with("{pose: {arm: a, tolerance_deg: 1}}"), "tolerance", 0, "tasks[1].pose.tolerance_deg",
       "expected tolerance_mm or tolerance_m"},
      {tasks, with("{relative_pose: {arms: [a, a]}}"), "a]}}", 0, "tasks[1].relative_pose.arms[1]", "a second time"},
      {tasks, "tasks: [{axis: {arm: a}}]", "[{axis", 0, "tasks", "expected one `tip` or a `pose`"},
      {tasks, "tasks: [{relative: [b, a]}, {pose: {arm: a}}]", "b, a]", 0, "tasks[0].relative[0]",
       "another arm first than the one that follows the shape"},
  };
  for (const Refusal& refusal : refusals)
    expectRefusal(text, refusal, [](const std::filesystem::path& file) { loadTrajectory(file); });
}

Eigen::Vector3d anyVector(Dice& random) {
  return {random.uniform(-0.8, 0.8), random.uniform(-0.8, 0.8), random.uniform(-0.8, 0.8)};
}

/// At most `most` tasks, the first ones at priorities before the last.
std::vector<planning::FurtherTask> anyFurther(Dice& random, int most) {
  std::vector<planning::FurtherTask> all(static_cast<std::size_t>(random.integer(0, most)));
  for (std::size_t k = 0; k < all.size(); ++k) {
    planning::FurtherTask& task = all[k];
    task.kind = static_cast<planning::TaskKind>(4 + random.integer(0, 8));
    task.priority = static_cast<int>(k) + (k + 1 == all.size() ? random.integer(0, 1) : 0);
    task.arm = random.integer(0, 3);
    if (task.relative())
      task.other_arm = 4 + random.integer(0, 3);
    if (random.integer(0, 1))
      task.tolerance = random.uniform(0.01, 1.0);
    if (task.kind == planning::TaskKind::kLookAt || task.kind == planning::TaskKind::kRemoteCentre) {
      task.target = anyVector(random);
    } else if (kinematics::findTaskKind(task.kind)->soft()) {
      task.target.x() = random.uniform(0.01, 0.9);
    } else if (random.integer(0, 1)) {
      task.heading = planning::Heading::kWaypoints;
      task.waypoints = {{0.25, anyVector(random)}, {1.0, anyVector(random)}};
    } else if (!task.relative()) {
      task.heading = planning::Heading::kTangent;
    }
  }
  return all;
}

void expectSame(const std::vector<planning::FurtherTask>& a, const std::vector<planning::FurtherTask>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k) {
    EXPECT_EQ(a[k].kind, b[k].kind);
    EXPECT_EQ(a[k].priority, b[k].priority);
    EXPECT_EQ(a[k].arm, b[k].arm);
    EXPECT_EQ(a[k].other_arm, b[k].other_arm);
    EXPECT_EQ(a[k].heading, b[k].heading);
    EXPECT_EQ(a[k].target, b[k].target);
    EXPECT_EQ(a[k].follows_leader, b[k].follows_leader);
    EXPECT_EQ(a[k].tolerance, b[k].tolerance);
    ASSERT_EQ(a[k].waypoints.size(), b[k].waypoints.size());
    for (std::size_t i = 0; i < a[k].waypoints.size(); ++i) {
      EXPECT_EQ(a[k].waypoints[i].at, b[k].waypoints[i].at);
      EXPECT_EQ(a[k].waypoints[i].rotation, b[k].waypoints[i].rotation);
    }
  }
}

TEST(FurtherTasks, FormattedTextReadsBack) {
  for (std::uint32_t seed = tandem::test::baseSeed(); seed < tandem::test::baseSeed() + 300; ++seed) {
    SCOPED_TRACE(tandem::test::trace(seed));
    Dice random(seed);
    TrajectorySpec spec;
    spec.name = "any";
    spec.shape = planning::Line{{0.01, 0.0, 0.0}};
    if (random.chance(0.5))
      spec.other_arm = planning::kNoArm;
    spec.further = anyFurther(random, spec.hasRelative() ? 2 : 3);
    const auto own = std::ranges::find_if(spec.further, [&](const planning::FurtherTask& task) {
      return task.kind == planning::TaskKind::kRemoteCentre && task.arm == spec.arm;
    });
    if (own != spec.further.end() && random.chance(0.5)) {
      own->follows_leader = true;
      own->target.setZero();
    }
    const auto pose = std::ranges::find(spec.further, planning::TaskKind::kTipPose, &planning::FurtherTask::kind);
    const bool follows = std::ranges::any_of(spec.further, &planning::FurtherTask::follows_leader);
    if (pose != spec.further.end() && !spec.hasRelative() && !follows && random.chance(0.5)) {
      spec.tip_task = false;
      spec.arm = pose->arm;
      spec.further.back().priority = static_cast<int>(spec.further.size()) - 1;
    }
    const std::string text = formatTrajectory(spec);
    SCOPED_TRACE(text);
    const TrajectorySpec read = parsedTrajectory(text);
    EXPECT_EQ(read.arm, spec.arm);
    EXPECT_EQ(read.tip_task, spec.tip_task);
    expectSame(read.further, spec.further);
    if (HasFailure())
      break;
  }
}

}  // namespace
}  // namespace tandem::config::test
