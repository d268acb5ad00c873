// SPDX-License-Identifier: Apache-2.0
#include "services/simulation/sim_core.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "operation/convert.h"
#include "robots/capability.h"
#include "robots/plant/plant.h"
#include "services/dds/reply.h"
#include "services/runtime/periodic_loop.h"

namespace tandem::simulation {
namespace {

constexpr double kLongestCatchUp = 1.0;  // s

sim::SimulatedDrives makeDrives(const runtime::Setup& setup) {
  std::vector<safety::ArmLimits> limits;
  std::vector<safety::ArmVector> start;
  for (const config::Arm& arm : setup.robot.arms) {
    limits.push_back(arm.limits);
    start.emplace_back(arm.home);
  }
  sim::SimulatedDrivesOptions options;
  options.control_period = setup.deployment.control_period;
  options.lock_step = setup.deployment.clock == config::ClockMode::kLockStep;
  options.budgets = setup.deployment.budgets;
  options.translation_acceleration = setup.deployment.sim_translation_acceleration;
  options.rotation_acceleration = setup.deployment.sim_rotation_acceleration;
  options.shortest_step = setup.deployment.sim_period;
  options.mechanics = setup.deployment.plant.mechanics;
  options.encoders = setup.deployment.plant.encoders;
  options.seed = setup.deployment.plant.seed;
  return {limits, start, options};
}

std::optional<sim::PlantTips> makeTips(const runtime::Setup& setup) {
  if (!has(setup.robot, robots::Capability::kTips))
    return std::nullopt;
  return robots::makePlantTips(setup.robot, setup.deployment.plant);
}

}  // namespace

SimCore::SimCore(const runtime::Setup& setup)
    : DriveCore(setup, makeDrives(setup)), reports_(setup.deployment.emergency_stop_budget), tips_(makeTips(setup)) {
  const sim::PlantOptions& plant = setup.deployment.plant;
  if (plant.tracker.present)
    tracker_.emplace(drives_.armCount(), plant.tracker, plant.seed);
  placeTips(0);
}

void SimCore::placeTips(std::int64_t now) noexcept {
  if (!tips_)
    return;
  tips_->restart();
  for (int k = 0; k < drives_.armCount(); ++k)
    tips_->update(k, drives_.plant(k).tubes());
  if (tracker_)
    tracker_->restart(*tips_, now, drives_.answersCommand());
}

void SimCore::moveTips(std::int64_t now) noexcept {
  for (int k = 0; tips_ && k < drives_.armCount(); ++k)
    tips_->update(k, drives_.plant(k).tubes());
  if (tracker_)
    tracker_->step(*tips_, now, drives_.answersCommand());
}

bool SimCore::onCommand(const dds::ActuationCommand& from, std::int64_t now, std::uint64_t arrivals) noexcept {
  const safety::RobotCommand& command = read(from, now, arrivals);
  if (!lock_step_) {
    drives_.command(command, now);
    return false;
  }
  const bool answers_now = isOfThisSession(from) && from.answers_state == sequence_;
  if (from.advance != 0 && !answers_now)
    return false;  // stale: it answers an earlier state
  drives_.command(command, simulated_time_);
  if (from.advance != 0)
    advance();
  return true;
}

void SimCore::advance() noexcept {
  simulated_time_ += static_cast<std::int64_t>(std::llround(1e9 * setup_.deployment.control_period));
  drives_.advance(simulated_time_);
  moveTips(simulated_time_);
}

void SimCore::step(std::int64_t now) noexcept {
  drives_.setEmergencyStop(injected_stop_ || reports_.active(now));
  drives_.step(setup_.deployment.sim_period, now);
  moveTips(now);
}

void SimCore::catchUp(std::uint64_t periods, std::int64_t now) noexcept {
  const double period = setup_.deployment.sim_period;
  const std::uint64_t taken = std::min(periods, static_cast<std::uint64_t>(std::max(1.0, kLongestCatchUp / period)));
  caught_up_ += taken;
  left_out_ += periods - taken;
  for (std::uint64_t behind = taken; behind-- > 0;)
    step(now - std::llround(1e9 * period * static_cast<double>(behind)));
}

void SimCore::state(std::int64_t now, dds::ActuationState& state) noexcept {
  show(now, lock_step_ ? simulated_time_ : now, state);
}

void SimCore::status(dds::HalStatus& status) const noexcept {
  show(status);
  status.caught_up = caught_up_;
  status.left_out = left_out_;
  for (int k = 0; k < drives_.armCount(); ++k)
    if (tips_) {
      const auto i = static_cast<std::size_t>(k);
      const sim::Snaps& snaps = tips_->snapsOf(k);
      status.snaps[i] = snaps.count;
      status.snap_energy[i] = snaps.energy;
      status.snap_distance[i] = snaps.distance;
    }
}

void SimCore::fillHead(dds::TipPoses& tips) const noexcept {
  tips.session = setup_.session;
  tips.state_session = setup_.session;
  tips.answers_state = sequence_;
  tips.arm_count = static_cast<std::uint8_t>(drives_.armCount());
}

bool SimCore::measuredTips(dds::TipPoses& tips) noexcept {
  const sim::TipMeasurement& latest = tracker_->latest();
  fillHead(tips);
  tips.sequence = latest.sequence;
  tips.stamp = latest.stamp;
  tips.answers_command = latest.mark;
  for (int k = 0; k < drives_.armCount(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    dds::setTip(k, latest.valid[i], latest.position[i], latest.orientation[i], tips);
  }
  return std::exchange(reported_, latest.sequence) != latest.sequence;
}

void SimCore::trueTips(dds::TipPoses& tips) const noexcept {
  fillHead(tips);
  tips.sequence = sequence_;
  tips.stamp = stamp_;
  tips.answers_command = drives_.answersCommand();
  for (int k = 0; tips_ && k < drives_.armCount(); ++k) {
    const Eigen::Isometry3d& pose = tips_->pose(k);
    dds::setTip(k, tips_->valid(k), pose.translation(), Eigen::Quaterniond(pose.linear()), tips);
  }
}

void SimCore::plantJoints(MechanismSnapshot& snapshot) const noexcept {
  trueTips(snapshot.head);
  snapshot.joint_resets = drives_.jointResets();
  snapshot.joint_count = 0;
  for (int k = 0; k < drives_.armCount(); ++k) {
    for (const double q : drives_.plant(k).tubes())
      snapshot.joints[static_cast<std::size_t>(snapshot.joint_count++)] = q;
  }
}

dds::Reply SimCore::onRequest(const dds::SimRequest& request) {
  const auto answer = [&request](dds::ReplyCode code, std::string reason) {
    return dds::replyTo(request, code, std::move(reason));
  };
  using Kind = dds::SimKind;
  const auto kind = static_cast<Kind>(request.kind);
  if (kind == Kind::kReset) {
    int joints = 0;
    for (int k = 0; k < drives_.armCount(); ++k)
      joints += drives_.jointCount(k);
    if (request.arm_count != drives_.armCount())
      return answer(dds::ReplyCode::kMalformed, "arm_count: found " + std::to_string(request.arm_count) +
                                                    ", expected " + std::to_string(drives_.armCount()));
    safety::RobotVector q(joints);
    for (int k = 0, i = 0; k < drives_.armCount(); ++k) {
      for (int j = 0; j < drives_.jointCount(k); ++j) {
        q[i++] = request.joints[dds::jointIndex(k, j)];
      }
    }
    // Time advances with commands only: advance it here until moving drives are at standstill.
    constexpr int kMostPeriods = 1000;
    for (int i = 0; lock_step_ && !drives_.standing() && i < kMostPeriods; ++i)
      advance();
    const sim::ResetResult result = drives_.reset(q);
    if (result == sim::ResetResult::kDone) {
      placeTips(lock_step_ ? simulated_time_ : runtime::monotonicNow());
      return answer(dds::ReplyCode::kOk, "");
    }
    return answer(
        result == sim::ResetResult::kOutsideLimits ? dds::ReplyCode::kOutsideLimits : dds::ReplyCode::kWrongState,
        std::string(sim::describe(result)));
  }
  if (kind == Kind::kInjectFault && (request.fault == "emergency_stop" || request.fault == "emergency_stop_released")) {
    injected_stop_ = request.fault == "emergency_stop";
    drives_.setEmergencyStop(injected_stop_);
    return answer(dds::ReplyCode::kOk, "");
  }
  if (kind == Kind::kInjectFault) {
    const auto fault = sim::axisFaultFromName(request.fault);
    if (!fault)
      return answer(dds::ReplyCode::kMalformed, "unknown fault '" + request.fault.substr(0, 40) + "'");
    if (drives_.inject(request.arm, request.joint, *fault))
      return answer(dds::ReplyCode::kOk, "");
    return answer(dds::ReplyCode::kMalformed, "axis: found arm " + std::to_string(request.arm) + ", joint " +
                                                  std::to_string(request.joint) +
                                                  " (from 0), expected one of the robot's joints");
  }
  if (kind == Kind::kStep) {
    constexpr std::uint32_t kMost = 100000;
    if (!lock_step_)
      return answer(dds::ReplyCode::kWrongState, "step: this simulator runs in real time; steps need clock: lock_step");
    if (request.steps < 1 || request.steps > kMost)
      return answer(dds::ReplyCode::kMalformed, "steps: expected 1 to 100000");
    for (std::uint32_t i = 0; i < request.steps; ++i)
      advance();
    return answer(dds::ReplyCode::kOk, "");
  }
  return answer(dds::ReplyCode::kUnknown,
                "found kind " + std::to_string(request.kind) + ", expected 1 (reset), 2 (step) or 3 (fault)");
}

}  // namespace tandem::simulation
