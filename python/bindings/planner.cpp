// SPDX-License-Identifier: Apache-2.0
#include <pybind11/stl.h>

#include <atomic>

#include "planning/start_choice.h"
#include "planning/timing.h"
#include "python/bindings/bind.h"
#include "python/bindings/robot.h"
#include "python/bindings/trajectory.h"
#include "robots/overlap.h"

namespace tandem::python {
namespace {

/// @param key  for messages @throw py::value_error unless it is a rigid transformation
Eigen::Isometry3d poseFrom(const Array& numbers, const std::string& key) {
  constexpr double kRounding = 1e-3;
  if (numbers.ndim() != 2 || numbers.shape(0) != 4 || numbers.shape(1) != 4)
    throw py::value_error(key + ": found another shape, expected (4, 4)");
  const Eigen::Matrix4d matrix = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(numbers.data());
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  const bool rigid = matrix.allFinite() && (rotation * rotation.transpose()).isIdentity(kRounding) &&
                     rotation.determinant() > 0.0 && matrix.row(3).isApprox(Eigen::RowVector4d(0, 0, 0, 1));
  if (!rigid)
    throw py::value_error(key + ": found no rigid transformation, expected a rotation, a position (m), and 0, 0, 0, 1");
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::Quaterniond(rotation).normalized().toRotationMatrix();
  pose.translation() = matrix.topRightCorner<3, 1>();
  return pose;
}

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
    for (const config::Arm& arm : robot.file->arms)
      names_.push_back(arm.name);
  }

  py::dict ik(const py::dict& targets, const py::object& reference) const {
    std::vector<planning::TipTarget> tips;
    for (const auto& [arm, target] : targets) {
      planning::TipTarget tip;
      const std::string name = py::cast<std::string>(arm);
      tip.arm = robot_.indexOf(name);
      const Array numbers = py::cast<Array>(target);
      if (numbers.ndim() == 2) {
        const Eigen::Isometry3d pose = poseFrom(numbers, "target of " + name);
        tip.position = pose.translation();
        tip.orientation = Eigen::Quaterniond(pose.linear());
      } else {
        const bool directed = numbers.ndim() == 1 && numbers.shape(0) == 6;
        const Eigen::VectorXd values = Rows(numbers, directed ? 6 : 3, "target of " + name)[0];
        tip.position = values.head<3>();
        if (directed)
          tip.direction = values.tail<3>().normalized();
      }
      tips.push_back(tip);
    }
    if (tips.empty())
      throw py::value_error("targets: found none, expected one or more arms");
    const safety::RobotVector from = reference.is_none() ? robot_.home() : robot_.stack(reference, "reference");
    const planning::IkAnswer answer = [&] {
      const py::gil_scoped_release released;
      return planning::InverseKinematics(arms(), options_).solve(tips, from);
    }();
    py::dict result;
    result["reach"] = std::string(planning::name(answer.reach));
    result["reason"] = answer.reason;
    result["joints"] = toArray(answer.q);
    result["errors"] = answer.error;
    result["angles"] = answer.angle;
    result["stability"] = answer.stability;
    std::vector<std::string> limits;
    for (const planning::ActiveLimit& limit : answer.limits)
      limits.push_back(robot_.file->arms[static_cast<std::size_t>(limit.arm)].name + ": " + limit.description);
    result["limits"] = limits;
    return result;
  }

  py::dict check(const Trajectory& trajectory, const py::object& start) const {
    const safety::RobotVector from = startOf(start);
    return reportOf(checked(trajectory, from));
  }

  py::dict repair(const Trajectory& trajectory, const py::object& start, double smoothing) const {
    const safety::RobotVector from = startOf(start);
    const planning::TrajectorySpec spec = trajectory.of(*robot_.file);
    const planning::RepairResult repaired = [&] {
      const py::gil_scoped_release released;
      return planning::repairTrajectory(arms(), spec, from, feasibility(), smoothing);
    }();
    py::dict result;
    result["trajectory"] = Trajectory{repaired.spec};
    result["before"] = reportOf(repaired.before);
    result["after"] = reportOf(repaired.after);
    result["rounds"] = repaired.rounds;
    result["largest_change"] = repaired.largest_change;
    result["rms_change"] = repaired.rms_change;
    return result;
  }

  py::dict time(const Trajectory& trajectory,
                const py::object& start,
                double translation_acceleration,
                double rotation_velocity,
                double rotation_acceleration) const {
    const safety::RobotVector from = startOf(start);
    const planning::FeasibilityReport report = checked(trajectory, from);
    if (!report.feasible)
      throw py::value_error("trajectory " + trajectory.spec.name + " is not feasible from this start; see check()");
    const planning::TimingProblem problem =
        planning::timingProblem(model_.limits(), report.pathFrom(from),
                                {translation_acceleration, rotation_velocity, rotation_acceleration,
                                 robot_.file->parameters.snsqp_rotation_velocity});
    const planning::Timing timing = [&] {
      const py::gil_scoped_release released;
      return planning::timeOptimal(problem);
    }();
    py::dict result;
    result["status"] = std::string(idl::name(timing.status));
    result["time"] = toArray(Eigen::VectorXd::Map(timing.time.data(), static_cast<Eigen::Index>(timing.time.size())));
    result["joints"] = toArray(problem.path.transpose());
    std::vector<std::string> limiting;
    for (const int joint : timing.limiting)
      limiting.push_back(jointName(joint));
    result["limiting"] = limiting;
    return result;
  }

