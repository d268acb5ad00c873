// SPDX-License-Identifier: Apache-2.0
#include "services/dds/validate.h"

#include <algorithm>

namespace tandem::dds {
namespace {

const char* badArms(std::uint8_t count) { return count > safety::kMaxArms ? "arm_count above 8" : nullptr; }

const char* badJoints(const PerArm<std::uint8_t>& count) {
  const bool bad = std::any_of(count.begin(), count.end(), [](int n) { return n > safety::kMaxJointsPerArm; });
  return bad ? "joint_count above 8" : nullptr;
}

const char* badTexts(std::initializer_list<const std::string*> texts) {
  for (const std::string* text : texts) {
    if (text->size() > kMaxText) {
      return "text too long";
    }
    // CDR ends a text at its first NUL: what follows would be lost.
    if (text->find('\0') != std::string::npos) {
      return "NUL within a text";
    }
  }
  return nullptr;
}

const char* either(const char* first, const char* second) { return first != nullptr ? first : second; }

const char* badReport(const TrajectoryReport& report) {
  if (report.points.size() > kMaxList) {
    return "too many points";
  }
  const char* problem = badTexts({&report.start});
  for (const PointReport& point : report.points) {
    problem = either(problem, badTexts({&point.words}));
    problem = either(problem, point.joints.size() > safety::kMaxJoints ? "too many joints" : nullptr);
  }
  return problem;
}

const char* badRehearsal(const RehearsalReport& report) {
  const char* problem = badTexts({&report.words});
  for (const std::string& limit : report.held)
    problem = either(problem, badTexts({&limit}));
  return either(problem, report.held.size() > kMaxList ? "a list too long" : nullptr);
}

const char* badTrajectory(const std::string& text) {
  if (text.size() > kMaxTrajectory) {
    return "trajectory too long";
  }
  return text.find('\0') != std::string::npos ? "NUL within a text" : nullptr;
}

}  // namespace

const char* malformed(const ActuationState& message) {
  return either(badArms(message.arm_count), badJoints(message.joint_count));
}

const char* malformed(const ActuationCommand& message) { return badArms(message.arm_count); }

const char* malformed(const ActuationLimits& message) {
  return either(badArms(message.arm_count), badJoints(message.joint_count));
}

const char* malformed(const PlanningReference& message) {
  if (message.task_count > message.tasks.size()) {
    return "task_count above 4";
  }
  for (const TaskReference& task : message.tasks) {
    if (task.arm >= safety::kMaxArms || task.other_arm >= safety::kMaxArms) {
      return "arm of a task above 7";
    }
  }
  return nullptr;
}

const char* malformed(const PlanningRequest& message) { return badTrajectory(message.trajectory); }

/// A trajectory that is too long is planning's concern, which says so to the client.
const char* malformed(const ComputationRequest& message) {
  if (message.joints.size() > kMaxList || message.targets.size() > kMaxList) {
    return "too many joints or targets";
  }
  return message.trajectory.find('\0') != std::string::npos ? "NUL within a text" : nullptr;
}

const char* malformed(const ComputationProgress& message) { return badTexts({&message.at}); }

const char* malformed(const ComputationResult& message) {
  const char* problem = badTexts({&message.reason, &message.ik.words});
  problem = either(problem, badReport(message.report));
  problem = either(problem, badReport(message.repair.before));
  problem = either(problem, either(badRehearsal(message.with_posture), badRehearsal(message.without_posture)));
  problem = either(problem, badTrajectory(message.repair.trajectory));
  for (const LimitReport& limit : message.ik.limits)
    problem = either(problem, badTexts({&limit.words}));
  const auto longest = std::max({message.start.size(), message.ik.joints.size(), message.ik.tips.size(),
                                 message.ik.errors.size(), message.ik.limits.size(), message.timing.times.size(),
                                 message.timing.limiting.size(), message.starts.size()});
  return either(problem, longest > kMaxList ? "a list too long" : nullptr);
}

const char* malformed(const Reply& message) { return badTexts({&message.reason}); }

const char* malformed(const TipPoses& message) { return badArms(message.arm_count); }

const char* malformed(const ControlStatus& message) {
  if (message.limit_count > message.limit_kind.size())
    return "limit_count above 8";
  return either(badArms(message.arm_count),
                message.task_count > message.task_error.size() ? "task_count above 4" : nullptr);
}

const char* malformed(const Clearances& message) {
  return message.bodies.size() > safety::kMaxArms * safety::kMaxArms ? "too many bodies" : nullptr;
}

const char* malformed(const ControlRequest& message) {
  if (message.joint_count > message.joints.size()) {
    return "joint_count above 8";
  }
  if (message.arm >= safety::kMaxArms && message.arm != kAllArms) {
    return "arm above 7, and not 255 for all";
  }
  return badTexts({&message.text, &message.value});
}

const char* malformed(const Stop& message) { return badTexts({&message.reason}); }

const char* malformed(const SimRequest& message) {
  if (message.arm >= safety::kMaxArms || message.joint >= safety::kMaxJointsPerArm) {
    return "arm or joint above 7";
  }
  return either(badArms(message.arm_count), badTexts({&message.fault}));
}

const char* malformed(const HalStatus& message) {
  return either(badArms(message.arm_count),
                message.bus_count > message.bus_state.size() ? "bus_count above 8" : nullptr);
}

const char* malformed(const HalRequest& message) {
  return message.arm >= safety::kMaxArms && message.arm != kAllArms ? "arm above 7, and not 255 for all" : nullptr;
}

const char* malformed(const ClockRequest&) { return nullptr; }

const char* malformed(const ClockReply& message) { return badTexts({&message.process, &message.host}); }

const char* malformed(const TeleopInput& message) {
  return message.arm >= safety::kMaxArms || message.other_arm >= safety::kMaxArms ? "arm above 7" : nullptr;
}

const char* malformed(const TeleopStatus& message) {
  if (message.stages.size() > kMaxList)
    return "too many stages";
  const char* problem = badTexts({&message.reason, &message.refusal, &message.limited_by});
  for (const TeleopStage& stage : message.stages)
    problem = either(problem, badTexts({&stage.name, &stage.limited_by}));
  return problem;
}

const char* malformed(const CrtkStatus& message) {
  if (message.commands.size() > kMaxList)
    return "too many commands";
  const char* problem = badTexts({&message.stamps});
  for (const CrtkCommand& command : message.commands)
    problem = either(problem, badTexts({&command.name, &command.refusal}));
  return problem;
}

const char* malformed(const Shape& message) {
  const std::size_t count = message.tubes.size();
  if (count > kMaxList / 3) {
    return "too many points";
  }
  if (message.points.size() != 3 * count || message.outer_radius.size() != count) {
    return "points, tubes and outer_radius of different lengths";
  }
  return badTexts({&message.frame});
}

const char* malformed(const JointState& message) {
  const auto longest =
      std::max({message.name.size(), message.position.size(), message.velocity.size(), message.effort.size()});
  if (longest > kMaxList) {
    return "too many joints";
  }
  for (const std::string& text : message.name) {
    if (const char* problem = badTexts({&text})) {
      return problem;
    }
  }
  return badTexts({&message.frame});
}

const char* malformed(const PoseStamped& message) { return badTexts({&message.frame}); }

const char* malformed(const TwistStamped& message) { return badTexts({&message.frame}); }

const char* malformed(const Empty&) { return nullptr; }

const char* malformed(const Bool&) { return nullptr; }

const char* malformed(const Path& message) {
  if (message.poses.size() > kMaxList) {
    return "too many poses";
  }
  for (const PoseStamped& pose : message.poses) {
    if (const char* problem = malformed(pose)) {
      return problem;
    }
  }
  return badTexts({&message.frame});
}

const char* malformed(const OperatingState& message) { return badTexts({&message.frame, &message.state}); }

const char* malformed(const StringStamped& message) { return badTexts({&message.frame, &message.text}); }

const char* malformed(const DiagnosticArray& message) {
  if (message.status.size() > kMaxList) {
    return "too many statuses";
  }
  for (const DiagnosticStatus& status : message.status) {
    if (status.values.size() > kMaxList) {
      return "too many values";
    }
    const char* problem = badTexts({&status.name, &status.message, &status.hardware_id});
    for (const auto& [key, value] : status.values) {
      problem = either(problem, badTexts({&key, &value}));
    }
    if (problem != nullptr) {
      return problem;
    }
  }
  return badTexts({&message.frame});
}

const char* malformed(const Log& message) {
  return badTexts({&message.name, &message.text, &message.file, &message.function});
}

const char* malformed(const MarkerArray& message) {
  if (message.markers.size() > kMaxList)
    return "too many markers";
  for (const Marker& marker : message.markers) {
    if (marker.points.size() > kMaxList)
      return "too many points";
    if (!marker.colors.empty() && marker.colors.size() != marker.points.size())
      return "points and colors of different lengths";
    if (marker.texture_coordinates.size() > kMaxList ||
        std::max(marker.texture.size(), marker.mesh.size()) > kMaxPayload)
      return "texture or mesh too long";
    if (const char* problem =
            badTexts({&marker.frame, &marker.group, &marker.texture_resource, &marker.texture_frame,
                      &marker.texture_format, &marker.text, &marker.mesh_resource, &marker.mesh_name}))
      return problem;
  }
  return nullptr;
}

}  // namespace tandem::dds
