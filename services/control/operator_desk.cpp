// SPDX-License-Identifier: Apache-2.0
#include "services/control/operator_desk.h"

#include <algorithm>
#include <cmath>

namespace tandem::service {
namespace {

namespace teleoperation = planning::teleoperation;
using teleoperation::State;

/// How long a refusal is shown where nothing better is to be said, ns.
constexpr std::int64_t kShown = 1'000'000'000;

template <std::size_t N>
bool finite(const std::array<double, N>& numbers) noexcept {
  return std::all_of(numbers.begin(), numbers.end(), [](double x) { return std::isfinite(x); });
}

Eigen::Quaterniond rotation(const std::array<double, 4>& xyzw) noexcept { return {xyzw[3], xyzw[0], xyzw[1], xyzw[2]}; }

template <class From>
std::array<double, 3> list(const From& v) noexcept {
  return {v[0], v[1], v[2]};
}

}  // namespace

const char* words(OperatorReason reason) {
  switch (reason) {
    case OperatorReason::kNone:
      return "";
    case OperatorReason::kNotCommander:
      return "its client does not hold the control lease; acquire it first";
    case OperatorReason::kOtherControl:
      return "it answers another session of control; echo session and sequence of control/status";
    case OperatorReason::kOutOfSequence:
      return "its sequence is not above that of the one before";
    case OperatorReason::kLate:
      return "the control/status that it answers is too old";
    case OperatorReason::kNotFinite:
      return "a number is not finite";
    case OperatorReason::kDevice:
      return "device: expected 0 to 6";
    case OperatorReason::kKind:
      return "kind: expected 1 (velocity) or 2 (pose)";
    case OperatorReason::kFrame:
      return "frame: expected 0 (base) or 1 (view)";
    case OperatorReason::kView:
      return "view: expected a unit quaternion";
    case OperatorReason::kMode:
      return "mode: expected 1 (tip), 2 (pair) or 3 (relative); 2 and 3 need two different arms";
    case OperatorReason::kArm:
      return "arm or other_arm: the robot has no such arm";
    case OperatorReason::kScale:
      return "scale: expected 0.05 to 1, or 0 for the deployment's";
    case OperatorReason::kLockStep:
      return "in lock-step nobody can drive; use a deployment with clock: real_time";
    case OperatorReason::kNotEnabled:
      return "an arm that would move is not ENABLED; enable it, then release the dead-man switch and hold it again";
    case OperatorReason::kTrajectory:
      return "a trajectory is running; pause or stop it, then release the dead-man switch and hold it again";
    case OperatorReason::kJoints:
      return "an arm moves joint by joint; let it end, then release the dead-man switch and hold it again";
    case OperatorReason::kTips:
      return "a tip is not known; release the dead-man switch and hold it again when it is";
    case OperatorReason::kSilent:
      return "no fresh input came; release the dead-man switch and hold it again";
    case OperatorReason::kHeldBefore:
      return "the dead-man switch was held from the start; release it and hold it again";
    case OperatorReason::kCatheters:
      return "catheters that work together are moved by paths and by joints, not tip by tip";
  }
  return "unknown";
}

OperatorDesk::OperatorDesk(const Setup& setup, int arm_count)
    : session_(setup.session),
      lock_step_(setup.deployment.clock == config::ClockMode::kLockStep),
      arm_count_(arm_count),
      budget_(std::max(setup.deployment.budgets.teleoperation, 2.5 * setup.deployment.control_period)),
      pipeline_(setup.deployment.teleoperation.options, setup.deployment.control_period) {}

OperatorReason OperatorDesk::judge(const dds::TeleopInput& input) const noexcept {
  using enum OperatorReason;
  if (input.control_session != session_)
    return kOtherControl;
  if (seen_ && input.sequence <= last_.sequence)
    return kOutOfSequence;
  if (input.device >= teleoperation::kDevices)
    return kDevice;
  if (input.kind != 1 && input.kind != 2)
    return kKind;
  if (input.frame > 1)
    return kFrame;
  if (input.arm >= arm_count_ || input.other_arm >= arm_count_)
    return kArm;
  const auto mode = static_cast<teleoperation::Mode>(input.mode);
  if (input.mode < 1 || input.mode > 3 || (mode != teleoperation::Mode::kTip && input.arm == input.other_arm))
    return kMode;
  if (!finite(input.view) || !finite(input.linear) || !finite(input.angular) || !finite(input.position) ||
      !finite(input.orientation) || !std::isfinite(input.scale))
    return kNotFinite;
  if (input.frame == 1 && std::abs(rotation(input.view).norm() - 1.0) > 1e-2)
    return kView;
  if (input.scale != 0.0 && (input.scale < teleoperation::kMinScale || input.scale > teleoperation::kMaxScale))
    return kScale;
  return kNone;
}

void OperatorDesk::take(const dds::TeleopInput& input, const Context& context) noexcept {
  OperatorReason refusal = OperatorReason::kNone;
  const bool nobody = input.client == 0 || input.client == dds::kCrtkClient;
  const bool commander = !nobody && input.client == context.lease_holder;
  if (lock_step_) {
    refusal = OperatorReason::kLockStep;
  } else if (!commander) {
    refusal = OperatorReason::kNotCommander;
  } else {
    if (input.client != last_.client) {  // another operator starts anew
      pipeline_.release();
      last_ = {};
      seen_ = false;
      locked_ = true;
      reason_ = OperatorReason::kHeldBefore;
    }
    refusal = judge(input);
    if (refusal == OperatorReason::kNone && context.statuses->age(input.answers_control, context.now) > budget_) {
      ++late_;
      refusal = OperatorReason::kLate;
    }
  }
  if (refusal == OperatorReason::kNone)
    return accept(input, context);
  ++refused_;
  refusal_ = refusal;
  refused_client_ = input.client;
  last_refusal_ = context.now;
}

void OperatorDesk::accept(const dds::TeleopInput& input, const Context& context) noexcept {
  ++accepted_;
  if (last_taken_ != 0 && context.now > last_taken_)
    rate_ += 0.1 * (1e9 / static_cast<double>(context.now - last_taken_) - rate_);
  last_taken_ = context.now;
  latency_ = context.statuses->age(input.answers_control, context.now);
  last_ = input;
  seen_ = true;
  sample_.number = accepted_;
  sample_.present = input.operator_present != 0;
  sample_.clutch = input.clutch != 0;
  sample_.mode = static_cast<teleoperation::Mode>(input.mode);
  sample_.arm = input.arm;
  sample_.other_arm = input.other_arm;
  sample_.pose = input.kind == 2;
  sample_.value = Eigen::Vector3d::Map(sample_.pose ? input.position.data() : input.linear.data());
  sample_.frame = input.frame == 1 ? rotation(input.view).normalized() : Eigen::Quaterniond::Identity();
  sample_.scale = input.scale;
  if (!sample_.present) {
    pipeline_.release();
    locked_ = false;
    reason_ = OperatorReason::kNone;
  }
}

bool OperatorDesk::fresh(const Context& context) const noexcept {
  return seen_ && last_.client == context.lease_holder &&
         context.statuses->age(last_.answers_control, context.now) <= budget_;
}

bool OperatorDesk::wants(const Context& context) noexcept {
  if (seen_ && last_.client != context.lease_holder) {
    stop(OperatorReason::kNotCommander);
    seen_ = false;
  }
  if (!seen_ || !sample_.present)
    return false;
  if (!fresh(context)) {
    stop(OperatorReason::kSilent);
    return false;
  }
  return !locked_;
}

void OperatorDesk::stop(OperatorReason reason) noexcept {
  pipeline_.release();
  if (!locked_ || reason_ == OperatorReason::kNone)
    reason_ = reason;
  locked_ = true;
}

void OperatorDesk::fill(const Context& context, OperatorMoment& moment) const noexcept {
  moment = {};
  const bool here = fresh(context);
  if (here) {
    moment.state = locked_ && sample_.present ? State::kStopped : pipeline_.state();
    moment.reason = locked_ ? reason_ : OperatorReason::kNone;
  } else if (seen_ && locked_) {
    moment.state = State::kStopped;
    moment.reason = reason_;
  } else if (last_refusal_ != 0 && context.now - last_refusal_ < kShown) {
    moment.state = State::kRefused;
    moment.reason = refusal_;
  }
  moment.client = seen_ ? last_.client : 0;
  moment.answers_input = seen_ ? last_.sequence : 0;
  moment.accepted = accepted_;
  moment.refused = refused_ - late_;
  moment.late = late_;
  moment.refused_client = refused_client_;
  moment.refusal = refusal_;
  moment.device = last_.device;
  moment.operator_present = here ? last_.operator_present : 0;
  moment.clutch = here ? last_.clutch : 0;
  moment.mode = last_.mode;
  moment.arm = last_.arm;
  moment.other_arm = last_.other_arm;
  moment.frame = last_.frame;
  moment.scale = pipeline_.scale();
  moment.input_age = seen_ ? std::min(1e3, context.statuses->age(last_.answers_control, context.now)) : 0.0;
  moment.latency = latency_;
  moment.input_rate = here ? rate_ : 0.0;
  moment.lag = pipeline_.lag();
  moment.engaged = pipeline_.engaged();
  for (std::size_t s = 0; here && s < moment.stages.size(); ++s) {
    const teleoperation::StageResult& from = pipeline_.stages()[s];
    moment.stages[s] = {list(from.input), list(from.output), from.limiter, from.index};
  }
  if (moment.engaged) {
    moment.wanted = list(pipeline_.wanted());
    moment.target = list(pipeline_.target());
    moment.position = list(pipeline_.position());
  }
}

}  // namespace tandem::service
