// SPDX-License-Identifier: Apache-2.0
/** @file Benchmark of the complete control cycle, models included, for growing numbers of tubes and arms. */
#include <benchmark/benchmark.h>

#include <memory>
#include <string>

#include "bench/enroll.h"
#include "bench/joint_paths.h"
#include "bench/percentiles.h"
#include "bench/step_problems.h"
#include "control/methods.h"
#include "kinematics/tube_model.h"
#include "planning/detail/pose_solvers.h"
#include "planning/reference_tracker.h"

namespace tandem::bench {
namespace {

using control::Backend;
using control::Method;
using planning::TaskKind;

constexpr std::uint32_t kSeed = 20240607;
constexpr double kPeriod = 0.1;   // s
constexpr int kPathLength = 100;  // cycles from one start

/** Arms in a row, with models and limits. */
struct Robot {
  Robot(int arms, const std::string& model) {
    for (int k = 0; k < arms; ++k) {
      kinematics::ConcentricTubeArm arm = arkArm();
      arm.base.translation().y() = 5e-3 * (arms - 1 - 2 * k);
      owned.push_back(kinematics::makeArmModel(model, arm));
      limits.push_back(limitsOf(arm));
    }
    for (int k = 0; k < arms; ++k) {
      models.push_back(owned[static_cast<std::size_t>(k)].get());
      limit_pointers.push_back(&limits[static_cast<std::size_t>(k)]);
    }
  }
  std::vector<std::unique_ptr<kinematics::TubeModel>> owned;
  std::vector<safety::ArmLimits> limits;
  std::vector<const kinematics::ArmModel*> models;
  std::vector<const safety::ArmLimits*> limit_pointers;
};

/// One arm: its tip. More: relative position of the first two, tip of the first, and likewise of the next two.
planning::Reference tasksOf(int arms, const planning::TrackResult& at, const Eigen::Vector3d& offset) {
  planning::Reference reference;
  const auto place = [&](int arm) -> Eigen::Vector3d {
    return at.tip[static_cast<std::size_t>(arm)].pose.translation();
  };
  const auto add = [&](TaskKind kind, int arm, int other, const Eigen::Vector3d& position) {
    reference.tasks[static_cast<std::size_t>(reference.task_count++)] = {kind, arm, other, position};
  };
  for (int arm = 0; arm < std::min(arms, 4); arm += 2) {
    if (arm + 1 < arms)
      add(TaskKind::kRelativePosition, arm, arm + 1, place(arm) - place(arm + 1));
    add(TaskKind::kTipPosition, arm, 0, place(arm) + offset);
  }
  return reference;
}

/** Cycles of a closed loop, recorded for repeated timing. */
struct Loop {
  std::vector<safety::RobotVector> joints;
  std::vector<planning::Reference> references;
};

/// Tips follow circles of 5 mm radius at 2 mm/s from random starts, within the limits; the same for all methods.
Loop record(const Robot& robot, int paths, int length) {
  const int arms = static_cast<int>(robot.models.size());
  control::MethodParameters parameters;
  parameters.period = kPeriod;
  planning::ReferenceTracker tracker(robot.models, robot.limit_pointers, Method::kSns, parameters, {});
  const auto starts = randomJoints(robot.owned[0]->arm(), true, 2 * paths * arms, kSeed);
  Loop loop;
  planning::TrackResult result;
  for (std::size_t next = 0; loop.joints.size() < static_cast<std::size_t>(paths) * static_cast<std::size_t>(length) &&
                             next < starts.size();) {
    safety::RobotVector q(tracker.jointCount());
    for (int k = 0; k < arms; ++k)
      q.segment(6 * k, 6) = starts[next++];
    tracker.restart();
    tracker.computeTips(q, result);
    const planning::TrackResult begin = result;
    Loop path;
    for (int step = 0; step < length && (step == 0 || result.status == planning::TrackStatus::kOk); ++step) {
      constexpr double kRadius = 5e-3, kRate = 0.4;
      const double angle = kRate * kPeriod * step;
      const Eigen::Vector3d offset(kRadius * std::sin(angle), kRadius * (1.0 - std::cos(angle)), 0.0);
      path.joints.push_back(q);
      path.references.push_back(tasksOf(arms, begin, offset));
      tracker.step(q, q, path.references.back(), result);
      q += kPeriod * result.solution.velocity;
    }
    if (path.joints.size() != static_cast<std::size_t>(length) || result.status != planning::TrackStatus::kOk)
      continue;  // a model or the method failed on the path
    loop.joints.insert(loop.joints.end(), path.joints.begin(), path.joints.end());
    loop.references.insert(loop.references.end(), path.references.begin(), path.references.end());
  }
  return loop;
}

void timeCycle(benchmark::State& state, int arms, const std::string& model, Method method, Backend backend, bool warm) {
  const bool few = backend == Backend::kIpopt;  // slow
  const int length = few ? 10 : kPathLength;
  const Robot robot(arms, model);
  control::MethodParameters parameters;
  parameters.period = kPeriod;
  parameters.backend = backend;
  const Loop loop = record(robot, few ? 3 : 20, length);
  Percentiles percentiles(loop.joints.size());
  planning::TrackResult result;
  int failed = 0;
  for (auto _ : state) {
    double seconds = 0.0;
    failed = 0;
    std::unique_ptr<planning::ReferenceTracker> fresh;
    for (std::size_t k = 0; k < loop.joints.size(); ++k) {
      if (!warm || k % static_cast<std::size_t>(length) == 0)
        fresh = std::make_unique<planning::ReferenceTracker>(robot.models, robot.limit_pointers, method, parameters,
                                                             planning::Gains{});
      seconds += percentiles.time(k, [&] { fresh->step(loop.joints[k], loop.joints[k], loop.references[k], result); });
      const auto status = result.solution.status;
      const bool answered = result.status == planning::TrackStatus::kOk || status == control::SolveStatus::kInfeasible;
      failed += answered ? 0 : 1;
    }
    state.SetIterationTime(seconds / static_cast<double>(loop.joints.size()));
  }
  percentiles.report(state);
  state.counters["failed"] = failed;
}

/// Inverse kinematics of two arms from a point of a path to the tips ten periods later, as `plan check` does it from
/// point to point: by steps, or with Ipopt.
void timePose(benchmark::State& state, const std::string& model, bool by_steps) {
  constexpr std::size_t kApart = 10;
  const Robot robot(2, model);
  const Loop loop = record(robot, 5, kPathLength);
  const planning::Arms arms{robot.models, robot.limit_pointers};
  std::vector<planning::PoseProblem> problems;
  for (std::size_t k = 0; k + kApart < loop.joints.size(); k += by_steps ? 1 : 7) {
    if (k % kPathLength + kApart >= kPathLength)
      continue;
    planning::PoseProblem problem{&arms, {}, loop.joints[k], std::vector<kinematics::Branch>(2), false, false, {}};
    for (int arm = 0; arm < 2; ++arm) {
      kinematics::Tip tip;
      robot.owned[static_cast<std::size_t>(arm)]->tip(loop.joints[k].segment(6 * arm, 6),
                                                      problem.branches[static_cast<std::size_t>(arm)], tip);
      kinematics::Branch branch = problem.branches[static_cast<std::size_t>(arm)];
      robot.owned[static_cast<std::size_t>(arm)]->tip(loop.joints[k + kApart].segment(6 * arm, 6), branch, tip);
      problem.targets.push_back({arm, tip.pose.translation(), {}});
    }
    problems.push_back(problem);
  }
  Percentiles percentiles(problems.size());
  int failed = 0;
  for (auto _ : state) {
    double seconds = 0.0;
    failed = 0;
    for (std::size_t k = 0; k < problems.size(); ++k) {
      bool solved = false;
      seconds += percentiles.time(k, [&] {
        solved = by_steps ? planning::solveBySteps(problems[k], problems[k].reference).has_value()
                          : planning::solveByIpopt(problems[k], problems[k].reference, 100, {}).solved;
      });
      failed += solved ? 0 : 1;
    }
    state.SetIterationTime(seconds / static_cast<double>(problems.size()));
  }
  percentiles.report(state);
  state.counters["failed"] = failed;
}

/// Tip and Jacobian of an arm with `tubes` tubes, cold start, with overlapping curved parts.
void timeTubes(benchmark::State& state, int tubes, const std::string& name) {
  const auto model = kinematics::makeArmModel(name, arkArm(tubes));
  const auto joints = randomJoints(model->arm(), true, 2000, kSeed);
  Percentiles percentiles(joints.size());
  kinematics::Tip tip;
  int failed = 0;
  for (auto _ : state) {
    double seconds = 0.0;
    failed = 0;
    for (std::size_t k = 0; k < joints.size(); ++k) {
      kinematics::ModelStatus status{};
      seconds += percentiles.time(k, [&] { status = model->tip(joints[k], tip); });
      failed += status == kinematics::ModelStatus::kOk ? 0 : 1;
    }
    state.SetIterationTime(seconds / static_cast<double>(joints.size()));
  }
  percentiles.report(state);
  state.counters["failed"] = failed;
}

}  // namespace

void enrollAll() {
  for (const std::string model : {"rigid", "compliant"}) {
    for (int m = 0; m < control::kMethodCount; ++m) {
      const auto method = static_cast<Method>(m);
      const std::string name = "cycle/" + std::string(control::name(method)) + "/" + model + "/active-set/";
      for (const bool warm : {true, false})
        enroll(name + (warm ? "warm" : "cold"),
               [=](auto& state) { timeCycle(state, 2, model, method, Backend::kActiveSet, warm); });
      if (control::solvesProgrammes(method))
        enroll("cycle/" + std::string(control::name(method)) + "/" + model + "/ipopt/warm",
               [=](auto& state) { timeCycle(state, 2, model, method, Backend::kIpopt, true); });
    }
    for (const bool by_steps : {true, false})
      enroll("pose/" + model + (by_steps ? "/steps" : "/ipopt"),
             [=](auto& state) { timePose(state, model, by_steps); });
    for (int arms = 1; arms <= safety::kMaxArms; ++arms)
      enroll("arms/snsqp/" + model + "/active-set/" + std::to_string(arms),
             [=](auto& state) { timeCycle(state, arms, model, Method::kSnsqp, Backend::kActiveSet, true); });
    for (int tubes = 2; tubes <= kinematics::kMaxTubes; ++tubes)
      enroll("tubes/tip/" + model + "/cold/" + std::to_string(tubes),
             [=](auto& state) { timeTubes(state, tubes, model); });
  }
}

}  // namespace tandem::bench
