// SPDX-License-Identifier: Apache-2.0
#include "sim/simulated_drives.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace tandem::sim {
namespace {

using safety::ArmVector;

/// A start that misses a limit by rounding is inside.
constexpr double kInsideTolerance = 1e-9;

PlantLimits plantLimits(const safety::ArmLimits& limits, const SimulatedDrivesOptions& options) {
  const int n = limits.jointCount();
  PlantLimits plant{ArmVector::Constant(n, safety::kUnlimited), ArmVector::Constant(n, safety::kUnlimited)};
  if (options.lock_step)
    return plant;
  for (int j = 0; j < n; ++j) {
    // The reference may use the whole speed of the joint; a hair more lets the plant keep up with it exactly.
    plant.velocity[j] = limits.joints[j].velocity * (1.0 + 1e-6);
    plant.acceleration[j] = limits.isTranslation(j) ? options.translation_acceleration : options.rotation_acceleration;
  }
  return plant;
}

JointOptions jointOptions(int arm, const safety::ArmLimits& limits, const SimulatedDrivesOptions& options) {
  const double step = options.lock_step ? options.control_period : options.shortest_step;
  JointOptions joints{options.mechanics, options.encoders, options.seed, arm, step};
  for (int j = 0; j < limits.jointCount(); ++j)
    joints.kinds[j] = limits.joints[j].kind;
  return joints;
}

safety::FaultRecord driveFailure(safety::FaultCause cause, int joint, double amount = 0.0, double allowed = 0.0) {
  return {bit(safety::Fault::kDrive), cause, static_cast<std::uint8_t>(joint), amount, allowed};
}

void checkArguments(const std::vector<safety::ArmLimits>& limits,
                    const std::vector<ArmVector>& start,
                    const SimulatedDrivesOptions& options) {
  const auto refuse = [](const std::string& message) { throw std::invalid_argument("simulated drives: " + message); };
  if (limits.empty() || limits.size() > static_cast<std::size_t>(safety::kMaxArms)) {
    refuse("1 to " + std::to_string(safety::kMaxArms) + " arms expected, found " + std::to_string(limits.size()));
  }
  if (start.size() != limits.size())
    refuse("found start joints of " + std::to_string(start.size()) + " arms, expected one for each of the " +
           std::to_string(limits.size()));
  if (!(options.control_period > 0.0))
    refuse("control period: found " + std::to_string(options.control_period) + " s, expected more than 0 s");
  for (std::size_t a = 0; a < limits.size(); ++a) {
    const std::string arm = "arm " + std::to_string(a);
    if (start[a].size() != limits[a].jointCount())
      refuse(arm + ": found a start of " + std::to_string(start[a].size()) + " joints, expected " +
             std::to_string(limits[a].jointCount()));
    if (!(safety::largestViolation(limits[a], start[a]) <= kInsideTolerance) || !start[a].allFinite()) {
      refuse(arm + ": found a start outside the limits of its joints, expected one inside");
    }
  }
}

}  // namespace

std::string_view describe(ResetResult result) {
  switch (result) {
    case ResetResult::kDone:
      return "done";
    case ResetResult::kMoving:
      return "an arm is still moving; wait for standstill";
    case ResetResult::kEnabled:
      return "an arm is ENABLED or PAUSED; disable it first";
    case ResetResult::kWrongSize:
      return "found another number of joints than the robot has, expected one position for each joint";
    case ResetResult::kOutsideLimits:
      return "found joints outside their limits, expected positions inside";
  }
  return "unknown";
}

SimulatedDrives::SimulatedDrives(const std::vector<safety::ArmLimits>& limits,
                                 const std::vector<ArmVector>& start,
                                 const SimulatedDrivesOptions& options)
    : options_(options),
      monitor_(static_cast<int>(limits.size()),
               options.budgets.commandAge(options.control_period),
               options.budgets.lost_samples) {
  checkArguments(limits, start, options);
  const safety::SupervisorOptions supervisor{options.control_period, options.budgets, options.lock_step};
  for (std::size_t a = 0; a < limits.size(); ++a) {
    arms_.push_back({safety::ArmSupervisor(limits[a], start[a], supervisor),
                     SimulatedArm(start[a], plantLimits(limits[a], options),
                                  jointOptions(static_cast<int>(a), limits[a], options))});
  }
}

bool SimulatedDrives::command(const Command& command, std::int64_t now) noexcept {
  const safety::StreamCheck checked = monitor_.check(command.header, standing());
  for (int a = 0; a < armCount(); ++a) {
    Arm& arm = arms_[a];
    if (checked.new_session)
      arm.supervisor.disableForNewSession();
    safety::ArmRequest request = command.forArm(a, jointCount(a), checked);
    request.lost |= arm.plant.failed();
    arm.supervisor.noteRecoverRequest(request.request == safety::DriveRequest::kRecover);
    const safety::JointMask without =
        request.request == safety::DriveRequest::kRecover ? request.lost : arm.supervisor.lost();
    const safety::FaultRecord present = safety::withEmergencyStop(arm.plant.presentFailure(without), emergency_stop_);
    guards_.add(a, arm.supervisor.command(request, positionsOf(arm), present, now));
  }
  if (std::ranges::none_of(arms_, [](const Arm& arm) { return arm.supervisor.powered(); }))
    monitor_.resetLosses();
  else if (checked.lost.faults != 0)
    stopPowered(checked.lost);
  return checked.faults == 0;
}

