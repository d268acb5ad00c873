// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "config/bind.h"
#include "config/file_tables.h"
#include "control/method_names.h"

namespace tandem::config {
namespace {

using enum Quantity;
constexpr const char* kIpv4 =
    "^((25[0-5]|2[0-4][0-9]|1[0-9][0-9]|[1-9]?[0-9])\\.){3}(25[0-5]|2[0-4][0-9]|1[0-9][0-9]|[1-9]?[0-9])$";
constexpr int kMostEntries = 1000;
constexpr double kLongestTime = 86400.0;                          // s, of what may pass unnoticed
constexpr double kShortestPeriod = 10e-6, kLongestPeriod = 60.0;  // s, of a periodic loop

template <class Owner>
Field relativeGain() {
  return positive("relative_gain", kGain, "lambda_AB, of the relative position", &Owner::relative_gain);
}

template <class Owner>
Field tipGain() {
  return positive("tip_gain", kGain, "lambda_A, of the tip position", &Owner::tip_gain);
}

/// What processes and hosts are called.
template <class Owner>
Field nameField() {
  return text("name", "unique in the file", &Owner::name)
      .required()
      .matching("^[a-z][a-z0-9_-]*$", "a name of small letters, digits, _ and -, a letter first");
}

const Mapping kJointsTable{"joints",
                           "Where one arm starts; tube 1 (innermost) first.",
                           {
                               text("arm", "name of the arm in the robot file").required(),
                               number("beta", kLength, "translations").required().list(2, 4),
                               number("alpha", kAngle, "rotations").required().list(2, 4),
                           }};

const Mapping kConfigurationTable{"configuration",
                                  "A start configuration: every arm of the robot, inside its limits.",
                                  {
                                      text("name", "unique in the file", &Configuration::name).required().orInteger(),
                                      mapping("joints", kJointsTable, "one entry for every arm of the robot")
                                          .list(1, safety::kMaxArms)
                                          .defaultNote("home"),
                                  }};

const Mapping kExperimentTrajectoryTable = [] {
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

const Mapping kErrorsTable{"errors",
                           "Published error figures.",
                           {
                               notNegative("rms", kLength, "root mean square").defaultNote("not published"),
                               notNegative("std", kLength, "standard deviation").defaultNote("not published"),
                               notNegative("max", kLength, "largest").defaultNote("not published"),
                           }};

const Mapping kPublishedTable{
    "published",
    "A published row to stand beside the measured one.",
    {
        text("trajectory", "name of one of the trajectories", &PublishedRow::trajectory).required(),
        text("method", "name of the method", &PublishedRow::method).required().oneOf(control::methodNames()),
        notNegative("iterations", kNone, "control steps over the whole trajectory").defaultNote("not published"),
        mapping("relative", kErrorsTable, "epsilon_AB, of the relative position"),
        mapping("tip", kErrorsTable, "epsilon_A, of the tip position"),
    }};

const Mapping& budgetsTable() {
  using B = safety::Budgets;
  static const Mapping table{
      "budgets",
      "How long each party may be silent; a warning for values above the defaults, which need a reason in "
      "docs/safety.md.",
      {
          positive("minimum_age", kTime, "floor of the age of a command or of a state", &B::minimum_age)
              .atMost(kLongestTime),
          number("age_periods", kNone, "the age in control periods, whichever is larger", &B::age_periods)
              .within(1, 1e6),
          positive("planning_reference", kTime, "age of planning's reference, judged by control",
                   &B::planning_reference)
              .atMost(kLongestTime),
          positive("teleoperation", kTime, "age of an operator's stream, judged by control", &B::teleoperation)
              .atMost(kLongestTime),
          positive("tip_measurement", kTime,
                   "age of a measured tip, or so many control periods as age_periods says, judged by control",
                   &B::tip_measurement)
              .atMost(kLongestTime),
          number("drive_heartbeat", kTime, "the drives' budget for hal's heartbeat", &B::drive_heartbeat)
              .within(1e-3, 60),
          positive("lease", kTime, "silence after which the control lease is lost", &B::lease).atMost(kLongestTime),
          number(
              "lost_samples", kNone,
              "share of the last 100 states, of the last 100 commands and of the last 100 frames of a drive that may "
              "be lost, or as many as one silence of the greatest age holds; 1: any",
              &B::lost_samples)
              .within(0, 1),
          positive("lock_step", kTime,
                   "in lock-step: silence after which a run is given up; nothing else is judged by the clock",
                   &B::lock_step)
              .atMost(kLongestTime),
      }};
  return table;
}

const Mapping kPortTable{
    "port",
    "A plate with a round hole that the arms come through, about the z axis of the robot base frame.",
    {
        positive("radius", kLength, "of the hole", &kinematics::Port::radius).required(),
        notNegative("depth",
                    kLength,
                    "how far the hole's rim stands in front of the entry plane, into the body",
                    &kinematics::Port::depth),
    }};

const Mapping kProcessTable{
    "process",
    "One process.",
    {
        nameField<Process>(),
        text("executable", "name on the search path or beside tandem, or a path", &Process::executable).required(),
        text("arguments", "appended to those that `tandem up` gives", &Process::arguments)
            .list(0, 100)
            .defaultNote("none"),
        flag("service",
             "false: a program that knows nothing of deployments; it gets its arguments alone",
             &Process::is_service),
        text("host", "the one of the hosts that it runs on", &Process::host).defaultNote("required with hosts"),
        flag("essential", "false: the others go on when it dies", &Process::essential),
    }};

const Mapping kBlackBoxTable{
    "black_box",
    "What tandem-recorder keeps in memory, and writes as an MCAP file when an arm faults or is stopped.",
    {
        positive("before", kTime, "how much is kept from before the fault", &BlackBox::before).atMost(kLongestTime),
        positive("after", kTime, "how much is added from after it", &BlackBox::after).atMost(kLongestTime),
        integer("memory_mb", "megabytes that hold both", &BlackBox::memory).within(1, 65536),
        text("directory", "of the files, relative to the folder of this file", &BlackBox::directory)
            .defaultNote("the user's state folder"),
        integer("files", "that are kept; the oldest ones are removed", &BlackBox::files).within(1, 10000),
        text("topics", "below the prefix; * stands for any text", &BlackBox::topics)
            .list(1, 200)
            .unique()
            .defaultNote("all"),
    }};

const Mapping kConsoleTable{
    "console",
    "Where tandem-console serves browsers and tools, and whom (docs/foxglove.md). An address that others reach needs "
    "TLS "
    "and an operator_token.",
    {
        text("address", "that it is bound to", &Console::address).matching(kIpv4, "an IPv4 address"),
        integer("port", "TCP port of HTTP and WebSocket", &Console::port).within(1, 65535),
        text("certificate",
             "file of the TLS certificate and its chain, PEM, relative to the folder of this file",
             &Console::certificate)
            .defaultNote("no TLS"),
        text("key", "file of its private key, PEM, relative likewise", &Console::key).defaultNote("no TLS"),
        text("operator_token", "file with a text; whoever shows it may command", &Console::operator_token)
            .defaultNote("none: everybody on this machine may command"),
        text("viewer_token", "file with a text; whoever shows it may look, and stop", &Console::viewer_token)
            .defaultNote("none: nobody but operators"),
        text("origins", "of pages of others that may connect, as browsers name them", &Console::origins)
            .matching("^https?://[A-Za-z0-9.-]+(:[0-9]+)?$", "SCHEME://HOST or SCHEME://HOST:PORT")
            .list(1, 50)
            .unique()
            .defaultNote("none but its own page"),
    }};

const Mapping kDiscoveryTable{
    "discovery",
    "The discovery server; `tandem up` starts it on the machine that has its address.",
    {
        text("server",
             "name of one of the hosts, or an IPv4 address of the machine that it runs on",
             &DiscoveryServer::address)
            .required(),
        integer("port", "UDP port that it listens on", &DiscoveryServer::port).within(1024, 65535),
    }};

const Mapping kHostTable{"host",
                         "One machine.",
                         {
                             nameField<Host>(),
                             text("address", "of its interface on the network that the hosts share", &Host::address)
                                 .required()
                                 .matching(kIpv4, "an IPv4 address"),
                         }};

}  // namespace

const Mapping& experimentTable() {
  static const Mapping table{
      "experiment",
      "An experiment: trajectories run from start configurations by several methods.",
      {
          kindField("experiment"),
          text("name", "name of the experiment", &Experiment::name).required(),
          robotField(),
          text("methods", "methods to compare", allOf<control::Method>(), &Experiment::methods)
              .required()
              .list(1, control::kMethodCount)
              .unique(),
          relativeGain<Experiment>(),
          tipGain<Experiment>(),
          mapping("configurations", kConfigurationTable, "start configurations").required().list(1, kMostEntries),
          mapping("trajectories", kExperimentTrajectoryTable, "what is run").required().list(1, kMostEntries),
          mapping("published", kPublishedTable, "published rows").list(0, kMostEntries).defaultNote("none"),
      }};
  return table;
}

const Mapping& deploymentTable() {
  using D = Deployment;
  using planning::Feedback;
  static const Mapping table{
      "deployment",
      "Which processes run a robot, on which network, and how fast.",
      {
          kindField("deployment"),
          text("name", "name of the deployment", &D::name).required().withoutMotion(),
          robotField(),
          text("hardware", "hardware file of tandem-hal, relative to the folder of this file, or a preset")
              .defaultNote("none")
              .withoutMotion(),
          text("prefix", "topic prefix, the robot's name on the wire: rt/PREFIX/...", &D::prefix)
              .matching("^[a-z][a-z0-9_]*$", "a name of small letters, digits and _, a letter first")
              .withoutMotion(),
          integer("domain", "DDS domain", &D::domain).within(0, 232).withoutMotion(),
          text("interface_address", "address of the only network interface used", &D::interface_address)
              .matching(kIpv4, "an IPv4 address")
              .withoutMotion(),
          text("peers", "addresses that discovery asks; there is no multicast", &D::peers)
              .matching(kIpv4, "an IPv4 address")
              .list(1, 64)
              .unique()
              .defaultNote("127.0.0.1")
              .withoutMotion(),
          mapping("hosts", kHostTable,
                  "the machines, instead of interface_address and peers; each finds itself by its address", &D::hosts)
              .list(1, 16)
              .defaultNote("none: one machine")
              .withoutMotion(),
          text("security",
               "folder of credentials, relative to the folder of this file: everything is encrypted, and only who is "
               "certified takes part (docs/security.md)")
              .defaultNote("none: whoever is on the network can command the robot")
              .withoutMotion(),
          mapping("discovery", kDiscoveryTable, "a server that processes ask for one another, instead of all peers",
                  &D::discovery)
              .defaultNote("none: peers are asked")
              .withoutMotion(),
          text("clock", "absolute monotonic timer, or deterministic: state k, reference k, command k, state k + 1",
               {{"real_time", ClockMode::kRealTime}, {"lock_step", ClockMode::kLockStep}}, &D::clock),
          number("control_period", kTime, "period of control and planning", &D::control_period)
              .within(kShortestPeriod, kLongestPeriod),
          number("sim_period", kTime, "period of plant and bus, not above control_period", &D::sim_period)
              .within(kShortestPeriod, kLongestPeriod),
          positive("sim_translation_acceleration", kAcceleration, "of the simulated joints in real time",
                   &D::sim_translation_acceleration)
              .orUnlimited(),
          positive("sim_rotation_acceleration", kAngularAcceleration, "of the simulated joints in real time",
                   &D::sim_rotation_acceleration)
              .orUnlimited(),
          positive("status_period", kTime, "of hal/status, control/status and the topics of each arm",
                   &D::status_period)
              .atMost(kLongestTime)
              .withoutMotion(),
          positive(
              "idle_power_off", kTime,
              "after which an arm that has power and that nobody commands loses it, where its axes hold without; a "
              "warning, again and again, where they do not",
              &D::idle_power_off)
              .orUnlimited(),
          number("emergency_stop_topic", kTime,
                 "hal or sim listens to the topic emergency_stop, on which whoever reads the emergency stop says again "
                 "and "
                 "again whether it is pressed; a longer silence than this stops all arms, too",
                 &D::emergency_stop_budget)
              .within(0.01, 10)
              .defaultNote("it does not"),
          integer("realtime_priority", "SCHED_FIFO priority of the periodic threads; 0: default scheduling",
                  &D::realtime_priority)
              .within(0, 99)
              .withoutMotion(),
          flag("lock_memory", "lock all memory pages", &D::lock_memory).withoutMotion(),
          integer(
              "memory_limit_mb",
              "megabytes that a service may take; one that needs more ends, instead of others of its PC. 0: no limit",
              &D::memory_limit)
              .within(0, 1 << 20)
              .withoutMotion(),
          mapping("budgets", budgetsTable(), "time budgets", &D::budgets),
          text("method", "method that control starts with", allOf<control::Method>(), &D::method),
          relativeGain<D>(),
          tipGain<D>(),
          text("model", "kinematic model that control and planning use", &D::model).oneOf({"rigid", "compliant"}),
          text("feedback",
               "tips that errors are computed with: those of the model, or those that a tip tracker measures on "
               "sensing/tips",
               allOf<Feedback>(), &D::feedback),
          mapping("port", kPortTable,
                  "the port that the arms come through: control publishes their distance to it, planning keeps them "
                  "off it",
                  &D::port)
              .defaultNote("none"),
          mapping("plant", plantTable(), "the simulated robot").defaultNote("ideal and rigid"),
          mapping("teleoperation", teleoperationTable(), "operators' devices and CRTK clients")
              .defaultNote("all defaults"),
          mapping("black_box", kBlackBoxTable, "what tandem-recorder keeps for the case of a fault", &D::black_box)
              .withoutMotion(),
          mapping("console", kConsoleTable, "where tandem-console serves browsers and tools, and whom", &D::console)
              .withoutMotion(),
          mapping("processes", kProcessTable, "what `tandem up` starts", &D::processes)
              .required()
              .list(1, 32)
              .withoutMotion(),
      }};
  return table;
}

}  // namespace tandem::config
