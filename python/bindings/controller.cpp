// SPDX-License-Identifier: Apache-2.0
#include "python/bindings/controller.h"

#include <pybind11/stl.h>

#include <cmath>

#include "control/method_names.h"
#include "planning/reference_tracker.h"
#include "python/bindings/bind.h"

namespace tandem::python {
namespace {

/** Result of relative(), tip(), joint_limits() or elastic_stability(), with arms by their names. Of soft tasks the
 * position is [d, 0, 0]. */
struct Target {
  planning::TaskKind kind = planning::TaskKind::kNone;
  std::string arm, other;
  Eigen::Vector3d position = Eigen::Vector3d::Zero(), feed_forward = Eigen::Vector3d::Zero();
};

Eigen::Vector3d vector3(const py::object& object, const std::string& name) {
  if (object.is_none())
    return Eigen::Vector3d::Zero();
  return Rows(py::cast<Array>(object), 3, name)[0];
}

/// A soft task, which acts where the arm is nearer than a distance to what it keeps away from.
Target softTarget(planning::TaskKind kind, const std::string& arm, double distance) {
  return {kind, arm, "", {distance, 0.0, 0.0}, Eigen::Vector3d::Zero()};
}

std::string describe(const Target& target) {
  const std::string task(kinematics::findTaskKind(target.kind)->description);
  return task + " " + target.arm + (target.other.empty() ? "" : " and " + target.other);
}

/** Result of one step. */
struct Step {
  safety::RobotVector velocity;
  std::vector<double> errors, scales, residuals;
  std::string status;
  int iterations = 0, active_limits = 0;
  std::vector<Eigen::Matrix4d> tips;
};

std::string statusOf(const planning::TrackResult& result) {
  switch (result.status) {
    case planning::TrackStatus::kOk:
      return "solved";
    case planning::TrackStatus::kSolver:
      return std::string(control::name(result.solution.status));
    case planning::TrackStatus::kModel:
      throw ModelError("arm " + std::to_string(result.model_arm) + ": " +
                       std::string(kinematics::describe(result.model)));
    default:
      throw py::value_error("target: found a number that is not finite, expected finite ones");
  }
}

/** Sequence of control steps. */
class Controller {
 public:
  Controller(const Robot& robot,
             const std::string& method,
             const std::string& model,
             double period,
             planning::Gains gains,
             const py::kwargs& options)
      : robot_(robot),
        model_((checkModel(model), robot.tubes()), model),
        tracker_(model_.models(), model_.limits(), methodFrom(method), parametersFrom(robot, period, options), gains) {}

  Step step(const py::object& q, const std::vector<Target>& targets, const py::object& setpoint) {
    const safety::RobotVector joints = robot_.stack(q, "q");
    const safety::RobotVector from = setpoint.is_none() ? joints : robot_.stack(setpoint, "setpoint");
    if (targets.empty() || targets.size() > static_cast<std::size_t>(planning::kMaxTasks))
      throw py::value_error("targets: found " + std::to_string(targets.size()) + ", expected 1 to " +
                            std::to_string(planning::kMaxTasks));
    planning::Reference reference;
    for (const Target& target : targets)
      reference.tasks[static_cast<std::size_t>(reference.task_count++)] = taskOf(target);
    tracker_.step(joints, from, reference, result_);
    return answer(reference.task_count);
  }

  void restart() { tracker_.restart(); }
  std::string method() const { return std::string(control::name(tracker_.method())); }

 private:
  planning::TaskReference taskOf(const Target& target) const {
    planning::TaskReference task;
    task.kind = target.kind;
    task.arm = robot_.indexOf(target.arm);
    if (target.kind == planning::TaskKind::kElasticStability &&
        !model_.models()[static_cast<std::size_t>(task.arm)]->canSnap())
      throw py::value_error("targets: found elastic_stability of " + target.arm +
                            ", whose model cannot lose it, expected a Controller with model='compliant'");
    task.other_arm = target.kind == planning::TaskKind::kRelativePosition ? robot_.indexOf(target.other) : 0;
    task.position = target.position;
    task.feed_forward = target.feed_forward;
    return task;
  }

