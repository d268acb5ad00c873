// SPDX-License-Identifier: Apache-2.0
/** @file The table of all topics: name, type, quality of service, who publishes.
 *
 * On the wire a topic is called rt/PREFIX/NAME, or rt/PREFIX/ARM/NAME for topics of one arm, and its type
 * PACKAGE::msg::dds_::TYPE_, as ROS 2 has it. A name that begins with a slash stands for itself, outside the prefix.
 * docs/topics.md shows the same table to users.
 */
#pragma once

#include <string>
#include <tuple>
#include <vector>

#include "services/dds/messages.h"

namespace tandem::dds {

/** Quality of service. All volatile unless said otherwise. */
enum class Profile {
  kPeriodic,  ///< best effort; writers keep 64, readers the latest one. In lock-step: reliable, readers keep 4096
  kCommand,   ///< as kPeriodic, plus exclusive ownership, deadline, lifespan and liveliness; not in lock-step
  kReliable,  ///< reliable, keep last 64 (readers 10): requests, replies, and what ROS 2 clients subscribe to
  kLatched,   ///< reliable, transient local, keep last 1: a late reader gets the last one
};

/** One topic; `Message` is what it carries. */
template <class M>
struct Topic {
  using Message = M;
  const char* name;         ///< below the prefix, or below the arm's name; absolute with a slash in front
  const char* type;         ///< as ROS 2 writes it, e.g. "sensor_msgs/msg/JointState"
  Profile profile;          ///< quality of service
  bool per_arm;             ///< one of it per arm
  const char* publisher;    ///< who publishes
  const char* description;  ///< for people
  bool pair = false;        ///< of a topic per arm: one more of it for the pair of arms, named kPair
};

/// What stands in place of an arm's name for the first two arms together.
inline constexpr const char* kPair = "pair";

inline constexpr Topic<ActuationState> kActuationState{
    "actuation/state",  "tandem_msgs/msg/ActuationState",
    Profile::kPeriodic, false,
    "hal or sim",       "all joints: measured position and velocity, validity, operating state, sequence, stamp"};
inline constexpr Topic<ActuationCommand> kActuationCommand{
    "actuation/command", "tandem_msgs/msg/ActuationCommand",
    Profile::kCommand,   false,
    "control",           "joint velocity and position setpoints, and the sequence of the state they answer"};
inline constexpr Topic<ActuationLimits> kActuationLimits{
    "actuation/limits", "tandem_msgs/msg/ActuationLimits",
    Profile::kPeriodic, false,
    "control",          "the moving bounds in force, and which are active"};
inline constexpr Topic<PlanningReference> kPlanningReference{
    "planning/reference", "tandem_msgs/msg/PlanningReference",
    Profile::kPeriodic,   false,
    "planning",           "tasks of one control step, trajectory, point, tolerance"};
inline constexpr Topic<PlanningRequest> kPlanningRequest{
    "planning/request", "tandem_msgs/msg/PlanningRequest",          Profile::kReliable, false,
    "clients",          "start, pause, resume or stop a trajectory"};
inline constexpr Topic<Reply> kPlanningReply{"planning/reply", "tandem_msgs/msg/Reply",   Profile::kReliable, false,
                                             "planning",       "typed answer with reason"};
inline constexpr Topic<ComputationRequest> kPlanningCompute{
    "planning/compute", "tandem_msgs/msg/ComputationRequest",
    Profile::kReliable, false,
    "clients",          "check, repair or time a trajectory, choose a start, inverse kinematics; cancel"};
inline constexpr Topic<ComputationProgress> kPlanningProgress{
    "planning/progress",       "tandem_msgs/msg/ComputationProgress", Profile::kReliable, false, "planning",
    "how far a computation is"};
inline constexpr Topic<ComputationResult> kPlanningResult{
    "planning/result", "tandem_msgs/msg/ComputationResult",           Profile::kReliable, false,
    "planning",        "what a computation found, with typed reasons"};
inline constexpr Topic<Path> kPlanningPath{"planning/path", "nav_msgs/msg/Path", Profile::kLatched,
                                           false,           "planning",          "the planned path, for drawing"};
inline constexpr Topic<ControlStatus> kControlStatus{
    "control/status",   "tandem_msgs/msg/ControlStatus",
    Profile::kPeriodic, false,
    "control",          "method, errors, task scales, limits in the way, solve time, loop statistics"};
inline constexpr Topic<Clearances> kControlClearance{
    "control/clearance", "tandem_msgs/msg/Clearances",
    Profile::kReliable,  false,
    "control",           "how near arms are to one another and to the port, with gradients"};
inline constexpr Topic<ControlRequest> kControlRequest{
    "control/request",  "tandem_msgs/msg/ControlRequest",
    Profile::kReliable, false,
    "clients",          "lease, method and parameters, jog, home, move_jp"};
inline constexpr Topic<Reply> kControlReply{"control/reply", "tandem_msgs/msg/Reply",   Profile::kReliable, false,
                                            "control",       "typed answer with reason"};
inline constexpr Topic<TipPoses> kSensingTips{"sensing/tips",         "tandem_msgs/msg/TipPoses",
                                              Profile::kPeriodic,     false,
                                              "a tip tracker or sim", "measured tip poses, validity, sequence, stamp"};
inline constexpr Topic<TipPoses> kSimTips{"sim/tips",
                                          "tandem_msgs/msg/TipPoses",
                                          Profile::kPeriodic,
                                          false,
                                          "sim",
                                          "where the tips of the simulated robot really are"};
inline constexpr Topic<SimRequest> kSimRequest{"sim/request", "tandem_msgs/msg/SimRequest", Profile::kReliable, false,
                                               "clients",     "reset, step, inject a fault"};
inline constexpr Topic<Reply> kSimReply{"sim/reply", "tandem_msgs/msg/Reply",   Profile::kReliable, false,
                                        "sim",       "typed answer with reason"};
inline constexpr Topic<HalRequest> kHalRequest{
    "hal/request", "tandem_msgs/msg/HalRequest", Profile::kReliable, false, "clients", "home the drives"};
inline constexpr Topic<Reply> kHalReply{"hal/reply", "tandem_msgs/msg/Reply",   Profile::kReliable, false,
                                        "hal",       "typed answer with reason"};
inline constexpr Topic<Stop> kStop{"stop",
                                   "tandem_msgs/msg/Stop",
                                   Profile::kReliable,
                                   false,
                                   "everyone",
                                   "stop all arms; hal, sim and control obey and latch it"};
inline constexpr Topic<Bool> kEmergencyStop{
    "emergency_stop",   "std_msgs/msg/Bool",
    Profile::kReliable, false,
    "clients",          "whether the emergency stop is pressed, by whoever reads it; again and again"};
inline constexpr Topic<HalStatus> kHalStatus{"hal/status",       "tandem_msgs/msg/HalStatus",
                                             Profile::kPeriodic, false,
                                             "hal or sim",       "drive states, faults, guard counters, bus load"};
inline constexpr Topic<DiagnosticArray> kDiagnostics{
    "diagnostics",      "diagnostic_msgs/msg/DiagnosticArray",
    Profile::kReliable, false,
    "every service",    "state of every service, for people and ROS 2 tools"};
inline constexpr Topic<Log> kLog{"/rosout", "rcl_interfaces/msg/Log", Profile::kReliable,
                                 false,     "every service",          "what services log, for people and ROS 2 tools"};
inline constexpr Topic<MarkerArray> kMarkers{"markers",          "visualization_msgs/msg/MarkerArray",
                                             Profile::kReliable, false,
                                             "console",          "the arms as lines and spheres, while somebody looks"};

inline constexpr Topic<ClockRequest> kClockRequest{
    "clock/request", "tandem_msgs/msg/ClockRequest", Profile::kReliable, false, "everyone", "what time is it there?"};
inline constexpr Topic<ClockReply> kClockReply{"clock/reply",      "tandem_msgs/msg/ClockReply",
                                               Profile::kReliable, false,
                                               "every service",    "wall clock of a service's host"};

inline constexpr Topic<TeleopInput> kTeleopInput{"teleop/input",     "tandem_msgs/msg/TeleopInput",
                                                 Profile::kPeriodic, false,
                                                 "clients",          "what an operator's device says"};
inline constexpr Topic<TeleopStatus> kTeleopStatus{
    "teleop/status",    "tandem_msgs/msg/TeleopStatus",
    Profile::kReliable, false,
    "control",          "what becomes of it, stage by stage; who drives, what limits it"};
inline constexpr Topic<CrtkStatus> kCrtkStatus{"crtk/status",      "tandem_msgs/msg/CrtkStatus",
                                               Profile::kReliable, false,
                                               "control",          "CRTK commands taken and refused, with the reasons"};

/** A topic that CRTK names: one for each arm and, as relative position of the two tips or joints of both, for the pair.
 */
template <class M>
constexpr Topic<M> crtk(const char* name, const char* type, const char* publisher, const char* description) {
  return {name, type, Profile::kReliable, true, publisher, description, true};
}
inline constexpr const char* kJointStateType = "sensor_msgs/msg/JointState";
inline constexpr const char* kPoseType = "geometry_msgs/msg/PoseStamped";
inline constexpr const char* kTwistType = "geometry_msgs/msg/TwistStamped";

inline constexpr auto kMeasuredJs =
    crtk<JointState>("measured_js", kJointStateType, "control", "CRTK: measured joints");
inline constexpr auto kMeasuredCp =
    crtk<PoseStamped>("measured_cp", kPoseType, "control", "CRTK: tip pose of the measured joints");
inline constexpr auto kMeasuredCv =
    crtk<TwistStamped>("measured_cv", kTwistType, "control", "CRTK: tip velocity of the measured joints");
inline constexpr auto kSetpointJs =
    crtk<JointState>("setpoint_js", kJointStateType, "control", "CRTK: joint setpoint in force");
inline constexpr auto kSetpointCp =
    crtk<PoseStamped>("setpoint_cp", kPoseType, "control", "CRTK: tip pose of the joint setpoint");
inline constexpr auto kSetpointCv = crtk<TwistStamped>("setpoint_cv",
                                                       kTwistType,
                                                       "control",
                                                       "CRTK: tip velocity of the joint velocity that is commanded");
inline constexpr auto kGoalJs =
    crtk<JointState>("goal_js", kJointStateType, "control", "CRTK: joints that a motion leads to");
inline constexpr auto kGoalCp = crtk<PoseStamped>("goal_cp", kPoseType, "control", "CRTK: tip pose that is aimed at");
inline constexpr auto kGoalCv =
    crtk<TwistStamped>("goal_cv", kTwistType, "control", "CRTK: tip velocity that interpolate_cv asks for");
inline constexpr Topic<OperatingState> kOperatingState{"operating_state",
                                                       "crtk_msgs/msg/OperatingState",
                                                       Profile::kLatched,
                                                       true,
                                                       "control",
                                                       "CRTK: DISABLED, ENABLED, PAUSED or FAULT; homed, busy",
                                                       true};
inline constexpr Topic<Shape> kShape{"shape",   "tandem_msgs/msg/Shape", Profile::kReliable, true,
                                     "control", "backbone, for drawing"};

inline constexpr auto kServoJp =
    crtk<JointState>("servo_jp", kJointStateType, "clients", "CRTK: joint positions, streamed, followed as it comes");
inline constexpr auto kServoJr =
    crtk<JointState>("servo_jr",
                     kJointStateType,
                     "clients",
                     "CRTK: joint positions, relative to where they are, streamed, followed as it comes");
inline constexpr auto kServoJv =
    crtk<JointState>("servo_jv", kJointStateType, "clients", "CRTK: joint velocities, streamed, followed as it comes");
inline constexpr auto kServoCp =
    crtk<PoseStamped>("servo_cp", kPoseType, "clients", "CRTK: tip position, streamed, followed as it comes");
inline constexpr auto kServoCr =
    crtk<PoseStamped>("servo_cr",
                      kPoseType,
                      "clients",
                      "CRTK: tip position, relative to where it is, streamed, followed as it comes");
inline constexpr auto kServoCv =
    crtk<TwistStamped>("servo_cv", kTwistType, "clients", "CRTK: tip velocity, streamed, followed as it comes");
inline constexpr auto kInterpolateJp =
    crtk<JointState>("interpolate_jp", kJointStateType, "clients", "CRTK: joint positions, streamed, smoothed");
inline constexpr auto kInterpolateJr =
    crtk<JointState>("interpolate_jr",
                     kJointStateType,
                     "clients",
                     "CRTK: joint positions, relative to where they are, streamed, smoothed");
inline constexpr auto kInterpolateJv =
    crtk<JointState>("interpolate_jv", kJointStateType, "clients", "CRTK: joint velocities, streamed, smoothed");
inline constexpr auto kInterpolateCp =
    crtk<PoseStamped>("interpolate_cp", kPoseType, "clients", "CRTK: tip position, streamed, smoothed");
inline constexpr auto kInterpolateCr =
    crtk<PoseStamped>("interpolate_cr",
                      kPoseType,
                      "clients",
                      "CRTK: tip position, relative to where it is, streamed, smoothed");
inline constexpr auto kInterpolateCv =
    crtk<TwistStamped>("interpolate_cv", kTwistType, "clients", "CRTK: tip velocity, streamed, smoothed");
inline constexpr auto kMoveJp =
    crtk<JointState>("move_jp", kJointStateType, "clients", "CRTK: joint positions, one goal, busy until there");
inline constexpr auto kMoveJr =
    crtk<JointState>("move_jr",
                     kJointStateType,
                     "clients",
                     "CRTK: joint positions, relative to where they are, one goal, busy until there");
inline constexpr auto kMoveCp =
    crtk<PoseStamped>("move_cp", kPoseType, "clients", "CRTK: tip position, one goal, busy until there");
inline constexpr auto kMoveCr =
    crtk<PoseStamped>("move_cr",
                      kPoseType,
                      "clients",
                      "CRTK: tip position, relative to where it is, one goal, busy until there");
inline constexpr auto kHold = crtk<Empty>("hold", "std_msgs/msg/Empty", "clients", "CRTK: end motions, stay");
inline constexpr auto kStateCommand = crtk<StringStamped>("state_command",
                                                          "crtk_msgs/msg/StringStamped",
                                                          "clients",
                                                          "CRTK: enable, disable, pause, resume, home, unhome");

/// Every topic, once.
inline constexpr auto kTopics = std::tuple{kActuationState,
                                           kActuationCommand,
                                           kActuationLimits,
                                           kPlanningReference,
                                           kPlanningRequest,
                                           kPlanningReply,
                                           kPlanningCompute,
                                           kPlanningProgress,
                                           kPlanningResult,
                                           kPlanningPath,
                                           kControlStatus,
                                           kControlClearance,
                                           kControlRequest,
                                           kControlReply,
                                           kTeleopInput,
                                           kTeleopStatus,
                                           kCrtkStatus,
                                           kSensingTips,
                                           kSimTips,
                                           kSimRequest,
                                           kSimReply,
                                           kHalRequest,
                                           kHalReply,
                                           kStop,
                                           kEmergencyStop,
                                           kHalStatus,
                                           kDiagnostics,
                                           kClockRequest,
                                           kClockReply,
                                           kMeasuredJs,
                                           kMeasuredCp,
                                           kMeasuredCv,
                                           kSetpointJs,
                                           kSetpointCp,
                                           kSetpointCv,
                                           kGoalJs,
                                           kGoalCp,
                                           kGoalCv,
                                           kOperatingState,
                                           kShape,
                                           kServoJp,
                                           kServoJr,
                                           kServoJv,
                                           kServoCp,
                                           kServoCr,
                                           kServoCv,
                                           kInterpolateJp,
                                           kInterpolateJr,
                                           kInterpolateJv,
                                           kInterpolateCp,
                                           kInterpolateCr,
                                           kInterpolateCv,
                                           kMoveJp,
                                           kMoveJr,
                                           kMoveCp,
                                           kMoveCr,
                                           kHold,
                                           kStateCommand,
                                           kLog,
                                           kMarkers};

/// Calls f(topic) with every Topic<M> of the table.
template <class F>
void forEachTopic(F&& f) {
  std::apply([&](const auto&... topic) { (f(topic), ...); }, kTopics);
}

/** A topic without its message type, for lists and look-ups at run time. */
struct TopicInfo {
  std::string name;         ///< below the prefix, with the arm's name where there is one: "arm_a/measured_js"
  std::string type;         ///< "sensor_msgs/msg/JointState"
  Profile profile;          ///< quality of service
  std::string arm;          ///< or kPair; empty for topics of the whole robot
  std::string publisher;    ///< who publishes
  std::string description;  ///< for people
};

/// All topics of a robot with these arms, in the order of the table; those of the pair where there are two arms or
/// more.
std::vector<TopicInfo> allTopics(const std::vector<std::string>& arm_names);

/// "periodic", "command", "reliable" or "latched".
const char* name(Profile profile);

/// Name of a topic in ROS 2 and in files: "/PREFIX/NAME", or the name itself where it begins with a slash.
std::string rosTopicName(const std::string& prefix, const std::string& name);

/** Name of a topic in DDS: "rt/PREFIX/NAME", or "rt/PREFIX/ARM/NAME" with an arm; "rt" in front of an absolute name.
 * @throw std::invalid_argument where prefix or arm are not made of letters, digits and underscores (the prefix may have
 * slashes between them). */
std::string ddsTopicName(const std::string& prefix, const std::string& name, const std::string& arm = "");

/// Name of a type in DDS: "sensor_msgs/msg/JointState" -> "sensor_msgs::msg::dds_::JointState_".
std::string ddsTypeName(const std::string& type);

}  // namespace tandem::dds
