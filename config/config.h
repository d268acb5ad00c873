// SPDX-License-Identifier: Apache-2.0
/** @file Structs and loaders of robot, experiment, deployment, trajectory and hardware files.
 *
 * Files are YAML; every number with a unit has it in its key (`outer_diameter_mm`), and only this room converts units.
 * Every error is a config::Error that names file, line, column and key, what was found and what was expected.
 */
#pragma once

#include <algorithm>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "control/parameters.h"
#include "hal/hardware.h"
#include "kinematics/clearance.h"
#include "kinematics/concentric_tube.h"
#include "planning/teleoperation/pipeline.h"
#include "planning/tips.h"
#include "planning/trajectory.h"
#include "safety/budgets.h"
#include "safety/limits.h"
#include "sim/plant_options.h"

namespace tandem::config {

/** Refusal of a file; what() is "FILE:LINE:COLUMN: KEY: MESSAGE" (1-based; 0:0 without a location), one line for each
 * error of the file, in its order. The other members are those of the first. */
class Error : public std::runtime_error {
 public:
  Error(std::string file, int line, int column, std::string key, const std::string& message);
  /// All errors of a file. @param errors  at least one
  explicit Error(std::vector<Error> errors);
  const std::string& file() const { return file_; }
  int line() const { return line_; }
  int column() const { return column_; }
  const std::string& key() const { return key_; }
  /// Each error of the file on its own.
  std::vector<Error> all() const;

 private:
  Error(const std::vector<Error>& sorted, std::nullptr_t);

  std::string file_;
  int line_;
  int column_;
  std::string key_;
  std::shared_ptr<const std::vector<Error>> all_ = nullptr;  ///< null: this one alone
};

/** One arm of a robot file. */
struct Arm {
  std::string name;                      ///< topic name, e.g. arm_a
  std::vector<std::string> joint_names;  ///< beta_1, ...
  kinematics::ConcentricTubeArm model;   ///< concentric tubes only; without tubes for other types
  safety::ArmLimits limits;
  Eigen::VectorXd home;  ///< joint vector, m and rad, inside the limits

  int jointCount() const { return limits.jointCount(); }
};

/** Type-specific values of a robot file; each loader derives its own. */
struct TypeData {
  virtual ~TypeData() = default;
};

/** A robot file of any type. */
struct Robot {
  std::string name;
  std::string type = "robot";  ///< robot type; see config/robot_files.h
  bool hardware = false;       ///< for real hardware: finite rotation limits required
  std::vector<Arm> arms;
  control::MethodParameters parameters;  ///< defaults for this robot
  std::vector<std::string> warnings;     ///< "FILE:LINE:COLUMN: KEY: ...", e.g. Poisson's ratio above 0.5
  std::filesystem::path file;
  std::shared_ptr<const TypeData> data;  ///< null if `arms` is complete
};

/** Start configuration of an experiment: joint vectors of all arms in the robot's order, m and rad. */
struct Configuration {
  std::string name;  ///< "1", "2", "3" in Table 2
  std::vector<Eigen::VectorXd> joints;
};

/** Published result for comparison (a row of Table 3), m. NaN: not published. */
struct PublishedRow {
  std::string trajectory;
  std::string method;
  double iterations = 0.0;
  double rms_ab = 0.0, std_ab = 0.0, max_ab = 0.0;
  double rms_a = 0.0, std_a = 0.0, max_a = 0.0;
};

/** Trajectory that is run from certain configurations. */
struct ExperimentTrajectory {
  planning::TrajectorySpec spec;
  std::vector<std::string> configurations;  ///< names; a shape name may have other parameters for others
};

/** An experiment file. */
struct Experiment {
  std::string name;
  std::filesystem::path robot;  ///< resolved against the experiment file's folder
  std::vector<Configuration> configurations;
  std::vector<ExperimentTrajectory> trajectories;
  std::vector<control::Method> methods;
  std::filesystem::path method_library;  ///< of Method::kForeign, resolved in the same way; empty: none
  double relative_gain = 5.0;            ///< lambda_AB, 1/s
  double tip_gain = 3.0;                 ///< lambda_A, 1/s
  std::vector<PublishedRow> published;
  std::filesystem::path file;
};

/** Host of a deployment on several machines. */
struct Host {
  std::string name;     ///< robot, console
  std::string address;  ///< IPv4 address of its interface on the common network
};

/** Address of a deployment's discovery server. */
struct DiscoveryServer {
  std::string address;  ///< IPv4
  int port = 11811;     ///< UDP
};

/** One process of a deployment. */
struct Process {
  std::string name;                    ///< sim, control, planning
  std::string executable;              ///< tandem-sim ...
  std::vector<std::string> arguments;  ///< appended to those of tandem up
  bool is_service = true;              ///< takes --deployment and --log
  std::string host;                    ///< host that runs it; empty without hosts
  bool essential = true;               ///< its end ends the deployment
};

/** Black box: memory and files of tandem-recorder for the time around a fault. */
struct BlackBox {
  double before = 30.0;                  ///< s before the fault
  double after = 3.0;                    ///< s after the fault
  int memory = 128;                      ///< MB reserved for it
  std::filesystem::path directory;       ///< of the files; empty: that of the user, see docs/recording.md
  int files = 20;                        ///< number of files kept; the oldest ones are deleted
  std::vector<std::string> topics{"*"};  ///< without the prefix; * matches any text
};

/** Addresses, TLS and access rights of tandem-console. */
struct Console {
  std::string address = "127.0.0.1";  ///< IPv4 to bind to; except for loopback, TLS and operator_token are required
  int port = 8765;                    ///< TCP, of HTTP and WebSocket
  std::filesystem::path certificate, key;  ///< PEM, of TLS; empty: none
  std::filesystem::path operator_token;    ///< file with the token of clients that may command; empty: all may
  std::filesystem::path viewer_token;      ///< file with the token of clients that may view and stop; empty: no others
  std::vector<std::string> origins;        ///< origins of foreign pages that may connect: "https://tools.example:8080"

