// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>

#include "control/damping.h"
#include "control/detail/qp_methods.h"
#include "control/methods.h"
#include "control/posture.h"
#include "control/recovery.h"

namespace tandem::control {
namespace {

constexpr double kOver = 1e-12;          // beyond a limit by no more than this is at it, m/s or rad/s
constexpr double kDependentRow = 1e-10;  // squared part of a unit row that tasks and saturated joints leave free
constexpr double kNoLever = 1e-6;        // m/rad: with less, joints do not move a task
constexpr double kRankLost = 1e-3;       // part of a task's velocity that the joints left free may fail to have

using Projector =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, safety::kMaxJoints, safety::kMaxJoints>;

/** A bound on one joint or on a row of equation (1), as a^T qdot <= value with at most two entries. */
struct Side {
  int first = 0, second = 0;
  double a_first = 0.0, a_second = 0.0;
  double value = 0.0;

  double of(const RobotVector& v) const { return a_first * v[first] + (a_second == 0.0 ? 0.0 : a_second * v[second]); }
};

/** Saturation in the null space, analytic: Flacco, De Luca & Khatib, "Control of Redundant Robots Under Hard Joint
 * Constraints: Saturation in the Null Space", IEEE T-RO 31(3), 2015, algorithm 4; reference 12 of Alsaka et al. 2024.
 * For k = 1, 2, ..., with qdot_0 = 0 and P_0 = I, from qbar = qdot_{k-1} and Pbar = P_{k-1} on:
 *
 *   A = J_k Pbar,   qdot(s) = qbar + A# (s v_k - J_k qbar),
 *   s = the largest in [0, 1] for which qdot(s) keeps every limit;
 *   where s < 1: the limit c^T qdot <= d that s stands at is held from now on,
 *     qbar += u (d - c^T qbar) / (c^T u),   Pbar -= u u^T / (c^T u),   u = Pbar c,
 *   and again, until s = 1 or A no longer has the first J_k qdot(s); qdot_k is the qdot(s) with the largest s.
 *   P_k = P_{k-1} - (J_k P_{k-1})# J_k P_{k-1}.
 *
 * c is a joint or, beyond the paper, a coupled row of equation (1). The inverse is that of the joints in SI, damped in
 * singular directions alone (damping.h). Once limits that are held have made more directions singular than the first A
 * had, it is not damped, but seeks the J_k qdot(s) of the first: a limit that takes a direction which the task does not
 * need does not stop the task. qdot_0 is zero inside all limits, else the way back (Recovery). What all tasks leave
 * free goes towards qdot_p where there is a posture, straight on up to a limit and then along it. Limits are those of
 * (8), rotations bounded by rotation_velocity. */
class Sns final : public Resolver {
 public:
  explicit Sns(const MethodParameters& parameters) : Resolver(parameters), recovery_(parameters.backend) {}
  Method method() const override { return Method::kSns; }

 private:
  /** The part of a task's velocity that is had, and what limits the rest. */
  struct Scaled {
    double s = -1.0;  ///< below zero: no s keeps the limits
    int side = -1;    ///< that s stands at
  };

  void setSides(const StepProblem& problem, const VelocityBounds& bounds) noexcept {
    side_count_ = 0;
    for (int j = 0; j < problem.joint_count; ++j) {
      if (bounds.upper[j] < safety::kUnlimited)
        side_[static_cast<std::size_t>(side_count_++)] = {j, j, 1.0, 0.0, bounds.upper[j]};
      if (bounds.lower[j] > -safety::kUnlimited)
        side_[static_cast<std::size_t>(side_count_++)] = {j, j, -1.0, 0.0, -bounds.lower[j]};
    }
    for (int i = 0; i < bounds.row_count; ++i) {
      const CoupledRow& row = problem.row[static_cast<std::size_t>(i)];
      if (bounds.row_rate[static_cast<std::size_t>(i)] < safety::kUnlimited)
        side_[static_cast<std::size_t>(side_count_++)] = {row.first, row.second, row.a_first, row.a_second,
                                                          bounds.row_rate[static_cast<std::size_t>(i)]};
    }
  }

  /// The largest s in [0, 1] for which base + s slope keeps all sides.
  Scaled scale(const RobotVector& base, const RobotVector& slope) const noexcept {
    Scaled result{1.0, -1};
    double least = 0.0;
    for (int i = 0; i < side_count_; ++i) {
      const Side& side = side_[static_cast<std::size_t>(i)];
      const double room = side.value - side.of(base) + kOver, rate = side.of(slope);
      if (rate > 0.0 && room < result.s * rate)
        result = {room / rate, i};
      else if (rate < 0.0)
        least = std::max(least, room / rate);
      else if (rate == 0.0 && room < 0.0)
        return {-1.0, i};
    }
    return result.s < least ? Scaled{-1.0, result.side} : result;
  }

  /// A^T (A A^T + D)^-1 w.
  static RobotVector answer(const TaskJacobian& A,
                            const Eigen::LLT<TaskGram>& factor,
                            const TaskVector& wanted) noexcept {
    const TaskVector y = factor.solve(wanted);
    return A.transpose().lazyProduct(y);
  }

