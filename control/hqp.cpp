// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "control/damping.h"
#include "control/detail/qp_methods.h"
#include "control/methods.h"
#include "control/posture.h"
#include "control/recovery.h"

namespace tandem::control {
namespace {

/** Our own hierarchy: all inequalities first, then the tasks in their order, then where the tubes would rather be.
 *
 *   L     lower <= qdot <= upper,   a_i^T qdot <= rate_i  (coupled rows),   g_i^T qdot >= r_i  (margins)
 *
 *   level 0, where a margin is below its least value or a joint outside its limits: the way back (Recovery), and
 *     qdot_0 = argmax t   s.t.  L,   g_i^T qdot >= t r_i  for the margins that have to grow,   0 <= t <= 1
 *
 *   level k = 1 ... m-1, all tasks but the last one:
 *     qdot_k, y, s_k = argmin  -s + zeta/2 (|qdot|_W^2 + |y|^2 + s^2)
 *     s.t.  J_k qdot + D_k y = J_k qdot_{k-1} + s (v_k - J_k qdot_{k-1}),   J_i qdot = J_i qdot_i  for i < k,
 *           0 <= s <= 1 / (1 - delta),   L;      then back by delta of the way to qdot_{k-1}, s = 0
 *
 *   level m, the last task:
 *     qdot_m, y = argmin  1/2 |J_m qdot + D_m y - v_m|^2 + zeta_m/2 (|qdot|_W^2 + |y|^2)
 *     s.t.  J_i qdot = J_i qdot_i  for i < m,   L
 *
 *   last level:
 *     qdot = argmin  |qdot - qdot_c|_W^2   s.t.  J_i qdot = J_i qdot_i  for all i,   L
 *
 * Without the reserve delta, a task that limits scale down would leave those after it a face of L, and which face that
 * is changes all at once: there strict priorities jump. With it every level has points inside L, and its set of
 * velocities changes continuously. s_k is 1 where the limits allow 1 / (1 - delta), else 1 - delta times the largest.
 *
 * The regularisation of the linear programme max s is exact (Mangasarian & Meyer 1979, Friedlander & Tseng 2007): below
 * some zeta, s_k is that of the programme itself, to the last digit, and of all its solutions qdot_k is the least. For
 * any zeta each level is strictly convex, so that its solution is unique and changes continuously with the problem,
 * also where active limits change. The last task is answered as near as the limits allow instead of more slowly in its
 * own direction: what cannot go straight goes along the limit.
 *
 * D_k damps the singular directions of J_k as far as the tasks before leave it free, and nothing else (damping.h).
 * Holding a task, J_i qdot = J_i qdot_i, in a direction in which joints hardly move it, pins these joints to what
 * rounding makes of 0 / 0, and it jumps with every digit. Where a task is near singular, tasks are therefore held as
 *
 *   J_i qdot + eta w = J_i qdot_i   at the cost 1/2 |w|^2,
 *
 * which lets go of directions far below eta alone, continuously, and changes a task by less than eta times a velocity.
 * W weighs a translation by spread_distance as a rotation by 1 rad. qdot_c is the velocity towards the posture where
 * there is one, else away from limits and neighbours that are nearer than spread_distance (spreadVelocity()). */
class Hqp final : public Resolver {
 public:
  explicit Hqp(const MethodParameters& parameters)
      : Resolver(parameters),
        recovery_(parameters.backend),
        margins_(makeQpBackend(parameters.backend)),
        last_(makeQpBackend(parameters.backend)) {
    for (auto& backend : backend_)
      backend = makeQpBackend(parameters.backend);
  }
  Method method() const override { return Method::kHqp; }
  void reset() noexcept override {
    recovery_.reset();
    for (auto& backend : backend_)
      backend->reset();
    margins_->reset();
    last_->reset();
  }

 private:
  /// Sizes the QP: `extra` variables behind the velocities, rows of L; equalities hold tasks before `level`, with w
  /// behind all other variables where one of them is near singular.
  void setLimits(const StepProblem& problem, const Solution& solution, int level, int extra, int equalities) {
    const int rows = solution.bounds.row_count;
    int held = 0;
    for (int i = 0; i < level; ++i)
      held += static_cast<int>(done_[i].size());
    const int soft = singular_ ? held : 0;
    qp_.resize(problem.joint_count + extra + soft, held + equalities, rows + problem.barrier_count);
    for (int i = 0; i < soft; ++i)
      qp_.E(i, problem.joint_count + extra + i) = kHold;
    qp_.H.diagonal().tail(soft).setOnes();
    addLimits(problem, solution.bounds, qp_);
    for (int i = 0; i < problem.barrier_count; ++i) {
      qp_.A.row(rows + i).head(problem.joint_count) = -problem.barrier[i].gradient.transpose();
      qp_.b[rows + i] = -rate_[i];
    }
    for (int i = 0, row = 0; i < level; ++i) {
      const int size = static_cast<int>(done_[i].size());
      qp_.E.block(row, 0, size, problem.joint_count) = problem.task[i].jacobian;
      qp_.e.segment(row, size) = done_[i];
      row += size;
    }
  }

