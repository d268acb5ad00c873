// SPDX-License-Identifier: Apache-2.0
#include "services/control/clearance_publisher.h"

#include <spdlog/spdlog.h>

#include <algorithm>

#include "operation/convert.h"
#include "robots/overlap.h"

namespace tandem::control_service {
namespace {

void copy(const Eigen::Vector3d& from, std::array<double, 3>& to) { std::copy(from.begin(), from.end(), to.begin()); }

void copy(const kinematics::Gradient& from, std::array<double, safety::kMaxJointsPerArm>& to) {
  for (Eigen::Index j = 0; j < from.size(); ++j)
    to[static_cast<std::size_t>(j)] = from[j];
}

dds::BodyClearance messageOf(const kinematics::Clearance& clearance, int arm, int other) {
  dds::BodyClearance message;
  message.arm = static_cast<std::uint8_t>(arm);
  message.other_arm = static_cast<std::uint8_t>(other);
  message.distance = clearance.distance;
  const bool port = message.other_arm == dds::kPort;
  copy(clearance.place_a, message.place);
  copy(port ? clearance.place_a : clearance.place_b, message.other_place);
  message.s = clearance.s_a;
  message.other_s = clearance.s_b;
  copy(clearance.by_a, message.by_joints);
  copy(clearance.by_b, message.by_other_joints);
  return message;
}

}  // namespace

ClearanceMeter::ClearanceMeter(const runtime::Setup& setup, const robots::RobotModel& robot)
    : setup_(setup),
      robot_(robot),
      branches_(static_cast<std::size_t>(robot.armCount())),
      bodies_(static_cast<std::size_t>(robot.armCount())) {}

bool ClearanceMeter::makeBody(const dds::ActuationState& state, int k) {
  const auto i = static_cast<std::size_t>(k);
  if (state.valid[i] == 0 || state.joint_count[i] != robot_.size(k))
    return false;
  const Eigen::VectorXd q = dds::jointsOf(state.position, k, robot_.size(k));
  return kinematics::makeBody(*robot_.models()[i], q, branches_[i], true, bodies_[i]) == kinematics::ModelStatus::kOk;
}

dds::Clearances ClearanceMeter::measure(const dds::ActuationState& state) {
  if (session_ != state.session || joint_resets_ != state.joint_resets)
    branches_.assign(branches_.size(), {});
  session_ = state.session;
  joint_resets_ = state.joint_resets;
  dds::Clearances message;
  message.session = setup_.session;
  message.sequence = ++sequence_;
  message.answers_state = state.sequence;
  message.stamp = state.stamp;
  std::vector<int> known;
  for (int k = 0; k < robot_.armCount(); ++k) {
    if (state.arm_count == robot_.armCount() && makeBody(state, k))
      known.push_back(k);
  }
  for (std::size_t i = 0; i < known.size(); ++i) {
    const kinematics::Body& body = bodies_[static_cast<std::size_t>(known[i])];
    for (std::size_t j = i + 1; j < known.size(); ++j)
      message.bodies.push_back(
          messageOf(clearance(body, bodies_[static_cast<std::size_t>(known[j])]), known[i], known[j]));
    if (setup_.deployment.port)
      message.bodies.push_back(messageOf(clearance(body, *setup_.deployment.port), known[i], dds::kPort));
  }
  return message;
}

ClearancePublisher::ClearancePublisher(dds::Bus& bus, const runtime::Setup& setup, const robots::RobotModel& robot)
    : setup_(setup),
      robot_(robot),
      measures_(!robot.models().empty()),
      meter_(setup, robot),
      writer_(bus.writer(dds::kControlClearance)),
      states_(outbox_.latest<dds::ActuationState>([this](const dds::ActuationState& state) {
        if (state.sequence > 0)
          measure(state);
      })) {}

void ClearancePublisher::measure(const dds::ActuationState& state) {
  const dds::Clearances clearances = meter_.measure(state);
  const auto arms = static_cast<std::size_t>(robot_.armCount());
  const std::size_t expected = arms * (arms - 1) / 2 + (setup_.deployment.port ? arms : 0);
  double distance = std::numeric_limits<double>::infinity();
  for (const dds::BodyClearance& body : clearances.bodies)
    distance = std::min(distance, body.distance);
  if (clearances.bodies.size() < expected)
    distance = std::numeric_limits<double>::quiet_NaN();
  distance_.store(distance, std::memory_order_release);
  stamp_.store(runtime::monotonicNow(), std::memory_order_release);
  reportOverlap(state, distance);
  writer_.write(clearances);
}

/// Once for each time that arms begin to overlap.
void ClearancePublisher::reportOverlap(const dds::ActuationState& state, double distance) {
  constexpr double kApart = 50e-6;  // m
  if (overlapped_ ? distance > kApart : distance < 0.0) {
    overlapped_ = !overlapped_;
    if (!overlapped_)
      return spdlog::info("the bodies are apart again");
    std::vector<Eigen::VectorXd> joints;
    for (int k = 0; k < robot_.armCount(); ++k)
      joints.emplace_back(dds::jointsOf(state.position, k, robot_.size(k)));
    const std::vector<std::string> overlaps = robots::describeOverlaps(setup_.robot, robot_, joints);
    for (const std::string& overlap : overlaps)
      spdlog::warn("{}", overlap);
    if (overlaps.empty())
      spdlog::warn("an arm is {:.3g} mm inside the wall of the port; retract the arms, or move them away from the wall",
                   -1e3 * distance);
  }
}

}  // namespace tandem::control_service
