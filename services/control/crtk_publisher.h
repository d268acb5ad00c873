// SPDX-License-Identifier: Apache-2.0
/** @file What ROS 2 and CRTK clients read of each arm: joints, poses, operating state, shape. */
#pragma once

#include <string>
#include <vector>

#include "experiments/run_record.h"
#include "services/setup/diagnostics.h"
#include "services/setup/fault_log.h"
#include "services/setup/process.h"

namespace tandem::service {

/** A moment of the robot, handed over by the periodic thread. */
struct Moment {
  dds::ActuationState state;
  dds::ControlStatus status;
  dds::PlanningReference reference;
  std::array<safety::FaultRecord, safety::kMaxArms> faults;
};

/** Publishes arm_x/... and control's diagnostics from moments. Runs on a publisher thread: it computes poses and shapes
 * and allocates. */
class CrtkPublisher {
 public:
  CrtkPublisher(dds::Bus& bus, const Setup& setup, const experiments::RobotModel& robot);
  void publish(const Moment& moment);

 private:
  struct Arm {
    std::string name;
    std::vector<std::string> joint_names;
    dds::Writer<dds::JointState> measured_js, setpoint_js;
    dds::Writer<dds::PoseStamped> measured_cp, setpoint_cp, goal_cp;
    dds::Writer<dds::OperatingState> operating_state;
    dds::Writer<dds::Shape> shape;
    dds::OperatingState last_state;
    kinematics::Branch branch;  ///< of the measured joints, which an elastic arm's model follows
    std::uint64_t session = 0;  ///< of the state that was last followed
    std::uint32_t placements = 0;
  };
  void publishJoints(Arm& arm,
                     int k,
                     const Moment& moment,
                     const Eigen::VectorXd& measured,
                     const Eigen::VectorXd& setpoint);
  void publishPose(dds::Writer<dds::PoseStamped>& writer,
                   int k,
                   std::int64_t stamp,
                   const Eigen::VectorXd& q,
                   kinematics::Branch& branch) const;
  void publishGoal(Arm& arm, int k, const Moment& moment) const;
  void publishState(Arm& arm, int k, const Moment& moment);
  void publishDiagnostics(const Moment& moment);
  void publishShape(Arm& arm, int k, std::int64_t stamp, const Eigen::VectorXd& q);

  const Setup& setup_;
  const experiments::RobotModel& robot_;
  std::string frame_;
  std::vector<Arm> arms_;
  Diagnostics diagnostics_;
  std::vector<kinematics::ShapePoint> shape_;
};

}  // namespace tandem::service
