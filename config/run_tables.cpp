// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "config/detail/bind.h"
#include "config/file_tables.h"
#include "control/method_names.h"

namespace tandem::config {
namespace {

using enum Quantity;
constexpr const char* kIpv4 =
    "^((25[0-5]|2[0-4][0-9]|1[0-9][0-9]|[1-9]?[0-9])\\.){3}(25[0-5]|2[0-4][0-9]|1[0-9][0-9]|[1-9]?[0-9])$";
constexpr int kMostEntries = 1000;
constexpr double kLongestTime = 86400.0;                          // s, of a time-out
constexpr double kShortestPeriod = 10e-6, kLongestPeriod = 60.0;  // s, of a periodic loop

template <class Owner>
Field relativeGain() {
  return positive("relative_gain", kGain, "gain of the relative position (lambda_AB)", &Owner::relative_gain);
}

template <class Owner>
Field tipGain() {
  return positive("tip_gain", kGain, "gain of the tip position (lambda_A)", &Owner::tip_gain);
}

Field methodLibrary() {
  return text("method_library",
              "shared library of the method `foreign`, relative to the folder of this file (docs/own-method.md)")
      .defaultNote("none");
}

/// Field for the name of a process or host.
template <class Owner>
Field nameField() {
  return text("name", "unique in the file", &Owner::name)
      .required()
      .matching("^[a-z][a-z0-9_-]*$", "a name of lower-case letters, digits, _ and -, starting with a letter");
}

const Mapping kJointsTable{"joints",
                           "Start joints of one arm; tube 1 (innermost) first.",
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
    "Published result for comparison.",
    {
        text("trajectory", "name of one of the trajectories", &PublishedRow::trajectory).required(),
        text("method", "name of the method", &PublishedRow::method).required().oneOf(control::methodNames()),
        notNegative("iterations", kNone, "control steps over the whole trajectory").defaultNote("not published"),
        mapping("relative", kErrorsTable, "errors of the relative position (epsilon_AB)"),
        mapping("tip", kErrorsTable, "errors of the tip position (epsilon_A)"),
    }};

const Mapping& budgetsTable() {
  using B = safety::Budgets;
  static const Mapping table{
      "budgets",
      "Time budgets: longest permitted ages and silences. Values above the defaults cause a warning (docs/safety.md).",
      {
          positive("minimum_age", kTime, "least budget for the age of a command or a state", &B::minimum_age)
              .atMost(kLongestTime),
          number("age_periods", kNone, "budget for that age in control periods; the larger of the two applies",
                 &B::age_periods)
              .within(1, 1e6),
          positive("planning_reference", kTime, "age of planning's reference, judged by control",
                   &B::planning_reference)
              .atMost(kLongestTime),
          positive("teleoperation", kTime, "age of an operator's stream, judged by control", &B::teleoperation)
              .atMost(kLongestTime),
          positive("tip_measurement", kTime,
                   "age of a measured tip, judged by control; at least age_periods control periods",
                   &B::tip_measurement)
              .atMost(kLongestTime),
          positive("clearance", kTime, "age of the distance of bodies, with least_clearance; judged by control",
                   &B::clearance)
              .atMost(kLongestTime),
          number("drive_heartbeat", kTime, "the drives' budget for hal's heartbeat", &B::drive_heartbeat)
              .within(1e-3, 60),
          positive("lease", kTime, "silence after which the control lease is lost", &B::lease).atMost(kLongestTime),
          number("lost_samples", kNone,
                 "share of the last 100 samples (states, commands, frames of a drive) that may be lost, at least as "
                 "many as the longest permitted silence contains; 1: no limit",
                 &B::lost_samples)
              .within(0, 1),
          positive(
              "lock_step", kTime,
              "in lock-step: longest wait for a message, in wall time, before a run ends; other budgets do not apply",
              &B::lock_step)
              .atMost(kLongestTime),
      }};
  return table;
}

const Mapping kPortTable{
    "port",
    "A plate with a round hole that the arms come through, about the z axis of the robot base frame.",
    {
        positive("radius", kLength, "radius of the hole", &kinematics::Port::radius).required(),
        notNegative("depth",
                    kLength,
                    "distance of the hole's rim in front of the entry plane, into the body",
                    &kinematics::Port::depth),
    }};

const Mapping kProcessTable{
    "process",
    "One process.",
    {
        nameField<Process>(),
        text("executable",
             "program: a name on the search path or in the folder of `tandem`, or a path",
             &Process::executable)
            .required(),
        text("arguments", "arguments appended to those of `tandem up`", &Process::arguments)
            .list(0, 100)
            .defaultNote("none"),
        flag("service", "false: an external program, started with `arguments` only", &Process::is_service),
        text("host", "host on which the process runs", &Process::host).defaultNote("required with hosts"),
        flag("essential", "false: the other processes continue when it ends", &Process::essential),
    }};

const Mapping kBlackBoxTable{
    "black_box",
    "Black box: data that tandem-recorder keeps in memory, and writes as an MCAP file when an arm faults or is "
    "stopped.",
    {
        positive("before", kTime, "duration recorded before the fault", &BlackBox::before).atMost(kLongestTime),
        positive("after", kTime, "duration recorded after the fault", &BlackBox::after).atMost(kLongestTime),
        integer("memory_mb", "memory for both durations, MB", &BlackBox::memory).within(1, 65536),
        text("directory", "folder of the recordings, relative to the folder of this file", &BlackBox::directory)
            .defaultNote("the user's state folder"),
        integer("files", "largest number of files; the oldest are deleted", &BlackBox::files).within(1, 10000),
        text("topics", "topics to record, without prefix; * matches any text", &BlackBox::topics)
            .list(1, 200)
            .unique()
            .defaultNote("all"),
    }};

const Mapping kConsoleTable{
    "console",
    "Address, TLS and access control of tandem-console (docs/foxglove.md). An address other than 127.0.0.1 needs TLS "
    "and an operator_token.",
    {
        text("address", "IPv4 address to bind to", &Console::address).matching(kIpv4, "an IPv4 address"),
        integer("port", "TCP port of HTTP and WebSocket", &Console::port).within(1, 65535),
        text("certificate",
             "file of the TLS certificate and its chain, PEM, relative to the folder of this file",
             &Console::certificate)
            .defaultNote("no TLS"),
        text("key", "file of its private key, PEM, relative likewise", &Console::key).defaultNote("no TLS"),
        text("operator_token", "file with the token of operators, who may command", &Console::operator_token)
            .defaultNote("none: every client on this machine may command"),
        text("viewer_token", "file with the token of viewers, who may read and stop", &Console::viewer_token)
            .defaultNote("none: operators only"),
        text("origins", "origins of other web pages that may connect", &Console::origins)
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
        integer("port", "UDP port of the discovery server", &DiscoveryServer::port).within(1024, 65535),
    }};

const Mapping kHostTable{
    "host",
    "One host.",
    {
        nameField<Host>(),
        text("address", "address of the host's interface on the network that the hosts share", &Host::address)
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
              .list(1, control::kMethodCount + 1)
              .unique(),
          methodLibrary(),
          relativeGain<Experiment>(),
          tipGain<Experiment>(),
          mapping("configurations", kConfigurationTable, "start configurations").required().list(1, kMostEntries),
          mapping("trajectories", kExperimentTrajectoryTable, "trajectories to run").required().list(1, kMostEntries),
          mapping("published", kPublishedTable, "published results for comparison")
              .list(0, kMostEntries)
              .defaultNote("none"),
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
              .matching("^[a-z][a-z0-9_]*$", "a name of lower-case letters, digits and _, starting with a letter")
              .withoutMotion(),
          integer("domain", "DDS domain", &D::domain).within(0, 232).withoutMotion(),
          text("interface_address", "address of the only network interface used", &D::interface_address)
              .matching(kIpv4, "an IPv4 address")
              .withoutMotion(),
          text("peers", "addresses for discovery, which uses unicast only", &D::peers)
              .matching(kIpv4, "an IPv4 address")
              .list(1, 64)
              .unique()
              .defaultNote("127.0.0.1")
              .withoutMotion(),
          mapping("hosts", kHostTable,
                  "the hosts, instead of interface_address and peers; each process recognises its host by its address",
                  &D::hosts)
              .list(1, 16)
              .defaultNote("none: one machine")
              .withoutMotion(),
          text("security",
               "folder of credentials, relative to the folder of this file: encrypts all traffic and admits certified "
               "processes only (docs/security.md)")
              .defaultNote("none: every program on the network can command the robot")
              .withoutMotion(),
          mapping("discovery", kDiscoveryTable,
                  "discovery server through which processes find one another, instead of peers", &D::discovery)
              .defaultNote("none: discovery through peers")
              .withoutMotion(),
          text("clock",
               "real_time: absolute monotonic timer; lock_step: deterministic sequence of state k, reference k, "
               "command k, state k + 1",
               {{"real_time", ClockMode::kRealTime}, {"lock_step", ClockMode::kLockStep}}, &D::clock),
          number("control_period", kTime, "period of control and planning", &D::control_period)
              .within(kShortestPeriod, kLongestPeriod),
          number("sim_period", kTime, "period of plant and bus, not above control_period", &D::sim_period)
              .within(kShortestPeriod, kLongestPeriod),
          positive("sim_translation_acceleration", kAcceleration,
                   "acceleration limit of the simulated translations in real time", &D::sim_translation_acceleration)
              .orUnlimited(),
          positive("sim_rotation_acceleration", kAngularAcceleration,
                   "acceleration limit of the simulated rotations in real time", &D::sim_rotation_acceleration)
              .orUnlimited(),
          positive("status_period", kTime,
                   "period of hal/status, control/permissions, control/clearance and the topics of each arm",
                   &D::status_period)
              .atMost(kLongestTime)
              .withoutMotion(),
          positive("idle_power_off", kTime,
                   "time without a commander after which an arm loses power, if its axes hold without power; otherwise "
                   "a warning is repeated",
                   &D::idle_power_off)
              .orUnlimited(),
          number("least_clearance", kLength,
                 "interlock: moving arms stop and latch the fault `clearance` if their bodies, or a body and the port, "
                 "come closer; negative values allow an overlap",
                 &D::least_clearance)
              .within(-0.1, 0.1)
              .defaultNote("no interlock"),
          number("emergency_stop_topic", kTime,
                 "longest silence of topic emergency_stop; a longer silence, or a pressed stop, stops all arms",
                 &D::emergency_stop_budget)
              .within(0.01, 10)
              .defaultNote("the topic is not read"),
          integer("realtime_priority", "SCHED_FIFO priority of the periodic threads; 0: default scheduling",
                  &D::realtime_priority)
              .within(0, 99)
              .withoutMotion(),
          flag("lock_memory", "lock all memory pages", &D::lock_memory).withoutMotion(),
          integer("memory_limit_mb", "memory limit of a service, MB; a service that exceeds it ends. 0: no limit",
                  &D::memory_limit)
              .within(0, 1 << 20)
              .withoutMotion(),
          mapping("budgets", budgetsTable(), "time budgets", &D::budgets),
          text("method", "method that control starts with", allOf<control::Method>(), &D::method),
          methodLibrary(),
          relativeGain<D>(),
          tipGain<D>(),
          text("model", "kinematic model that control and planning use", &D::model).oneOf({"rigid", "compliant"}),
          text("feedback", "source of tip positions for errors: the model, or a tip tracker on sensing/tips",
               allOf<Feedback>(), &D::feedback),
          text("orientation_feedback",
               "source of tip orientations for errors of axes, orientations, views and poses; `sensor` needs feedback: "
               "sensor, and a tracker that measures orientations",
               allOf<Feedback>(), &D::orientation_feedback),
          mapping("port", kPortTable,
                  "the port through which the arms enter: control publishes clearances to it, planning avoids it",
                  &D::port)
              .defaultNote("none"),
          mapping("plant", plantTable(), "the simulated robot").defaultNote("ideal and rigid"),
          mapping("teleoperation", teleoperationTable(), "operators' devices and CRTK clients")
              .defaultNote("all defaults"),
          mapping("black_box", kBlackBoxTable, "black box of tandem-recorder: data from before and after a fault",
                  &D::black_box)
              .withoutMotion(),
          text("cycle_log",
               "folder, relative to the folder of this file, in which sim, hal and control write a CSV file with one "
               "line per cycle: what they took, published and decided, on their own clocks (docs/csv.md)",
               &D::cycle_log)
              .defaultNote("none")
              .withoutMotion(),
          mapping("console", kConsoleTable, "address, TLS and access control of tandem-console", &D::console)
              .withoutMotion(),
          mapping("processes", kProcessTable, "processes that `tandem up` starts", &D::processes)
              .required()
              .list(1, 32)
              .withoutMotion(),
      }};
  return table;
}

}  // namespace tandem::config
