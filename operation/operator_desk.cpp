// SPDX-License-Identifier: Apache-2.0
#include "operation/operator_desk.h"

#include <algorithm>
#include <cmath>

namespace tandem::operation {
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

std::string operatorWords(Reason reason) {
  const bool stands = reason == Reason::kNotEnabled || reason == Reason::kTrajectory || reason == Reason::kJoints ||
                      reason == Reason::kTips;
  return std::string(name(reason)) + (stands ? ", then release the dead-man switch and hold it again" : "");
}

OperatorDesk::OperatorDesk(const Site& site)
    : session_(site.session),
      lock_step_(site.lockStep()),
      arm_count_(site.arms()),
      budget_(std::max(site.deployment.budgets.teleoperation, 2.5 * site.period())),
      pipeline_(site.deployment.teleoperation.options, site.period()) {}

Reason OperatorDesk::judge(const msg::TeleopInput& input) const noexcept {
  using enum idl::RefusalReason;
  if (input.control_session != session_)
    return kOtherControl;
  if (seen_ && input.sequence <= last_.sequence)
    return kOutOfSequence;
  if (input.device >= idl::count<teleoperation::Device>)
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

void OperatorDesk::take(const msg::TeleopInput& input, const Context& context) noexcept {
  Reason refusal = Reason::kNone;
  const bool nobody = input.client == 0 || input.client == msg::kCrtkClient;
  const bool commander = !nobody && input.client == context.lease_holder;
  if (lock_step_) {
    refusal = Reason::kLockStep;
  } else if (!commander) {
    refusal = Reason::kNotCommander;
  } else {
    if (input.client != last_.client) {  // another operator starts anew
      pipeline_.release();
      last_ = {};
      seen_ = false;
      locked_ = true;
      reason_ = Reason::kHeldBefore;
    }
    refusal = judge(input);
    if (refusal == Reason::kNone && context.statuses->age(input.answers_control, context.now) > budget_) {
      ++late_;
      refusal = Reason::kLate;
    }
  }
  if (refusal == Reason::kNone)
    return accept(input, context);
  ++refused_;
  refusal_ = refusal;
  refused_client_ = input.client;
  last_refusal_ = context.now;
}

void OperatorDesk::accept(const msg::TeleopInput& input, const Context& context) noexcept {
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
    reason_ = Reason::kNone;
  }
}

bool OperatorDesk::fresh(const Context& context) const noexcept {
  return seen_ && last_.client == context.lease_holder &&
         context.statuses->age(last_.answers_control, context.now) <= budget_;
}

bool OperatorDesk::wants(const Context& context) noexcept {
  if (seen_ && last_.client != context.lease_holder) {
    stop(Reason::kNotCommander);
    seen_ = false;
  }
  if (!seen_ || !sample_.present)
    return false;
  if (!fresh(context)) {
    stop(Reason::kSilent);
    return false;
  }
  return !locked_;
}

void OperatorDesk::stop(Reason reason) noexcept {
  pipeline_.release();
  if (!locked_ || reason_ == Reason::kNone)
    reason_ = reason;
  locked_ = true;
}

void OperatorDesk::fill(const Context& context, OperatorMoment& moment) const noexcept {
  moment = {};
  const bool here = fresh(context);
  if (here) {
    moment.state = locked_ && sample_.present ? State::kStopped : pipeline_.state();
    moment.reason = locked_ ? reason_ : Reason::kNone;
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

}  // namespace tandem::operation
