// SPDX-License-Identifier: Apache-2.0
/** @file Structs and loaders of robot, experiment, deployment and hardware files.
 *
 * Files are YAML; every number that has a unit has it in its key (`outer_diameter_mm`), and this room is the only place
 * where units are converted. Every error is a config::Error that names file, line, column and key, what was found and
 * what was expected.
 */
#pragma once

#include <algorithm>
#include <filesystem>
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

/** Where and why a file is refused; what() is "FILE:LINE:COLUMN: KEY: MESSAGE" (1-based; 0:0 where no place applies).
 */
class Error : public std::runtime_error {
 public:
  Error(std::string file, int line, int column, std::string key, const std::string& message);
  const std::string& file() const { return file_; }
  int line() const { return line_; }
  int column() const { return column_; }
  const std::string& key() const { return key_; }

 private:
  std::string file_;
  int line_;
  int column_;
  std::string key_;
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

/** Values of a robot file that only its type has; each loader derives its own. */
struct TypeData {
  virtual ~TypeData() = default;
};

/** A robot file of any type. */
struct Robot {
  std::string name;
  std::string type = "robot";  ///< kind of the file; see config/robot_files.h
  bool hardware = false;       ///< refused without finite rotation limits
  std::vector<Arm> arms;
  control::MethodParameters parameters;  ///< defaults for this robot
  std::vector<std::string> warnings;     ///< "FILE:LINE:COLUMN: KEY: ...", e.g. Poisson's ratio above 0.5
  std::filesystem::path file;
  std::shared_ptr<const TypeData> data;  ///< null where `arms` has everything
};

/** A start configuration of an experiment: joint vectors of all arms in the robot's order, m and rad. */
struct Configuration {
  std::string name;  ///< "1", "2", "3" in Table 2
  std::vector<Eigen::VectorXd> joints;
};

/** One published figure to stand beside ours (a row of Table 3), m. NaN where not published. */
struct PublishedRow {
  std::string trajectory;
  std::string method;
  double iterations = 0.0;
  double rms_ab = 0.0, std_ab = 0.0, max_ab = 0.0;
  double rms_a = 0.0, std_a = 0.0, max_a = 0.0;
};

/** A trajectory that is run from certain configurations. */
struct ExperimentTrajectory {
  planning::TrajectorySpec spec;
  std::vector<std::string> configurations;  ///< names; the same shape name may appear with other parameters for others
};

/** An experiment file. */
struct Experiment {
  std::string name;
  std::filesystem::path robot;  ///< resolved against the experiment file's folder
  std::vector<Configuration> configurations;
  std::vector<ExperimentTrajectory> trajectories;
  std::vector<control::Method> methods;
  std::filesystem::path method_library;  ///< of Method::kForeign, resolved likewise; empty: none
  double relative_gain = 5.0;            ///< lambda_AB, 1/s
  double tip_gain = 3.0;                 ///< lambda_A, 1/s
  std::vector<PublishedRow> published;
  std::filesystem::path file;
};

/** A machine of a deployment that spreads over several. */
struct Host {
  std::string name;     ///< robot, console
  std::string address;  ///< IPv4, of its interface on the network that they share
};

/** Where the discovery server of a deployment listens. */
struct DiscoveryServer {
  std::string address;  ///< IPv4
  int port = 11811;     ///< UDP
};

/** One process of a deployment. */
struct Process {
  std::string name;                    ///< sim, control, planning
  std::string executable;              ///< tandem-sim ...
  std::vector<std::string> arguments;  ///< appended to those that tandem up gives
  bool is_service = true;              ///< takes --deployment and --log
  std::string host;                    ///< where it runs; empty without hosts
  bool essential = true;               ///< its death ends the deployment
};

/** What tandem-recorder keeps in memory, and where it writes it when an arm faults. */
struct BlackBox {
  double before = 30.0;                  ///< s before the fault
  double after = 3.0;                    ///< s behind it
  int memory = 128;                      ///< MB that hold them
  std::filesystem::path directory;       ///< of the files; empty: of the user who runs it, see docs/recording.md
  int files = 20;                        ///< that are kept; the oldest ones go
  std::vector<std::string> topics{"*"};  ///< below the prefix; * stands for any text
};

/** Where tandem-console serves browsers and tools, and whom. */
struct Console {
  std::string address = "127.0.0.1";       ///< IPv4 that it is bound to; one that others reach needs all of the below
  int port = 8765;                         ///< TCP, of HTTP and WebSocket
  std::filesystem::path certificate, key;  ///< PEM, of TLS; empty: none
  std::filesystem::path operator_token;    ///< file; whoever shows its text may command; empty: everybody may
  std::filesystem::path viewer_token;      ///< file; whoever shows its text may look and stop; empty: nobody else
  std::vector<std::string> origins;        ///< of pages of others that may connect: "https://tools.example:8080"

  bool loopback() const { return address.starts_with("127."); }
  bool tls() const { return !certificate.empty(); }
};

/** CRTK commands of clients that know no lease. */
struct Crtk {
  bool commands = true;  ///< false: no command topics exist
  /// Names of DDS participants that may command; "*": all; empty: as without commands.
  std::vector<std::string> clients;
  bool by_arrival = true;          ///< age: how much later than the quickest of its stream; otherwise by wall clocks
  double tip_step = 2e-3;          ///< largest step of a target by servo_cp and servo_cr, m
  double translation_step = 1e-3;  ///< likewise by servo_jp and servo_jr, m
  double rotation_step = 0.05;     ///< likewise, rad
  double acceleration = 20e-3;     ///< of targets by interpolate and move, m/s^2

