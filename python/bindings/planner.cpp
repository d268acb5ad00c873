// SPDX-License-Identifier: Apache-2.0
#include <pybind11/stl.h>

#include <atomic>

#include "planning/feasibility.h"
#include "python/bindings/bind.h"
#include "python/bindings/robot.h"
#include "python/bindings/trajectory.h"

namespace tandem::python {
namespace {

/** Requirements and search options of one planner, for all its computations. */
class Planner {
 public:
  Planner(const Robot& robot,
          const std::string& model,
          std::optional<double> stability,
          std::optional<double> clearance,
          int starts,
          std::uint64_t seed)
      : robot_(robot), model_((checkModel(model), robot.tubes()), model) {
    options_.demands.stability = stability;
    options_.demands.clearance = clearance;
    options_.starts = starts;
    options_.seed = seed;
  }

  py::dict ik(const py::dict& targets, const py::object& reference) const {
    std::vector<planning::TipTarget> tips;
    for (const auto& [arm, target] : targets) {
      planning::TipTarget tip;
      const std::string name = py::cast<std::string>(arm);
      tip.arm = robot_.indexOf(name);
      const Array numbers = py::cast<Array>(target);
      const bool directed = numbers.ndim() == 1 && numbers.shape(0) == 6;
      const Eigen::VectorXd values = Rows(numbers, directed ? 6 : 3, "target of " + name)[0];
      tip.position = values.head<3>();
      if (directed)
        tip.direction = values.tail<3>().normalized();
      tips.push_back(tip);
    }
    if (tips.empty())
      throw py::value_error("targets: found none, expected one or more arms");
    const safety::RobotVector from = reference.is_none() ? robot_.home() : robot_.stack(reference, "reference");
    const planning::IkAnswer answer = [&] {
      const py::gil_scoped_release released;
      return planning::InverseKinematics({model_.models(), model_.limits()}, options_).solve(tips, from);
    }();
    py::dict result;
    result["reach"] = std::string(planning::name(answer.reach));
    result["reason"] = answer.reason;
    result["joints"] = toArray(answer.q);
    result["errors"] = answer.error;
    result["stability"] = answer.stability;
    std::vector<std::string> limits;
    for (const planning::ActiveLimit& limit : answer.limits)
      limits.push_back(robot_.file->arms[static_cast<std::size_t>(limit.arm)].name + ": " + limit.description);
    result["limits"] = limits;
    return result;
  }

  py::dict check(const Trajectory& trajectory, const py::object& start) const {
    const safety::RobotVector from = start.is_none() ? robot_.home() : robot_.stack(start, "start");
    const planning::TrajectorySpec spec = trajectory.of(*robot_.file);
    planning::FeasibilityOptions options;
    options.ik = options_;
    const planning::FeasibilityReport report = [&] {
      const py::gil_scoped_release released;
      return planning::checkTrajectory({model_.models(), model_.limits()}, spec, from, options);
    }();
    py::dict result;
    result["feasible"] = report.feasible;
    result["start"] = report.start;
    Eigen::MatrixXd joints(static_cast<Eigen::Index>(report.points.size()), robot_.jointCount());
    Eigen::VectorXd errors(joints.rows());
    std::vector<std::string> reach, reasons;
    for (std::size_t i = 0; i < report.points.size(); ++i) {
      const planning::PointReport& point = report.points[i];
      joints.row(static_cast<Eigen::Index>(i)) = point.q;
      errors[static_cast<Eigen::Index>(i)] = point.error;
      reach.emplace_back(planning::name(point.reach));
      reasons.push_back(point.reason);
    }
    result["joints"] = toArray(joints);
    result["errors"] = toArray(errors);
    result["reach"] = reach;
    result["reason"] = reasons;
    return result;
  }

 private:
  Robot robot_;
  robots::RobotModel model_;
  planning::IkOptions options_;
};

}  // namespace

void bindPlanner(py::module_& module) {
  using namespace py::literals;
  py::class_<Planner>(module, "Planner", "Inverse kinematics and feasibility under all limits (docs/planning.md).")
      .def(py::init<const Robot&, const std::string&, std::optional<double>, std::optional<double>, int,
                    std::uint64_t>(),
           "robot"_a, py::kw_only(), "model"_a = "rigid", "stability"_a = py::none(), "clearance"_a = py::none(),
           "starts"_a = 12, "seed"_a = 1,
           "stability, clearance (m): smallest permitted ones, none unless given. The same seed gives the same result.")
      .def("inverse_kinematics", &Planner::ik, "targets"_a, "reference"_a = py::none(),
           "targets: by the name of the arm a position, (3,), m, or position and direction, (6,). The joints nearest "
           "to the reference (home unless given) that reach them, or those of the nearest pose: a dict with reach "
           "('reached', 'limits', 'outside_workspace' ...), reason, joints, errors (m), limits, stability.")
      .def(
          "check", &Planner::check, "trajectory"_a, "start"_a = py::none(),
          "Feasibility of a trajectory from a start, point by point: a dict with feasible, start (reason why it is not "
          "a valid start), and for each point joints, errors (m), reach, reason.");
}

}  // namespace tandem::python
