// SPDX-License-Identifier: Apache-2.0
#include "operation/operator_input_handler.h"

#include <algorithm>
#include <cmath>

namespace tandem::operation {
namespace {

namespace teleoperation = planning::teleoperation;
using teleoperation::State;

/// Time for which a refusal is displayed without a later one, ns.
constexpr std::int64_t kShown = 1'000'000'000;

template <std::size_t N>
bool finite(const std::array<double, N>& numbers) noexcept {
  return std::all_of(numbers.begin(), numbers.end(), [](double x) { return std::isfinite(x); });
}

Eigen::Quaterniond rotation(const std::array<double, 4>& xyzw) noexcept { return {xyzw[3], xyzw[0], xyzw[1], xyzw[2]}; }

bool isUnit(const std::array<double, 4>& xyzw) noexcept { return std::abs(rotation(xyzw).norm() - 1.0) <= 1e-2; }

template <class From>
std::array<double, 3> list(const From& v) noexcept {
  return {v[0], v[1], v[2]};
}

}  // namespace

std::string describeOperatorStop(Reason reason) {
  const bool stands = reason == Reason::kNotEnabled || reason == Reason::kTrajectory || reason == Reason::kJoints ||
                      reason == Reason::kTips;
  return std::string(name(reason)) + (stands ? ", then release the dead-man switch and press it again" : "");
}

OperatorInputHandler::OperatorInputHandler(const ControlSetup& setup)
    : session_(setup.session),
      lock_step_(setup.lockStep()),
      arm_count_(setup.arms()),
      budget_(std::max(setup.deployment.budgets.teleoperation, 2.5 * setup.period())),
      pipeline_(setup.deployment.teleoperation.options, setup.period()) {}

Reason OperatorInputHandler::judge(const msg::TeleopInput& input) const noexcept {
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
  if (input.frame == 1 && !isUnit(input.view))
    return kView;
  if (input.kind == 2 && pipeline_.rotates() && !isUnit(input.orientation))
    return kView;
  if (input.scale != 0.0 && (input.scale < teleoperation::kMinScale || input.scale > teleoperation::kMaxScale))
    return kScale;
  return kNone;
}

void OperatorInputHandler::take(const msg::TeleopInput& input, const Context& context) noexcept {
  Reason refusal = Reason::kNone;
  const bool nobody = input.client == 0 || input.client == msg::kCrtkClient;
  const bool commander = !nobody && input.client == context.lease_owner;
  if (lock_step_) {
    refusal = Reason::kLockStep;
  } else if (!commander) {
    refusal = Reason::kNotCommander;
  } else {
    if (input.client != last_.client) {  // a new operator: restart
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

void OperatorInputHandler::accept(const msg::TeleopInput& input, const Context& context) noexcept {
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
  sample_.angular = Eigen::Vector3d::Map(input.angular.data());
  sample_.orientation = pipeline_.rotates() ? rotation(input.orientation).normalized() : Eigen::Quaterniond::Identity();
  sample_.frame = input.frame == 1 ? rotation(input.view).normalized() : Eigen::Quaterniond::Identity();
  sample_.scale = input.scale;
  if (!sample_.present) {
    pipeline_.release();
    locked_ = false;
    reason_ = Reason::kNone;
  }
}

bool OperatorInputHandler::fresh(const Context& context) const noexcept {
  return seen_ && last_.client == context.lease_owner &&
         context.statuses->age(last_.answers_control, context.now) <= budget_;
}

bool OperatorInputHandler::isActive(const Context& context) noexcept {
  if (seen_ && last_.client != context.lease_owner) {
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

void OperatorInputHandler::stop(Reason reason) noexcept {
  pipeline_.release();
  if (!locked_ || reason_ == Reason::kNone)
    reason_ = reason;
  locked_ = true;
}

void OperatorInputHandler::fill(const Context& context, OperatorSnapshot& snapshot) const noexcept {
  snapshot = {};
  const bool here = fresh(context);
  if (here) {
    snapshot.state = locked_ && sample_.present ? State::kStopped : pipeline_.state();
    snapshot.reason = locked_ ? reason_ : Reason::kNone;
  } else if (seen_ && locked_) {
    snapshot.state = State::kStopped;
    snapshot.reason = reason_;
  } else if (last_refusal_ != 0 && context.now - last_refusal_ < kShown) {
    snapshot.state = State::kRefused;
    snapshot.reason = refusal_;
  }
  snapshot.client = seen_ ? last_.client : 0;
  snapshot.answers_input = seen_ ? last_.sequence : 0;
  snapshot.accepted = accepted_;
  snapshot.refused = refused_ - late_;
  snapshot.late = late_;
  snapshot.refused_client = refused_client_;
  snapshot.refusal = refusal_;
  snapshot.device = last_.device;
  snapshot.operator_present = here ? last_.operator_present : 0;
  snapshot.clutch = here ? last_.clutch : 0;
  snapshot.mode = last_.mode;
  snapshot.arm = last_.arm;
  snapshot.other_arm = last_.other_arm;
  snapshot.frame = last_.frame;
  snapshot.scale = pipeline_.scale();
  snapshot.input_age = seen_ ? std::min(1e3, context.statuses->age(last_.answers_control, context.now)) : 0.0;
  snapshot.latency = latency_;
  snapshot.input_rate = here ? rate_ : 0.0;
  snapshot.lag = pipeline_.lag();
  snapshot.engaged = pipeline_.engaged();
  snapshot.rotates = pipeline_.rotates();
  const auto copy = [](const teleoperation::StageResults& from, auto& to) {
    for (std::size_t s = 0; s < to.size(); ++s)
      to[s] = {list(from[s].input), list(from[s].output), from[s].limiter, from[s].index};
  };
  if (here) {
    copy(pipeline_.stages(), snapshot.stages);
    copy(pipeline_.rotationStages(), snapshot.rotation_stages);
  }
  if (snapshot.engaged) {
    snapshot.wanted = list(pipeline_.wanted());
    snapshot.target = list(pipeline_.target());
    snapshot.position = list(pipeline_.position());
  }
}

}  // namespace tandem::operation
