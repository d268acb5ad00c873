// SPDX-License-Identifier: Apache-2.0
#include <pybind11/stl.h>

#include <limits>

#include "config/config.h"
#include "experiments/closed_loop.h"
#include "python/bindings/bind.h"
#include "python/bindings/controller.h"
#include "python/bindings/trajectory.h"

namespace tandem::python {
namespace {

using namespace py::literals;

/// Period, and the plant: a dict with the keys of `plant` in a deployment, of this model unless it names another.
experiments::LoopOptions loopOptions(const Robot& robot,
                                     const std::string& model,
                                     double period,
                                     const py::dict& plant) {
  checkModel(model);
  const auto keys = py::dict(**plant);
  if (!keys.contains("model"))
    keys["model"] = model;
  const auto text = py::module_::import("json").attr("dumps")(keys, "ensure_ascii"_a = false).cast<std::string>();
  experiments::LoopOptions options;
  options.control_period = period;
  options.plant = config::parsePlant(text, "plant", *robot.file);
  return options;
}

/** The simulated robot, with the objects that it refers to. */
class Simulator {
 public:
  Simulator(const Robot& robot, const py::object& start, const std::string& model, double period, const py::dict& plant)
      : robot_(robot),
        options_(loopOptions(robot, model, period, plant)),
        model_(robot.tubes(), model),
        plant_(*robot_.file,
               model_,
               robot_.split(start.is_none() ? robot_.home() : robot_.stack(start, "start")),
               options_) {}

  void step(const py::object& velocity) {
    const safety::RobotVector v = robot_.stack(velocity, "velocity");
    if (!v.allFinite())
      throw py::value_error("velocity: found a number that is not finite, expected finite ones");
    plant_.move(v, true);
  }
  const experiments::SimulatedRobot& plant() const { return plant_; }

  py::dict tips() const {
    py::dict tips;
    for (int k = 0; k < model_.armCount(); ++k)
      tips[py::str(robot_.file->arms[static_cast<std::size_t>(k)].name)] = toArray(plant_.tips().pose(k).matrix());
    return tips;
  }

  /// Latest valid measurements of the tracker. Orientations that it does not measure are NaN.
  py::dict measuredTips() const {
    py::dict tips;
    for (int k = 0; k < model_.armCount(); ++k) {
      const auto i = static_cast<std::size_t>(k);
      const planning::MeasuredTips::Entry& measured = plant_.measuredTips().arm[i];
      if (!measured.known)
        continue;
      Eigen::Matrix4d pose = Eigen::Matrix4d::Identity();
      pose.topLeftCorner<3, 3>().setConstant(std::numeric_limits<double>::quiet_NaN());
      if (measured.oriented.known)
        pose.topLeftCorner<3, 3>() = measured.orientation.toRotationMatrix();
      pose.topRightCorner<3, 1>() = measured.position;
      tips[py::str(robot_.file->arms[i].name)] = toArray(pose);
    }
    return tips;
  }

