// SPDX-License-Identifier: Apache-2.0
#include "control/method_check.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <random>

#include "control/velocity_bounds.h"

namespace tandem::control {
namespace {

constexpr int kProblems = 200;       // with far limits, and the same number with near ones
constexpr double kTolerance = 0.05;  // of a task's velocity
constexpr double kBeyond = 1e-8;     // m/s and rad/s, rounding of a velocity at its bound

template <class... Numbers>
std::string text(const char* format, Numbers... numbers) {
  std::array<char, 400> line{};
  std::snprintf(line.data(), line.size(), format, numbers...);
  return line.data();
}

/** Random problems in the robot's layout. */
class Problems {
 public:
  explicit Problems(const std::vector<const safety::ArmLimits*>& limits) {
    problem_.setLimits(limits.data(), static_cast<int>(limits.size()));
    const int n = problem_.joint_count;
    const int first = std::clamp(n - 1, 1, 3), second = std::clamp(n - first - 1, 0, 3);
    problem_.task_count = second > 0 ? 2 : 1;
    rows_ = {first, second};
  }

  StepProblem& far() {
    constexpr double kFar = 10.0;  // m, rad
    draw(1e-4);
    for (int j = 0; j < problem_.joint_count; ++j)
      limit(problem_.joint[static_cast<std::size_t>(j)], kFar, kFar, safety::kUnlimited);
    for (int i = 0; i < problem_.row_count; ++i)
      problem_.row[static_cast<std::size_t>(i)].gap = kFar;
    return problem_;
  }

  StepProblem& near() {
    draw(0.05);
    for (int j = 0; j < problem_.joint_count; ++j)
      limit(problem_.joint[static_cast<std::size_t>(j)], room(), room(), between(1e-3, 2e-2));
    for (int i = 0; i < problem_.row_count; ++i)
      problem_.row[static_cast<std::size_t>(i)].gap = room();
    return problem_;
  }

 private:
  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  /// m or rad; zero in one of ten cases.
  double room() { return between(0.0, 1.0) < 0.1 ? 0.0 : between(0.0, 2e-3); }

  void limit(JointState& joint, double below, double above, double velocity) {
    joint.position = between(-0.01, 0.01);
    joint.lower = joint.frozen_lower = joint.moving_lower = joint.position - below;
    joint.upper = joint.frozen_upper = joint.moving_upper = joint.position + above;
    joint.velocity = velocity;
    joint.approach_acceleration = safety::kUnlimited;
  }

  /// Draws tasks of this speed, m/s: translations move them one to one, rotations with a lever of 20 mm.
  void draw(double speed) {
    for (int k = 0; k < problem_.task_count; ++k) {
      Task& task = problem_.task[static_cast<std::size_t>(k)];
      const int rows = rows_[static_cast<std::size_t>(k)];
      task.jacobian.resize(rows, problem_.joint_count);
      task.velocity.resize(rows);
      for (int j = 0; j < problem_.joint_count; ++j) {
        const auto kind = problem_.joint[static_cast<std::size_t>(j)].kind;
        for (int i = 0; i < rows; ++i)
          task.jacobian(i, j) = between(-1.0, 1.0) * (kind == JointKind::kRotation ? 0.02 : 1.0);
      }
      for (int i = 0; i < rows; ++i)
        task.velocity[i] = between(-1.0, 1.0);
      task.velocity *= speed / task.velocity.norm();
    }
  }

  std::mt19937 random_{1};  // NOLINT(bugprone-random-generator-seed): reproducible result
  StepProblem problem_;
  std::array<int, 2> rows_{};
};

/** Check of one method; the first violation is the refusal. */
class Check {
 public:
  Check(Resolver& resolver, const CheckConditions& conditions)
      : resolver_(resolver), conditions_(conditions), problems_(conditions.limits) {}

  CheckResult run() {
    if (resolver_.method() != Method::kForeign) {
      refuse("found method() = " + std::string(name(resolver_.method())) + ", expected Method::kForeign");
    } else if (farLimits() && nearLimits() && judgeAllocations() && judgeTime()) {
      remark(time_);
    }
    return result_;
  }

 private:
  bool refuse(std::string why) {
    result_.refusal = std::move(why);
    return false;
  }
  void remark(const std::string& what) { result_.remarks += (result_.remarks.empty() ? "" : "; ") + what; }

  bool solve(const StepProblem& problem) {
    using Clock = std::chrono::steady_clock;
    const std::size_t before = conditions_.allocation_count == nullptr ? 0 : conditions_.allocation_count();
    const auto begin = Clock::now();
    resolver_.solve(problem, solution_);
    const double duration = std::chrono::duration<double>(Clock::now() - begin).count();
    if (conditions_.allocation_count != nullptr && !durations_.empty())
      allocations_ += conditions_.allocation_count() - before;
    durations_.push_back(duration);
    slow_ += conditions_.judge_time && duration > longest() ? 1 : 0;
    if (slow_ > kCalls / 20 && !judgeTime())
      return false;
    if (solution_.status == SolveStatus::kSolved || solution_.status == SolveStatus::kInfeasible)
      return true;
    return refuse(
        text("call %zu: found the status '%s', which also stands for a velocity that is not finite or not of "
             "%d joints; expected a finite velocity of every joint",
             durations_.size(), std::string(name(solution_.status)).c_str(), problem.joint_count));
  }