  bool admitsAll() const { return std::ranges::find(clients, "*") != clients.end(); }
  bool admitsNone() const { return !commands || clients.empty(); }
};

/** How operators and CRTK clients move tips. */
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
  std::filesystem::path hardware;               ///< hardware file of tandem-hal, resolved likewise; empty: none
  std::string prefix = "tandem";                ///< topic prefix, the robot's name on the wire: rt/<prefix>/...
  int domain = 0;                               ///< DDS domain, 0..232
  std::string interface_address = "127.0.0.1";  ///< the only interface used; without hosts
  std::vector<std::string> peers{"127.0.0.1"};  ///< initial peers, no multicast; without hosts
  std::vector<Host> hosts;                      ///< empty: everything runs on one machine
  std::filesystem::path security;            ///< folder of credentials, resolved likewise; empty: nothing is protected
  std::optional<DiscoveryServer> discovery;  ///< instead of asking peers; none: peers
  ClockMode clock = ClockMode::kRealTime;
  double control_period = 0.1;                               ///< s
  double sim_period = 1e-3;                                  ///< s, plant and bus period
  double sim_translation_acceleration = safety::kUnlimited;  ///< of the simulated joints in real time, m/s^2
  double sim_rotation_acceleration = safety::kUnlimited;     ///< rad/s^2
  double status_period = 0.05;                               ///< s, of hal/status, control/status to people, arm_x/...
  double idle_power_off = 60.0;  ///< s after which an arm that nobody commands loses its power, where it holds without
  double emergency_stop_budget = 0.0;  ///< s between reports on topic emergency_stop; 0: it is not asked
  int realtime_priority = 0;           ///< SCHED_FIFO priority of the periodic threads, 0 = default scheduling
  bool lock_memory = false;
  int memory_limit = 2048;  ///< of each service, MB; 0: none
  safety::Budgets budgets;
  control::Method method = control::Method::kNspqp;
  std::filesystem::path method_library;  ///< of Method::kForeign, resolved likewise; empty: none
  double relative_gain = 5.0;            ///< lambda_AB, 1/s
  double tip_gain = 3.0;                 ///< lambda_A, 1/s
  std::string model = "rigid";           ///< kinematic model of control and planning: "rigid" or "compliant"
  planning::Feedback feedback = planning::Feedback::kModel;
  std::optional<kinematics::Port> port;  ///< that the arms come through; its distance is published and kept by plans
  sim::PlantOptions plant;               ///< of the simulated robot
  Teleoperation teleoperation;
  BlackBox black_box;
  Console console;
  std::vector<Process> processes;
  std::vector<std::string> warnings;  ///< "FILE:LINE:COLUMN: KEY: ...", e.g. a budget above its default
  /// All that motion depends on, of this file, the robot's and the hardware's (config/values.h).
  std::string values;
  std::filesystem::path file;
};

Robot loadRobot(const std::filesystem::path& file);
Experiment loadExperiment(const std::filesystem::path& file);
Deployment loadDeployment(const std::filesystem::path& file);

/// The one of the deployment's hosts that has one of these addresses; null where none has, or there are no hosts.
const Host* hostAmong(const Deployment& deployment, const std::set<std::string>& addresses);

/** A hardware file, checked against its robot and against the load limits of its buses.
 * @param heartbeat_budget time-out of the drives for the HAL's heartbeat (Budgets::drive_heartbeat), s: part of the bus
 * load
 * @param refuse_overload false: a bus beyond its load limit is let through, for the calculator. */
hal::HardwareConfig loadHardware(const std::filesystem::path& file,
                                 double heartbeat_budget = safety::Budgets{}.drive_heartbeat,
                                 bool refuse_overload = true);

/** A trajectory given as YAML text (planning/request, `tandem run`), `origin` names it in errors. CSV paths are
 * relative to `folder`; an empty folder refuses them, as texts from the wire must not name files. */
planning::TrajectorySpec parseTrajectory(const std::string& yaml,
                                         const std::string& origin,
                                         const std::filesystem::path& folder);

/** A trajectory file; CSV paths are relative to its folder. */
planning::TrajectorySpec loadTrajectory(const std::filesystem::path& file);

/** A trajectory as YAML text in SI units that parseTrajectory reads back, without references to other files: what
 * planning/request carries. */
std::string formatTrajectory(const planning::TrajectorySpec& spec);

/** What kind of file it is by its first key (`tandem: robot/1`), fully loaded and checked, as one line for people.
 * @throw Error as the loaders do. */
struct Summary {
  std::string kind;  ///< robot, experiment, deployment, trajectory, hardware
  std::string text;
  std::vector<std::string> warnings;
};
Summary validate(const std::filesystem::path& file);

/// All presets of a kind, by name; of two with the same name the one that findFile() finds.
std::vector<std::filesystem::path> presets(const std::string& kind);

/// A folder or file of what is installed beside the executable (../share/tandem/INSTALLED) or, from a build tree, lies
/// in it or its source tree (SOURCE). Empty where there is none.
std::filesystem::path findShared(const std::string& installed, const std::vector<std::string>& in_trees);

/** Finds a preset by bare name ("ark2024"): as a path if it is one, else in the folders given by TANDEM_CONFIG_PATH
 * (colon-separated), else beside the executable or module (../share/tandem), else, from a build tree, in its source
 * tree.
 * @param kind one or several of kinds(), with | between them, or empty for any
 * @throw Error that lists the presets there are. */
std::filesystem::path findFile(const std::string& name_or_path, const std::string& kind);

}  // namespace tandem::config