  py::list starts(const Trajectory& trajectory, const py::object& start, int tries) const {
    planning::StartOptions options;
    options.feasibility = feasibility();
    options.tries = tries;
    const safety::RobotVector from = startOf(start);
    const planning::TrajectorySpec spec = trajectory.of(*robot_.file);
    const planning::StartChoice choice = [&] {
      const py::gil_scoped_release released;
      return planning::chooseStart(arms(), spec, from, options);
    }();
    py::list result;
    for (const planning::StartCandidate& candidate : choice.candidates) {
      py::dict one;
      one["joints"] = toArray(candidate.q);
      one["unreachable"] = candidate.unreachable;
      one["room"] = candidate.room;
      one["mean_room"] = candidate.mean_room;
      result.append(one);
    }
    return result;
  }

  py::dict clearance(const py::object& joints) const {
    const auto bodies = robots::bodiesAt(model_, robot_.split(startOf(joints)));
    for (std::size_t k = 0; k < bodies.size(); ++k) {
      if (!bodies[k])
        throw ModelError("arm " + names_[k] + ": the model has no solution at these joints");
    }
    py::dict result;
    for (const auto& [i, j, least] : robots::armDistances(bodies))
      result[py::make_tuple(names_[i], names_[j])] =
          py::make_tuple(least.distance, toArray(least.place_a), toArray(least.place_b));
    return result;
  }

 private:
  planning::Arms arms() const { return {model_.models(), model_.limits(), names_}; }

  safety::RobotVector startOf(const py::object& joints) const {
    return joints.is_none() ? robot_.home() : robot_.stack(joints, "start");
  }

  planning::FeasibilityOptions feasibility() const {
    planning::FeasibilityOptions options;
    options.ik = options_;
    return options;
  }

  planning::FeasibilityReport checked(const Trajectory& trajectory, const safety::RobotVector& from) const {
    const planning::TrajectorySpec spec = trajectory.of(*robot_.file);
    const py::gil_scoped_release released;
    return planning::checkTrajectory(arms(), spec, from, feasibility());
  }

  py::dict reportOf(const planning::FeasibilityReport& report) const {
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

  /// "left.beta_1" of an index among all joints; empty for -1.
  std::string jointName(int joint) const {
    for (const config::Arm& arm : robot_.file->arms) {
      if (joint >= 0 && joint < arm.jointCount())
        return arm.name + "." + arm.joint_names[static_cast<std::size_t>(joint)];
      joint -= arm.jointCount();
    }
    return "";
  }

  Robot robot_;
  robots::RobotModel model_;
  planning::IkOptions options_;
  std::vector<std::string> names_;  ///< of the arms
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
           "targets: by the name of the arm a position, (3,), m, position and direction, (6,), or a pose, (4, 4). The "
           "joints nearest to the reference (home unless given) that reach them, or those of the nearest pose: a dict "
           "with reach ('reached', 'limits', 'outside_workspace' ...), reason, joints, errors (m), angles (rad), "
           "limits, stability.")
      .def(
          "check", &Planner::check, "trajectory"_a, "start"_a = py::none(),
          "Feasibility of a trajectory from a start, point by point: a dict with feasible, start (reason why it is not "
          "a valid start), and for each point joints, errors (m), reach, reason.")
      .def(
          "repair", &Planner::repair, "trajectory"_a, "start"_a = py::none(), py::kw_only(), "smoothing"_a = 3.0,
          "The nearest feasible trajectory: a dict with trajectory (absolute waypoints), before and after (as check() "
          "returns them), rounds, largest_change and rms_change of the tip's points (m). smoothing 0 moves only points "
          "that cannot be reached. It is of use where after['feasible'] is true.")
      .def(
          "time", &Planner::time, "trajectory"_a, "start"_a = py::none(), py::kw_only(),
          "translation_acceleration"_a = 0.0, "rotation_velocity"_a = 0.0, "rotation_acceleration"_a = 0.0,
          "The fastest timing within the joints' limits (Verscheure et al. 2009), or within those given (m/s^2, rad/s, "
          "rad/s^2; 0: the robot file's): a dict with status ('optimal', ...), time (s) and joints of the start and "
          "each point, and for each segment limiting, the joint nearest to its velocity limit ('' for an "
          "acceleration). "
          "ValueError where the trajectory is not feasible.")
      .def("starts", &Planner::starts, "trajectory"_a, "start"_a = py::none(), py::kw_only(), "tries"_a = 20,
           "Start configurations with the same tips, the best first: dicts with joints, unreachable (points), room "
           "(smallest margin to all limits on the way, per 0.1 m and 1 rad) and mean_room.")
      .def("clearance", &Planner::clearance, "joints"_a = py::none(),
           "Smallest distance between the bodies of each two arms at joints (home unless given): by the names of the "
           "arms (distance (m; below zero they overlap), place on the first, place on the other (m, base frame)).");
}

}  // namespace tandem::python
