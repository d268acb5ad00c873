// SPDX-License-Identifier: Apache-2.0
/** @file Arm supervisor: state machine, gate, interpolation, stop ramp and watchdog of one arm; hal and sim share it.
 *
 * hal and sim run the same object. It turns commands, which come once per control period, into a reference for the
 * joints at the period of the bus, and it decides when there is none. */
#pragma once

#include <cstdint>

#include "safety/budgets.h"
#include "safety/gate.h"
#include "safety/operating_state.h"
#include "safety/recovery.h"
#include "safety/stop_ramp.h"
#include "safety/watchdog.h"

namespace tandem::safety {

/** Options of an ArmSupervisor. */
struct SupervisorOptions {
  double control_period = 0.1;  ///< T: each setpoint is meant to be reached this long after its command, s
  Budgets budgets;
  /// Lock-step with ideal joints: a hold after a finished period stands there and then, without a ramp.
  bool immediate_hold = false;
};

/** Part of a command for one arm. */
struct ArmRequest {
  DriveRequest request = DriveRequest::kKeep;
  JointMask lost = 0;   ///< kRecover: joints that cannot be used, or shall not
  bool unseen = false;  ///< kRecover: who asks cannot have seen the fault that the arm is in
  bool moving = false;  ///< `motion` counts; otherwise the arm completes its segment and holds
  /** The velocity counts: it is integrated here, from the last setpoint that passed the gate. The client knows only a
   * setpoint one state older, so its own sum would jump back or ahead by the motion of all lost or late commands
   * since. At any rate of commands, the setpoint is ahead of the joints by at most one period of the
   * requested velocity. The position has to be finite; `duration` is ignored: it is the control period. */
  GateCommand motion;
};

/** Supervisor of one arm. Nothing after construction allocates, locks or throws. Times are ns on the caller's clock. */
class ArmSupervisor {
 public:
  /// The arm stands at `position` (m, rad), DISABLED.
  ArmSupervisor(const ArmLimits& limits, const ArmVector& position, const SupervisorOptions& options);

  /** Takes a command.
   *
   * A command that fails an integrity guard stops the arm and latches if the arm is ENABLED or PAUSED, and has no
   * effect otherwise. Enabling sets the setpoint to `measured`, or, where the error of the readings puts that outside
   * the limits, to the nearest joints inside; the motion in the same command is ignored, because it
   * was computed before. Enabling waits until the arm stands, and is refused outside the limits, with a fault that says
   * by how much: then kRecover is the way back.
   * @param measured present position, m, rad; of lost joints, where they are taken to be
   * @param present faults whose cause stands now; an attempt to enable latches them
   * @return what the gate did. */
  GateReport command(const ArmRequest& request,
                     const ArmVector& measured,
                     const FaultRecord& present,
                     std::int64_t now) noexcept;

  /// Stops the arm with the ramp and latches; a record without faults does nothing.
  void latch(const FaultRecord& record) noexcept;

  /** An axis does not follow: the reference of that axis becomes where it is, the others stop with the ramp, and
   * Fault::kDrive latches. @param record names the joint; @param position of that axis, m, rad. */
  void latchAxisFailure(const FaultRecord& record, double position) noexcept;

  /// Disables a standing arm, because another commander takes over.
  void disableForNewSession() noexcept;

  /// Goes on by dt, s: watchdog, interpolation, ramp.
  void step(double dt, std::int64_t now) noexcept;

  /// Puts a standing arm elsewhere. For simulated arms.
  void place(const ArmVector& position) noexcept;

  OperatingState state() const noexcept { return machine_.state(); }
  FaultMask faults() const noexcept { return machine_.faults(); }
  /// Cause of FAULT; empty in the other states.
  const FaultRecord& faultRecord() const noexcept { return record_; }
  /// ENABLED or PAUSED: a failure has to stop this arm.
  bool powered() const noexcept;
  /// ENABLED or PAUSED to be recovered: slow, inwards, without the joints in lost().
  bool recovering() const noexcept { return recovering_ && powered(); }
  JointMask lost() const noexcept { return recovering() ? lost_ : JointMask{0}; }
  /// Once per command: whether it asks to recover. One request gives power once: what latches while it lasts, or after
  /// it was granted, is not cleared by its repetitions, only by a request that follows other commands.
  void noteRecoverRequest(bool recover) noexcept {
    recover_requested_ = recover;
    recover_consumed_ = recover_consumed_ && recover;
  }
  bool recoverRequestConsumed() const noexcept { return recover_consumed_; }
  /// The reference stands still.
  bool standing() const noexcept { return mode_ == Mode::kStanding; }
  /// Present reference of the joints, m, rad.
  const ArmVector& reference() const noexcept { return reference_; }
  /// Velocity of the reference, m/s, rad/s.
  const ArmVector& referenceVelocity() const noexcept { return velocity_; }
  /// The last setpoint that passed the gate, m, rad; the reference while the arm stops or stands.
  const ArmVector& setpoint() const noexcept { return mode_ == Mode::kSegment ? target_ : reference_; }
  const ArmLimits& limits() const noexcept { return limits_; }

 private:
  enum class Mode : std::uint8_t {
    kStanding,
    kSegment,  ///< on the way to target_
    kArrived,  ///< at target_ with the speed of the segment; the next step begins a stop unless a command comes first
    kRamp,
  };

  FaultRecord recordOf(const GateReport& report) const noexcept;
  void applyRequest(const ArmRequest& request, const ArmVector& measured, const FaultRecord& present) noexcept;
  void enable(const ArmVector& measured, const FaultRecord& present) noexcept;
  ArmVector firstSetpoint(const ArmVector& measured) const noexcept;
  void recover(const ArmVector& measured, JointMask lost) noexcept;
  void setSpeeds(bool recovering, JointMask lost) noexcept;
  ArmVector withinOnePeriod(const ArmVector& next) const noexcept;
  void move(const ArmVector& setpoint) noexcept;
  void hold() noexcept;
  void stop() noexcept;
  void stand() noexcept;
  double advanceSegment(double dt) noexcept;

  Gate gate_;
  SupervisorOptions options_;
  StateMachine machine_;
  FaultRecord record_;
  Watchdog watchdog_;
  StopRamp ramp_;
  ArmLimits limits_;         ///< as given; the gate's are slower while the arm is recovered
  bool recovering_ = false;  ///< since the last time it got power
  JointMask lost_ = 0;
  bool recover_requested_ = false;  ///< the last command asks to recover
  bool recover_consumed_ = false;
  Mode mode_ = Mode::kStanding;
  ArmVector reference_;
  ArmVector velocity_;
  ArmVector start_;            ///< of the segment
  ArmVector target_;           ///< of the segment
  ArmVector commanded_speed_;  ///< of the last command, as it left the gate
  double elapsed_ = 0.0;       ///< in the segment, which takes a control period, s
};

}  // namespace tandem::safety
