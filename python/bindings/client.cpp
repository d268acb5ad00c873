// SPDX-License-Identifier: Apache-2.0
/** @file Python class tandem.Client. Blocking calls wait in a thread without the GIL; the calling thread handles
 * signals and progress callbacks. A thread that waits for the GIL holds no lock of a client. */
#include <pybind11/stl.h>

#include <chrono>
#include <future>

#include "control/conflict.h"
#include "operation/convert.h"
#include "planning/follower.h"
#include "python/bindings/bind.h"
#include "python/bindings/controller.h"
#include "python/bindings/live_robot.h"
#include "python/bindings/trajectory.h"
#include "robots/limit_description.h"
#include "services/client/arguments.h"
#include "services/client/run_summary.h"

namespace tandem::python {
namespace {

using client::RunState;
using dds::jointIndex;

/// Runs `work` on a separate thread. Ctrl-C and exceptions of `report` interrupt it, and are raised after it has ended.
void await(LiveRobot& live, const std::function<void()>& work, const std::function<void()>& report = {}) {
  auto done = std::async(std::launch::async, work);
  std::exception_ptr error;
  for (bool ready = false; !ready;) {
    {
      const py::gil_scoped_release released;
      ready = done.wait_for(std::chrono::milliseconds(50)) == std::future_status::ready;
    }
    if (error)
      continue;
    try {
      if (PyErr_CheckSignals() != 0)
        throw py::error_already_set();
      if (report)
        report();
    } catch (...) {
      error = std::current_exception();
      live.interrupt(true);
    }
  }
  if (!error)
    return done.get();
  live.interrupt(false);
  std::rethrow_exception(error);
}

/** Latest progress of a run, passed from its thread to the calling thread. */
class LatestRunState {
 public:
  void put(const RunState& state) {
    const std::lock_guard lock(mutex_);
    latest_ = state;
  }
  std::optional<RunState> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(latest_, std::nullopt);
  }

 private:
  std::mutex mutex_;
  std::optional<RunState> latest_;
};

py::dict armStatus(const client::Snapshot& s, int arm) {
  const auto k = static_cast<std::size_t>(arm);
  const auto joints = [&](const dds::JointArray& all) {
    return toArray(dds::jointsOf(all, arm, s.state.joint_count[k]));
  };
  py::dict one;
  one["operating_state"] = std::string(safety::name(static_cast<safety::OperatingState>(s.status.operating_state[k])));
  one["is_homed"] = s.status.homed[k] != 0;
  one["is_busy"] = s.status.busy[k] != 0;
  one["faults"] = safety::describeFaults(s.status.faults[k] | s.state.faults[k]);
  one["joints"] = joints(s.state.position);
  one["velocity"] = joints(s.state.velocity);
  return one;
}

py::list describeLimits(const config::Robot& robot, const dds::ControlStatus& status) {
  py::list limits;
  for (std::size_t i = 0; i < status.limit_count && status.limit_arm[i] < robot.arms.size(); ++i)
    limits.append(robots::describeLimit(
        robot, {static_cast<control::LimitKind>(status.limit_kind[i]), status.limit_arm[i], status.limit_tube[i]}));
  return limits;
}

/** The Python object: owns a LiveRobot until it is closed. */
class Client {
 public:
  explicit Client(const std::string& deployment) {
    const py::gil_scoped_release released;
    live_ = std::make_shared<LiveRobot>(deployment);
  }

  void connect(double timeout) {
    const auto live = here();
    await(*live, [&] { live->connect(timeout); });
  }
  void close() {
    std::shared_ptr<LiveRobot> last = std::exchange(live_, nullptr);
    const py::gil_scoped_release released;
    last.reset();
  }

