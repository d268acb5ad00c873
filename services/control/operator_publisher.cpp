// SPDX-License-Identifier: Apache-2.0
#include "services/control/operator_publisher.h"
#include "config/arm_names.h"

#include <spdlog/fmt/fmt.h>

#include <numbers>

#include "control/conflict.h"

namespace tandem::control_service {
namespace {

using planning::teleoperation::Limiter;
using planning::teleoperation::Stage;

}  // namespace

OperatorPublisher::OperatorPublisher(dds::Bus& bus, const runtime::Setup& setup, const CrtkCommandHandler& handler)
    : setup_(setup),
      handler_(handler),
      operators_(bus.writer(dds::kTeleopStatus)),
      crtk_(bus.writer(dds::kCrtkStatus)) {}

void OperatorPublisher::publish(const dds::ControlStatus& status,
                                const operation::OperatorSnapshot& operators,
                                const operation::CrtkSnapshot& crtk) {
  ++sequence_;
  operators_.write(statusOf(status, operators));
  dds::CrtkStatus message;
  message.session = setup_.session;
  message.sequence = sequence_;
  message.stamp = status.stamp;
  handler_.fill(crtk, message);
  crtk_.write(message);
}

/// Of a stage of rotations.
std::string OperatorPublisher::rotationLimiterOf(const operation::OperatorSnapshot::Stage& stage) const {
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  const double most = setup_.deployment.teleoperation.options.rotation.max_speed;
  switch (stage.limiter) {
    case Limiter::kSpeed:
      return fmt::format("max_angular_speed {:.4g} deg/s", kDegrees * most);
    case Limiter::kLeash:
      return "leash_angle (the orientation of the tip lags behind its target)";
    default:
      return limiterOf(stage);
  }
}

std::string OperatorPublisher::limiterOf(const operation::OperatorSnapshot::Stage& stage) const {
  constexpr std::array<const char*, 6> kSides{"x_min", "x_max", "y_min", "y_max", "z_min", "z_max"};
  const auto& guard = setup_.deployment.teleoperation.options.guard;
  const auto index = static_cast<std::size_t>(stage.index);
  switch (stage.limiter) {
    case Limiter::kNone:
      return "";
    case Limiter::kForbiddenRegion:
      return "forbidden region " + (index < guard.forbidden.size() ? guard.forbidden[index].name : "");
    case Limiter::kGuidance:
      return "guidance";
    case Limiter::kWorkspace:
      return std::string("workspace ") + kSides[std::min<std::size_t>(index, 5)];
    case Limiter::kSpeed:
      return fmt::format("max_speed {:.4g} mm/s", 1e3 * guard.max_speed);
    case Limiter::kLeash:
      return "leash (the tip lags behind its target)";
    case Limiter::kDeadband:
      return "deadband";
    case Limiter::kDeadMan:
      return "dead-man switch";
    case Limiter::kClutch:
      return "clutch";
    case Limiter::kScale:
      return "scale";
  }
  return "unknown";
}

/// "tube 2 of arm_a against tube 1, ...", the one with the largest multiplier first; empty if no limit is active.
std::string OperatorPublisher::jointLimits(const dds::ControlStatus& status) const {
  const std::vector<std::string> names = config::shortArmNames(setup_.robot);
  std::string all;
  for (std::size_t i = 0; i < status.limit_count && status.limit_arm[i] < names.size(); ++i) {
    const control::NamedLimit limit{static_cast<control::LimitKind>(status.limit_kind[i]), status.limit_arm[i],
                                    status.limit_tube[i]};
    all += (i == 0 ? "" : ", ") + control::describe(limit, names);
  }
  return all;
}

dds::TeleopStatus OperatorPublisher::statusOf(const dds::ControlStatus& status,
                                              const operation::OperatorSnapshot& snapshot) const {
  dds::TeleopStatus m;
  m.session = setup_.session;
  m.sequence = sequence_;
  m.answers_state = status.answers_state;
  m.stamp = status.stamp;
  m.state = static_cast<std::uint8_t>(snapshot.state);
  m.reason = operation::describeOperatorStop(snapshot.reason);
  m.client = snapshot.client;
  m.answers_input = snapshot.answers_input;
  m.device = snapshot.device;
  m.operator_present = snapshot.operator_present;
  m.clutch = snapshot.clutch;
  m.mode = snapshot.mode;
  m.arm = snapshot.arm;
  m.other_arm = snapshot.other_arm;
  m.frame = snapshot.frame;
  m.scale = snapshot.scale;
  m.input_age = snapshot.input_age;
  m.latency = snapshot.latency;
  m.input_rate = snapshot.input_rate;
  m.accepted = snapshot.accepted;
  m.refused = snapshot.refused;
  m.late = snapshot.late;
  m.refused_client = snapshot.refused_client;
  m.refusal = operation::describeOperatorStop(snapshot.refusal);
  m.tip_target = snapshot.tip_target;
  if (snapshot.client == 0)
    return m;
  const auto add = [&](const std::string& name, const operation::OperatorSnapshot::Stage& from, std::string limiter) {
    m.stages.push_back({name, static_cast<std::uint8_t>(from.input != from.output ? 1 : 0), std::move(limiter),
                        from.input, from.output});
  };
  using planning::teleoperation::name;
  for (std::size_t s = 0; s < snapshot.stages.size(); ++s)
    add(std::string(name(static_cast<Stage>(s))), snapshot.stages[s], limiterOf(snapshot.stages[s]));
  for (std::size_t s = 0; snapshot.rotates && s < snapshot.rotation_stages.size(); ++s) {
    const auto stage = static_cast<Stage>(s);
    if (stage != Stage::kFixture && stage != Stage::kWorkspace)
      add("rotation_" + std::string(name(stage)), snapshot.rotation_stages[s],
          rotationLimiterOf(snapshot.rotation_stages[s]));
  }
  if (!snapshot.engaged)
    return m;
  m.wanted = snapshot.wanted;
  m.target = snapshot.target;
  m.position = snapshot.position;
  const auto note = [&](const std::string& why) {
    if (!why.empty())
      m.limited_by += (m.limited_by.empty() ? "" : "; ") + why;
  };
  // Only stages that are limits; a filter and a frame are none.
  for (const Stage stage : {Stage::kFixture, Stage::kWorkspace, Stage::kRate, Stage::kReach})
    note(limiterOf(snapshot.stages[static_cast<std::size_t>(stage)]));
  for (const Stage stage : {Stage::kRate, Stage::kReach}) {
    if (snapshot.rotates)
      note(rotationLimiterOf(snapshot.rotation_stages[static_cast<std::size_t>(stage)]));
  }
  note(status.limited != 0 ? jointLimits(status) : "");
  m.clamped = m.limited_by.empty() ? 0 : 1;
  m.tip_latency = snapshot.lag;
  return m;
}

}  // namespace tandem::control_service
