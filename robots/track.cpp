// SPDX-License-Identifier: Apache-2.0
#include "robots/track.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "kinematics/grasp/grasp.h"
#include "planning/path_reference.h"
#include "robots/mechanism_equilibrium.h"

namespace tandem::robots {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Relative rank tolerance of singular values: rods are solved to 1e-11 of their length, derivatives are those of the
/// solution, and contact compliances with ratios up to 1e4 leave errors of about a thousandth of this value.
constexpr double kRank = 1e-7;
/// Sine of the angle below which a direction counts as one of the movable ones.
constexpr double kOutside = 1e-4;
/// Velocity of joints without a velocity limit, m/s and rad/s.
constexpr double kUnlimitedSpeed = 1e3;

struct Spaces {
  MatrixXd range, complement, null;  ///< orthonormal: range, its complement, null space
};

Spaces spacesOf(const MatrixXd& matrix, double least = 0.0) {
  if (matrix.size() == 0) {
    return {MatrixXd(matrix.rows(), 0), MatrixXd::Identity(matrix.rows(), matrix.rows()),
            MatrixXd::Identity(matrix.cols(), matrix.cols())};
  }
  const Eigen::JacobiSVD<MatrixXd> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const VectorXd& values = svd.singularValues();
  Eigen::Index rank = 0;
  while (rank < values.size() && values[rank] > kRank * values[0] && values[rank] > least)
    ++rank;
  return {svd.matrixU().leftCols(rank), svd.matrixU().rightCols(matrix.rows() - rank),
          svd.matrixV().rightCols(matrix.cols() - rank)};
}

/// Rows of the tracked components, metres each.
template <class Matrix>
MatrixXd rowsOf(const Matrix& matrix, const std::vector<int>& tracked, double length) {
  MatrixXd rows(tracked.size(), matrix.cols());
  for (std::size_t k = 0; k < tracked.size(); ++k)
    rows.row(static_cast<Eigen::Index>(k)) = (tracked[k] < 3 ? 1.0 : length) * matrix.row(tracked[k]);
  return rows;
}

/// Inverse of rowsOf(): columns of tracked components as twists.
MatrixXd twistsOf(const MatrixXd& columns, const std::vector<int>& tracked, double length) {
  MatrixXd twists = MatrixXd::Zero(6, columns.cols());
  for (std::size_t k = 0; k < tracked.size(); ++k)
    twists.row(tracked[k]) = columns.row(static_cast<Eigen::Index>(k)) / (tracked[k] < 3 ? 1.0 : length);
  return twists;
}

/// Jacobians of higherTasks(), stacked.
MatrixXd higherRows(const Mechanism& mechanism) {
  MatrixXd higher(0, mechanism.jacobian().cols());
  for (const control::Task& task : mechanism.higherTasks(0.0)) {
    higher.conservativeResize(higher.rows() + task.jacobian.rows(), Eigen::NoChange);
    higher.bottomRows(task.jacobian.rows()) = task.jacobian;
  }
  return higher;
}

Spaces motionSpaces(const Mechanism& mechanism, const std::vector<int>& tracked) {
  const MatrixXd free = spacesOf(higherRows(mechanism)).null;
  // After higherTasks(), remaining rates below this fraction are rounding.
  const MatrixXd rows = rowsOf(mechanism.jacobian(), tracked, mechanism.length());
  return spacesOf(rows * free, kRank * rows.norm());
}

std::string listed(const Eigen::Matrix<double, 6, Eigen::Dynamic>& twists, double length) {
  std::string text;
  for (Eigen::Index k = 0; k < twists.cols(); ++k)
    text += (k > 0 ? ", " : "") + kinematics::grasp::describe(twists.col(k), length);
  return text.empty() ? "none" : text;
}

planning::ReferenceTracker makeTracker(const Mechanism& mechanism, const TrackOptions& options) {
  return planning::ReferenceTracker::ofObject(mechanism.limits(), mechanism.home(), options.method, options.parameters,
                                              {options.gain, options.gain});
}

/** One run and its record. */
class NotedRun {
 public:
  NotedRun(Mechanism& mechanism, const ObjectPath& path, const TrackOptions& options)
      : mechanism_(mechanism),
        path_(path),
        options_(options),
        tracker_(makeTracker(mechanism, options)),
        joints_(mechanism.home()),
        solved_at_(joints_) {}

