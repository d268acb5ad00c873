// SPDX-License-Identifier: Apache-2.0
#include "services/control/crtk_publisher.h"

#include "planning/reference.h"
#include "safety/operating_state.h"
#include "services/common/periodic_loop.h"
#include "services/dds/convert.h"

namespace tandem::service {
namespace {

constexpr int kShapePoints = 60;

}  // namespace

CrtkPublisher::CrtkPublisher(dds::Bus& bus, const Setup& setup, const experiments::RobotModel& robot)
    : setup_(setup),
      robot_(robot),
      frame_(setup.deployment.prefix + "_base"),
      diagnostics_(bus, setup.name, setup.robot.name) {
  for (const config::Arm& from : setup.robot.arms) {
    Arm arm;
    arm.name = from.name;
    for (const char* kind : {"_beta_", "_alpha_"}) {
      for (int i = 1; i <= from.model.tubeCount(); ++i)
        arm.joint_names.push_back(from.name + kind + std::to_string(i));
    }
    arm.measured_js = bus.writer(dds::kMeasuredJs, from.name);
    arm.setpoint_js = bus.writer(dds::kSetpointJs, from.name);
    arm.measured_cp = bus.writer(dds::kMeasuredCp, from.name);
    arm.setpoint_cp = bus.writer(dds::kSetpointCp, from.name);
    arm.goal_cp = bus.writer(dds::kGoalCp, from.name);
    arm.operating_state = bus.writer(dds::kOperatingState, from.name);
    arm.shape = bus.writer(dds::kShape, from.name);
    arms_.push_back(std::move(arm));
  }
}

void CrtkPublisher::publish(const Moment& moment) {
  publishDiagnostics(moment);
  for (int k = 0; k < robot_.armCount(); ++k) {
    Arm& arm = arms_[static_cast<std::size_t>(k)];
    publishState(arm, k, moment);
    if (moment.state.sequence == 0)
      continue;  // nothing measured yet: say nothing rather than something invalid
    const Eigen::VectorXd measured = dds::jointsOf(moment.state.position, k, robot_.size(k));
    const Eigen::VectorXd setpoint = dds::jointsOf(moment.state.setpoint, k, robot_.size(k));
    publishJoints(arm, k, moment, measured, setpoint);
    if (arm.session != moment.state.session || arm.placements != moment.state.placements)
      arm.branch = {};
    arm.session = moment.state.session;
    arm.placements = moment.state.placements;
    if (moment.state.valid[static_cast<std::size_t>(k)] != 0) {
      publishPose(arm.measured_cp, k, moment.state.stamp, measured, arm.branch);
      publishShape(arm, k, moment.state.stamp, measured);
    }
    kinematics::Branch ahead = arm.branch;
    publishPose(arm.setpoint_cp, k, moment.state.stamp, setpoint, ahead);
    publishGoal(arm, k, moment);
  }
}

void CrtkPublisher::publishJoints(Arm& arm,
                                  int k,
                                  const Moment& moment,
                                  const Eigen::VectorXd& measured,
                                  const Eigen::VectorXd& setpoint) {
  dds::JointState js;
  js.frame = frame_;
  js.name = arm.joint_names;
  js.position.assign(setpoint.begin(), setpoint.end());
  js.stamp = moment.state.stamp;
  arm.setpoint_js.write(js);
  // CRTK: a stamp of zero marks what is not valid.
  js.stamp = moment.state.valid[static_cast<std::size_t>(k)] != 0 ? moment.state.stamp : 0;
  js.position.assign(measured.begin(), measured.end());
  for (int j = 0; j < robot_.size(k); ++j)
    js.velocity.push_back(moment.state.velocity[dds::jointIndex(k, j)]);
  arm.measured_js.write(js);
}

void CrtkPublisher::publishPose(dds::Writer<dds::PoseStamped>& writer,
                                int k,
                                std::int64_t stamp,
                                const Eigen::VectorXd& q,
                                kinematics::Branch& branch) const {
  kinematics::Tip tip;
  if (robot_.models()[static_cast<std::size_t>(k)]->tip(q, branch, tip) != kinematics::ModelStatus::kOk)
    return;
  const Eigen::Vector3d p = tip.pose.translation();
  const Eigen::Quaterniond r(tip.pose.linear());
  dds::PoseStamped pose;
  pose.stamp = stamp;
  pose.frame = frame_;
  pose.position = {p.x(), p.y(), p.z()};
  pose.orientation = {r.x(), r.y(), r.z(), r.w()};
  writer.write(pose);
}

void CrtkPublisher::publishGoal(Arm& arm, int k, const Moment& moment) const {
  for (std::size_t i = 0; i < moment.reference.task_count; ++i) {
    const dds::TaskReference& task = moment.reference.tasks[i];
    if (task.kind != static_cast<std::uint8_t>(planning::TaskKind::kTipPosition) || task.arm != k)
      continue;
    dds::PoseStamped pose;
    pose.stamp = moment.state.stamp;
    pose.frame = frame_;
    pose.position = task.position;
    arm.goal_cp.write(pose);
  }
}

void CrtkPublisher::publishState(Arm& arm, int k, const Moment& moment) {
  const auto i = static_cast<std::size_t>(k);
  dds::OperatingState state;
  state.stamp = moment.state.stamp;
  state.frame = frame_;
  state.state = std::string(safety::name(static_cast<safety::OperatingState>(moment.status.operating_state[i])));
  state.is_homed = moment.status.homed[i] != 0;
  state.is_busy = moment.status.busy[i] != 0;
  const bool same = state.state == arm.last_state.state && state.is_homed == arm.last_state.is_homed &&
                    state.is_busy == arm.last_state.is_busy;
  if (same)
    return;  // the topic is latched: late readers get the last one
  arm.operating_state.write(state);
  arm.last_state = state;
}

void CrtkPublisher::publishDiagnostics(const Moment& moment) {
  const dds::ControlStatus& status = moment.status;
  std::string states, faults;
  for (int k = 0; k < robot_.armCount(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    if (moment.faults[i].faults != 0)
      faults += "; FAULT of " + describe(setup_.robot, {k, moment.faults[i]});
    states += (k == 0 ? "" : ", ") + arms_[i].name + " " +
              std::string(safety::name(static_cast<safety::OperatingState>(status.operating_state[i])));
  }
  const std::string hold(dds::describe(static_cast<dds::HoldReason>(status.hold)));
  const auto level = !faults.empty() ? Diagnostics::Level::kError
                     : hold.empty()  ? Diagnostics::Level::kOk
                                     : Diagnostics::Level::kWarn;
  diagnostics_.publish(monotonicNow(), moment.state.stamp, level,
                       states + (hold.empty() ? "" : "; the trajectory is held: " + hold) + faults,
                       {{"model", setup_.deployment.model},
                        {"feedback", std::string(planning::name(setup_.deployment.feedback))},
                        {"method", std::string(control::name(static_cast<control::Method>(status.method)))},
                        {"cycles", std::to_string(status.cycles)},
                        {"overruns", std::to_string(status.overruns)},
                        {"jitter_max_s", std::to_string(status.jitter_max)},
                        {"cycle_time_max_s", std::to_string(status.cycle_time_max)}});
}

void CrtkPublisher::publishShape(Arm& arm, int k, std::int64_t stamp, const Eigen::VectorXd& q) {
  const auto model = robot_.models()[static_cast<std::size_t>(k)];
  if (model->shape(q, kinematics::Wrench::Zero(), arm.branch, kShapePoints, shape_) != kinematics::ModelStatus::kOk)
    return;
  dds::Shape shape;
  shape.stamp = stamp;
  shape.frame = frame_;
  for (const kinematics::ShapePoint& point : shape_) {
    for (double x : point.pose.translation())
      shape.points.push_back(static_cast<float>(x));
    shape.tubes.push_back(static_cast<std::uint8_t>(point.outermost_tube));
    const auto tube = static_cast<std::size_t>(std::max(point.outermost_tube, 1) - 1);
    shape.outer_radius.push_back(static_cast<float>(0.5 * model->arm().tubes[tube].outer_diameter));
  }
  arm.shape.write(shape);
}

}  // namespace tandem::service
