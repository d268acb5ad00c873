// SPDX-License-Identifier: Apache-2.0
#include "planning/pose_problem.h"

#include <algorithm>
#include <cmath>

#include "control/conflict.h"
#include "planning/detail/index.h"

namespace tandem::planning {
namespace {

using Eigen::Vector3d;

constexpr double kDirectionUnit = 0.2;    // rad
constexpr double kRegularisation = 1e-8;  // rho
constexpr double kRowUnit = 0.1;          // m
constexpr double kFree = 2e19;            // Ipopt's infinity

/// Rows of a residual with this number of axes: the first one of the next axis.
Eigen::Index residualRows(std::size_t axes) { return 3 + 3 * static_cast<Eigen::Index>(axes); }

/// r_k and its derivative with respect to the joints of its arm (m, rad).
void residual(const TipTarget& target, const kinematics::Tip& tip, Eigen::VectorXd& r, Eigen::MatrixXd& by_joints) {
  const std::vector<TipTarget::Axis> axes = target.axes();
  const auto joints = tip.jacobian.cols(), rows = residualRows(axes.size());
  r.resize(rows);
  by_joints.resize(rows, joints);
  r.head<3>() = (tip.pose.translation() - target.position) / kLengthUnit;
  by_joints.topRows<3>() = tip.jacobian.topRows<3>() / kLengthUnit;
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const Vector3d axis = tip.pose.linear().col(axes[k].column);
    r.segment<3>(residualRows(k)) = (axis - axes[k].desired) / kDirectionUnit;
    for (Eigen::Index j = 0; j < joints; ++j) {
      const Vector3d angular = tip.jacobian.col(j).tail<3>();
      by_joints.col(j).segment<3>(residualRows(k)) = angular.cross(axis) / kDirectionUnit;
    }
  }
}

/// Two unit vectors perpendicular to d, and d: rows.
Eigen::Matrix3d acrossAndAlong(const Vector3d& d) {
  Eigen::Matrix3d rows;
  rows.row(0) = d.unitOrthogonal().transpose();
  rows.row(1) = d.cross(Vector3d(rows.row(0))).transpose();
  rows.row(2) = d.transpose();
  return rows;
}

/** Collects constraint rows. */
class Rows {
 public:
  Rows(PosePoint& point, int joints) : point_(point), joints_(joints) {}

  void add(ConstraintName name, double value, const Eigen::RowVectorXd& row, double lower, double upper) {
    const Eigen::Index k = point_.constraints.size();
    for (auto* vector : {&point_.constraints, &point_.lower, &point_.upper})
      vector->conservativeResize(k + 1);
    point_.jacobian.conservativeResize(k + 1, joints_);
    point_.constraints[k] = value;
    point_.lower[k] = lower;
    point_.upper[k] = upper;
    point_.jacobian.row(k) = row;
    point_.names.push_back(name);
  }