  const RobotVector& joints() const { return joints_; }

  /// Starts at home and satisfies higherTasks() with the object in place. @return empty, or why that fails
  std::string prepare(TrackRecord& record) {
    if (const std::string why = mechanism_.solveEquilibrium(joints_); !why.empty())
      return "home: " + why;
    for (const auto& [name, value] : mechanism_.columns())
      record.names.push_back(name);
    if (const std::string why = mechanism_.infeasibility(); !why.empty())
      return why;
    const double period = options_.parameters.period;
    const planning::ObjectReference held = planning::heldReference(path_, mechanism_.pose());
    for (double left = options_.preparation_time; mechanism_.residual() > kPrepared * options_.residual_limit;
         left -= period) {
      const std::string why = step(-left, held, record);
      if (!why.empty() || left < period)
        return "before the path: " + (why.empty() ? kContactsNotReady : why);
    }
    return mechanism_.error();
  }

  /// One period of tracking. @return empty, or why it failed
  std::string step(double time, const planning::ObjectReference& reference, TrackRecord& record) {
    const double period = options_.parameters.period;
    const auto solve_equilibrium = [this](const RobotVector& q) {
      return q == solved_at_ ? std::string() : mechanism_.solveEquilibrium(q);
    };
    TrackStep noted = noteStep(mechanism_, joints_, time);
    const std::string why =
        stepByMiddle(mechanism_, solve_equilibrium, tracker_, joints_, reference, period, equilibrium_, result_);
    noted.error = result_.error[0];
    noted.active_limits = result_.solution.active_count;
    noted.status = result_.solution.status;
    record.steps.push_back(std::move(noted));
    if (!why.empty())
      return why;
    if (result_.status != planning::TrackStatus::kOk)
      return std::string(idl::name(result_.solution.status));
    joints_ = tracker_.moved(joints_, period * result_.solution.velocity);
    solved_at_ = joints_;
    return mechanism_.solveEquilibrium(joints_);
  }

 private:
  Mechanism& mechanism_;
  const ObjectPath& path_;
  const TrackOptions& options_;
  planning::ReferenceTracker tracker_;
  planning::Equilibrium equilibrium_;
  planning::TrackResult result_;
  RobotVector joints_, solved_at_;
};

}  // namespace

TrackStep noteStep(const Mechanism& mechanism, const RobotVector& joints, double time) {
  TrackStep step;
  step.time = time;
  step.joints = joints;
  step.pose = mechanism.pose();
  step.residual = mechanism.residual();
  for (const auto& [name, value] : mechanism.columns())
    step.columns.push_back(value);
  return step;
}

void judge(const TrackOptions& options, TrackRecord& record) {
  double squares = 0.0;
  int count = 0;
  for (const TrackStep& step : record.steps) {
    if (step.time < 0.0)
      continue;
    squares += step.error * step.error;
    ++count;
    record.max_error = std::max(record.max_error, step.error);
    record.max_residual = std::max(record.max_residual, step.residual);
  }
  record.rms_error = count > 0 ? std::sqrt(squares / count) : 0.0;
  const auto millimetres = [](double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.3g mm", 1e3 * value);
    return std::string(text);
  };
  if (record.stopped.empty() && record.max_residual > options.residual_limit)
    record.stopped =
        "contact residual is " + millimetres(record.max_residual) + ", allowed " + millimetres(options.residual_limit);
  if (record.stopped.empty() && record.max_error > options.most_error)
    record.stopped = "path error is " + millimetres(record.max_error) + ", allowed " + millimetres(options.most_error);
}

