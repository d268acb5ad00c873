// SPDX-License-Identifier: Apache-2.0
/** @file Exchange with the drives: the last state, the commands sent since, and the joints from which the next cycle
 * continues.
 */
#pragma once

#include "idl/messages.h"
#include "operation/control_setup.h"
#include "safety/command_monitor.h"
#include "safety/faults.h"
#include "safety/operating_state.h"

namespace tandem::operation {

/** Joint velocities of one cycle, of all arms. */
struct Velocities {
  safety::RobotVector value;                   ///< m/s, rad/s
  std::array<bool, safety::kMaxArms> moves{};  ///< false: the arm holds
};

/** Both directions between control and the drives. Nothing allocates after construction; times are ns on one clock. */
class DriveExchange {
 public:
  explicit DriveExchange(const ControlSetup& setup);

  /** Events detected in a state. */
  struct StateUpdate {
    bool ours = false;       ///< false: the state is another robot's, and ignored
    bool restarted = false;  ///< the drives have restarted
    bool displaced = false;  ///< the joints were reset without a motion
  };
  /// @param arrivals  states received so far, this one included; 0: not counted
  StateUpdate take(const msg::ActuationState& state, std::uint64_t arrivals = 0) noexcept;
  /// Begins a cycle.
  void begin(std::int64_t now) noexcept;
  /// Joints of the last state, and the setpoints from which the velocities of this cycle are integrated.
  void readJoints() noexcept;

  const msg::ActuationState& state() const noexcept { return state_; }
  bool received() const noexcept { return state_.sequence > 0; }
  /// A new state has arrived since the last cycle.
  bool fresh() const noexcept { return fresh_; }
  safety::OperatingState state(int arm) const noexcept {
    return static_cast<safety::OperatingState>(state_.operating_state[static_cast<std::size_t>(arm)]);
  }
  const safety::RobotVector& measured() const noexcept { return measured_; }
  const safety::RobotVector& setpoints() const noexcept { return setpoints_; }
  /// Velocities of the last command.
  const safety::RobotVector& lastSent() const noexcept { return sent_[sequence_ % kRemembered]; }
  /// Sequence of the last command.
  std::uint64_t sequence() const noexcept { return sequence_; }
  /// Send time of each command.
  const safety::StateStamps& sendTimes() const noexcept { return times_; }
  /// Number of commands that the last state does not include yet.
  std::uint64_t inFlight() const noexcept { return sequence_ - state_.answers_command; }
  /// Whether the state is too old, by the command that it echoes, or too many are lost. @return the fault; empty: none
  safety::FaultRecord judge(std::int64_t now) const noexcept;
  /// Share of the last 100 states that have arrived, 0 to 1.
  double success() const noexcept { return success_.value(); }

  /// Writes the next command, without requests to the drives; arms that `velocities` does not move hold.
  void send(std::int64_t now, bool advance, const Velocities& velocities, msg::ActuationCommand& command) noexcept;
  /// Lock-step: the present state has not been answered with motion.
  bool unanswered() const noexcept { return received() && state_.sequence != answered_; }

 private:
  safety::ArmVector setpoint(int arm) const noexcept;

  ControlSetup setup_;
  static constexpr std::size_t kRemembered = 16;
  msg::ActuationState state_;
  bool fresh_ = false;
  std::int64_t seen_ = 0;
  safety::StreamSuccess success_;
  safety::RobotVector measured_, setpoints_;
  std::array<safety::RobotVector, kRemembered> sent_;  ///< by sequence
  safety::StateStamps times_;
  std::uint64_t sequence_ = 0, answered_ = 0;
};

}  // namespace tandem::operation
