// SPDX-License-Identifier: Apache-2.0
/** @file Private: between the structs of messages.h and the types generated from idl/.
 *
 * Wire<M>::Generated is the type on the wire, Wire<M>::Support its (de)serialiser; toWire() and fromWire() copy. For
 * messages with the same members on both sides one member list serves both directions.
 */
#pragma once

#include <cstdint>

#include "crtk_msgsPubSubTypes.h"
#include "diagnostic_msgsPubSubTypes.h"
#include "geometry_msgsPubSubTypes.h"
#include "nav_msgsPubSubTypes.h"
#include "rcl_interfacesPubSubTypes.h"
#include "sensor_msgsPubSubTypes.h"
#include "services/dds/messages.h"
#include "std_msgsPubSubTypes.h"
#include "tandem_msgsPubSubTypes.h"
#include "tandem_msgs_planningPubSubTypes.h"
#include "tandem_msgs_teleopPubSubTypes.h"
#include "visualization_msgsPubSubTypes.h"

namespace tandem::dds {

template <class M>
struct Wire;

// clang-format off
#define TANDEM_WIRE(MESSAGE, PACKAGE)                     \
  template <> struct Wire<MESSAGE> {                      \
    using Generated = ::PACKAGE::msg::MESSAGE;            \
    using Support = ::PACKAGE::msg::MESSAGE##PubSubType;  \
  };
TANDEM_WIRE(ActuationState, tandem_msgs)
TANDEM_WIRE(ActuationCommand, tandem_msgs)
TANDEM_WIRE(ActuationLimits, tandem_msgs)
TANDEM_WIRE(TaskReference, tandem_msgs)
TANDEM_WIRE(TipPoses, tandem_msgs)
TANDEM_WIRE(PlanningReference, tandem_msgs)
TANDEM_WIRE(PlanningRequest, tandem_msgs)
TANDEM_WIRE(TipTarget, tandem_msgs)
TANDEM_WIRE(ComputationRequest, tandem_msgs)
TANDEM_WIRE(ComputationProgress, tandem_msgs)
TANDEM_WIRE(PointReport, tandem_msgs)
TANDEM_WIRE(TrajectoryReport, tandem_msgs)
TANDEM_WIRE(RehearsalReport, tandem_msgs)
TANDEM_WIRE(LimitReport, tandem_msgs)
TANDEM_WIRE(IkReport, tandem_msgs)
TANDEM_WIRE(RepairReport, tandem_msgs)
TANDEM_WIRE(TimingReport, tandem_msgs)
TANDEM_WIRE(StartReport, tandem_msgs)
TANDEM_WIRE(ComputationResult, tandem_msgs)
TANDEM_WIRE(Reply, tandem_msgs)
TANDEM_WIRE(ControlStatus, tandem_msgs)
TANDEM_WIRE(BodyClearance, tandem_msgs)
TANDEM_WIRE(Clearances, tandem_msgs)
TANDEM_WIRE(ControlRequest, tandem_msgs)
TANDEM_WIRE(Stop, tandem_msgs)
TANDEM_WIRE(SimRequest, tandem_msgs)
TANDEM_WIRE(HalStatus, tandem_msgs)
TANDEM_WIRE(HalRequest, tandem_msgs)
TANDEM_WIRE(ClockRequest, tandem_msgs)
TANDEM_WIRE(ClockReply, tandem_msgs)
TANDEM_WIRE(TeleopInput, tandem_msgs)
TANDEM_WIRE(TeleopStage, tandem_msgs)
TANDEM_WIRE(TeleopStatus, tandem_msgs)
TANDEM_WIRE(CrtkCommand, tandem_msgs)
TANDEM_WIRE(CrtkStatus, tandem_msgs)
TANDEM_WIRE(Shape, tandem_msgs)
TANDEM_WIRE(JointState, sensor_msgs)
TANDEM_WIRE(PoseStamped, geometry_msgs)
TANDEM_WIRE(TwistStamped, geometry_msgs)
TANDEM_WIRE(Empty, std_msgs)
TANDEM_WIRE(Bool, std_msgs)
TANDEM_WIRE(Path, nav_msgs)
TANDEM_WIRE(OperatingState, crtk_msgs)
TANDEM_WIRE(StringStamped, crtk_msgs)
TANDEM_WIRE(DiagnosticArray, diagnostic_msgs)
TANDEM_WIRE(Log, rcl_interfaces)
TANDEM_WIRE(MarkerArray, visualization_msgs)
#undef TANDEM_WIRE

/// Calls DO(M) for every message that has a topic.
#define TANDEM_EACH_MESSAGE(DO)                                                                          \
  DO(ActuationState) DO(ActuationCommand) DO(ActuationLimits) DO(PlanningReference) DO(PlanningRequest)  \
  DO(TipPoses) DO(Reply) DO(ControlStatus) DO(ControlRequest) DO(Stop) DO(SimRequest) DO(HalStatus)      \
  DO(HalRequest) DO(Shape) DO(JointState) DO(PoseStamped) DO(Path) DO(OperatingState) DO(StringStamped)  \
  DO(DiagnosticArray) DO(ComputationRequest) DO(ComputationProgress) DO(ComputationResult) DO(Clearances) \
  DO(ClockRequest) DO(ClockReply) DO(TeleopInput) DO(TeleopStatus) DO(CrtkStatus) DO(TwistStamped) DO(Empty) \
  DO(Log) DO(MarkerArray) DO(Bool)

// One list of members per message. `f` gets each pair of members, ours and the generated one.
#define F(MEMBER) f(m.MEMBER, w.MEMBER());
#define TANDEM_MEMBERS(MESSAGE, ...)                                        \
  template <class M, class W, class Copy>                                   \
  void members(const MESSAGE*, M& m, W& w, Copy f) { __VA_ARGS__ }
TANDEM_MEMBERS(ActuationState, F(session) F(sequence) F(stamp) F(answers_command) F(placements) F(lock_step) F(arm_count)
               F(joint_count) F(valid) F(operating_state) F(faults) F(recovery) F(lost) F(homed) F(holds) F(position) F(velocity)
               F(setpoint))
TANDEM_MEMBERS(ActuationCommand, F(control_session) F(sequence) F(state_session) F(answers_state) F(stamp) F(advance)
               F(arm_count) F(request) F(without) F(moving) F(velocity) F(position))
TANDEM_MEMBERS(ActuationLimits, F(sequence) F(answers_state) F(stamp) F(arm_count) F(joint_count) F(lower) F(upper)
               F(velocity_lower) F(velocity_upper) F(active))
TANDEM_MEMBERS(TaskReference, F(kind) F(arm) F(other_arm) F(position) F(orientation) F(feed_forward))
TANDEM_MEMBERS(PlanningReference, F(sequence) F(state_session) F(answers_state) F(answers_control) F(stamp)
               F(trajectory_id) F(point) F(point_count) F(iteration) F(total_iterations) F(phase) F(tolerance)
               F(task_count) F(tasks) F(posture_valid) F(posture))
TANDEM_MEMBERS(TipPoses, F(session) F(sequence) F(state_session) F(answers_state) F(answers_command) F(stamp)
               F(arm_count) F(valid) F(position) F(orientation))
TANDEM_MEMBERS(PlanningRequest, F(client) F(request) F(kind) F(trajectory) F(planned))
TANDEM_MEMBERS(TipTarget, F(arm) F(has_direction) F(position) F(direction))
TANDEM_MEMBERS(ComputationRequest, F(client) F(request) F(kind) F(computation) F(trajectory) F(joints) F(targets)
               F(stability) F(arms_may_touch) F(clearance) F(port_radius) F(port_depth) F(accept) F(starts) F(seed)
               F(rehearse) F(smoothing) F(tries) F(translation_acceleration) F(rotation_velocity) F(rotation_acceleration)
               F(time_limit))
TANDEM_MEMBERS(ComputationProgress, F(client) F(request) F(kind) F(fraction) F(at) F(done) F(all) F(elapsed))
TANDEM_MEMBERS(PointReport, F(point) F(reach) F(words) F(wanted) F(wanted_relative) F(tip) F(relative) F(error)
               F(relative_error) F(stability) F(clearance) F(joints))
TANDEM_MEMBERS(TrajectoryReport, F(feasible) F(start) F(planar_start) F(rotation_conditioning) F(points))
TANDEM_MEMBERS(RehearsalReport, F(end) F(points) F(converged) F(point) F(tip_error) F(relative_error) F(held) F(words)
               F(iterations) F(largest_violation) F(fastest_rotation))
TANDEM_MEMBERS(LimitReport, F(arm) F(words) F(force))
TANDEM_MEMBERS(IkReport, F(reach) F(words) F(joints) F(tips) F(errors) F(limits) F(stability) F(clearance) F(starts)
               F(iterations))
TANDEM_MEMBERS(RepairReport, F(before) F(trajectory) F(rounds) F(largest_change) F(rms_change))
TANDEM_MEMBERS(TimingReport, F(status) F(times) F(limiting))
TANDEM_MEMBERS(StartReport, F(joints) F(unreachable) F(room) F(mean_room) F(given))
TANDEM_MEMBERS(ComputationResult, F(client) F(request) F(kind) F(outcome) F(cancelled_by) F(reason) F(elapsed) F(start)
               F(report) F(rehearsed) F(with_posture) F(without_posture) F(repair) F(ik) F(timing) F(starts))
TANDEM_MEMBERS(Reply, F(client) F(request) F(accepted) F(code) F(reason) F(value))
TANDEM_MEMBERS(ControlStatus, F(session) F(sequence) F(answers_state) F(answers_reference) F(stamp) F(method) F(backend)
               F(bounds) F(solve_status) F(arm_count) F(operating_state) F(homed) F(recovery) F(busy) F(faults) F(lease_holder)
               F(task_count) F(task_error) F(task_scale) F(task_residual) F(iterations) F(kkt_residual) F(solve_time)
               F(cycle_time) F(period) F(jitter_max) F(cycle_time_max) F(cycles) F(overruns) F(active_limits)
               F(model) F(feedback) F(hold) F(tip_age) F(snaps) F(limited) F(limit_count) F(limit_kind) F(limit_arm)
               F(limit_tube) F(limit_bound) F(idle) F(idle_left) F(source))
TANDEM_MEMBERS(BodyClearance, F(arm) F(other_arm) F(distance) F(place) F(other_place) F(s) F(other_s) F(by_joints)
               F(by_other_joints))
TANDEM_MEMBERS(Clearances, F(session) F(sequence) F(answers_state) F(stamp) F(bodies))
TANDEM_MEMBERS(ControlRequest, F(client) F(request) F(kind) F(arm) F(text) F(value) F(joint_count) F(joints))
TANDEM_MEMBERS(Stop, F(client) F(sequence) F(reason))
TANDEM_MEMBERS(SimRequest, F(client) F(request) F(kind) F(arm_count) F(joints) F(steps) F(arm) F(joint) F(fault))
TANDEM_MEMBERS(HalStatus, F(session) F(sequence) F(stamp) F(arm_count) F(operating_state) F(faults) F(guard_count)
               F(guard_largest) F(guard_arm) F(guard_joint) F(first_fault) F(fault_cause) F(fault_joint)
               F(fault_amount) F(fault_allowed) F(period) F(jitter_max) F(cycles) F(overruns) F(caught_up) F(left_out) F(bus_load)
               F(snaps) F(emergency_stop)
               F(homed) F(power) F(axis_phase) F(axis_state) F(axis_error) F(axis_guards) F(axis_temperature)
               F(following_error) F(encoder_difference) F(hardware_count) F(hardware_arm) F(hardware_joint) F(bus_count) F(bus_state)
               F(bus_loads) F(bus_dropped) F(bus_overflow))
TANDEM_MEMBERS(HalRequest, F(client) F(request) F(kind) F(arm))
TANDEM_MEMBERS(ClockRequest, F(client) F(request))
TANDEM_MEMBERS(ClockReply, F(client) F(request) F(process) F(host) F(received) F(sent))
TANDEM_MEMBERS(TeleopInput, F(client) F(sequence) F(control_session) F(answers_control) F(stamp) F(device)
               F(operator_present) F(clutch) F(mode) F(arm) F(other_arm) F(kind) F(frame) F(view) F(linear) F(angular)
               F(position) F(orientation) F(scale) F(buttons))
TANDEM_MEMBERS(TeleopStage, F(name) F(active) F(limited_by) F(input) F(output))
TANDEM_MEMBERS(TeleopStatus, F(session) F(sequence) F(answers_state) F(stamp) F(state) F(reason) F(client)
               F(answers_input) F(device) F(operator_present) F(clutch) F(mode) F(arm) F(other_arm) F(frame) F(scale)
               F(input_age) F(latency) F(input_rate) F(tip_latency) F(accepted) F(refused) F(late) F(refused_client)
               F(refusal) F(stages) F(wanted) F(target) F(position) F(tip_target) F(clamped) F(limited_by))
TANDEM_MEMBERS(CrtkCommand, F(name) F(active) F(accepted) F(refused) F(refusal))
TANDEM_MEMBERS(CrtkStatus, F(session) F(sequence) F(stamp) F(commanding) F(stamps) F(commands))
TANDEM_MEMBERS(Empty, F(structure_needs_at_least_one_member))
TANDEM_MEMBERS(Bool, F(data))
TANDEM_MEMBERS(Shape, F(stamp) F(frame) F(points) F(tubes) F(outer_radius))
#undef TANDEM_MEMBERS
#undef F
// clang-format on

/// Structs with a list of members, which may stand in others.
template <class M>
concept Listed = requires {
  typename Wire<M>::Generated;
};

struct CopyToWire {
  template <class T, class W>
  void operator()(const T& ours, W& wire) const {
    if constexpr (Listed<T>) {
      members(&ours, ours, wire, *this);
    } else {
      wire = ours;
    }
  }
  template <Listed T, std::size_t N, class W>
  void operator()(const std::array<T, N>& ours, W& wire) const {
    for (std::size_t i = 0; i < N; ++i) {
      (*this)(ours[i], wire[i]);
    }
  }
  template <Listed T, class W>
  void operator()(const std::vector<T>& ours, W& wire) const {
    wire.resize(ours.size());
    for (std::size_t i = 0; i < ours.size(); ++i) {
      (*this)(ours[i], wire[i]);
    }
  }
};

struct CopyFromWire {
  template <class T, class W>
  void operator()(T& ours, const W& wire) const {
    if constexpr (Listed<T>) {
      members(&ours, ours, wire, *this);
    } else {
      ours = wire;
    }
  }
  template <Listed T, std::size_t N, class W>
  void operator()(std::array<T, N>& ours, const W& wire) const {
    for (std::size_t i = 0; i < N; ++i) {
      (*this)(ours[i], wire[i]);
    }
  }
  template <Listed T, class W>
  void operator()(std::vector<T>& ours, const W& wire) const {
    ours.resize(wire.size());
    for (std::size_t i = 0; i < wire.size(); ++i) {
      (*this)(ours[i], wire[i]);
    }
  }
};

template <class M>
void toWire(const M& message, typename Wire<M>::Generated& wire) {
  members(&message, message, wire, CopyToWire{});
}
template <class M>
void fromWire(typename Wire<M>::Generated& wire, M& message) {
  members(&message, message, wire, CopyFromWire{});
}

// ROS messages: a stamp is sec and nanosec there, a pose a tree of structs.
void toWire(const JointState& message, ::sensor_msgs::msg::JointState& wire);
void toWire(const PoseStamped& message, ::geometry_msgs::msg::PoseStamped& wire);
void toWire(const TwistStamped& message, ::geometry_msgs::msg::TwistStamped& wire);
void toWire(const Path& message, ::nav_msgs::msg::Path& wire);
void toWire(const OperatingState& message, ::crtk_msgs::msg::OperatingState& wire);
void toWire(const StringStamped& message, ::crtk_msgs::msg::StringStamped& wire);
void toWire(const DiagnosticArray& message, ::diagnostic_msgs::msg::DiagnosticArray& wire);
void toWire(const Log& message, ::rcl_interfaces::msg::Log& wire);
void toWire(const MarkerArray& message, ::visualization_msgs::msg::MarkerArray& wire);
void fromWire(::rcl_interfaces::msg::Log& wire, Log& message);
void fromWire(::visualization_msgs::msg::MarkerArray& wire, MarkerArray& message);
void fromWire(::sensor_msgs::msg::JointState& wire, JointState& message);
void fromWire(::geometry_msgs::msg::PoseStamped& wire, PoseStamped& message);
void fromWire(::geometry_msgs::msg::TwistStamped& wire, TwistStamped& message);
void fromWire(::nav_msgs::msg::Path& wire, Path& message);
void fromWire(::crtk_msgs::msg::OperatingState& wire, OperatingState& message);
void fromWire(::crtk_msgs::msg::StringStamped& wire, StringStamped& message);
void fromWire(::diagnostic_msgs::msg::DiagnosticArray& wire, DiagnosticArray& message);

/** A generated value that knows whether the last decoding into it succeeded. */
template <class M>
struct Sample : Wire<M>::Generated {
  bool decoded = false;
};

/** The generated (de)serialiser, hardened: bytes from foreign writers may be anything. Only ever decodes into a
 * Sample<M>; decoding never fails toward DDS (which would stop taking) but leaves `decoded` false. */
template <class M>
class GuardedSupport : public Wire<M>::Support {
 public:
  using Generated = typename Wire<M>::Generated;

  GuardedSupport() {
    this->auto_fill_type_object(false);
    this->auto_fill_type_information(false);
  }

  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) override;
  void* createData() override { return static_cast<Generated*>(new Sample<M>); }
  void deleteData(void* data) override { delete static_cast<Sample<M>*>(static_cast<Generated*>(data)); }
};

}  // namespace tandem::dds
