// SPDX-License-Identifier: Apache-2.0
#include "robots/mechanism_equilibrium.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace tandem::robots {
namespace {

/// Step size of the motion to distant joints, m and rad.
constexpr double kStep = 2e-3, kTurn = 0.05;

int fillTasks(const std::vector<control::Task>& from, int first, planning::Equilibrium& equilibrium) {
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  for (const control::Task& task : from) {
    if (first == static_cast<int>(equilibrium.tasks.size()) || task.jacobian.rows() > control::kMaxTaskRows)
      throw std::invalid_argument("the mechanism has more than " + std::to_string(equilibrium.tasks.size()) +
                                  " tasks besides the motion of the object, or one with more than " +
                                  std::to_string(control::kMaxTaskRows) + " rows");
    planning::EquilibriumTask& to = equilibrium.tasks[static_cast<std::size_t>(first++)];
    to.rows = static_cast<int>(task.jacobian.rows());
    Eigen::Map<Rows>(to.jacobian.data(), to.rows, task.jacobian.cols()) = task.jacobian;
    Eigen::VectorXd::Map(to.velocity.data(), to.rows) = task.velocity;
  }
  return first;
}

}  // namespace

void writeEquilibrium(const Mechanism& mechanism, const RobotVector& q, planning::Equilibrium& equilibrium) {
  equilibrium.joint_count = static_cast<int>(q.size());
  Eigen::VectorXd::Map(equilibrium.joints.data(), q.size()) = q;
  const Eigen::Isometry3d& pose = mechanism.pose();
  Eigen::Vector3d::Map(equilibrium.position.data()) = pose.translation();
  Eigen::Matrix3d::Map(equilibrium.rotation.data()) = pose.linear();
  Eigen::Matrix<double, 6, Eigen::Dynamic>::Map(equilibrium.jacobian.data(), 6, q.size()) = mechanism.jacobian();
  equilibrium.length = mechanism.length();
  equilibrium.residual = mechanism.residual();
  equilibrium.higher_count = fillTasks(mechanism.higherTasks(1.0), 0, equilibrium);
  equilibrium.lower_count =
      fillTasks(mechanism.lowerTasks(1.0), equilibrium.higher_count, equilibrium) - equilibrium.higher_count;
}

EquilibriumFollower::EquilibriumFollower(std::unique_ptr<Mechanism> mechanism)
    : mechanism_(std::move(mechanism)), joints_(mechanism_->home()) {
  if (const std::string why = mechanism_->solveEquilibrium(joints_); !why.empty())
    throw std::invalid_argument("home: " + why);
}

std::string EquilibriumFollower::solveEquilibrium(const RobotVector& q) {
  if (q.size() != joints_.size() || !q.allFinite())
    return "found " + std::to_string(q.size()) + " joints, expected " + std::to_string(joints_.size()) +
           " finite numbers";
  if (q == joints_)
    return {};
  const RobotVector from = joints_;
  double steps = 1.0;
  Eigen::Index j = 0;
  for (const safety::ArmLimits* arm : mechanism_->limits()) {
    for (const safety::JointLimit& joint : arm->joints) {
      const double step = joint.kind == safety::JointKind::kTranslation ? kStep : kTurn;
      steps = std::max(steps, std::ceil(std::abs(q[j] - from[j]) / step));
      ++j;
    }
  }
  for (double k = 1.0; k <= steps; k += 1.0) {
    const RobotVector next = k == steps ? q : RobotVector(from + k / steps * (q - from));
    if (std::string why = mechanism_->solveEquilibrium(next); !why.empty())
      return why;
    joints_ = next;
  }
  return {};
}

}  // namespace tandem::robots