  bool loopback() const { return address.starts_with("127."); }
  bool tls() const { return !certificate.empty(); }
};

/** Commands of CRTK clients, which have no lease. */
struct Crtk {
  bool commands = true;  ///< false: there are no command topics
  /// Names of DDS participants that may command; "*": all; empty: as with commands = false.
  std::vector<std::string> clients;
  bool by_arrival = true;             ///< age relative to the fastest sample of the stream; false: by wall clocks
  double tip_step = 2e-3;             ///< largest step of a target of servo_cp and servo_cr, m
  double tip_rotation_step = 0.1;     ///< the same of its orientation, rad
  double translation_step = 1e-3;     ///< the same for servo_jp and servo_jr, m
  double rotation_step = 0.05;        ///< the same, rad
  double acceleration = 20e-3;        ///< of targets of interpolate and move, m/s^2
  double angular_acceleration = 1.0;  ///< the same of their orientations, rad/s^2

  bool admitsAll() const { return std::ranges::find(clients, "*") != clients.end(); }
  bool admitsNone() const { return !commands || clients.empty(); }
};

/** Motion of tips by operators and CRTK clients. */
struct Teleoperation {
  planning::teleoperation::Options options;
  Crtk crtk;
};

enum class ClockMode {
  kRealTime,  ///< periodic on an absolute monotonic timer
  kLockStep,  ///< deterministic: state k, reference k, command k, state k+1
};

/** A deployment file. */
struct Deployment {
  std::string name;
  std::filesystem::path robot;                  ///< resolved against the deployment file's folder
  std::filesystem::path hardware;               ///< hardware file of tandem-hal, resolved in the same way; empty: none
  std::string prefix = "tandem";                ///< topic prefix, the robot's name on the wire: rt/<prefix>/...
  int domain = 0;                               ///< DDS domain, 0..232
  std::string interface_address = "127.0.0.1";  ///< the only interface used; without hosts
  std::vector<std::string> peers{"127.0.0.1"};  ///< initial peers, no multicast; without hosts
  std::vector<Host> hosts;                      ///< empty: everything runs on one machine
  std::filesystem::path security;               ///< folder of credentials, resolved in the same way; empty: no security
  std::optional<DiscoveryServer> discovery;     ///< instead of initial peers; none: peers
  ClockMode clock = ClockMode::kRealTime;
  double control_period = 0.1;                               ///< s
  double sim_period = 1e-3;                                  ///< s, plant and bus period
  double sim_translation_acceleration = safety::kUnlimited;  ///< of the simulated joints in real time, m/s^2
  double sim_rotation_acceleration = safety::kUnlimited;     ///< rad/s^2
  double status_period = 0.05;   ///< s, of hal/status, control/status for displays, arm_x/...
  double idle_power_off = 60.0;  ///< s without commands until power goes off, if the arm keeps its position without
  double least_clearance = -std::numeric_limits<double>::infinity();  ///< of bodies, m, else moving arms stop
  double emergency_stop_budget = 0.0;  ///< longest time between reports on topic emergency_stop, s; 0: no such reports
  int realtime_priority = 0;           ///< SCHED_FIFO priority of the periodic threads, 0 = default scheduling
  bool lock_memory = false;
  int memory_limit = 2048;  ///< of each service, MB; 0: none
  safety::Budgets budgets;
  control::Method method = control::Method::kNspqp;
  std::filesystem::path method_library;  ///< of Method::kForeign, resolved in the same way; empty: none
  double relative_gain = 5.0;            ///< lambda_AB, 1/s
  double tip_gain = 3.0;                 ///< lambda_A, 1/s
  std::string model = "rigid";           ///< kinematic model of control and planning: "rigid" or "compliant"
  planning::Feedback feedback = planning::Feedback::kModel;              ///< of tip positions
  planning::Feedback orientation_feedback = planning::Feedback::kModel;  ///< of tip orientations
  std::optional<kinematics::Port> port;  ///< common port of the arms; its clearance is published and limits plans
  sim::PlantOptions plant;               ///< of the simulated robot
  Teleoperation teleoperation;
  BlackBox black_box;
  std::filesystem::path cycle_log;  ///< folder of a file per process with a line per cycle; empty: none
  Console console;
  std::vector<Process> processes;
  std::vector<std::string> warnings;  ///< "FILE:LINE:COLUMN: KEY: ...", e.g. a budget above its default
  /// All values that motion depends on, of this file, the robot's and the hardware's (config/values.h).
  std::string values;
  std::filesystem::path file;
};

Robot loadRobot(const std::filesystem::path& file);
Experiment loadExperiment(const std::filesystem::path& file);
Deployment loadDeployment(const std::filesystem::path& file);

/// Host of the deployment with one of these addresses; null: none, or no hosts.
const Host* hostAmong(const Deployment& deployment, const std::set<std::string>& addresses);

/** Loads a hardware file and checks it against its robot and the load limits of its buses.
 * @param heartbeat_budget time-out of the drives for the HAL's heartbeat (Budgets::drive_heartbeat), s: part of the bus
 * load
 * @param refuse_overload false: accepts a bus above its load limit, for the load computation. */
hal::HardwareConfig loadHardware(const std::filesystem::path& file,
                                 double heartbeat_budget = safety::Budgets{}.drive_heartbeat,
                                 bool refuse_overload = true);

/** Parses a trajectory in YAML (planning/request, `tandem run`); `origin` names the text in errors. CSV paths are
 * relative to `folder`; an empty folder refuses them, because texts from the network must not name files. */
planning::TrajectorySpec parseTrajectory(const std::string& yaml,
                                         const std::string& origin,
                                         const std::filesystem::path& folder);

/** Loads a trajectory file; CSV paths are relative to its folder. */
planning::TrajectorySpec loadTrajectory(const std::filesystem::path& file);

/** Parses the plant of a deployment: a YAML text with the keys below `plant`; `origin` names the text in errors. */
sim::PlantOptions parsePlant(const std::string& yaml, const std::string& origin, const Robot& robot);

/** Trajectory as YAML text in SI units for parseTrajectory(), without references to other files: the content of
 * planning/request. */
std::string formatTrajectory(const planning::TrajectorySpec& spec);

/** Kind of a file by its first key (`tandem: robot/1`), loaded and checked completely, and a line that describes it.
 * @throw Error as the loaders do. */
struct Summary {
  std::string kind;  ///< robot, experiment, deployment, trajectory, hardware
  std::string text;
  std::vector<std::string> warnings;
};
Summary validate(const std::filesystem::path& file);

/// All presets of a kind, by name; of two with the same name, the one that findFile() finds.
std::vector<std::filesystem::path> presets(const std::string& kind);

/// Installed folder or file beside the executable (../share/tandem/INSTALLED), or, in a build tree, in it or its source
/// tree (SOURCE). Empty: not found.
std::filesystem::path findShared(const std::string& installed, const std::vector<std::string>& in_trees);

/** Finds a file by path, or a preset by its name ("ark2024"): in the folders of TANDEM_CONFIG_PATH (colon-separated),
 * else beside the executable or module (../share/tandem), else, in a build tree, in its source tree.
 * @param kind one or several of kinds(), separated by |, or empty for any
 * @throw Error that lists the available presets. */
std::filesystem::path findFile(const std::string& name_or_path, const std::string& kind);

}  // namespace tandem::config