 private:
  Robot robot_;
  experiments::LoopOptions options_;
  robots::RobotModel model_;
  experiments::SimulatedRobot plant_;
};

/// @param key  for messages @throw py::value_error
planning::Feedback feedbackFrom(const std::string& key, const std::string& name, const sim::PlantOptions& plant) {
  if (name == "model")
    return planning::Feedback::kModel;
  if (name != "sensor")
    throw py::value_error(key + ": found '" + name + "', expected 'model' or 'sensor'");
  if (!plant.tracker.present)
    throw py::value_error(key + ": found 'sensor' without a tracker, expected plant={'tracker': {...}}");
  return planning::Feedback::kSensor;
}

/** Record of one run, as numpy arrays by name. */
py::dict arraysOf(const experiments::RunRecord& record, const Robot& robot) {
  const std::vector<experiments::Row>& rows = record.rows();
  const auto count = static_cast<Eigen::Index>(rows.size());
  const auto arms = static_cast<int>(robot.file->arms.size());
  Eigen::VectorXd point(count), error_ab(count), error_a(count), violation(count);
  Eigen::MatrixXd joints(count, robot.jointCount()), lower(count, robot.jointCount()), upper(count, robot.jointCount());
  Array tips({static_cast<py::ssize_t>(count), static_cast<py::ssize_t>(arms), py::ssize_t{3}});
  for (Eigen::Index i = 0; i < count; ++i) {
    const experiments::Row& row = rows[static_cast<std::size_t>(i)];
    point[i] = row.data.point;
    error_ab[i] = row.error_ab;
    error_a[i] = row.error_a;
    violation[i] = row.violation;
    joints.row(i) = row.data.position;
    lower.row(i) = row.lower;
    upper.row(i) = row.upper;
    for (int k = 0; k < arms; ++k)
      Eigen::Map<Eigen::Vector3d>(tips.mutable_data() + 3 * (i * arms + k)) = row.data.tip[static_cast<std::size_t>(k)];
  }
  py::dict arrays;
  arrays["point"] = toArray(point).attr("astype")("int64");
  arrays["joints"] = toArray(joints);
  arrays["tips"] = tips;
  arrays["relative_error"] = toArray(error_ab);
  arrays["tip_error"] = toArray(error_a);
  arrays["moving_lower"] = toArray(lower);
  arrays["moving_upper"] = toArray(upper);
  arrays["violation"] = toArray(violation);
  const experiments::RunSummary summary = record.summary();
  arrays["converged"] = summary.converged;
  arrays["points"] = summary.points;
  arrays["iterations"] = summary.iterations;
  arrays["gate_actions"] = summary.gate_actions;
  return arrays;
}

py::dict run(const Robot& robot,
             const Trajectory& trajectory,
             const std::string& method,
             const py::object& start,
             const std::string& model,
             double period,
             double relative_gain,
             double tip_gain,
             const py::dict& plant,
             const std::string& feedback,
             const std::string& orientation_feedback,
             const py::kwargs& options) {
  config::Robot file = *robot.file;
  file.parameters = parametersFrom(robot, period, options);
  experiments::LoopOptions loop = loopOptions(robot, model, period, plant);
  loop.gains = {relative_gain, tip_gain};
  loop.feedback = feedbackFrom("feedback", feedback, loop.plant);
  loop.orientation_feedback = feedbackFrom("orientation_feedback", orientation_feedback, loop.plant);
  const safety::RobotVector from = start.is_none() ? robot.home() : robot.stack(start, "start");
  const experiments::RunPlan plan{
      {trajectory.spec.name, "start", methodFrom(method)}, trajectory.of(file), robot.split(from)};
  const robots::RobotModel models(file, model);
  const auto record = [&] {
    const py::gil_scoped_release released;
    return experiments::runOffline(file, models, plan, loop);
  }();
  return arraysOf(record, robot);
}

}  // namespace

void bindSimulator(py::module_& module) {
  py::class_<Simulator>(module, "Simulator",
                        "Gate, joints and tips of a robot in lock-step, enabled; time is simulated.")
      .def(py::init<const Robot&, const py::object&, const std::string&, double, const py::dict&>(), "robot"_a,
           "start"_a = py::none(), py::kw_only(), "model"_a = "rigid", "period"_a = 0.1, "plant"_a = py::dict(),
           "start: joints of all arms inside their limits, home unless given. period: s of a step. plant: "
           "imperfections, a dict with the keys of `plant` in a deployment.")
      .def("step", &Simulator::step, "velocity"_a,
           "One period at these joint velocities (m/s, rad/s); the gate keeps the limits. RuntimeError where it "
           "refuses.")
      .def_property_readonly(
          "joints", [](const Simulator& s) { return toArray(s.plant().position()); },
          "What the encoders read, m and rad.")
      .def_property_readonly(
          "setpoint", [](const Simulator& s) { return toArray(s.plant().setpoint()); }, "m and rad.")
      .def_property_readonly("tips", &Simulator::tips, "True tip pose by the name of the arm, (4, 4).")
      .def_property_readonly(
          "measured_tips", &Simulator::measuredTips,
          "Latest pose of each tip that the plant's tracker has measured, by the name of the arm, (4, 4); without a "
          "tracker none. An orientation that it does not measure is NaN.")
      .def_property_readonly(
          "gate_actions", [](const Simulator& s) { return s.plant().gateActions(); },
          "Interventions of the gate so far.")
      .def_property_readonly(
          "time", [](const Simulator& s) { return 1e-9 * static_cast<double>(s.plant().time()); },
          "Simulated time, s.");
  module.def(
      "run", &run, "robot"_a, "trajectory"_a, "method"_a = "nspqp", py::kw_only(), "start"_a = py::none(),
      "model"_a = "rigid", "period"_a = 0.1, "relative_gain"_a = 5.0, "tip_gain"_a = 3.0, "plant"_a = py::dict(),
      "feedback"_a = "model", "orientation_feedback"_a = "model",
      "Runs a trajectory in closed loop with the simulator, as `tandem experiment --offline` does. Returns a dict of "
      "arrays with one row per iteration, and of totals. plant: as for Simulator. feedback: 'sensor' follows the "
      "plant's tracker; orientation_feedback: likewise for tasks of axes and orientations, with feedback='sensor'. "
      "Further keywords: those of Controller.");
}

}  // namespace tandem::python