MotionSpace motionSpace(const Mechanism& mechanism, const std::vector<int>& tracked) {
  const Spaces spaces = motionSpaces(mechanism, tracked);
  const double length = mechanism.length();
  MotionSpace result;
  result.movable = twistsOf(kinematics::grasp::readable(spaces.range), tracked, length);
  result.missing = twistsOf(kinematics::grasp::readable(spaces.complement), tracked, length);
  return result;
}

double attainableSpeed(const Mechanism& mechanism, int direction) {
  VectorXd limits(mechanism.jacobian().cols());
  Eigen::Index j = 0;
  for (const safety::ArmLimits* arm : mechanism.limits()) {
    for (const safety::JointLimit& joint : arm->joints)
      limits[j++] = std::min(joint.velocity, kUnlimitedSpeed);
  }
  // With q' = D u, D the velocity limits: the least u that moves the object, scaled to |u_i| <= 1.
  const MatrixXd free = spacesOf(higherRows(mechanism) * limits.asDiagonal()).null;
  const MatrixXd row = rowsOf(mechanism.jacobian(), {direction}, mechanism.length()) * limits.asDiagonal();
  const VectorXd share = free * (row * free).transpose();
  const double largest = share.size() > 0 ? share.cwiseAbs().maxCoeff() : 0.0;
  return largest > 0.0 ? (row * share).value() / largest : 0.0;
}

std::string refusal(const Mechanism& mechanism, const ObjectPath& path) {
  const std::vector<int> tracked = path.tracked();
  const double length = mechanism.length();
  const Spaces spaces = motionSpaces(mechanism, tracked);
  std::string impossible;
  for (const int direction : path.directions) {
    const VectorXd wanted = rowsOf(Twist(Twist::Unit(direction)), tracked, length);
    const VectorXd outside = wanted - spaces.range * (spaces.range.transpose() * wanted);
    if (outside.norm() > kOutside * wanted.norm())
      impossible +=
          (impossible.empty() ? "" : ", ") + kinematics::grasp::describe(Twist(Twist::Unit(direction)), length);
  }
  if (impossible.empty())
    return "";
  const MotionSpace can = motionSpace(mechanism, tracked);
  return "the path requires " + impossible +
         (path.kept == Kept::kAll        ? " with all other components held"
          : path.kept == Kept::kPosition ? " with the position held"
                                         : "") +
         "; possible: " + listed(can.movable, length) + "; not possible: " + listed(can.missing, length);
}

TrackRecord track(Mechanism& mechanism,
                  const ObjectPath& path,
                  const TrackOptions& options,
                  const std::function<void(double, double)>& progress) {
  path.check();
  TrackRecord record;
  NotedRun run(mechanism, path, options);
  record.refused = run.prepare(record);
  if (record.refused.empty())
    record.refused = refusal(mechanism, path);
  if (!record.refused.empty())
    return record;
  record.first_shape = mechanism.shapes();
  const Eigen::Isometry3d start = mechanism.pose();
  const double period = options.parameters.period;
  const int steps = static_cast<int>(std::ceil(path.duration / period)) + 1;
  for (int k = 0; k < steps && record.stopped.empty(); ++k) {
    record.stopped = run.step(k * period, planning::pathReference(path, start, k * period, period), record);
    if (record.stopped.empty())
      record.stopped = mechanism.error();
    if (!record.stopped.empty())
      record.stopped = "at " + std::to_string(k * period).substr(0, 6) + " s: " + record.stopped;
    if (progress)
      progress(k * period, path.duration);
  }
  record.last_shape = mechanism.shapes();
  judge(options, record);
  return record;
}

std::string prepare(Mechanism& mechanism, const TrackOptions& options, RobotVector& joints) {
  ObjectPath here;
  here.directions = {0, 1};
  here.length = mechanism.length();
  TrackRecord record;
  NotedRun run(mechanism, here, options);
  const std::string why = run.prepare(record);
  joints = run.joints();
  return why;
}

}  // namespace tandem::robots
