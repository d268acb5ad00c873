// SPDX-License-Identifier: Apache-2.0
/** @file Random messages, and comparison member by member, from lists kept apart from those of the converters. */
#pragma once

#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "services/dds/messages.h"

namespace tandem::dds {

inline auto membersOf(PlanningRequest& m) { return std::tie(m.client, m.request, m.kind, m.trajectory, m.planned); }
inline auto membersOf(TipTarget& m) { return std::tie(m.arm, m.has_direction, m.position, m.direction); }
inline auto membersOf(ComputationRequest& m) {
  return std::tie(m.client, m.request, m.kind, m.computation, m.trajectory, m.joints, m.targets, m.stability,
                  m.arms_may_touch, m.clearance, m.port_radius, m.port_depth, m.accept, m.starts, m.seed, m.rehearse,
                  m.smoothing, m.tries, m.translation_acceleration, m.rotation_velocity, m.rotation_acceleration,
                  m.time_limit);
}
inline auto membersOf(ComputationProgress& m) {
  return std::tie(m.client, m.request, m.kind, m.fraction, m.at, m.done, m.all, m.elapsed);
}
inline auto membersOf(PointReport& m) {
  return std::tie(m.point, m.reach, m.words, m.wanted, m.wanted_relative, m.tip, m.relative, m.error, m.relative_error,
                  m.stability, m.clearance, m.joints);
}
inline auto membersOf(TrajectoryReport& m) {
  return std::tie(m.feasible, m.start, m.planar_start, m.rotation_conditioning, m.points);
}
inline auto membersOf(RehearsalReport& m) {
  return std::tie(m.end, m.points, m.converged, m.point, m.tip_error, m.relative_error, m.held, m.words, m.iterations,
                  m.largest_violation, m.fastest_rotation);
}
inline auto membersOf(LimitReport& m) { return std::tie(m.arm, m.words, m.force); }
inline auto membersOf(IkReport& m) {
  return std::tie(m.reach, m.words, m.joints, m.tips, m.errors, m.limits, m.stability, m.clearance, m.starts,
                  m.iterations);
}
inline auto membersOf(RepairReport& m) {
  return std::tie(m.before, m.trajectory, m.rounds, m.largest_change, m.rms_change);
}
inline auto membersOf(TimingReport& m) { return std::tie(m.status, m.times, m.limiting); }
inline auto membersOf(StartReport& m) { return std::tie(m.joints, m.unreachable, m.room, m.mean_room, m.given); }
inline auto membersOf(ComputationResult& m) {
  return std::tie(m.client, m.request, m.kind, m.outcome, m.cancelled_by, m.reason, m.elapsed, m.start, m.report,
                  m.rehearsed, m.with_posture, m.without_posture, m.repair, m.ik, m.timing, m.starts);
}
inline auto membersOf(Reply& m) { return std::tie(m.client, m.request, m.accepted, m.code, m.reason, m.value); }
inline auto membersOf(BodyClearance& m) {
  return std::tie(m.arm, m.other_arm, m.distance, m.place, m.other_place, m.s, m.other_s, m.by_joints,
                  m.by_other_joints);
}
inline auto membersOf(Clearances& m) { return std::tie(m.session, m.sequence, m.answers_state, m.stamp, m.bodies); }
inline auto membersOf(ControlRequest& m) {
  return std::tie(m.client, m.request, m.kind, m.arm, m.text, m.value, m.joint_count, m.joints);
}
inline auto membersOf(Stop& m) { return std::tie(m.client, m.sequence, m.reason); }
inline auto membersOf(SimRequest& m) {
  return std::tie(m.client, m.request, m.kind, m.arm_count, m.joints, m.steps, m.arm, m.joint, m.fault);
}
inline auto membersOf(Shape& m) { return std::tie(m.stamp, m.frame, m.points, m.tubes, m.outer_radius); }
inline auto membersOf(JointState& m) { return std::tie(m.stamp, m.frame, m.name, m.position, m.velocity, m.effort); }
inline auto membersOf(PoseStamped& m) { return std::tie(m.stamp, m.frame, m.position, m.orientation); }
inline auto membersOf(TwistStamped& m) { return std::tie(m.stamp, m.frame, m.linear, m.angular); }
inline auto membersOf(TeleopStage& m) { return std::tie(m.name, m.active, m.limited_by, m.input, m.output); }
inline auto membersOf(TeleopStatus& m) {
  return std::tie(m.session, m.sequence, m.answers_state, m.stamp, m.state, m.reason, m.client, m.answers_input,
                  m.device, m.operator_present, m.clutch, m.mode, m.arm, m.other_arm, m.frame, m.scale, m.input_age,
                  m.latency, m.input_rate, m.tip_latency, m.accepted, m.refused, m.late, m.refused_client, m.refusal,
                  m.stages, m.wanted, m.target, m.position, m.tip_target, m.clamped, m.limited_by);
}
inline auto membersOf(CrtkCommand& m) { return std::tie(m.name, m.active, m.accepted, m.refused, m.refusal); }
inline auto membersOf(CrtkStatus& m) {
  return std::tie(m.session, m.sequence, m.stamp, m.commanding, m.stamps, m.commands);
}
inline auto membersOf(Path& m) { return std::tie(m.stamp, m.frame, m.poses); }
inline auto membersOf(OperatingState& m) { return std::tie(m.stamp, m.frame, m.state, m.is_homed, m.is_busy); }
inline auto membersOf(StringStamped& m) { return std::tie(m.stamp, m.frame, m.text); }
inline auto membersOf(DiagnosticStatus& m) { return std::tie(m.level, m.name, m.message, m.hardware_id, m.values); }
inline auto membersOf(DiagnosticArray& m) { return std::tie(m.stamp, m.frame, m.status); }
inline auto membersOf(Log& m) { return std::tie(m.stamp, m.level, m.name, m.text, m.file, m.function, m.line); }
inline auto membersOf(Marker& m) {
  return std::tie(m.stamp, m.frame, m.group, m.id, m.type, m.action, m.position, m.orientation, m.scale, m.color,
                  m.lifetime, m.frame_locked, m.points, m.colors, m.texture_resource, m.texture_stamp, m.texture_frame,
                  m.texture_format, m.texture, m.texture_coordinates, m.text, m.mesh_resource, m.mesh_name, m.mesh,
                  m.mesh_materials);
}
inline auto membersOf(MarkerArray& m) { return std::tie(m.markers); }
inline auto membersOf(Bool& m) { return std::tie(m.data); }

/** Fills messages with random values. */
class Randomiser {
 public:
  explicit Randomiser(unsigned seed) : random_(seed) {}

