// SPDX-License-Identifier: Apache-2.0
/** @file Publication of CRTK and ROS 2 feedback of each arm: joints, poses, operating state, shape. */
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "operation/crtk_request.h"
#include "operation/operator_input_handler.h"
#include "robots/robot_model.h"
#include "services/control/mechanism_places.h"
#include "services/runtime/diagnostics.h"
#include "services/runtime/fault_log.h"
#include "services/runtime/process.h"

namespace tandem::control_service {

/** Snapshot of the robot, from the periodic thread. */
struct Snapshot {
  dds::ActuationState state;
  dds::ControlStatus status;
  dds::ControlPermissions permissions;
  dds::JointArray commanded{};  ///< joint velocities, m/s, rad/s
  std::array<safety::FaultRecord, safety::kMaxArms> faults;
  operation::OperatorSnapshot operators;
  operation::CrtkSnapshot crtk;
};

/** Publishes arm_x/... and control's diagnostics from snapshots. Runs on a publisher thread: it computes poses and
 * shapes and allocates. */
class CrtkPublisher {
 public:
  CrtkPublisher(dds::Bus& bus, const runtime::Setup& setup, const robots::RobotModel& robot);
  /// @param stamp  of the messages, ROS time, ns @param parameters  of the method, for diagnostics
  void publish(const Snapshot& snapshot, std::int64_t stamp, const runtime::Details& parameters);

 private:
  /** Writers of the topics common to an arm and the pair. */
  struct Ends {
    Ends(dds::Bus& bus, const std::string& group);
    dds::Writer<dds::JointState> measured_js, setpoint_js, goal_js;
    dds::Writer<dds::PoseStamped> measured_cp, setpoint_cp, goal_cp;
    dds::Writer<dds::TwistStamped> measured_cv, setpoint_cv, goal_cv;
    dds::Writer<dds::OperatingState> operating_state;
    dds::OperatingState last_state;
    bool has_js = false, has_cp = false, has_cv = false;  ///< the last published goal is valid
  };
  /** Pose and velocity of a tip, or of one tip relative to another. */
  struct Place {
    bool known = false;
    Eigen::Vector3d position = Eigen::Vector3d::Zero(), linear = position, angular = position;
    Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
    bool moves = true;  ///< the velocity is valid, too
  };
  struct Joints {
    bool valid = true;
    std::vector<double> position, velocity;
    Place place;
  };
  struct Arm {
    Arm(dds::Bus& bus, const config::Arm& from);
    std::string name;
    std::vector<std::string> joint_names;
    Ends ends;
    dds::Writer<dds::Shape> shape;
    kinematics::Branch branch;  ///< of the elastic model at the measured joints
    std::uint64_t session = 0;  ///< of the last processed state
    std::uint32_t joint_resets = 0;
    Joints measured, setpoint;
  };
  void publishArm(Arm& arm, int k, const Snapshot& snapshot);
  void publishPair(const Snapshot& snapshot);
  void publish(Ends& ends, const std::vector<std::string>& names, const Joints& measured, const Joints& setpoint);
  void publishGoals(Ends& ends, int group, const std::vector<std::string>& names, const Snapshot& snapshot);
  void publishState(Ends& ends, dds::OperatingState state);
  Place placeOf(int k, const Joints& joints, kinematics::Branch& branch) const;
  dds::OperatingState stateOf(int k, const Snapshot& snapshot) const;
  void publishDiagnostics(const Snapshot& snapshot, const runtime::Details& parameters);
  void publishShape(Arm& arm, int k, const Eigen::VectorXd& q);
  void publishMechanism(Arm& arm, int k);

  const runtime::Setup& setup_;
  const robots::RobotModel& robot_;
  std::string frame_;
  std::int64_t stamp_ = 0;  ///< of the messages of this snapshot
  std::optional<MechanismPlaces> mechanism_;
  bool mechanism_known_ = false;  ///< mechanism_ is valid at the joints of this snapshot
  std::vector<Arm> arms_;
  std::optional<Ends> pair_;
  std::vector<std::string> pair_names_;  ///< joint names of the pair
  dds::Bus& bus_;
  runtime::Diagnostics diagnostics_;
  std::vector<kinematics::ShapePoint> shape_;
};

}  // namespace tandem::control_service
