// SPDX-License-Identifier: Apache-2.0
#include "operation/drive_exchange.h"

#include <algorithm>

#include "operation/convert.h"

namespace tandem::operation {

DriveExchange::DriveExchange(const ControlSetup& setup) : setup_(setup) {
  measured_.setZero(setup.model.jointCount());
  setpoints_ = measured_;
  sent_.fill(measured_);
}

DriveExchange::StateUpdate DriveExchange::take(const msg::ActuationState& state, std::uint64_t arrivals) noexcept {
  StateUpdate update;
  if (state.arm_count != setup_.arms())
    return update;
  for (int k = 0; k < setup_.arms(); ++k) {
    if (state.joint_count[static_cast<std::size_t>(k)] != setup_.model.size(k))
      return update;
  }
  update.ours = true;
  if (arrivals > 0)
    success_.note(state.session, state.sequence, state.stamp, arrivals);
  if (std::ranges::none_of(state.operating_state,
                           [](auto of_arm) { return safety::hasPower(static_cast<safety::OperatingState>(of_arm)); }))
    success_.resetLosses();
  update.restarted = state_.session != 0 && state.session != state_.session;
  update.displaced = update.restarted || state.joint_resets != state_.joint_resets;
  fresh_ = fresh_ || update.restarted || state.sequence != state_.sequence;
  state_ = state;
  if (update.restarted)
    answered_ = 0;
  return update;
}

void DriveExchange::begin(std::int64_t now) noexcept {
  if (fresh_)
    seen_ = now;
  readJoints();
}

void DriveExchange::readJoints() noexcept {
  for (int k = 0; k < setup_.arms(); ++k) {
    setup_.of(k, measured_) = msg::jointsOf(state_.position, k, setup_.model.size(k));
    setup_.of(k, setpoints_) = setpoint(k);
  }
}

/// The last setpoint that passed the gate, plus all commands sent since.
safety::ArmVector DriveExchange::setpoint(int k) const noexcept {
  safety::ArmVector from = msg::jointsOf(state_.setpoint, k, setup_.model.size(k));
  if (setup_.lockStep())
    return from;
  // Some of them may be lost; to count them as executed is conservative near a limit.
  const std::uint64_t first = sequence_ - std::min<std::uint64_t>(inFlight(), kRemembered) + 1;
  for (std::uint64_t i = first; i <= sequence_; ++i)
    from += setup_.period() * setup_.of(k, sent_[i % kRemembered]);
  return from;
}

safety::FaultRecord DriveExchange::judge(std::int64_t now) const noexcept {
  const double age = times_.age(state_.answers_command, now);
  const double allowed = setup_.deployment.budgets.commandAge(setup_.period());
  if (age <= allowed)
    return success_.judge(safety::Fault::kStateTimeout, setup_.deployment.budgets.lost_samples, allowed);
  const bool silent = 1e-9 * static_cast<double>(now - seen_) > 0.5 * allowed;
  return {bit(safety::Fault::kStateTimeout), silent ? safety::FaultCause::kSilent : safety::FaultCause::kUnanswered,
          idl::kNoJoint, age, allowed};
}

void DriveExchange::send(std::int64_t now,
                         bool advance,
                         const Velocities& velocities,
                         msg::ActuationCommand& command) noexcept {
  command = msg::ActuationCommand{};
  command.control_session = setup_.session;
  command.sequence = ++sequence_;
  command.state_session = state_.session;
  command.answers_state = state_.sequence;
  command.stamp = setup_.lockStep() ? state_.stamp : now;
  command.advance = advance ? 1 : 0;
  command.arm_count = static_cast<std::uint8_t>(setup_.arms());
  times_.record(command.sequence, now);
  safety::RobotVector& sent = sent_[sequence_ % kRemembered];
  for (int k = 0; k < setup_.arms(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    command.moving[i] = velocities.moves[i] ? 1 : 0;
    for (int j = 0; j < setup_.model.size(k); ++j) {
      const int joint = setup_.model.offset(k) + j;
      sent[joint] = velocities.moves[i] ? velocities.value[joint] : 0.0;
      command.velocity[msg::jointIndex(k, j)] = sent[joint];
      command.position[msg::jointIndex(k, j)] = setpoints_[joint] + setup_.period() * sent[joint];
    }
  }
  fresh_ = false;
  if (advance)
    answered_ = state_.sequence;
}

}  // namespace tandem::operation