  bool farLimits() {
    int done = 0, claimed = 0;
    double error_sum = 0.0, progress = 0.0, share = 0.0;
    for (int i = 0; i < kProblems; ++i) {
      StepProblem& problem = problems_.far();
      if (!solve(problem))
        return false;
      const Task& first = problem.task[0];
      const TaskVector miss = first.jacobian.lazyProduct(solution_.velocity) - solution_.scale[0] * first.velocity;
      const double error = miss.norm() / first.velocity.norm();
      error_sum += error;
      done += error <= kTolerance ? 1 : 0;
      claimed += solution_.scale[0] >= 0.5 ? 1 : 0;
      if (problem.task_count < 2)
        continue;
      Task& second = problem.task[1];
      share += solution_.scale[1] / kProblems;
      const RobotVector forth = solution_.velocity;
      second.velocity = -second.velocity;
      if (!solve(problem))
        return false;
      const RobotVector change = 0.5 * (solution_.velocity - forth);
      progress += second.velocity.dot(second.jacobian.lazyProduct(change)) / second.velocity.squaredNorm() / kProblems;
    }
    constexpr int kMost = kProblems * 9 / 10;
    if (done < kMost || claimed < kMost) {
      return refuse(
          text("found |J_1 qdot - s_1 v_1| of %.2f |v_1| on average, below %.2f in %d, and s_1 above 0.5 in "
               "%d of %d problems whose limits are far, expected both in at least %d: the velocity has to "
               "follow from the Jacobian",
               error_sum / kProblems, kTolerance, done, claimed, kProblems, kMost));
    }
    if (share >= 0.1 && progress < 0.1) {
      return refuse(
          text("found that %.0f %% of task 2 is done where Solution::scale says %.0f %%, expected at least "
               "10 %%, or a scale below 0.1 for a task that the method neglects",
               100.0 * progress, 100.0 * share));
    }
    if (problems_.far().task_count > 1 && share < 0.1)
      remark("neglects tasks after the first");
    return true;
  }

  bool nearLimits() {
    int keeps = 0;
    for (int i = 0; i < kProblems; ++i) {
      const StepProblem& problem = problems_.near();
      if (!solve(problem))
        return false;
      const VelocityBounds& said = solution_.bounds;
      if (!said.lower.array().isFinite().any() && !said.upper.array().isFinite().any() && said.row_count == 0)
        continue;
      ++keeps;
      const double beyond = excess(problem);
      if (beyond > kBeyond) {
        return refuse(
            text("found a velocity %.2g m/s (rad/s) beyond the bounds of the joints, expected it within them, "
                 "or Solution::bounds left infinite by a method that leaves the limits to the gate",
                 beyond));
      }
    }
    if (keeps < kProblems)
      remark("leaves the limits to the gate");
    return true;
  }

  double excess(const StepProblem& problem) {
    const RobotVector& v = solution_.velocity;
    velocityBounds(problem, conditions_.parameters.bounds, conditions_.parameters.period, bounds_);
    double most = std::max((bounds_.lower - v).maxCoeff(), (v - bounds_.upper).maxCoeff());
    for (int i = 0; i < bounds_.row_count; ++i) {
      const CoupledRow& row = problem.row[static_cast<std::size_t>(i)];
      most = std::max(most, row.a_first * v[row.first] + row.a_second * v[row.second] -
                                bounds_.row_rate[static_cast<std::size_t>(i)]);
    }
    return most;
  }

  bool judgeAllocations() {
    if (conditions_.allocation_count == nullptr)
      remark("allocations not counted");
    if (allocations_ == 0)
      return true;
    return refuse(text("found %zu allocations in %zu calls, expected none after the first call", allocations_,
                       durations_.size() - 1));
  }

  bool judgeTime() {
    const auto at = static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(durations_.size()));
    std::nth_element(durations_.begin(), durations_.begin() + at, durations_.end());
    const double found = durations_[static_cast<std::size_t>(at)];
    if (conditions_.judge_time && found > longest()) {
      return refuse(
          text("found that 95 of 100 calls take up to %.3g ms, expected at most %.3g ms, half of the control "
               "period",
               1e3 * found, 1e3 * longest()));
    }
    time_ = text("95 of 100 calls take at most %.3g ms", 1e3 * found);
    return true;
  }

  double longest() const { return 0.5 * conditions_.parameters.period; }

  static constexpr int kCalls = 3 * kProblems;
  Resolver& resolver_;
  const CheckConditions& conditions_;
  Problems problems_;
  Solution solution_;
  VelocityBounds bounds_;
  CheckResult result_;
  std::vector<double> durations_;
  std::string time_;
  std::size_t allocations_ = 0;
  int slow_ = 0;
};

}  // namespace

CheckResult checkMethod(Resolver& resolver, const CheckConditions& conditions) {
  return Check(resolver, conditions).run();
}

}  // namespace tandem::control