  SolveStatus solve(QpBackend& backend, Solution& solution) {
    backend.solve(qp_, qp_solution_);
    solution.iterations += qp_solution_.iterations;
    if (qp_solution_.status != QpStatus::kSolved)
      return statusOf(qp_solution_.status);
    solution.kkt_residual = std::max(solution.kkt_residual, qp_solution_.residual);
    solution.velocity = qp_solution_.x.head(solution.velocity.size());
    return SolveStatus::kSolved;
  }

  /// Level 0: what margins may ask for at all.
  void findMarginRates(const StepProblem& problem, Solution& solution) {
    const int n = problem.joint_count, rows = solution.bounds.row_count;
    bool grow = false;
    for (int i = 0; i < problem.barrier_count; ++i) {
      rate_[i] = problem.barrier[i].rate;
      grow = grow || rate_[i] > problem.barrier[i].gradient.dot(solution.velocity);
    }
    if (!grow)
      return;
    setLimits(problem, solution, 0, 1, 0);
    for (int i = 0; i < problem.barrier_count; ++i) {
      const double now = problem.barrier[i].gradient.dot(solution.velocity);
      if (rate_[i] > now) {
        qp_.b[rows + i] = -now;
        qp_.A(rows + i, n) = rate_[i] - now;
      }
    }
    costOfShare(n, 0);
    const RobotVector before = solution.velocity;
    if (solve(*margins_, solution) != SolveStatus::kSolved)
      solution.velocity = before;
    // By a little less than what was found: rounding must not forbid it.
    for (int i = 0; i < problem.barrier_count; ++i) {
      const double now = problem.barrier[i].gradient.dot(solution.velocity);
      rate_[i] = std::min(rate_[i], now - kRounding * std::abs(now));
    }
  }

  /// -s + zeta/2 (|qdot|_W^2 + s^2 + ...), s standing behind the velocities.
  void costOfShare(int n, int damped) {
    qp_.H.diagonal().segment(n, 1 + damped).setConstant(parameters_.hqp_zeta);
    qp_.H.diagonal().head(n) = parameters_.hqp_zeta * weight_;
    qp_.g[n] = -1.0;
    qp_.lower[n] = 0.0;
    qp_.upper[n] = 1.0;
  }

  /** J_k W^-1 J_k^T without what the tasks before have taken: with A = J W^-1/2 and A_p those of the tasks before,
   *  A (I - A_p^T (A_p A_p^T + D_p^2)^-1 A_p) A^T. @return how many directions are singular; `factor_` damps them. */
  int damp(const StepProblem& problem, int k) {
    TaskJacobian scaled = problem.task[k].jacobian;
    for (int j = 0; j < problem.joint_count; ++j)
      scaled.col(j) /= weight_[j];
    TaskGram gram = scaled.lazyProduct(problem.task[k].jacobian.transpose());
    if (before_.rows() > 0) {
      const auto mixed = before_.lazyProduct(scaled.transpose()).eval();
      gram -= mixed.transpose().lazyProduct(before_factor_.solve(mixed));
    }
    return dampingFactor(gram, parameters_.singular_lever, factor_);
  }

  /// Takes task k among those before.
  void remember(const StepProblem& problem, int k) {
    const Task& task = problem.task[k];
    const int size = static_cast<int>(task.velocity.size()), old = static_cast<int>(before_.rows());
    done_[k] = task.jacobian.lazyProduct(solution_velocity_);
    before_.conservativeResize(old + size, problem.joint_count);
    before_.bottomRows(size) = task.jacobian;
    before_damping_.conservativeResize(old + size, old + size);
    before_damping_.bottomRows(size).setZero();
    before_damping_.rightCols(size).setZero();
    before_damping_.bottomRightCorner(size, size) = factor_.lazyProduct(factor_);
    EqualityMatrix scaled = before_;
    for (int j = 0; j < problem.joint_count; ++j)
      scaled.col(j) /= weight_[j];
    Gram gram = before_.lazyProduct(scaled.transpose()) + before_damping_;
    before_factor_.compute(gram);
  }

  SolveStatus share(const StepProblem& problem, int k, Solution& solution) {
    const int n = problem.joint_count;
    const Task& task = problem.task[k];
    const int size = static_cast<int>(task.velocity.size());
    const bool singular = damp(problem, k) > 0;
    const int damped = singular ? size : 0;
    setLimits(problem, solution, k, 1 + damped, size);
    costOfShare(n, damped);
    qp_.upper[n] = 1.0 / (1.0 - kReserve);
    const RobotVector before = solution.velocity;
    const TaskVector now = task.jacobian.lazyProduct(solution.velocity);
    const int row = qp_.equalities() - size;
    qp_.E.block(row, 0, size, n) = task.jacobian;
    qp_.E.block(row, n, size, 1) = now - task.velocity;
    if (singular)
      qp_.E.block(row, n + 1, size, size) = factor_;
    qp_.e.segment(row, size) = now;
    singular_ = singular_ || singular;
    const SolveStatus status = solve(*backend_[k], solution);
    if (status != SolveStatus::kSolved)
      return status;
    // Both ends satisfy L and the tasks before, so does what lies between them.
    solution.velocity = before + (1.0 - kReserve) * (solution.velocity - before);
    solution.scale[k] = (1.0 - kReserve) * qp_solution_.x[n];
    return status;
  }