  Robot robot() const { return Robot(std::make_shared<const config::Robot>(here()->robot())); }
  py::dict status() const {
    const auto live = here();
    const client::Snapshot s = snapshot(*live);
    py::dict all;
    all["deployment"] = live->deployment().name;
    all["robot"] = live->robot().name;
    all["method"] = std::string(control::name(static_cast<control::Method>(s.status.method)));
    all["model"] = std::string(dds::name(static_cast<dds::Model>(s.status.model)));
    all["feedback"] = std::string(planning::name(static_cast<planning::Feedback>(s.status.feedback)));
    all["lease"] = s.status.lease_owner == 0 ? "free" : s.status.lease_owner == live->id() ? "ours" : "held";
    all["source"] = std::string(dds::name(static_cast<dds::Source>(s.status.source)));
    all["hold"] = std::string(dds::name(static_cast<dds::HoldReason>(s.status.hold)));
    py::dict arms;
    for (int k = 0; k < std::min<int>(s.state.arm_count, static_cast<int>(live->robot().arms.size())); ++k)
      arms[live->robot().arms[static_cast<std::size_t>(k)].name.c_str()] = armStatus(s, k);
    all["arms"] = arms;
    py::dict trajectory;
    trajectory["phase"] = std::string(planning::name(static_cast<planning::Phase>(s.reference.phase)));
    trajectory["point"] = s.reference.point;
    trajectory["points"] = s.reference.point_count;
    trajectory["iterations"] = s.reference.total_iterations;
    all["trajectory"] = trajectory;
    all["errors"] = std::vector<double>(s.status.task_error.begin(), s.status.task_error.begin() + s.status.task_count);
    all["limits"] = describeLimits(live->robot(), s.status);
    py::dict control;
    control["period"] = s.status.period;
    control["cycles"] = s.status.cycles;
    control["overruns"] = s.status.overruns;
    control["cycle_time_max"] = s.status.cycle_time_max;
    all["control"] = control;
    return all;
  }
  py::tuple measuredJs(const std::string& arm) const {
    const auto live = here();
    const int k = robot().indexOf(arm);
    const client::Snapshot s = snapshot(*live);
    const auto i = static_cast<std::size_t>(k);
    if (s.state.valid[i] == 0)
      throw client::Failure(client::kFailure,
                            live->robot().arms[i].name + ": the drives report no valid joint measurement");
    return py::make_tuple(toArray(dds::jointsOf(s.state.position, k, s.state.joint_count[i])),
                          toArray(dds::jointsOf(s.state.velocity, k, s.state.joint_count[i])));
  }
  Array measuredCp(const std::string& arm) const {
    const auto live = here();
    const auto k = static_cast<std::size_t>(robot().indexOf(arm));
    dds::PoseStamped tip;
    await(*live, [&] { tip = live->measuredTip(k); });
    Eigen::Isometry3d pose(
        Eigen::Quaterniond(tip.orientation[3], tip.orientation[0], tip.orientation[1], tip.orientation[2]));
    pose.translation() = Eigen::Vector3d::Map(tip.position.data());
    return toArray(pose.matrix());
  }

  void stateCommand(const char* command) const {
    const auto live = here();
    await(*live, [&] { live->stateCommand(command); });
  }
  void stop(const std::string& reason) const {
    const auto live = here();
    await(*live, [&] { live->stop(reason); });
  }
  void home() const {
    const auto live = here();
    await(*live, [&] { live->home(); });
  }
  void setMethod(const std::string& method) const {
    const auto live = here();
    await(*live, [&, wanted = methodFrom(method)] { live->setMethod(wanted); });
  }
  void set(const std::string& name, const py::object& value) const {
    const auto live = here();
    await(*live, [&, text = py::cast<std::string>(py::str(value))] { live->setParameter(name, text); });
  }
  void moveJp(const std::string& arm, const Array& q) const {
    const auto live = here();
    const auto k = static_cast<std::size_t>(robot().indexOf(arm));
    if (q.ndim() != 1)
      throw py::value_error("q: found an array of " + std::to_string(q.ndim()) + " dimensions, expected one");
    const Eigen::VectorXd joints = Rows(q, live->robot().arms[k].limits.jointCount(), "q")[0];
    await(*live, [&] { live->moveJp(k, joints); });
  }
  py::dict run(const py::object& trajectory, const py::object& method, bool keep_enabled, const py::object& progress) {
    const auto live = here();
    const std::string text = py::isinstance<Trajectory>(trajectory)
                                 ? config::formatTrajectory(py::cast<Trajectory>(trajectory).spec)
                                 : client::runText(py::cast<std::string>(trajectory));
    std::optional<control::Method> wanted;
    if (!method.is_none())
      wanted = methodFrom(py::cast<std::string>(method));
    LatestRunState latest;
    RunState end;
    const auto put = [&](const RunState& state) { latest.put(state); };
    const auto report = [&] {
      if (const auto state = latest.take(); state && !progress.is_none())
        progress(state->point, state->points, state->errors);
    };
    await(
        *live, [&] { end = live->run(text, wanted, keep_enabled, put); }, report);
    py::dict result;
    result["points"] = end.points;
    result["iterations"] = end.iterations;
    result["errors"] = end.errors;
    const auto summary = client::summaryJson(end.summary, live->robot());
    result["summary"] = py::module_::import("json").attr("loads")(summary.dump());
    return result;
  }

