// SPDX-License-Identifier: Apache-2.0
/** @file Computations that clients ask planning for. Joints of all arms stand one after the other here, arm after arm,
 * m and rad. */
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace tandem::dds {

enum class ComputationKind : std::uint8_t {
  kCheck = 1,
  kRepair,
  kInverseKinematics,
  kTime,
  kChooseStart,
  kCancel,
  kKeepAlive
};

/// One tip of a ComputationRequest. tandem_msgs/TipTarget
struct TipTarget {
  std::uint8_t arm = 0;
  std::uint8_t has_direction = 0;     ///< 1: the direction counts
  std::array<double, 3> position{};   ///< m, robot base frame
  std::array<double, 3> direction{};  ///< of the tool's z axis, robot base frame; of any length
};

/// planning/compute, clients -> planning. Zeros and empty lists are the defaults. tandem_msgs/ComputationRequest
struct ComputationRequest {
  std::uint64_t client = 0;
  std::uint64_t request = 0;      ///< chosen by the client; reply, progress and result carry it
  std::uint8_t kind = 0;          ///< ComputationKind
  std::uint64_t computation = 0;  ///< cancel, keep alive: the request that is meant
  std::string trajectory;         ///< all but inverse kinematics: the trajectory as YAML text
  std::vector<double> joints;     ///< start; empty: the robot's present ones
  std::vector<TipTarget> targets;
  double stability = 0.0;           ///< smallest one of compliant arms, 0 to 1
  std::uint8_t arms_may_touch = 0;  ///< 1: clearance does not count
  double clearance = 0.0;           ///< smallest distance between the arms' bodies, m
  double port_radius = 0.0;         ///< of the hole about the robot's z axis, m; 0: no port
  double port_depth = 0.0;          ///< m
  double accept = 0.0;              ///< m: points nearer than this are reached; 0: 10 um
  std::uint32_t starts = 0;         ///< random starts of a search; 0: 12
  std::uint64_t seed = 0;
  std::string rehearse;                   ///< check: method that the closed loop is rehearsed with; empty: it is not
  double smoothing = 0.0;                 ///< repair
  std::uint32_t tries = 0;                ///< choose a start: random references; 0: 20
  double translation_acceleration = 0.0;  ///< time: instead of the robot's, m/s^2; 0: the robot's
  double rotation_velocity = 0.0;         ///< time: likewise, rad/s
  double rotation_acceleration = 0.0;     ///< time: likewise, rad/s^2
  double time_limit = 0.0;                ///< s; 0: 600
};

/// planning/progress, planning -> clients. tandem_msgs/ComputationProgress
struct ComputationProgress {
  std::uint64_t client = 0;
  std::uint64_t request = 0;
  std::uint8_t kind = 0;
  double fraction = 0.0;  ///< 0 to 1; stays 0 where nobody can tell
  std::string at;         ///< what is counted: "point", "start", "round 2, point", "timing"
  std::uint32_t done = 0;
  std::uint32_t all = 0;  ///< 0: not counted
  double elapsed = 0.0;   ///< s
};

/// tandem_msgs/PointReport; planning::PointReport on the wire
struct PointReport {
  std::uint32_t point = 0;
  std::uint8_t reach = 0;  ///< planning::Reach
  std::string words;
  std::array<double, 3> wanted{}, wanted_relative{}, tip{}, relative{};  ///< m, robot base frame
  double error = 0.0, relative_error = 0.0;                              ///< m
  double stability = 1.0, clearance = 0.0;
  std::vector<double> joints;
};

/// tandem_msgs/TrajectoryReport; planning::FeasibilityReport on the wire
struct TrajectoryReport {
  std::uint8_t feasible = 0;
  std::string start;  ///< what is wrong with the start itself; empty if nothing
  std::uint8_t planar_start = 0;
  double rotation_conditioning = 0.0;  ///< m/rad
  std::vector<PointReport> points;
};

/// tandem_msgs/RehearsalReport; planning::Rehearsal on the wire
struct RehearsalReport {
  std::uint8_t end = 0;  ///< planning::RehearsalEnd
  std::uint32_t points = 0, converged = 0, point = 0;
  double tip_error = 0.0, relative_error = 0.0;  ///< m
  std::vector<std::string> held;
  std::string words;
  std::uint32_t iterations = 0;
  double largest_violation = 0.0, fastest_rotation = 0.0;
};

/// tandem_msgs/LimitReport
struct LimitReport {
  std::uint8_t arm = 0;
  std::string words;
  double force = 0.0;
};

/// tandem_msgs/IkReport; planning::IkAnswer on the wire
struct IkReport {
  std::uint8_t reach = 0;  ///< planning::Reach
  std::string words;
  std::vector<double> joints, tips, errors;
  std::vector<LimitReport> limits;
  double stability = 1.0, clearance = 0.0;
  std::uint32_t starts = 0, iterations = 0;
};

/// tandem_msgs/RepairReport
struct RepairReport {
  TrajectoryReport before;
  std::string trajectory;  ///< YAML text; empty where none was found
  std::uint32_t rounds = 0;
  double largest_change = 0.0, rms_change = 0.0;  ///< m
};

/// tandem_msgs/TimingReport
struct TimingReport {
  std::uint8_t status = 0;             ///< planning::TimingStatus
  std::vector<double> times;           ///< s, of the start and of each point
  std::vector<std::int32_t> limiting;  ///< joint that limits each piece; -1: an acceleration does
};

/// tandem_msgs/StartReport
struct StartReport {
  std::vector<double> joints;
  std::uint32_t unreachable = 0;
  double room = 0.0, mean_room = 0.0;
  std::uint8_t given = 0;
};

enum class Outcome : std::uint8_t {
  kGood = 0,   ///< feasible, reached, found
  kNot,        ///< not so, and the reports say why
  kCancelled,  ///< before its end
  kFailed      ///< reason says why
};
enum class CancelledBy : std::uint8_t { kNobody = 0, kClient, kSilence, kTimeLimit, kEnd };

/// planning/result, planning -> clients. tandem_msgs/ComputationResult
struct ComputationResult {
  std::uint64_t client = 0;
  std::uint64_t request = 0;
  std::uint8_t kind = 0;
  std::uint8_t outcome = 0;       ///< Outcome
  std::uint8_t cancelled_by = 0;  ///< CancelledBy
  std::string reason;             ///< for people; empty where good
  double elapsed = 0.0;           ///< s
  std::vector<double> start;      ///< joints that it started from
  TrajectoryReport report;        ///< check, time; repair: of the repaired trajectory
  std::uint8_t rehearsed = 0;     ///< 1: the two that follow count
  RehearsalReport with_posture, without_posture;
  RepairReport repair;
  IkReport ik;
  TimingReport timing;
  std::vector<StartReport> starts;  ///< the best first
};

}  // namespace tandem::dds