  SolveStatus nearest(const StepProblem& problem, int k, Solution& solution) {
    const int n = problem.joint_count;
    const Task& task = problem.task[k];
    const int size = static_cast<int>(task.velocity.size());
    const int extra = damp(problem, k) > 0 ? size : 0;
    setLimits(problem, solution, k, extra, 0);
    qp_.H.topLeftCorner(n, n) = task.jacobian.transpose().lazyProduct(task.jacobian);
    qp_.g.head(n) = -(task.jacobian.transpose().lazyProduct(task.velocity));
    if (extra > 0) {
      qp_.H.block(0, n, n, size) = task.jacobian.transpose().lazyProduct(factor_);
      qp_.H.block(n, 0, size, n) = factor_.lazyProduct(task.jacobian);
      qp_.H.block(n, n, size, size) = factor_.lazyProduct(factor_);
      qp_.g.segment(n, size) = -factor_.lazyProduct(task.velocity);
      singular_ = true;
    }
    qp_.H.diagonal().head(n) += kNearestZeta * weight_;
    qp_.H.diagonal().segment(n, extra).array() += kNearestZeta;
    const SolveStatus status = solve(*backend_[k], solution);
    const TaskVector now = task.jacobian.lazyProduct(solution.velocity);
    const double wanted = task.velocity.squaredNorm();
    solution.scale[k] = wanted > 0.0 ? std::clamp(now.dot(task.velocity) / wanted, 0.0, 1.0) : 1.0;
    return status;
  }

  SolveStatus solvePosture(const StepProblem& problem, Solution& solution) {
    const int n = problem.joint_count;
    const RobotVector wanted = problem.posture.size() > 0
                                   ? postureVelocity(problem, parameters_, parameters_.rotation_velocity)
                                   : spreadVelocity(problem, parameters_);
    setLimits(problem, solution, problem.task_count, 0, 0);
    qp_.H.diagonal().head(n) = weight_;
    qp_.g.head(n) = -weight_.cwiseProduct(wanted);
    return solve(*last_, solution);
  }

  SolveStatus resolve(const StepProblem& problem, Solution& solution) noexcept override {
    velocityBounds(problem, parameters_.bounds, parameters_.period, solution.bounds);
    boundSteps(problem, parameters_.translation_step / parameters_.period, parameters_.rotation_velocity,
               solution.bounds);
    weight_.setOnes(problem.joint_count);
    for (int j = 0; j < problem.joint_count; ++j) {
      if (problem.joint[j].kind == JointKind::kTranslation)
        weight_[j] = 1.0 / (parameters_.spread_distance * parameters_.spread_distance);
    }
    before_.resize(0, problem.joint_count);
    before_damping_.resize(0, 0);
    singular_ = false;
    recovery_.apply(problem, solution.bounds, solution.velocity);
    findMarginRates(problem, solution);
    for (int k = 0; k < problem.task_count; ++k) {
      const bool last = k + 1 == problem.task_count;
      const SolveStatus status = last ? nearest(problem, k, solution) : share(problem, k, solution);
      // The velocity of the level before satisfies every constraint of this one: what is called infeasible has no other
      // point, up to rounding.
      if (status != SolveStatus::kSolved && status != SolveStatus::kInfeasible)
        return status;
      solution_velocity_ = solution.velocity;
      remember(problem, k);
    }
    const SolveStatus status = solvePosture(problem, solution);
    return status == SolveStatus::kInfeasible ? SolveStatus::kSolved : status;
  }

  static constexpr double kRounding = 1e-9;
  static constexpr double kReserve = 0.02;      ///< delta
  static constexpr double kHold = 1e-9;         ///< eta, m/rad: far above rounding, far below what can be seen
  static constexpr double kNearestZeta = 1e-6;  ///< zeta_m, m^2/rad^2

  using Gram = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxEqualities, kMaxEqualities>;
  Recovery recovery_;
  std::array<std::unique_ptr<QpBackend>, kMaxTasks> backend_;  ///< one per level: each is warm-started by itself
  std::unique_ptr<QpBackend> margins_, last_;
  QuadraticProgram qp_;
  QpSolution qp_solution_;
  RobotVector weight_, solution_velocity_;
  std::array<double, kMaxBarriers> rate_{};  ///< of margins, as far as they can be had
  std::array<TaskVector, kMaxTasks> done_;   ///< J_i qdot_i
  EqualityMatrix before_;                    ///< Jacobians of the levels so far
  Gram before_damping_;                      ///< their D^2
  Eigen::LLT<Gram> before_factor_;
  TaskGram factor_;        ///< D_k
  bool singular_ = false;  ///< a task so far is near singular
};

}  // namespace

std::unique_ptr<Resolver> makeHqp(const MethodParameters& parameters) { return std::make_unique<Hqp>(parameters); }

}  // namespace tandem::control
