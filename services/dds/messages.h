// SPDX-License-Identifier: Apache-2.0
/** @file What crosses the wire, as plain structs. Generated DDS types stay behind converters in this folder.
 *
 * Arrays over joints are indexed arm * kMaxJointsPerArm + joint. Stamps are ns on the publisher's monotonic clock, or
 * simulated time in lock-step; only the process that wrote a stamp may compare it with a clock.
 */
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "safety/dimensions.h"
#include "services/dds/clock_messages.h"
#include "services/dds/computation_messages.h"
#include "services/dds/standard_messages.h"
#include "services/dds/teleop_messages.h"
#include "services/dds/view_messages.h"

namespace tandem::dds {

using JointArray = std::array<double, safety::kMaxJoints>;
template <class T>
using PerArm = std::array<T, safety::kMaxArms>;

/// Where a joint of an arm stands in arrays over joints; both count from 0.
constexpr std::size_t jointIndex(int arm, int joint) {
  return static_cast<std::size_t>(arm * safety::kMaxJointsPerArm + joint);
}

/// ControlRequest::arm for all arms.
inline constexpr std::uint8_t kAllArms = 255;

/// actuation/state, hal or sim -> all. tandem_msgs/ActuationState
struct ActuationState {
  std::uint64_t session = 0;          ///< random, new with every start of hal or sim
  std::uint64_t sequence = 0;         ///< counts from 1 within the session
  std::int64_t stamp = 0;             ///< ns
  std::uint64_t answers_command = 0;  ///< sequence of the last command taken
  std::uint32_t placements = 0;  ///< times the joints were put elsewhere without a path (sim reset, hal's references)
  std::uint8_t lock_step = 0;
  std::uint8_t arm_count = 0;
  PerArm<std::uint8_t> joint_count{};
  PerArm<std::uint8_t> valid{};            ///< 1: positions and velocities of this arm are measured and good
  PerArm<std::uint8_t> operating_state{};  ///< safety::OperatingState of the drives
  PerArm<std::uint32_t> faults{};          ///< latched safety::Fault bits
  PerArm<std::uint8_t> recovery{};         ///< 1: ENABLED to recover: slow, inwards, without the joints in `lost`
  PerArm<std::uint8_t> lost{};             ///< bit j: joint j stays where it is
  PerArm<std::uint8_t> homed{};            ///< 1: all joints know where they are
  PerArm<std::uint8_t> holds{};            ///< 1: the arm stays where it is without power
  JointArray position{};                   ///< m, rad
  JointArray velocity{};                   ///< m/s, rad/s
  JointArray setpoint{};                   ///< last setpoint past the gate, m, rad
};

/// actuation/command, control -> hal or sim. tandem_msgs/ActuationCommand
struct ActuationCommand {
  std::uint64_t control_session = 0;  ///< random, new with every start of control
  std::uint64_t sequence = 0;
  std::uint64_t state_session = 0;  ///< whose state is answered
  std::uint64_t answers_state = 0;  ///< sequence of that state
  std::int64_t stamp = 0;
  std::uint8_t advance = 0;  ///< lock-step: 1 = the plant takes one step of one control period with this command
  std::uint8_t arm_count = 0;
  PerArm<std::uint8_t> request{};  ///< safety::DriveRequest: keep, disable, enable, pause, resume, recover
  PerArm<std::uint8_t> without{};  ///< recover: bit j: joint j shall not be used even if its drive could be
  PerArm<std::uint8_t> moving{};   ///< 1: the velocity counts; 0: end the segment under way and hold
  JointArray velocity{};           ///< m/s, rad/s over the next control period, from the drives' last setpoint on
  JointArray position{};           ///< where control takes that to end, m, rad; finite, otherwise of no effect
};

/// actuation/limits, control -> all. tandem_msgs/ActuationLimits
struct ActuationLimits {
  std::uint64_t sequence = 0;
  std::uint64_t answers_state = 0;
  std::int64_t stamp = 0;
  std::uint8_t arm_count = 0;
  PerArm<std::uint8_t> joint_count{};
  JointArray lower{};  ///< moving lower bound of each joint with its neighbours at their present position
  JointArray upper{};
  JointArray velocity_lower{};  ///< m/s, rad/s
  JointArray velocity_upper{};
  std::array<std::uint8_t, safety::kMaxJoints> active{};  ///< 1: the solution stands at a bound or row of this joint
};

/// One task of a reference. tandem_msgs/TaskReference
struct TaskReference {
  std::uint8_t kind = 0;  ///< planning::TaskKind
  std::uint8_t arm = 0;
  std::uint8_t other_arm = 0;
  std::array<double, 3> position{};
  std::array<double, 4> orientation{0, 0, 0, 1};  ///< x y z w
  std::array<double, 6> feed_forward{};           ///< linear, angular; of a frame, NaN: this component is not tracked
};

/// planning/reference, planning -> control. tandem_msgs/PlanningReference
struct PlanningReference {
  std::uint64_t sequence = 0;
  std::uint64_t state_session = 0;
  std::uint64_t answers_state = 0;
  std::uint64_t answers_control = 0;  ///< sequence of the last control/status seen: freshness on control's own clock
  std::int64_t stamp = 0;
  std::uint32_t trajectory_id = 0;
  std::uint32_t point = 0;  ///< counts from 1; 0 = none
  std::uint32_t point_count = 0;
  std::uint32_t iteration = 0;  ///< within the point, counts from 1
  std::uint32_t total_iterations = 0;
  std::uint8_t phase = 0;  ///< planning::Phase: idle, running, paused, finished, failed
  double tolerance = 0.0;  ///< m
  std::uint8_t task_count = 0;
  std::array<TaskReference, 4> tasks{};
  std::uint8_t posture_valid = 0;  ///< 1: the posture counts
  JointArray posture{};            ///< where joints shall be as far as the tasks leave them free, m, rad
};

/// planning/request, clients -> planning. tandem_msgs/PlanningRequest
struct PlanningRequest {
  std::uint64_t client = 0;
  std::uint64_t request = 0;
  std::uint8_t kind = 0;     ///< 1 start, 2 pause, 3 resume, 4 stop
  std::string trajectory;    ///< start: the trajectory as YAML text
  std::uint8_t planned = 0;  ///< start: 1 = with the joints of the last feasible check of this text as posture
};

/// planning/reply, sim/reply, control/reply and hal/reply. tandem_msgs/Reply
struct Reply {
  std::uint64_t client = 0;
  std::uint64_t request = 0;
  std::uint8_t accepted = 0;
  std::uint16_t code = 0;   ///< dds::ReplyCode
  std::string reason;       ///< for people; what to do next
  std::uint32_t value = 0;  ///< planning: trajectory id
};

/// sensing/tips, tip tracker or sim -> control, planning; sim/tips, sim -> experiments. tandem_msgs/TipPoses
struct TipPoses {
  std::uint64_t session = 0;   ///< random, new with every start of whoever measures
  std::uint64_t sequence = 0;  ///< counts measurements from 1
  std::uint64_t state_session = 0;
  std::uint64_t answers_state = 0;    ///< of the last state published before this; in lock-step of the one with it
  std::uint64_t answers_command = 0;  ///< the last command that the robot had taken when it was measured
  std::int64_t stamp = 0;             ///< when it was measured, ns
  std::uint8_t arm_count = 0;
  PerArm<std::uint8_t> valid{};
  std::array<double, 3 * safety::kMaxArms> position{};     ///< x y z of each tool tip, m, robot base frame
  std::array<double, 4 * safety::kMaxArms> orientation{};  ///< x y z w
};

/// Why control holds a trajectory. ControlStatus::hold
enum class HoldReason : std::uint8_t {
  kNone = 0,
  kNoTips,       ///< feedback: sensor, and no tip has been measured yet
  kStaleTips,    ///< the last good measurement of a tip is too old
  kInvalidTips,  ///< the same, and what came since is marked invalid
  kNoRest,       ///< catheters: no rest of what they move is known near their joints, or it is too old
};

/// control/status, control -> all. tandem_msgs/ControlStatus
struct ControlStatus {
  std::uint64_t session = 0;
  std::uint64_t sequence = 0;
  std::uint64_t answers_state = 0;
  std::uint64_t answers_reference = 0;
  std::int64_t stamp = 0;
  std::uint8_t method = 0;        ///< control::Method
  std::uint8_t backend = 0;       ///< control::Backend
  std::uint8_t bounds = 0;        ///< control::BoundsKind
  std::uint8_t solve_status = 0;  ///< control::SolveStatus
  std::uint8_t arm_count = 0;
  PerArm<std::uint8_t> operating_state{};
  PerArm<std::uint8_t> homed{};
  PerArm<std::uint8_t> recovery{};  ///< 1: ENABLED to recover; only jog and withdraw move the arm
  PerArm<std::uint8_t> busy{};
  PerArm<std::uint32_t> faults{};
  std::uint64_t lease_holder = 0;  ///< client id, 0 = free
  std::uint8_t task_count = 0;
  std::array<double, 4> task_error{};     ///< m, norm per task
  std::array<double, 4> task_scale{};     ///< 0..1
  std::array<double, 4> task_residual{};  ///< m/s, |J qdot - v|
  std::uint32_t iterations = 0;           ///< of the solver
  double kkt_residual = 0.0;
  double solve_time = 0.0;      ///< s
  double cycle_time = 0.0;      ///< s, of the last cycle
  double period = 0.0;          ///< s
  double jitter_max = 0.0;      ///< s, largest lateness of a wake-up
  double cycle_time_max = 0.0;  ///< s
  std::uint64_t cycles = 0;
  std::uint64_t overruns = 0;
  std::uint32_t active_limits = 0;           ///< how many bounds and rows the solution stands at
  std::uint8_t model = 0;                    ///< kinematic model in force: 0 rigid, 1 compliant
  std::uint8_t feedback = 0;                 ///< planning::Feedback
  std::uint8_t hold = 0;                     ///< HoldReason
  double tip_age = 0.0;                      ///< s, of the oldest measured tip in use
  PerArm<std::uint32_t> snaps{};             ///< times the model's arm snapped into another equilibrium
  std::uint8_t limited = 0;                  ///< Limited
  std::uint8_t limit_count = 0;              ///< the heaviest first
  std::array<std::uint8_t, 8> limit_kind{};  ///< control::LimitKind
  std::array<std::uint8_t, 8> limit_arm{};
  std::array<std::uint8_t, 8> limit_tube{};  ///< counts from 1
  std::array<double, 8> limit_bound{};       ///< on the velocity, m/s, rad/s
  PerArm<double> idle{};                     ///< s for which an arm has had power and nobody commanded it; 0: not so
  PerArm<double> idle_left{};                ///< s until such an arm loses its power; below 0: it keeps it
  std::uint8_t source = 0;                   ///< dds::Source: who moves the robot
};

/// How the limits in ControlStatus hold the tasks back. ControlStatus::limited
enum class Limited : std::uint8_t { kNot = 0, kForbidden, kHeldBack };

/// control/clearance: one pair of bodies. tandem_msgs/BodyClearance
struct BodyClearance {
  static constexpr std::uint8_t kPort = 255;
  std::uint8_t arm = 0;
  std::uint8_t other_arm = kPort;
  double distance = 0.0;                         ///< m; below zero: they overlap
  std::array<double, 3> place{}, other_place{};  ///< on the backbones, m, robot base frame
  double s = 0.0, other_s = 0.0;                 ///< m
  std::array<double, safety::kMaxJointsPerArm> by_joints{}, by_other_joints{};  ///< of the distance, 1 and m/rad
};

/// control/clearance, control -> all. tandem_msgs/Clearances
struct Clearances {
  std::uint64_t session = 0;
  std::uint64_t sequence = 0;
  std::uint64_t answers_state = 0;
  std::int64_t stamp = 0;
  std::vector<BodyClearance> bodies;
};

/// control/request, clients -> control. tandem_msgs/ControlRequest
struct ControlRequest {
  std::uint64_t client = 0;
  std::uint64_t request = 0;
  std::uint8_t kind = 0;  ///< dds::ControlKind
  std::uint8_t arm = kAllArms;
  std::string text;   ///< method name; "backend", "bounds" or parameter name
  std::string value;  ///< parameter value; state command
  std::uint8_t joint_count = 0;
  std::array<double, safety::kMaxJointsPerArm> joints{};  ///< move_jp: m, rad; jog: m/s, rad/s; recover: without
};

/// stop, everyone -> hal, sim, control. tandem_msgs/Stop
struct Stop {
  std::uint64_t client = 0;
  std::uint64_t sequence = 0;
  std::string reason;
};

/// sim/request, clients -> sim. tandem_msgs/SimRequest
struct SimRequest {
  std::uint64_t client = 0;
  std::uint64_t request = 0;
  std::uint8_t kind = 0;  ///< 1 reset to joints, 2 step, 3 inject fault
  std::uint8_t arm_count = 0;
  JointArray joints{};
  std::uint32_t steps = 0;
  std::uint8_t arm = 0;
  std::uint8_t joint = 0;
  std::string fault;  ///< off, stuck, garbage, invalid, none
};

/// hal/status, hal or sim -> all. tandem_msgs/HalStatus
struct HalStatus {
  std::uint64_t session = 0;
  std::uint64_t sequence = 0;
  std::int64_t stamp = 0;
  std::uint8_t arm_count = 0;
  PerArm<std::uint8_t> operating_state{};
  PerArm<std::uint32_t> faults{};
  std::array<std::uint64_t, 16> guard_count{};  ///< interventions per safety::Guard since start
  std::array<double, 16> guard_largest{};       ///< largest amount per guard, SI
  std::array<std::uint8_t, 16> guard_arm{};     ///< arm and joint of the last intervention
  std::array<std::uint8_t, 16> guard_joint{};
  PerArm<std::uint32_t> first_fault{};  ///< what led the arm into FAULT: safety::FaultRecord
  PerArm<std::uint8_t> fault_cause{};   ///< safety::FaultCause
  PerArm<std::uint8_t> fault_joint{};   ///< counts from 0; 255 = no joint
  PerArm<double> fault_amount{};        ///< m or rad of that joint; s without a joint
  PerArm<double> fault_allowed{};
  double period = 0.0;
  double jitter_max = 0.0;
  std::uint64_t cycles = 0;
  std::uint64_t overruns = 0;
  std::uint64_t caught_up = 0;      ///< sim: periods stepped later than they were due; hal: 0
  std::uint64_t left_out = 0;       ///< periods never stepped; drives on a bus held their last target then
  double bus_load = 0.0;            ///< 0..1, of the fullest bus
  PerArm<std::uint32_t> snaps{};    ///< sim: times the arm snapped into another equilibrium
  std::uint8_t emergency_stop = 0;  ///< 0 not read, 1 released, 2 pressed
  // Of hal alone; 0 with a simulated robot.
  PerArm<std::uint8_t> homed{};                                 ///< 1: all joints know where they are
  PerArm<std::uint8_t> power{};                                 ///< hal::ArmPower
  std::array<std::uint8_t, safety::kMaxJoints> axis_phase{};    ///< hal::AxisPhase
  std::array<std::uint8_t, safety::kMaxJoints> axis_state{};    ///< hal::DriveState
  std::array<std::uint16_t, safety::kMaxJoints> axis_error{};   ///< last error code of drive or encoder
  std::array<std::uint32_t, safety::kMaxJoints> axis_guards{};  ///< bits of hal::HardwareGuard that act now
  std::array<float, safety::kMaxJoints> axis_temperature{};     ///< of the drive, deg C; NaN where it is not known
  JointArray following_error{};                                 ///< m, rad
  JointArray encoder_difference{};                              ///< absolute encoder minus drive, m, rad
  std::array<std::uint64_t, 24> hardware_count{};  ///< times each hal::HardwareGuard began to act since start
  std::array<std::uint8_t, 24> hardware_arm{};     ///< arm and joint of the last time
  std::array<std::uint8_t, 24> hardware_joint{};
  std::uint8_t bus_count = 0;
  std::array<std::uint8_t, 8> bus_state{};      ///< hal::can::BusState
  std::array<double, 8> bus_loads{};            ///< 0..1
  std::array<std::uint64_t, 8> bus_dropped{};   ///< frames that could not be sent
  std::array<std::uint64_t, 8> bus_overflow{};  ///< frames that were not fetched in time
};

/// hal/request, clients -> hal. tandem_msgs/HalRequest
struct HalRequest {
  std::uint64_t client = 0;
  std::uint64_t request = 0;
  std::uint8_t kind = 0;  ///< 1 home: goes on as long as the request is repeated
  std::uint8_t arm = kAllArms;
};

/// arm_x/shape, control -> all: backbone for drawing. tandem_msgs/Shape (unbounded sequence)
struct Shape {
  std::int64_t stamp = 0;
  std::string frame;
  std::vector<float> points;        ///< x y z per point, m, robot base frame
  std::vector<std::uint8_t> tubes;  ///< per point: outermost tube there, counts from 1
  std::vector<float> outer_radius;  ///< per point, m
};

enum class ReplyCode : std::uint16_t {
  kOk = 0,
  kMalformed,
  kNotLeaseHolder,
  kLeaseTaken,
  kWrongState,
  kOutsideLimits,
  kUnknown,
  kBusy,
  kFailed
};
enum class ControlKind : std::uint8_t {
  kAcquireLease = 1,
  kReleaseLease,
  kKeepLease,
  kStateCommand,
  kSetMethod,
  kSetParameter,
  kMoveJp,
  kJog,
  kHome,
  kHold,
  kWithdraw
};

}  // namespace tandem::dds
