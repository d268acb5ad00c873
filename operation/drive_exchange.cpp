// SPDX-License-Identifier: Apache-2.0
#include "operation/drive_exchange.h"

#include <algorithm>

#include "operation/convert.h"

namespace tandem::operation {

DriveExchange::DriveExchange(const Site& site) : site_(site) {
  measured_.setZero(site.model.jointCount());
  setpoints_ = measured_;
  sent_.fill(measured_);
}

DriveExchange::News DriveExchange::take(const msg::ActuationState& state, std::uint64_t arrivals) noexcept {
  News news;
  if (state.arm_count != site_.arms())
    return news;
  for (int k = 0; k < site_.arms(); ++k) {
    if (state.joint_count[static_cast<std::size_t>(k)] != site_.model.size(k))
      return news;
  }
  news.ours = true;
  if (arrivals > 0)
    success_.note(state.session, state.sequence, state.stamp, arrivals);
  if (std::ranges::none_of(state.operating_state,
                           [](auto of_arm) { return safety::hasPower(static_cast<safety::OperatingState>(of_arm)); }))
    success_.forgive();
  news.restarted = state_.session != 0 && state.session != state_.session;
  news.displaced = news.restarted || state.placements != state_.placements;
  fresh_ = fresh_ || news.restarted || state.sequence != state_.sequence;
  state_ = state;
  if (news.restarted)
    answered_ = 0;
  return news;
}

void DriveExchange::begin(std::int64_t now) noexcept {
  if (fresh_)
    seen_ = now;
  readJoints();
}

void DriveExchange::readJoints() noexcept {
  for (int k = 0; k < site_.arms(); ++k) {
    site_.of(k, measured_) = msg::jointsOf(state_.position, k, site_.model.size(k));
    site_.of(k, setpoints_) = setpoint(k);
  }
}

/// The last setpoint that the gate let through, and what has been sent since and is on its way.
safety::ArmVector DriveExchange::setpoint(int k) const noexcept {
  safety::ArmVector from = msg::jointsOf(state_.setpoint, k, site_.model.size(k));
  if (site_.lockStep())
    return from;
  // Some of them may be lost; to take them for done is the careful way where a limit is near.
  const std::uint64_t first = sequence_ - std::min<std::uint64_t>(inFlight(), kRemembered) + 1;
  for (std::uint64_t i = first; i <= sequence_; ++i)
    from += site_.period() * site_.of(k, sent_[i % kRemembered]);
  return from;
}

safety::FaultRecord DriveExchange::judge(std::int64_t now) const noexcept {
  const double age = times_.age(state_.answers_command, now);
  const double allowed = site_.deployment.budgets.commandAge(site_.period());
  if (age <= allowed)
    return success_.judge(safety::Fault::kStateTimeout, site_.deployment.budgets.lost_samples, allowed);
  const bool silent = 1e-9 * static_cast<double>(now - seen_) > 0.5 * allowed;
  return {bit(safety::Fault::kStateTimeout), silent ? safety::FaultCause::kSilent : safety::FaultCause::kUnanswered,
          idl::kNoJoint, age, allowed};
}

void DriveExchange::send(std::int64_t now,
                         bool advance,
                         const Velocities& velocities,
                         msg::ActuationCommand& command) noexcept {
  command = msg::ActuationCommand{};
  command.control_session = site_.session;
  command.sequence = ++sequence_;
  command.state_session = state_.session;
  command.answers_state = state_.sequence;
  command.stamp = site_.lockStep() ? state_.stamp : now;
  command.advance = advance ? 1 : 0;
  command.arm_count = static_cast<std::uint8_t>(site_.arms());
  times_.record(command.sequence, now);
  safety::RobotVector& sent = sent_[sequence_ % kRemembered];
  for (int k = 0; k < site_.arms(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    command.moving[i] = velocities.moves[i] ? 1 : 0;
    for (int j = 0; j < site_.model.size(k); ++j) {
      const int joint = site_.model.offset(k) + j;
      sent[joint] = velocities.moves[i] ? velocities.value[joint] : 0.0;
      command.velocity[msg::jointIndex(k, j)] = sent[joint];
      command.position[msg::jointIndex(k, j)] = setpoints_[joint] + site_.period() * sent[joint];
    }
  }
  fresh_ = false;
  if (advance)
    answered_ = state_.sequence;
}

}  // namespace tandem::operation