  /// |J qdot - w|.
  static double missed(const TaskJacobian& J, const RobotVector& velocity, const TaskVector& wanted) noexcept {
    const TaskVector has = J.lazyProduct(velocity);
    return (has - wanted).norm();
  }

  /// One task: velocity becomes qdot_k. @return s_k
  double resolveTask(const Task& task, RobotVector& velocity) noexcept {
    RobotVector base = velocity;
    held_ = projector_;
    double best = 0.0;
    TaskVector offset = TaskVector::Zero(task.velocity.size()), wanted = task.velocity;  // J_k qdot(s) sought
    TaskVector first_offset = offset, first = wanted;                                    // that of the first round
    int singular = 0;
    bool exact = false;
    const int joints = static_cast<int>(velocity.size());
    for (int round = 0; round <= joints; ++round) {
      const TaskJacobian A = task.jacobian.lazyProduct(held_);
      const TaskGram plain = A.lazyProduct(A.transpose());
      TaskGram gram = plain;
      if (!exact) {
        const int lost = dampSingularDirections(plain, parameters_.singular_lever, gram);
        if (round == 0)
          singular = lost;
        exact = lost > singular;
      }
      if (exact) {
        gram = plain;
        gram.diagonal().array() += kNoLever * kNoLever;
        offset = first_offset;
        wanted = first;
      }
      const Eigen::LLT<TaskGram> factor(gram);
      if (factor.info() != Eigen::Success)
        break;
      const TaskVector done = task.jacobian.lazyProduct(base);
      const RobotVector start = base + answer(A, factor, offset - done);
      const RobotVector slope = answer(A, factor, wanted);
      if (round == 0) {
        first_offset = task.jacobian.lazyProduct(start);
        first = task.jacobian.lazyProduct(slope);
      }
      if (exact && missed(task.jacobian, start, offset) + missed(task.jacobian, slope, wanted) >
                       kRankLost * (offset.norm() + wanted.norm()))
        break;  // what is held has taken a direction that the task needs with it
      const Scaled scaled = scale(start, slope);
      if (scaled.s > best) {
        best = scaled.s;
        velocity = start + scaled.s * slope;
      }
      if (scaled.s >= 1.0 || scaled.side < 0 || !hold(side_[static_cast<std::size_t>(scaled.side)], base))
        break;
    }
    return best;
  }

  /// Holds a side from now on. @return whether anything was left to hold it with
  bool hold(const Side& side, RobotVector& base) noexcept {
    RobotVector u = side.a_first * held_.col(side.first);
    if (side.a_second != 0.0)
      u += side.a_second * held_.col(side.second);
    const double free = side.of(u);
    if (free < kDependentRow)
      return false;
    base += u * ((side.value - side.of(base)) / free);
    for (int j = 0; j < u.size(); ++j)
      held_.col(j) -= u * (u[j] / free);
    return true;
  }

  /// Null space that the task leaves: removes its rows from projector_, one after the other.
  void project(const Task& task) noexcept {
    for (int i = 0; i < task.velocity.size(); ++i) {
      const RobotVector row = task.jacobian.row(i).transpose();
      const RobotVector u = projector_.lazyProduct(row);
      const double free = u.dot(row);
      if (free < kDependentRow * row.squaredNorm() || free <= 0.0)
        continue;
      for (int j = 0; j < u.size(); ++j)
        projector_.col(j) -= u * (u[j] / free);
    }
  }

  /// Towards a velocity as far as the tasks leave it free: straight on up to a limit, then along it.
  void follow(const RobotVector& wanted, RobotVector& velocity) noexcept {
    held_ = projector_;
    for (int round = 0; round <= velocity.size(); ++round) {
      const RobotVector rest = wanted - velocity;
      const RobotVector slope = held_.lazyProduct(rest);
      const Scaled scaled = scale(velocity, slope);
      if (scaled.s > 0.0)
        velocity += scaled.s * slope;
      RobotVector there = velocity;
      if (scaled.s >= 1.0 || scaled.side < 0 || !hold(side_[static_cast<std::size_t>(scaled.side)], there))
        return;
    }
  }

  SolveStatus resolve(const StepProblem& problem, Solution& solution) noexcept override {
    velocityBounds(problem, parameters_.bounds, parameters_.period, solution.bounds);
    boundSteps(problem, parameters_.translation_step / parameters_.period, parameters_.rotation_velocity,
               solution.bounds);
    recovery_.apply(problem, solution.bounds, solution.velocity);
    setSides(problem, solution.bounds);
    projector_.setIdentity(problem.joint_count, problem.joint_count);
    for (int k = 0; k < problem.task_count; ++k) {
      const Task& task = problem.task[static_cast<std::size_t>(k)];
      solution.scale[static_cast<std::size_t>(k)] = resolveTask(task, solution.velocity);
      project(task);
    }
    if (problem.posture.size() > 0)
      follow(postureVelocity(problem, parameters_, parameters_.rotation_velocity), solution.velocity);
    return SolveStatus::kSolved;
  }

  Recovery recovery_;
  int side_count_ = 0;
  std::array<Side, 2 * safety::kMaxJoints + kMaxRows> side_{};
  Projector projector_, held_;
};

}  // namespace

std::unique_ptr<Resolver> makeSns(const MethodParameters& parameters) { return std::make_unique<Sns>(parameters); }

}  // namespace tandem::control