 private:
  PosePoint& point_;
  int joints_;
};

Eigen::RowVectorXd spread(const Arms& arms, int arm, const Eigen::RowVectorXd& part) {
  Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(arms.jointCount());
  row.segment(arms.offset(arm), arms.size(arm)) = part;
  return row;
}

void addTargets(const PoseProblem& problem, PosePoint& point, Rows& rows) {
  const Arms& arms = *problem.arms;
  std::vector<Eigen::VectorXd> r(problem.targets.size());
  std::vector<Eigen::MatrixXd> by(problem.targets.size());
  for (std::size_t k = 0; k < problem.targets.size(); ++k)
    residual(problem.targets[k], point.tips[at(problem.targets[k].arm)], r[k], by[k]);
  using Kind = ConstraintName::Kind;
  if (problem.nearest) {
    const std::size_t counted = problem.keep_relative ? 1 : problem.targets.size();
    for (std::size_t k = 0; k < counted; ++k) {
      point.objective += 0.5 * r[k].squaredNorm();
      point.gradient += spread(arms, problem.targets[k].arm, r[k].transpose() * by[k]).transpose();
    }
    if (!problem.keep_relative)
      return;
    for (int i = 0; i < 3; ++i) {
      rows.add({Kind::kRelative, problem.targets[0].arm, problem.targets[1].arm}, r[0][i] - r[1][i],
               spread(arms, problem.targets[0].arm, by[0].row(i)) - spread(arms, problem.targets[1].arm, by[1].row(i)),
               0.0, 0.0);
    }
    return;
  }
  for (std::size_t k = 0; k < problem.targets.size(); ++k) {
    const TipTarget& target = problem.targets[k];
    for (int i = 0; i < 3; ++i)
      rows.add({Kind::kTarget, target.arm, i}, r[k][i], spread(arms, target.arm, by[k].row(i)), 0.0, 0.0);
    std::size_t number = 0;
    for (const TipTarget::Axis& axis : target.axes()) {
      const Eigen::Index first = residualRows(number++), last = axis.rows.rows() - 1;
      const Eigen::VectorXd value = axis.rows * (r[k].segment<3>(first) + axis.desired / kDirectionUnit);
      const Eigen::MatrixXd by_turned = axis.rows * by[k].middleRows<3>(first);
      for (Eigen::Index i = 0; i <= last; ++i) {
        rows.add({Kind::kTarget, target.arm, static_cast<int>(first + i)}, value[i],
                 spread(arms, target.arm, by_turned.row(i)), 0.0, i < last ? 0.0 : kFree);
      }
    }
  }
}

void addLimits(const PoseProblem& problem, const safety::RobotVector& q, Rows& rows) {
  const Arms& arms = *problem.arms;
  for (int arm = 0; arm < arms.count(); ++arm) {
    const safety::ArmLimits& limits = *arms.limits[at(arm)];
    for (std::size_t k = 0; k < limits.rows.size(); ++k) {
      const safety::LinearRow& row = limits.rows[k];
      const Eigen::VectorXd joints = q.segment(arms.offset(arm), arms.size(arm));
      rows.add({ConstraintName::Kind::kRow, arm, static_cast<int>(k)}, (rowValue(row, joints) - row.b) / kRowUnit,
               spread(arms, arm, row.a.transpose() / kRowUnit), -kFree, 0.0);
    }
  }
}

/// @return false if a model has no solution.
bool addClearances(const PoseProblem& problem, const safety::RobotVector& q, PosePoint& point, Rows& rows) {
  const Arms& arms = *problem.arms;
  const Demands& demands = problem.demands;
  if (!demands.clearance && !demands.port)
    return true;
  std::vector<kinematics::Body> bodies(at(arms.count()));
  for (int arm = 0; arm < arms.count(); ++arm) {
    const Eigen::VectorXd joints = q.segment(arms.offset(arm), arms.size(arm));
    kinematics::Branch branch = point.branches[at(arm)];
    point.status = kinematics::makeBody(*arms.models[at(arm)], joints, branch, true, bodies[at(arm)]);
    if (point.status != kinematics::ModelStatus::kOk)
      return false;
  }
  using Kind = ConstraintName::Kind;
  for (int a = 0; a < arms.count(); ++a) {
    for (int b = a + 1; demands.clearance && b < arms.count(); ++b) {
      const kinematics::Clearance c = kinematics::clearance(bodies[at(a)], bodies[at(b)]);
      rows.add({Kind::kClearance, a, b}, (c.distance - *demands.clearance) / kLengthUnit,
               (spread(arms, a, c.by_a) + spread(arms, b, c.by_b)) / kLengthUnit, 0.0, kFree);
    }
    if (demands.port) {
      const kinematics::Clearance c = kinematics::clearance(bodies[at(a)], *demands.port);
      rows.add({Kind::kPort, a, 0}, (c.distance - demands.port_clearance) / kLengthUnit,
               spread(arms, a, c.by_a) / kLengthUnit, 0.0, kFree);
    }
  }
  return true;
}

}  // namespace