  Step answer(int tasks) const {
    const control::Solution& solution = result_.solution;
    Step step;
    step.status = statusOf(result_);
    step.velocity = solution.velocity;
    step.errors.assign(result_.error.begin(), result_.error.begin() + tasks);
    step.scales.assign(solution.scale.begin(), solution.scale.begin() + tasks);
    step.residuals.assign(solution.residual.begin(), solution.residual.begin() + tasks);
    step.iterations = solution.iterations;
    step.active_limits = solution.active_count;
    for (int k = 0; k < model_.armCount(); ++k)
      step.tips.push_back(result_.tip[static_cast<std::size_t>(k)].pose.matrix());
    return step;
  }

  Robot robot_;
  robots::RobotModel model_;
  planning::ReferenceTracker tracker_;
  planning::TrackResult result_;
};

void bindStep(py::module_& module) {
  py::class_<Step>(module, "Step", "Result of Controller.step().")
      .def_property_readonly(
          "velocity", [](const Step& s) { return toArray(s.velocity); },
          "Joint velocities of all arms, m/s and rad/s; zero where status reports that none was found.")
      .def_readonly("status", &Step::status, "'solved', or the reason of the failure.")
      .def_readonly("errors", &Step::errors,
                    "Distance of each task from its target, m; of a soft task its cost C, m (stability times 0.05 m).")
      .def_readonly("scales", &Step::scales, "Scale of each task, chosen by the method, 0 to 1.")
      .def_readonly("residuals", &Step::residuals, "Part of each task that is not achieved, m/s.")
      .def_readonly("iterations", &Step::iterations, "Iterations of the QP solver; 0 for closed forms.")
      .def_readonly("active_limits", &Step::active_limits, "Number of active bounds and rows.")
      .def_property_readonly(
          "tips",
          [](const Step& s) {
            std::vector<Array> tips;
            for (const Eigen::Matrix4d& tip : s.tips)
              tips.push_back(toArray(tip));
            return tips;
          },
          "Tip pose of each arm at q, (4, 4).")
      .def("__repr__", [](const Step& s) { return "<tandem.Step " + s.status + ">"; });
}

}  // namespace

control::Method methodFrom(const std::string& name) {
  if (const auto method = idl::fromName<control::Method>(name))
    return *method;
  std::string known;
  for (const std::string& method : control::methodNames())
    known += (known.empty() ? "'" : ", '") + method + "'";
  throw py::value_error("method: found '" + name + "', expected one of " + known);
}

control::MethodParameters parametersFrom(const Robot& robot, double period, const py::kwargs& options) {
  control::MethodParameters parameters = robot.file->parameters;
  const auto positive = [](const std::string& name, double value) {
    if (!std::isfinite(value) || value <= 0.0)
      throw py::value_error(name + ": found " + std::to_string(value) + ", expected a finite number above 0");
    return value;
  };
  parameters.period = positive("period", period);
  for (const auto& [key, value] : options) {
    const auto name = py::cast<std::string>(key);
    const auto parameter = std::find_if(control::kTunableParameters.begin(), control::kTunableParameters.end(),
                                        [&](const control::TunableParameter& t) { return name == t.name; });
    if (parameter != control::kTunableParameters.end()) {
      parameters.*(parameter->member) = positive(name, py::cast<double>(value));
    } else if (name == "bounds" || name == "backend") {
      const auto word = py::cast<std::string>(value);
      const auto bounds = idl::fromName<control::BoundsKind>(word);
      const auto backend = idl::fromName<control::Backend>(word);
      if (name == "bounds" ? !bounds : !backend)
        throw py::value_error(name + ": found '" + word + "', expected " +
                              (name == "bounds" ? "'coupled' or 'frozen'" : "'active-set' or 'ipopt'"));
      parameters.bounds = name == "bounds" ? *bounds : parameters.bounds;
      parameters.backend = name == "backend" ? *backend : parameters.backend;
    } else {
      throw py::type_error("found argument '" + name +
                           "', expected bounds, backend or a parameter of the methods "
                           "(docs/methods.md)");
    }
  }
  return parameters;
}

void bindController(py::module_& module) {
  using namespace py::literals;
  py::class_<Target>(module, "Target",
                     "A task of a control step: relative(), tip(), joint_limits() or elastic_stability().")
      .def("__repr__", [](const Target& t) { return "<tandem.Target " + describe(t) + ">"; });
  module.def(
      "relative",
      [](const std::string& arm, const std::string& other, const py::object& position, const py::object& feed) {
        return Target{planning::TaskKind::kRelativePosition, arm, other, vector3(position, "position"),
                      vector3(feed, "feed_forward")};
      },
      "arm"_a, "other"_a, "position"_a, "feed_forward"_a = py::none(),
      "Desired position of the tip of one arm relative to the tip of another, m, base frame (eq. (2)).");
  module.def(
      "tip",
      [](const std::string& arm, const py::object& position, const py::object& feed) {
        return Target{planning::TaskKind::kTipPosition, arm, "", vector3(position, "position"),
                      vector3(feed, "feed_forward")};
      },
      "arm"_a, "position"_a, "feed_forward"_a = py::none(), "Desired position of the tip of an arm, m, base frame.");
  module.def(
      "joint_limits",
      [](const std::string& arm, double distance) {
        if (!(distance > 0.0) || !std::isfinite(distance))
          throw py::value_error("distance: found " + std::to_string(distance) + ", expected a finite number above 0");
        return softTarget(planning::TaskKind::kJointLimits, arm, distance);
      },
      "arm"_a, "distance"_a,
      "Soft task (docs/tasks.md): keeps the arm away from joint limits that are nearer than distance, m; of rotations "
      "1 rad counts as 0.05 m.");
  module.def(
      "elastic_stability",
      [](const std::string& arm, double above) {
        if (!(above > 0.0 && above <= 1.0))
          throw py::value_error("above: found " + std::to_string(above) + ", expected a number above 0, at most 1");
        return softTarget(planning::TaskKind::kElasticStability, arm, above);
      },
      "arm"_a, "above"_a,
      "Soft task (docs/tasks.md): keeps the elastic stability of the arm above this number, 0 to 1. For a Controller "
      "with model='compliant'.");
  bindStep(module);
  module.attr("METHODS") = py::tuple(py::cast(control::methodNames()));
  py::class_<Controller>(module, "Controller", "Redundancy resolution: from joints and targets to joint velocities.")
      .def(py::init([](const Robot& robot, const std::string& method, const std::string& model, double period,
                       double relative_gain, double tip_gain, const py::kwargs& options) {
             return std::make_unique<Controller>(robot, method, model, period, planning::Gains{relative_gain, tip_gain},
                                                 options);
           }),
           "robot"_a, "method"_a = "nspqp", py::kw_only(), "model"_a = "rigid", "period"_a = 0.1,
           "relative_gain"_a = 5.0, "tip_gain"_a = 3.0,
           ("method: " + control::methodList() +
            ". period in s, gains in 1/s. Further keywords: bounds, backend, and the parameters of docs/methods.md.")
               .c_str())
      .def_property_readonly("method", &Controller::method, "Name of the redundancy resolution.")
      .def("step", &Controller::step, "q"_a, "targets"_a, "setpoint"_a = py::none(),
           "One step. q: measured joints of all arms, stacked or one vector per arm. targets: highest priority first. "
           "setpoint: joints from which limits are computed, q unless given. An elastic arm continues from the "
           "equilibrium of the previous step.")
      .def("restart", &Controller::restart,
           "To be called after a reset of the joints (a change of joints without a motion).");
}

}  // namespace tandem::python