/// Joint positions by the encoders; for an encoder without a reading, the reference of its joint.
ArmVector SimulatedDrives::positionsOf(const Arm& arm) noexcept {
  ArmVector q = arm.plant.reading();
  for (Eigen::Index j = 0; j < q.size(); ++j)
    q[j] = std::isfinite(q[j]) ? q[j] : arm.supervisor.reference()[j];
  return q;
}

void SimulatedDrives::checkSpeed(Arm& arm) const noexcept {
  for (int j = 0; j < arm.supervisor.limits().jointCount() && !options_.lock_step; ++j) {
    const double allowed = safety::kOverspeedFactor * arm.supervisor.limits().joints[j].velocity;
    const double speed = std::abs(arm.plant.velocityReading()[j]);
    if (speed > allowed) {
      arm.supervisor.latchAxisFailure(driveFailure(safety::FaultCause::kOverspeed, j), arm.plant.position()[j]);
      arm.plant.forget(j);
    }
  }
}

void SimulatedDrives::checkFollowing(Arm& arm) const noexcept {
  const safety::ArmLimits& limits = arm.supervisor.limits();
  for (int j = 0; j < limits.jointCount(); ++j) {
    const double window =
        limits.isTranslation(j) ? options_.following_error_translation : options_.following_error_rotation;
    const double position = arm.plant.position()[j];
    // Delay and lag are how this drive is; it fails when it is not where they would have brought it.
    const double error = std::abs(arm.plant.expected()[j] - position);
    if (error > window) {
      arm.supervisor.latchAxisFailure(driveFailure(safety::FaultCause::kFollowingError, j, error, window), position);
      arm.plant.forget(j);
    }
  }
}

void SimulatedDrives::checkDrives(Arm& arm) const noexcept {
  if (emergency_stop_ && (arm.supervisor.faults() & bit(safety::Fault::kStopRequested)) == 0)
    arm.supervisor.latch(safety::kEmergencyStopRecord);
  const bool powered = arm.supervisor.powered();
  for (int j = 0; j < arm.supervisor.limits().jointCount(); ++j) {
    const double position = arm.plant.position()[j];
    // A drive that dies while its arm stops must not catch up when it comes back.
    const bool lost = (arm.supervisor.lost() & safety::jointBit(j)) != 0;
    if (!lost && arm.plant.fault(j) == AxisFault::kOff && (powered || !arm.supervisor.standing())) {
      arm.supervisor.latchAxisFailure(driveFailure(safety::FaultCause::kOff, j), position);
      arm.plant.forget(j);
    }
  }
  if (powered)
    arm.supervisor.latch(arm.plant.presentFailure(arm.supervisor.lost()));
}

void SimulatedDrives::step(double dt, std::int64_t now) noexcept {
  for (int a = 0; a < armCount(); ++a) {
    Arm& arm = arms_[a];
    checkDrives(arm);
    arm.supervisor.step(dt, now);
    arm.plant.setPower(arm.supervisor.powered());
    arm.plant.step(dt, arm.supervisor.reference());
    checkSpeed(arm);
    checkFollowing(arm);
    // Without power a joint stays where it is; it owes nothing to an earlier reference.
    if (!arm.supervisor.powered() && standing(a)) {
      arm.supervisor.place(arm.plant.position());
      arm.plant.forget();
    }
  }
}

void SimulatedDrives::stop() noexcept {
  for (Arm& arm : arms_)
    arm.supervisor.latch({safety::bit(safety::Fault::kStopRequested)});
}

void SimulatedDrives::stopPowered(const safety::FaultRecord& record) noexcept {
  for (Arm& arm : arms_) {
    if (arm.supervisor.powered())
      arm.supervisor.latch(record);
  }
}

ResetResult SimulatedDrives::reset(const safety::RobotVector& joints) noexcept {
  Eigen::Index total = 0;
  for (int a = 0; a < armCount(); ++a) {
    if (arms_[a].supervisor.powered())
      return ResetResult::kEnabled;
    if (!standing(a))
      return ResetResult::kMoving;
    total += jointCount(a);
  }
  if (joints.size() != total)
    return ResetResult::kWrongSize;
  Eigen::Index first = 0;
  for (int a = 0; a < armCount(); first += jointCount(a), ++a) {
    const ArmVector q = joints.segment(first, jointCount(a));
    if (!q.allFinite() || safety::largestViolation(arms_[a].supervisor.limits(), q) > kInsideTolerance) {
      return ResetResult::kOutsideLimits;
    }
  }
  first = 0;
  for (int a = 0; a < armCount(); first += jointCount(a), ++a) {
    const ArmVector q = joints.segment(first, jointCount(a));
    arms_[a].supervisor.place(q);
    arms_[a].plant.place(q);
  }
  ++joint_resets_;
  return ResetResult::kDone;
}

bool SimulatedDrives::inject(int arm, int joint, AxisFault fault) noexcept {
  if (arm < 0 || arm >= armCount() || joint < 0 || joint >= jointCount(arm))
    return false;
  arms_[arm].plant.inject(joint, fault);
  return true;
}

bool SimulatedDrives::standing(int arm) const noexcept {
  return arms_[arm].supervisor.standing() && arms_[arm].plant.standing();
}

bool SimulatedDrives::standing() const noexcept {
  for (int a = 0; a < armCount(); ++a) {
    if (!standing(a))
      return false;
  }
  return true;
}

}  // namespace tandem::sim
