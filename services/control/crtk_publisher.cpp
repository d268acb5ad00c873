// SPDX-License-Identifier: Apache-2.0
#include "services/control/crtk_publisher.h"

#include <spdlog/fmt/fmt.h>

#include "operation/convert.h"
#include "robots/capability.h"
#include "robots/display_shape.h"
#include "safety/operating_state.h"
#include "services/control/crtk_command_handler.h"
#include "services/runtime/identity.h"
#include "services/runtime/method_library.h"
#include "services/runtime/periodic_loop.h"

namespace tandem::control_service {
namespace {}  // namespace

CrtkPublisher::Ends::Ends(dds::Bus& bus, const std::string& group)
    : measured_js(bus.writer(dds::kMeasuredJs, group)),
      setpoint_js(bus.writer(dds::kSetpointJs, group)),
      goal_js(bus.writer(dds::kGoalJs, group)),
      measured_cp(bus.writer(dds::kMeasuredCp, group)),
      setpoint_cp(bus.writer(dds::kSetpointCp, group)),
      goal_cp(bus.writer(dds::kGoalCp, group)),
      measured_cv(bus.writer(dds::kMeasuredCv, group)),
      setpoint_cv(bus.writer(dds::kSetpointCv, group)),
      goal_cv(bus.writer(dds::kGoalCv, group)),
      operating_state(bus.writer(dds::kOperatingState, group)) {}

CrtkPublisher::Arm::Arm(dds::Bus& bus, const config::Arm& from)
    : name(from.name), joint_names(jointNames(from)), ends(bus, from.name), shape(bus.writer(dds::kShape, from.name)) {}

CrtkPublisher::CrtkPublisher(dds::Bus& bus, const runtime::Setup& setup, const robots::RobotModel& robot)
    : setup_(setup), robot_(robot), frame_(setup.deployment.prefix + "_base"), bus_(bus), diagnostics_(bus, setup) {
  for (const config::Arm& from : setup.robot.arms)
    arms_.emplace_back(bus, from);
  if (has(setup.robot, robots::Capability::kCommonPath))
    mechanism_.emplace(setup, robot);
  if (arms_.size() >= 2) {
    pair_.emplace(bus, dds::kPair);
    pair_names_ = arms_[0].joint_names;
    pair_names_.insert(pair_names_.end(), arms_[1].joint_names.begin(), arms_[1].joint_names.end());
  }
}

void CrtkPublisher::publish(const Snapshot& snapshot, std::int64_t stamp, const runtime::Details& parameters) {
  stamp_ = stamp;
  publishDiagnostics(snapshot, parameters);
  mechanism_known_ = mechanism_ && mechanism_->update(snapshot.state);
  for (int k = 0; k < robot_.armCount(); ++k)
    publishArm(arms_[static_cast<std::size_t>(k)], k, snapshot);
  if (pair_)
    publishPair(snapshot);
}

void CrtkPublisher::publishArm(Arm& arm, int k, const Snapshot& snapshot) {
  publishState(arm.ends, stateOf(k, snapshot));
  if (snapshot.state.sequence == 0)
    return;  // no measurement yet: publish no invalid values
  const auto part = [&](const dds::JointArray& all) {
    const safety::ArmVector own = dds::jointsOf(all, k, robot_.size(k));
    return std::vector<double>(own.begin(), own.end());
  };
  arm.measured = {snapshot.state.valid[static_cast<std::size_t>(k)] != 0,
                  part(snapshot.state.position),
                  part(snapshot.state.velocity),
                  {}};
  arm.setpoint = {true, part(snapshot.state.setpoint), part(snapshot.commanded), {}};
  if (arm.session != snapshot.state.session || arm.joint_resets != snapshot.state.joint_resets)
    arm.branch = {};
  arm.session = snapshot.state.session;
  arm.joint_resets = snapshot.state.joint_resets;
  if (mechanism_known_) {
    publishMechanism(arm, k);
  } else if (arm.measured.valid && !mechanism_) {
    arm.measured.place = placeOf(k, arm.measured, arm.branch);
    publishShape(arm, k, Eigen::VectorXd::Map(arm.measured.position.data(), robot_.size(k)));
  }
  kinematics::Branch ahead = arm.branch;
  if (!mechanism_)
    arm.setpoint.place = placeOf(k, arm.setpoint, ahead);
  publish(arm.ends, arm.joint_names, arm.measured, arm.setpoint);
  publishGoals(arm.ends, k, arm.joint_names, snapshot);
}

/// x_AB and its velocity, in the axes of the base frame; orientation of A's tip in the frame of B's tip.
void CrtkPublisher::publishPair(const Snapshot& snapshot) {
  const dds::OperatingState a = stateOf(0, snapshot), b = stateOf(1, snapshot);
  const auto rank = [](const std::string& state) {
    return state == "FAULT" ? 0 : state == "DISABLED" ? 1 : state == "PAUSED" ? 2 : 3;
  };
  dds::OperatingState both = rank(a.state) <= rank(b.state) ? a : b;
  both.is_homed = a.is_homed && b.is_homed;
  both.is_busy = a.is_busy || b.is_busy;
  publishState(*pair_, both);
  if (snapshot.state.sequence == 0)
    return;
  const auto together = [](Joints joined, const Joints& other) {
    joined.valid = joined.valid && other.valid;
    joined.position.insert(joined.position.end(), other.position.begin(), other.position.end());
    joined.velocity.insert(joined.velocity.end(), other.velocity.begin(), other.velocity.end());
    Place& place = joined.place;
    place.known = place.known && other.place.known;
    place.moves = place.moves && other.place.moves;
    if (place.known) {
      place.position -= other.place.position;
      place.linear -= other.place.linear;
      place.angular -= other.place.angular;
      place.orientation = other.place.orientation.conjugate() * place.orientation;
    }
    return joined;
  };
  publish(*pair_, pair_names_, together(arms_[0].measured, arms_[1].measured),
          together(arms_[0].setpoint, arms_[1].setpoint));
  publishGoals(*pair_, operation::kPairGroup, pair_names_, snapshot);
}

CrtkPublisher::Place CrtkPublisher::placeOf(int k, const Joints& joints, kinematics::Branch& branch) const {
  Place place;
  kinematics::Tip tip;
  const auto q = Eigen::VectorXd::Map(joints.position.data(), robot_.size(k));
  if (robot_.models()[static_cast<std::size_t>(k)]->tip(q, branch, tip) != kinematics::ModelStatus::kOk)
    return place;
  const Eigen::Matrix<double, 6, 1> twist = tip.jacobian * Eigen::VectorXd::Map(joints.velocity.data(), robot_.size(k));
  place = {true, tip.pose.translation(), twist.head<3>(), twist.tail<3>(), Eigen::Quaterniond(tip.pose.linear())};
  return place;
}

void CrtkPublisher::publish(Ends& ends,
                            const std::vector<std::string>& names,
                            const Joints& measured,
                            const Joints& setpoint) {
  const auto write = [&](const Joints& joints, auto& js, auto& cp, auto& cv) {
    // CRTK: a stamp of zero marks invalid values.
    js.write({joints.valid ? stamp_ : 0, frame_, names, joints.position, joints.velocity, {}});
    if (!joints.place.known)
      return;
    const Place& place = joints.place;
    dds::PoseStamped pose{stamp_, frame_, {}, {}};
    Eigen::Vector3d::Map(pose.position.data()) = place.position;
    Eigen::Vector4d::Map(pose.orientation.data()) = place.orientation.coeffs();  // x y z w
    cp.write(pose);
    if (!place.moves)
      return;
    dds::TwistStamped twist{stamp_, frame_, {}, {}};
    Eigen::Vector3d::Map(twist.linear.data()) = place.linear;
    Eigen::Vector3d::Map(twist.angular.data()) = place.angular;
    cv.write(twist);
  };
  write(measured, ends.measured_js, ends.measured_cp, ends.measured_cv);
  write(setpoint, ends.setpoint_js, ends.setpoint_cp, ends.setpoint_cv);
}

/// Publishes active goals, and once, with a stamp of zero, goals that have ended.
void CrtkPublisher::publishGoals(Ends& ends,
                                 int group,
                                 const std::vector<std::string>& names,
                                 const Snapshot& snapshot) {
  const auto i = static_cast<std::size_t>(group);
  const operation::CrtkSnapshot& crtk = snapshot.crtk;
  const auto write = [&](bool has, bool& had, auto& writer, auto message) {
    message.stamp = has ? stamp_ : 0;
    message.frame = frame_;
    if (has || had)
      writer.write(message);
    had = has;
  };
  dds::PoseStamped pose;
  pose.position = crtk.cp[i];
  pose.orientation = crtk.cp_orientation[i];
  write(crtk.has_cp[i] != 0, ends.has_cp, ends.goal_cp, pose);
  dds::TwistStamped twist;
  twist.linear = crtk.cv[i];
  twist.angular = crtk.cv_angular[i];
  write(crtk.has_cv[i] != 0, ends.has_cv, ends.goal_cv, twist);
  dds::JointState joints;
  joints.name = names;
  bool has = true;
  for (int k = group == operation::kPairGroup ? 0 : group; k <= (group == operation::kPairGroup ? 1 : group); ++k) {
    has = has && crtk.has_js[static_cast<std::size_t>(k)] != 0;
    for (int j = 0; j < robot_.size(k); ++j)
      joints.position.push_back(crtk.js[dds::jointIndex(k, j)]);
  }
  write(has, ends.has_js, ends.goal_js, joints);
}

dds::OperatingState CrtkPublisher::stateOf(int k, const Snapshot& snapshot) const {
  const auto i = static_cast<std::size_t>(k);
  return {stamp_, frame_,
          std::string(safety::name(static_cast<safety::OperatingState>(snapshot.status.operating_state[i]))),
          snapshot.status.homed[i] != 0, snapshot.status.busy[i] != 0};
}

void CrtkPublisher::publishState(Ends& ends, dds::OperatingState state) {
  const bool same = state.state == ends.last_state.state && state.is_homed == ends.last_state.is_homed &&
                    state.is_busy == ends.last_state.is_busy;
  if (same)
    return;  // the topic is latched: late readers get the last sample
  ends.operating_state.write(state);
  ends.last_state = std::move(state);
}

void CrtkPublisher::publishDiagnostics(const Snapshot& snapshot, const runtime::Details& parameters) {
  const dds::ControlStatus& status = snapshot.status;
  std::string states, faults, idle;
  for (int k = 0; k < robot_.armCount(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    if (snapshot.faults[i].faults != 0)
      faults += "; FAULT of " + runtime::describe(setup_.robot, {k, snapshot.faults[i]});
    // No warning for an arm that will be powered off when its idle time ends; a warning for one that keeps power.
    if (status.idle[i] > setup_.deployment.idle_power_off && status.idle_left[i] < 0.0)
      idle += fmt::format("; {} has had power for {:.0f} s without a commander", arms_[i].name, status.idle[i]);
    states += (k == 0 ? "" : ", ") + arms_[i].name + " " +
              std::string(safety::name(static_cast<safety::OperatingState>(status.operating_state[i])));
  }
  const std::string hold(dds::name(static_cast<dds::HoldReason>(status.hold)));
  const auto level = !faults.empty()                ? runtime::Diagnostics::Level::kError
                     : hold.empty() && idle.empty() ? runtime::Diagnostics::Level::kOk
                                                    : runtime::Diagnostics::Level::kWarn;
  const auto method = static_cast<control::Method>(status.method);
  const std::string method_text = runtime::describeMethod(method, setup_.deployment, setup_.robot);
  const std::string foreign = method == control::Method::kForeign ? "; method " + method_text : "";
  runtime::Details values{{"model", std::string(idl::name(robot_.kind()))},
                          {"feedback", std::string(planning::name(setup_.deployment.feedback))},
                          {"orientation_feedback", std::string(planning::name(setup_.deployment.orientation_feedback))},
                          {runtime::kMethodKey, method_text},
                          {"cycles", std::to_string(status.cycles)},
                          {"overruns", std::to_string(status.overruns)},
                          {"state_success", std::to_string(status.state_success)},
                          {"reference_success", std::to_string(status.reference_success)},
                          {"jitter_max_s", std::to_string(status.jitter_max)},
                          {"cycle_time_max_s", std::to_string(status.cycle_time_max)}};
  values.insert(values.end(), parameters.begin(), parameters.end());
  std::string paused;
  if (const auto client = bus_.identityOf(status.paused_by); client && status.paused_by != 0) {
    paused = "; paused by " + runtime::describe(*client);
    values.push_back({runtime::kPausedByKey + std::to_string(status.paused_by), runtime::describe(*client)});
  }
  diagnostics_.publish(
      snapshot.status.stamp, level,
      states + paused + (hold.empty() ? "" : "; the trajectory is held: " + hold) + foreign + idle + faults,
      std::move(values));
}

void CrtkPublisher::publishMechanism(Arm& arm, int k) {
  const Eigen::Isometry3d& tip = mechanism_->tip(k);
  const Eigen::Vector3d still = Eigen::Vector3d::Zero();
  arm.measured.place = {true, tip.translation(), still, still, Eigen::Quaterniond(tip.linear()), false};
  dds::Shape shape = mechanism_->shape(k);
  shape.stamp = stamp_;
  shape.frame = frame_;
  arm.shape.write(shape);
}

void CrtkPublisher::publishShape(Arm& arm, int k, const Eigen::VectorXd& q) {
  robots::DisplayShape body;
  if (!displayShape(*robot_.models()[static_cast<std::size_t>(k)], q, arm.branch, shape_, body))
    return;
  dds::Shape shape;
  shape.stamp = stamp_;
  shape.frame = frame_;
  shape.points = std::move(body.points);
  shape.tubes = std::move(body.tubes);
  shape.outer_radius = std::move(body.outer_radius);
  arm.shape.write(shape);
}

}  // namespace tandem::control_service