std::vector<TipTarget::Axis> TipTarget::axes() const {
  if (orientation) {
    const Eigen::Matrix3d to = orientation->toRotationMatrix();
    Axis x{0, to.col(0), Eigen::Matrix<double, 2, 3>::Zero()};  // z leaves one angle about it
    x.rows << to.col(1).transpose(), to.col(0).transpose();
    return {{2, to.col(2), acrossAndAlong(to.col(2))}, x};
  }
  if (direction)
    return {{2, *direction, acrossAndAlong(*direction)}};
  return {};
}

double TipTarget::turned(const Eigen::Isometry3d& tool) const {
  if (orientation)
    return orientation->angularDistance(Eigen::Quaterniond(tool.linear()));
  return direction ? 2.0 * std::asin(std::min(1.0, 0.5 * (tool.linear().col(2) - *direction).norm())) : 0.0;
}

std::string Arms::label(int arm) const {
  const auto k = static_cast<std::size_t>(arm);
  return "arm " + (k < names.size() ? names[k] : control::armLetter(arm));
}

int Arms::offset(int arm) const {
  int sum = 0;
  for (int k = 0; k < arm; ++k)
    sum += size(k);
  return sum;
}

double PoseProblem::unit(const Arms& arms, int joint) {
  int arm = 0;
  while (joint >= arms.offset(arm + 1))
    ++arm;
  return joint - arms.offset(arm) < arms.size(arm) / 2 ? 0.1 : 1.0;
}

safety::Interval PoseProblem::box(int joint) const {
  int arm = 0;
  while (joint >= arms->offset(arm + 1))
    ++arm;
  const safety::JointLimit& limit = arms->limits[at(arm)]->joints[at(joint - arms->offset(arm))];
  const double trust = unit(*arms, joint) < 1.0 ? translation_trust : rotation_trust;
  safety::Interval box{std::max(limit.lower, reference[joint] - trust),
                       std::min(limit.upper, reference[joint] + trust)};
  if (box.lower > box.upper)  // the reference is far outside the limits
    box = {limit.lower, limit.upper};
  return box;
}

PosePoint evaluate(const PoseProblem& problem, const safety::RobotVector& q) {
  const Arms& arms = *problem.arms;
  const int joints = arms.jointCount();
  PosePoint point;
  point.tips.resize(at(arms.count()));
  point.branches = problem.branches;
  point.branches.resize(at(arms.count()));
  for (int arm = 0; arm < arms.count(); ++arm) {
    point.status = arms.models[at(arm)]->tip(q.segment(arms.offset(arm), arms.size(arm)), point.branches[at(arm)],
                                             point.tips[at(arm)]);
    if (point.status != kinematics::ModelStatus::kOk)
      return point;
  }
  Eigen::VectorXd unit(joints);
  for (int j = 0; j < joints; ++j)
    unit[j] = PoseProblem::unit(arms, j);
  const Eigen::VectorXd away = (q - problem.reference).cwiseQuotient(unit);
  point.jacobian.resize(0, joints);
  point.gradient = Eigen::VectorXd::Zero(joints);
  Rows rows(point, joints);
  addTargets(problem, point, rows);
  addLimits(problem, q, rows);
  for (int arm = 0; arm < arms.count(); ++arm) {
    if (!problem.demands.stability)
      break;
    const Eigen::VectorXd own = q.segment(arms.offset(arm), arms.size(arm));
    const auto slope = arms.models[at(arm)]->stabilityGradient(own, point.branches[at(arm)]);
    rows.add({ConstraintName::Kind::kStability, arm, 0}, point.tips[at(arm)].stability - *problem.demands.stability,
             spread(arms, arm, slope), 0.0, kFree);
  }
  if (!addClearances(problem, q, point, rows))
    return point;
  // From joints to z.
  point.jacobian = point.jacobian * unit.asDiagonal();
  point.gradient = point.gradient.cwiseProduct(unit);
  const double weight = problem.nearest ? kRegularisation : 1.0;
  point.objective += 0.5 * weight * away.squaredNorm();
  point.gradient += weight * away;
  point.answered = std::isfinite(point.objective) && point.jacobian.allFinite() && point.constraints.allFinite();
  return point;
}

