// SPDX-License-Identifier: Apache-2.0
#include "services/control/control_request_handler.h"

#include <cmath>

#include "config/arm_names.h"
#include "control/method_names.h"
#include "services/dds/reply.h"

namespace tandem::control_service {
ControlRequestHandler::ControlRequestHandler(const runtime::Setup& setup, const robots::RobotModel& robot)
    : file_(setup.robot), robot_(robot), arm_names_(config::armList(setup.robot)) {
  settings_.method = setup.deployment.method;
  settings_.parameters = setup.robot.parameters;
  settings_.parameters.period = setup.deployment.control_period;
  settings_.gains = {setup.deployment.relative_gain, setup.deployment.tip_gain};
  proposed_ = settings_;
}

std::unique_ptr<planning::ReferenceTracker> ControlRequestHandler::makeTracker(
    const planning::MethodSettings& s) const {
  return robot_.makeTracker(s.method, s.parameters, s.gains);
}

std::unique_ptr<planning::ReferenceTracker> ControlRequestHandler::makeTracker() const {
  const std::lock_guard lock(mutex_);
  return makeTracker(settings_);
}

planning::MethodSettings ControlRequestHandler::changed(const dds::ControlRequest& request) const {
  const std::lock_guard lock(mutex_);
  planning::MethodSettings s = settings_;
  if (static_cast<dds::ControlKind>(request.kind) == dds::ControlKind::kSetMethod) {
    const auto method = idl::fromName<control::Method>(request.text);
    if (!method)
      throw std::invalid_argument("method: found '" + request.text + "', expected " + control::methodList());
    s.method = *method;
  } else {
    s.set(request.text, request.value);
  }
  return s;
}

runtime::Details ControlRequestHandler::parameters() const {
  const std::lock_guard lock(mutex_);
  runtime::Details values;
  for (const auto& [name, value] : settings_.values())
    values.push_back({runtime::kParameterKey + name, value});
  return values;
}

std::optional<operation::ParsedControlRequest> ControlRequestHandler::parse(const dds::ControlRequest& request,
                                                                            std::uint64_t owner,
                                                                            dds::Reply& refusal) {
  operation::ParsedControlRequest result;
  result.client = request.client;
  result.request = request.request;
  result.kind = static_cast<dds::ControlKind>(request.kind);
  result.control_session = request.control_session;
  result.answers_control = request.answers_control;
  const auto refused = [&](dds::ReplyCode code, std::string reason) {
    refusal = dds::replyTo(request, code, std::move(reason));
    return std::nullopt;
  };
  if (request.client == 0)
    return refused(dds::ReplyCode::kMalformed, "client: found 0, expected the client's number, which is not zero");
  if (request.client == dds::kCrtkClient)
    return refused(dds::ReplyCode::kMalformed, "client: found 2^64 - 1, which is reserved for CRTK clients");
  if (request.arm != dds::kAllArms) {
    if (request.arm >= arm_names_.size()) {
      return refused(dds::ReplyCode::kMalformed, "arm: found " + std::to_string(request.arm) + ", expected below " +
                                                     std::to_string(arm_names_.size()) + " or 255 for all");
    }
    result.arm = request.arm;
  }
  switch (result.kind) {
    case dds::ControlKind::kAcquireLease:
    case dds::ControlKind::kReleaseLease:
    case dds::ControlKind::kKeepLease:
    case dds::ControlKind::kHome:
    case dds::ControlKind::kHold:
      return result;
    case dds::ControlKind::kStateCommand: {
      const auto command = idl::fromName<safety::StateCommand>(request.value);
      if (!command) {
        return refused(dds::ReplyCode::kMalformed,
                       "state command: found '" + request.value +
                           "', expected enable, disable, pause, resume, home, unhome or recover");
      }
      result.command = *command;
      if (result.command != safety::StateCommand::kRecover)
        return result;
      if (result.arm == dds::kAllArms)
        return refused(dds::ReplyCode::kMalformed, "arm: expected one arm to recover, not all");
      if (request.joint_count != 0 && request.joint_count != robot_.size(result.arm))
        return refused(dds::ReplyCode::kMalformed, "joints: found " + std::to_string(request.joint_count) +
                                                       ", expected 0 or " + std::to_string(robot_.size(result.arm)));
      result.joint_count = request.joint_count;
      result.joints = request.joints;
      return result;
    }
    case dds::ControlKind::kWithdraw:
      if (result.arm == dds::kAllArms)
        return refused(dds::ReplyCode::kMalformed, "arm: expected one arm to withdraw, not all");
      return result;
    case dds::ControlKind::kMoveJp:
    case dds::ControlKind::kJog: {
      if (result.arm == dds::kAllArms)
        return refused(dds::ReplyCode::kMalformed, "arm: expected one arm, not all");
      const int expected = robot_.size(result.arm);
      if (request.joint_count != expected) {
        return refused(dds::ReplyCode::kMalformed, "joints: found " + std::to_string(request.joint_count) +
                                                       ", expected " + std::to_string(expected));
      }
      result.joint_count = expected;
      result.joints = request.joints;
      for (int j = 0; j < expected; ++j) {
        if (!std::isfinite(request.joints[static_cast<std::size_t>(j)])) {
          return refused(dds::ReplyCode::kMalformed, "joint " + std::to_string(j + 1) + " is not a finite number");
        }
      }
      return result;
    }
    case dds::ControlKind::kSetMethod:
    case dds::ControlKind::kSetParameter:
      // Only for the lease owner: this takes long, and other clients could block the thread that also receives stops.
      if (request.client != owner) {
        const auto reason = owner == 0 ? operation::Reason::kNoLease : operation::Reason::kOtherLease;
        return refused(dds::ReplyCode::kNotLeaseOwner, std::string(idl::name(reason)));
      }
      try {
        const planning::MethodSettings settings = changed(request);
        result.tracker = makeTracker(settings).release();
        const std::lock_guard lock(mutex_);
        proposed_ = settings;
        return result;
      } catch (const std::invalid_argument& error) {
        return refused(dds::ReplyCode::kMalformed, error.what());
      }
  }
  return refused(dds::ReplyCode::kUnknown, "unknown kind of request " + std::to_string(request.kind));
}

std::optional<operation::ParsedControlRequest> ControlRequestHandler::parse(const std::string& arm,
                                                                            const dds::StringStamped& command,
                                                                            std::string& refusal) const {
  operation::ParsedControlRequest result;
  result.kind = dds::ControlKind::kStateCommand;
  result.from_topic = true;
  for (std::size_t k = 0; k < arm_names_.size(); ++k) {
    if (arm_names_[k] == arm)
      result.arm = static_cast<int>(k);
  }
  const auto parsed = idl::fromName<safety::StateCommand>(command.string);
  if (!parsed || *parsed == safety::StateCommand::kRecover) {  // recover needs an explicit request of the lease owner
    refusal = arm + "/state_command: found '" + command.string.substr(0, 40) +
              "', expected enable, disable, pause, resume, home or unhome";
    return std::nullopt;
  }
  result.command = *parsed;
  return result;
}

dds::Reply ControlRequestHandler::replyTo(const operation::ControlReply& from) {
  delete from.retired;
  if (from.method_accepted) {
    const std::lock_guard lock(mutex_);
    settings_ = proposed_;
  }
  return dds::replyTo(from, from.refusal.code(), describe(from.refusal, file_),
                      static_cast<std::uint32_t>(from.status));
}

}  // namespace tandem::control_service