  template <class T>
  void operator()(T& value) {
    if constexpr (std::is_same_v<T, bool>) {
      value = below(2) == 1;
    } else if constexpr (std::is_same_v<T, std::int64_t>) {
      // Stamps: whatever int32 seconds can hold, before and after zero.
      value =
          std::uniform_int_distribution<std::int64_t>(-2'000'000'000'000'000'000, 2'000'000'000'000'000'000)(random_);
    } else if constexpr (std::is_integral_v<T>) {
      value = static_cast<T>(random_() * 0x9E3779B97F4A7C15u >> 3);
    } else if constexpr (std::is_floating_point_v<T>) {
      value = std::uniform_real_distribution<T>(-1e6, 1e6)(random_);
    } else {
      std::apply([this](auto&... member) { ((*this)(member), ...); }, membersOf(value));
    }
  }
  template <class T, std::size_t N>
  void operator()(std::array<T, N>& values) {
    for (T& value : values) {
      (*this)(value);
    }
  }
  template <class A, class B>
  void operator()(std::pair<A, B>& values) {
    (*this)(values.first);
    (*this)(values.second);
  }
  void operator()(std::string& text) {
    text.resize(below(40));
    for (char& letter : text) {
      letter = static_cast<char>(1 + below(255));
    }
  }
  template <class T>
  void operator()(std::vector<T>& values) {
    values.resize(below(20));
    for (T& value : values) {
      (*this)(value);
    }
  }

  std::size_t below(std::size_t limit) { return random_() % limit; }

 private:
  std::mt19937_64 random_;
};

template <class T>
bool same(T& a, T& b) {
  if constexpr (requires { membersOf(a); }) {
    return std::apply(
        [&](auto&... left) {
          return std::apply([&](auto&... right) { return (same(left, right) && ...); }, membersOf(b));
        },
        membersOf(a));
  } else {
    return a == b;
  }
}
template <class T>
bool same(std::vector<T>& a, std::vector<T>& b) {
  bool equal = a.size() == b.size();
  for (std::size_t i = 0; equal && i < a.size(); ++i) {
    equal = same(a[i], b[i]);
  }
  return equal;
}

}  // namespace tandem::dds