namespace {

/// Weights w_k of the residuals that correspond to the constraints' multipliers.
std::vector<Eigen::VectorXd> weights(const PoseProblem& problem, const Eigen::VectorXd& multipliers) {
  std::vector<Eigen::VectorXd> w;
  Eigen::Index next = 0;
  for (const TipTarget& target : problem.targets) {
    const std::vector<TipTarget::Axis> axes = target.axes();
    w.push_back(Eigen::VectorXd::Zero(residualRows(axes.size())));
    if (problem.nearest)
      continue;
    w.back().head<3>() = multipliers.segment<3>(next);
    next += 3;
    for (std::size_t k = 0; k < axes.size(); ++k) {
      const Eigen::Index count = axes[k].rows.rows();
      w.back().segment<3>(residualRows(k)) = axes[k].rows.transpose() * multipliers.segment(next, count);
      next += count;
    }
  }
  if (problem.nearest && problem.keep_relative) {
    w[0].head<3>() = multipliers.head<3>();
    w[1].head<3>() = -multipliers.head<3>();
  }
  return w;
}

}  // namespace

Eigen::MatrixXd curvature(const PoseProblem& problem,
                          const safety::RobotVector& q,
                          double factor,
                          const Eigen::VectorXd& multipliers) {
  constexpr double kStep = 1e-5, kLargest = 1e5;
  const Arms& arms = *problem.arms;
  const int joints = arms.jointCount();
  const double weight = factor * (problem.nearest ? kRegularisation : 1.0);
  Eigen::MatrixXd result = weight * Eigen::MatrixXd::Identity(joints, joints);
  const std::vector<Eigen::VectorXd> w = weights(problem, multipliers);
  for (std::size_t k = 0; k < problem.targets.size(); ++k) {
    const TipTarget& target = problem.targets[k];
    const int first = arms.offset(target.arm), size = arms.size(target.arm);
    const bool counted = problem.nearest && (k == 0 || !problem.keep_relative);
    kinematics::Branch start;
    if (at(target.arm) < problem.branches.size())
      start = problem.branches[at(target.arm)];
    kinematics::Tip tip;
    Eigen::VectorXd unit(size), r;
    Eigen::MatrixXd by, block = Eigen::MatrixXd::Zero(size, size);
    for (int j = 0; j < size; ++j)
      unit[j] = PoseProblem::unit(arms, first + j);
    safety::ArmVector moved = q.segment(first, size);
    if (arms.models[at(target.arm)]->tip(moved, start, tip) != kinematics::ModelStatus::kOk)
      continue;
    const auto slope = [&]() -> Eigen::VectorXd {
      residual(target, tip, r, by);
      return (by * unit.asDiagonal()).transpose() * (w[k] + (counted ? factor : 0.0) * r);
    };
    const Eigen::VectorXd here = slope();
    for (int j = 0; j < size; ++j) {
      Eigen::VectorXd ends[2] = {here, here};
      double span = 0.0;
      for (const int side : {0, 1}) {
        moved[j] = q[first + j] + (side == 0 ? -1.0 : 1.0) * kStep * unit[j];
        kinematics::Branch branch = start;
        if (arms.models[at(target.arm)]->tip(moved, branch, tip) != kinematics::ModelStatus::kOk)
          continue;
        ends[side] = slope();
        span += kStep;
      }
      moved[j] = q[first + j];
      if (span > 0.0)
        block.col(j) = (ends[1] - ends[0]) / span;
    }
    // A step across a discontinuity gives an entry as large as the jump divided by the step: clamped.
    block = block.cwiseMax(-kLargest).cwiseMin(kLargest).eval();
    result.block(first, first, size, size) += 0.5 * (block + block.transpose());
  }
  return result;
}

}  // namespace tandem::planning
