// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "config/config.h"
#include "config/file_tables.h"

namespace tandem::config {
namespace {

using enum Quantity;
const std::vector<std::string> kMethods = [] {
  std::vector<std::string> names;
  for (int m = 0; m < control::kMethodCount; ++m)
    names.emplace_back(control::name(static_cast<control::Method>(m)));
  return names;
}();
constexpr const char* kIpv4 =
    "^((25[0-5]|2[0-4][0-9]|1[0-9][0-9]|[1-9]?[0-9])\\.){3}(25[0-5]|2[0-4][0-9]|1[0-9][0-9]|[1-9]?[0-9])$";
constexpr int kMostEntries = 1000;

Field kind(const std::string& value) {
  return text("tandem", "kind and version of the file; the first key").required().oneOf({value});
}

Field robotPath() {
  return text("robot", "robot file, relative to the folder of this file, or the name of a preset").required();
}

Field relativeGain(double value) {
  return number("relative_gain", kGain, "lambda_AB, of the relative position").above(0).defaultsTo(value);
}

Field tipGain(double value) {
  return number("tip_gain", kGain, "lambda_A, of the tip position").above(0).defaultsTo(value);
}

const Mapping& jointsTable() {
  static const Mapping table{"joints",
                             "Where one arm starts; tube 1 (innermost) first.",
                             {
                                 text("arm", "name of the arm in the robot file").required(),
                                 number("beta", kLength, "translations").required().list(2, 4),
                                 number("alpha", kAngle, "rotations").required().list(2, 4),
                             }};
  return table;
}

const Mapping& configurationTable() {
  static const Mapping table{
      "configuration",
      "A start configuration: every arm of the robot, inside its limits.",
      {
          text("name", "unique in the file").required().orInteger(),
          mapping("joints", jointsTable(), "one entry for every arm of the robot").required().list(1, safety::kMaxArms),
      }};
  return table;
}

const Mapping& experimentTrajectoryTable() {
  static const Mapping table = [] {
    Mapping trajectory{"experiment_trajectory", "A trajectory, and the configurations from which it is run.",
                       trajectoryFields()};
    trajectory.fields.push_back(text("configurations",
                                     "names of configurations; the same trajectory name may appear again "
                                     "with other parameters for others")
                                    .list(1, kMostEntries)
                                    .unique()
                                    .orInteger()
                                    .defaultNote("all"));
    return trajectory;
  }();
  return table;
}

const Mapping& errorsTable() {
  static const Mapping table{"errors",
                             "Published error figures.",
                             {
                                 number("rms", kLength, "root mean square").atLeast(0).defaultNote("not published"),
                                 number("std", kLength, "standard deviation").atLeast(0).defaultNote("not published"),
                                 number("max", kLength, "largest").atLeast(0).defaultNote("not published"),
                             }};
  return table;
}

const Mapping& publishedTable() {
  static const Mapping table{"published",
                             "A published row to stand beside the measured one.",
                             {
                                 text("trajectory", "name of one of the trajectories").required(),
                                 text("method", "name of the method").required().oneOf(kMethods),
                                 number("iterations", kNone, "control steps over the whole trajectory")
                                     .atLeast(0)
                                     .defaultNote("not published"),
                                 mapping("relative", errorsTable(), "epsilon_AB, of the relative position"),
                                 mapping("tip", errorsTable(), "epsilon_A, of the tip position"),
                             }};
  return table;
}

const Mapping& budgetsTable() {
  const safety::Budgets defaults;
  static const Mapping table{
      "budgets",
      "How long each party may be silent; a warning for values above the defaults, which need a reason in "
      "docs/safety.md.",
      {
          number("minimum_age", kTime, "floor of the age of a command or of a state")
              .above(0)
              .defaultsTo(defaults.minimum_age),
          number("age_periods", kNone, "the age in control periods, whichever is larger")
              .atLeast(1)
              .defaultsTo(defaults.age_periods),
          number("planning_reference", kTime, "age of planning's reference, judged by control")
              .above(0)
              .defaultsTo(defaults.planning_reference),
          number("teleoperation", kTime, "age of an operator's stream, judged by control")
              .above(0)
              .defaultsTo(defaults.teleoperation),
          number("tip_measurement", kTime,
                 "age of a measured tip, or so many control periods as age_periods says, judged by control")
              .above(0)
              .defaultsTo(defaults.tip_measurement),
          number("drive_heartbeat", kTime, "the drives' budget for hal's heartbeat")
              .above(0)
              .defaultsTo(defaults.drive_heartbeat),
          number("lease", kTime, "silence after which the control lease is lost").above(0).defaultsTo(defaults.lease),
      }};
  return table;
}

const Mapping& portTable() {
  static const Mapping table{
      "port",
      "A plate with a round hole that the arms come through, about the z axis of the robot base frame.",
      {
          number("radius", kLength, "of the hole").required().above(0),
          number("depth", kLength, "how far the hole's rim stands in front of the entry plane, into the body")
              .atLeast(0)
              .defaultsTo(0.0),
      }};
  return table;
}

const Mapping& processTable() {
  static const Mapping table{
      "process",
      "One process.",
      {
          text("name", "unique in the file")
              .required()
              .matching("^[a-z][a-z0-9_-]*$", "a name of small letters, digits, _ and -, a letter first"),
          text("executable", "name on the search path or beside tandem, or a path").required(),
          text("arguments", "appended to those that `tandem up` gives").list(0, 100).defaultNote("none"),
          flag("service", "false: a program that knows nothing of deployments; it gets its arguments alone")
              .defaultsTo(1.0),
          text("host", "the one of the hosts that it runs on").defaultNote("required with hosts"),
          flag("essential", "false: the others go on when it dies").defaultsTo(1.0),
      }};
  return table;
}

const Mapping& blackBoxTable() {
  const BlackBox defaults;
  static const Mapping table{
      "black_box",
      "What tandem-recorder keeps in memory, and writes as an MCAP file when an arm faults or is stopped.",
      {
          number("before", kTime, "how much is kept from before the fault").above(0).defaultsTo(defaults.before),
          number("after", kTime, "how much is added from after it").above(0).defaultsTo(defaults.after),
          integer("memory_mb", "megabytes that hold both").within(1, 65536).defaultsTo(defaults.memory),
          text("directory", "of the files, relative to the folder of this file").defaultNote("the user's state folder"),
          integer("files", "that are kept; the oldest ones are removed").within(1, 10000).defaultsTo(defaults.files),
          text("topics", "below the prefix; * stands for any text").list(1, 200).unique().defaultNote("all"),
      }};
  return table;
}

const Mapping& consoleTable() {
  const Console defaults;
  static const Mapping table{
      "console",
      "Where tandem-console serves browsers and tools, and whom (docs/foxglove.md). An address that others reach needs "
      "TLS "
      "and an operator_token.",
      {
          text("address", "that it is bound to").matching(kIpv4, "an IPv4 address").defaultsTo(defaults.address),
          integer("port", "TCP port of HTTP and WebSocket").within(1, 65535).defaultsTo(defaults.port),
          text("certificate", "file of the TLS certificate and its chain, PEM, relative to the folder of this file")
              .defaultNote("no TLS"),
          text("key", "file of its private key, PEM, relative likewise").defaultNote("no TLS"),
          text("operator_token", "file with a text; whoever shows it may command")
              .defaultNote("none: everybody on this machine may command"),
          text("viewer_token", "file with a text; whoever shows it may look, and stop")
              .defaultNote("none: nobody but operators"),
          text("origins", "of pages of others that may connect, as browsers name them")
              .matching("^https?://[A-Za-z0-9.-]+(:[0-9]+)?$", "SCHEME://HOST or SCHEME://HOST:PORT")
              .list(1, 50)
              .unique()
              .defaultNote("none but its own page"),
      }};
  return table;
}

const Mapping& discoveryTable() {
  static const Mapping table{
      "discovery",
      "The discovery server; `tandem up` starts it on the machine that has its address.",
      {
          text("server", "name of one of the hosts, or an IPv4 address of the machine that it runs on").required(),
          integer("port", "UDP port that it listens on").within(1024, 65535).defaultsTo(DiscoveryServer{}.port),
      }};
  return table;
}

const Mapping& hostTable() {
  static const Mapping table{
      "host",
      "One machine.",
      {
          text("name", "unique in the file")
              .required()
              .matching("^[a-z][a-z0-9_-]*$", "a name of small letters, digits, _ and -, a letter first"),
          text("address", "of its interface on the network that the hosts share")
              .required()
              .matching(kIpv4, "an IPv4 address"),
      }};
  return table;
}

}  // namespace

const Mapping& experimentTable() {
  const Experiment defaults;
  static const Mapping table{
      "experiment",
      "An experiment: trajectories run from start configurations by several methods.",
      {
          kind("experiment/1"),
          text("name", "name of the experiment").required(),
          robotPath(),
          text("methods", "methods to compare").required().oneOf(kMethods).list(1, control::kMethodCount).unique(),
          relativeGain(defaults.relative_gain),
          tipGain(defaults.tip_gain),
          mapping("configurations", configurationTable(), "start configurations").required().list(1, kMostEntries),
          mapping("trajectories", experimentTrajectoryTable(), "what is run").required().list(1, kMostEntries),
          mapping("published", publishedTable(), "published rows").list(0, kMostEntries).defaultNote("none"),
      }};
  return table;
}

const Mapping& deploymentTable() {
  const Deployment defaults;
  static const Mapping table{
      "deployment",
      "Which processes run a robot, on which network, and how fast.",
      {
          kind("deployment/1"),
          text("name", "name of the deployment").required(),
          robotPath(),
          text("hardware", "hardware file of tandem-hal, relative to the folder of this file, or a preset")
              .defaultNote("none"),
          text("prefix", "topic prefix, the robot's name on the wire: rt/PREFIX/...")
              .matching("^[a-z][a-z0-9_]*$", "a name of small letters, digits and _, a letter first")
              .defaultsTo(defaults.prefix),
          integer("domain", "DDS domain").within(0, 232).defaultsTo(defaults.domain),
          text("interface_address", "address of the only network interface used")
              .matching(kIpv4, "an IPv4 address")
              .defaultsTo(defaults.interface_address),
          text("peers", "addresses that discovery asks; there is no multicast")
              .matching(kIpv4, "an IPv4 address")
              .list(1, 64)
              .unique()
              .defaultNote("127.0.0.1"),
          mapping("hosts", hostTable(),
                  "the machines, instead of interface_address and peers; each finds itself by its address")
              .list(1, 16)
              .defaultNote("none: one machine"),
          text("security",
               "folder of credentials, relative to the folder of this file: everything is encrypted, and only who is "
               "certified takes part (docs/security.md)")
              .defaultNote("none: whoever is on the network can command the robot"),
          mapping("discovery", discoveryTable(), "a server that processes ask for one another, instead of all peers")
              .defaultNote("none: peers are asked"),
          text("clock", "absolute monotonic timer, or deterministic: state k, reference k, command k, state k + 1")
              .oneOf({"real_time", "lock_step"})
              .defaultsTo("real_time"),
          number("control_period", kTime, "period of control and planning")
              .above(0)
              .defaultsTo(defaults.control_period),
          number("sim_period", kTime, "period of plant and bus, not above control_period")
              .above(0)
              .defaultsTo(defaults.sim_period),
          number("sim_translation_acceleration", kAcceleration, "of the simulated joints in real time")
              .above(0)
              .orUnlimited()
              .defaultsTo(defaults.sim_translation_acceleration),
          number("sim_rotation_acceleration", kAngularAcceleration, "of the simulated joints in real time")
              .above(0)
              .orUnlimited()
              .defaultsTo(defaults.sim_rotation_acceleration),
          number("status_period", kTime, "of hal/status, control/status and the topics of each arm")
              .above(0)
              .defaultsTo(defaults.status_period),
          number("idle_power_off", kTime,
                 "after which an arm that has power and that nobody commands loses it, where its axes hold without; a "
                 "warning, again and again, where they do not")
              .above(0)
              .orUnlimited()
              .defaultsTo(defaults.idle_power_off),
          number("emergency_stop_topic", kTime,
                 "hal or sim listens to the topic emergency_stop, on which whoever reads the emergency stop says again "
                 "and "
                 "again whether it is pressed; a longer silence than this stops all arms, too")
              .within(0.01, 10)
              .defaultNote("it does not"),
          integer("realtime_priority", "SCHED_FIFO priority of the periodic threads; 0: default scheduling")
              .within(0, 99)
              .defaultsTo(defaults.realtime_priority),
          flag("lock_memory", "lock all memory pages").defaultsTo(defaults.lock_memory),
          mapping("budgets", budgetsTable(), "time budgets"),
          text("method", "method that control starts with")
              .oneOf(kMethods)
              .defaultsTo(std::string(control::name(defaults.method))),
          relativeGain(defaults.relative_gain),
          tipGain(defaults.tip_gain),
          text("model", "kinematic model that control and planning use")
              .oneOf({"rigid", "compliant"})
              .defaultsTo(defaults.model),
          text("feedback",
               "tips that errors are computed with: those of the model, or those that a tip tracker measures on "
               "sensing/tips")
              .oneOf({"model", "sensor"})
              .defaultsTo("model"),
          mapping("port", portTable(),
                  "the port that the arms come through: control publishes their distance to it, planning keeps them "
                  "off it")
              .defaultNote("none"),
          mapping("plant", plantTable(), "the simulated robot").defaultNote("ideal and rigid"),
          mapping("teleoperation", teleoperationTable(), "operators' devices and CRTK clients")
              .defaultNote("all defaults"),
          mapping("black_box", blackBoxTable(), "what tandem-recorder keeps for the case of a fault"),
          mapping("console", consoleTable(), "where tandem-console serves browsers and tools, and whom"),
          mapping("processes", processTable(), "what `tandem up` starts").required().list(1, 32),
      }};
  return table;
}

}  // namespace tandem::config