 private:
  std::shared_ptr<LiveRobot> here() const {
    if (!live_)
      throw client::Failure(client::kFailure, "this client is closed");
    return live_;
  }
  static client::Snapshot snapshot(LiveRobot& live) {
    client::Snapshot s;
    await(live, [&] { s = live.snapshot(); });
    return s;
  }

  std::shared_ptr<LiveRobot> live_;
};

}  // namespace

void bindClient(py::module_& module) {
  using namespace py::literals;
  py::register_exception<client::Failure>(module, "ClientError", PyExc_RuntimeError).attr("__doc__") =
      "No message from a running system, or a refusal; the text names the service and the reason.";
  py::class_<Client>(
      module, "Client",
      "A client of a running system (`tandem up`), over DDS. Commands acquire and release the control lease, "
      "run one at a time, and return when they are done; ClientError gives the reason of a failure. "
      "Ctrl-C pauses moving arms. `with` connects at the beginning and closes at the end.")
      .def(py::init<const std::string&>(), "deployment"_a = "laptop",
           "A preset or file. Does not wait for other processes: the first call that needs them connects.")
      .def(
          "connect", &Client::connect, "timeout"_a = 10.0,
          "Waits until messages are exchanged with sim (or hal), control and planning; timeout in s. ClientError names "
          "the services without messages.")
      .def("close", &Client::close, "Ends the connection. The robot keeps its state.")
      .def("__enter__",
           [](py::object self) {
             self.attr("connect")();
             return self;
           })
      .def("__exit__", [](Client& client, const py::args&) { client.close(); })
      .def_property_readonly("robot", &Client::robot, "The Robot of the deployment.")
      .def("status", &Client::status,
           "Latest status of the system, as a dict: deployment, robot, method, model, feedback, lease ('free', 'ours', "
           "'held'), source, hold, arms (by name: operating_state, is_homed, is_busy, faults, joints, velocity), "
           "trajectory (phase, point, points, iterations), errors (m), limits (texts), control (period, cycles, "
           "overruns, cycle_time_max; s). Never older than 2 s and three control periods.")
      .def("measured_js", &Client::measuredJs, "arm"_a, "CRTK: (positions, velocities), m, rad, m/s, rad/s.")
      .def("measured_cp", &Client::measuredCp, "arm"_a,
           "CRTK: tip pose at the measured joints, computed by control, (4, 4), robot base frame.")
      .def(
          "enable", [](const Client& c) { c.stateCommand("enable"); }, "All arms to ENABLED.")
      .def(
          "disable", [](const Client& c) { c.stateCommand("disable"); }, "All arms to DISABLED; clears faults.")
      .def(
          "pause", [](const Client& c) { c.stateCommand("pause"); }, "All arms to PAUSED: motions wait.")
      .def(
          "resume", [](const Client& c) { c.stateCommand("resume"); }, "Paused arms to ENABLED: motions continue.")
      .def("stop", &Client::stop, "reason"_a = "stop of a Python client",
           "Soft stop of all arms; returns when the drives report standstill. Latches FAULT until disable(). Needs "
           "neither lease nor connection, and may be called from another thread or from progress while a command "
           "runs.")
      .def("method", &Client::setMethod, "name"_a, "Chooses the redundancy-resolution method.")
      .def("set", &Client::set, "name"_a, "value"_a, "Sets a parameter of the method or a gain, as `tandem robot set`.")
      .def("move_jp", &Client::moveJp, "arm"_a, "q"_a,
           "Moves one ENABLED arm along a straight line in joint space, m and rad, and returns when it has arrived.")
      .def("home", &Client::home, "Moves all ENABLED arms to the home of the robot file.")
      .def("run", &Client::run, "trajectory"_a, py::kw_only(), "method"_a = py::none(), "keep_enabled"_a = false,
           "progress"_a = py::none(),
           "Enables, follows a trajectory (Trajectory, preset or file; for catheters a path by preset or file) from "
           "the present tips, disables. progress(point, points, errors) is called as points are reached, errors in m; "
           "an exception in it pauses the arms and is raised here. Returns a dict of points, iterations, errors (m) at "
           "the "
           "end, and summary: errors of all tasks (RMS, 95 %, maximum), duration, gate_interventions, limits.");
}

}  // namespace tandem::python
