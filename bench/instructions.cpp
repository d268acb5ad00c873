// SPDX-License-Identifier: Apache-2.0
/** @file Workload for instructions.py: repeated calls of one function, delimited for callgrind, which counts
 * instructions independently of machine load. */
#include <algorithm>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <map>
#include <string>

#include "bench/joint_paths.h"
#include "bench/step_problems.h"
#include "control/methods.h"
#include "control/quadratic_program.h"
#include "control/resolver.h"
#include "kinematics/rotations.h"
#include "kinematics/tube_model.h"
#include "planning/reference_tracker.h"

/// Callgrind counts inside this function only (--toggle-collect).
// NOLINTNEXTLINE(readability-identifier-naming): a name of C
extern "C" [[gnu::noipa]] void tandem_measured(const std::function<void()>& call) { call(); }

namespace tandem::bench {
namespace {

constexpr std::uint32_t kSeed = 20240607;

/// Call whose instructions callgrind counts.
void measure(const std::function<void()>& call) { tandem_measured(call); }

/// Constructs one workload; its result executes call number k, and measures it.
using Case = std::function<std::function<void(int)>()>;

/// Forward kinematics with its exact Jacobian. @param warm  along a path at 1 kHz, from the previous equilibrium
Case tip(const std::string& model_name, const kinematics::ConcentricTubeArm& arm, bool overlap, bool warm) {
  return [=]() -> std::function<void(int)> {
    constexpr int kMost = 1000;
    auto joints = warm ? controlPath(arm, overlap, 1e-3, kMost, kSeed) : randomJoints(arm, overlap, kMost, kSeed);
    return [=, model = std::shared_ptr<kinematics::ArmModel>(kinematics::makeArmModel(model_name, arm)),
            branch = std::make_shared<kinematics::Branch>()](int k) {
      kinematics::Tip answer;
      branch->known = branch->known && warm;
      const auto& q = joints[static_cast<std::size_t>(k % kMost)];
      auto status = kinematics::ModelStatus::kOk;
      measure([&] { status = model->tip(q, *branch, answer); });
      if (status != kinematics::ModelStatus::kOk)
        throw std::runtime_error("the model has no solution at joint vector " + std::to_string(k));
    };
  };
}

/// The compliant model with 50 mN at the tip. @param warm  from its own result, otherwise from a cold start
Case loaded(const kinematics::ConcentricTubeArm& arm, bool overlap, bool warm) {
  return [=]() -> std::function<void(int)> {
    constexpr int kMost = 50;
    const auto joints = randomJoints(arm, overlap, kMost, kSeed);
    const std::shared_ptr<kinematics::ArmModel> model = kinematics::makeArmModel("compliant", arm);
    return [=](int k) {
      const kinematics::Wrench wrench = 0.05 * kinematics::Wrench::Unit(0);
      const auto& q = joints[static_cast<std::size_t>(k % kMost)];
      kinematics::Branch branch;
      kinematics::LoadedTip answer;
      auto status = warm ? model->loadedTip(q, wrench, branch, answer) : kinematics::ModelStatus::kOk;
      if (status == kinematics::ModelStatus::kOk)
        measure([&] { status = model->loadedTip(q, wrench, branch, answer); });
      if (status != kinematics::ModelStatus::kOk)
        throw std::runtime_error("the model has no solution at joint vector " + std::to_string(k));
    };
  };
}

/// One quadratic programme. @param warm  after the same programme with a gradient of 1 % less
Case program(int rows, bool warm) {
  return [=]() -> std::function<void(int)> {
    constexpr int kMost = 200;
    const std::shared_ptr<control::QpBackend> backend = control::makeQpBackend(control::Backend::kActiveSet);
    const auto solution = std::make_shared<control::QpSolution>();
    return [=](int k) {
      auto problem = randomProgram(kSeed + static_cast<std::uint32_t>(k % kMost), rows);
      backend->reset();
      if (warm) {
        backend->solve(problem, *solution);
        problem.g *= 1.01;
      }
      measure([&] { backend->solve(problem, *solution); });
    };
  };
}

/// One step of two arms without the models, active-set solver. @param warm  after the same step with 1 % less velocity
/// @param tasks  at most, in their order
Case step(control::Method method, bool warm, int tasks = control::kMaxTasks) {
  return [=]() -> std::function<void(int)> {
    constexpr int kMost = 200;
    const auto solution = std::make_shared<control::Solution>();
    const std::shared_ptr<control::Resolver> resolver = control::makeResolver(method, {});
    return [=, problems = randomSteps(kMost, kSeed)](int k) {
      control::StepProblem problem = problems[static_cast<std::size_t>(k % kMost)];
      problem.task_count = std::min(problem.task_count, tasks);
      resolver->reset();
      if (warm) {
        resolver->solve(problem, *solution);
        for (int task = 0; task < problem.task_count; ++task)
          problem.task[task].velocity *= 1.01;
      }
      measure([&] { resolver->solve(problem, *solution); });
    };
  };
}

/** Arms side by side, their tracker, and random joints inside the limits. */
struct Cycle {
  Cycle(int arms, control::Method method, const std::string& model) {
    for (int k = 0; k < arms; ++k) {
      kinematics::ConcentricTubeArm arm = arkArm();
      arm.base.translation().y() = 5e-3 * (arms - 1 - 2 * k);
      owned.push_back(kinematics::makeArmModel(model, arm));
      models.push_back(owned.back().get());
      joints.push_back(randomJoints(arm, true, kMost, kSeed + static_cast<std::uint32_t>(k)));
    }
    limits = limitsOf(arkArm());
    tracker = std::make_unique<planning::ReferenceTracker>(
        models, std::vector<const safety::ArmLimits*>(models.size(), &limits), method, control::MethodParameters{},
        planning::Gains{});
  }
  safety::RobotVector at(int k) const {
    const Eigen::Index size = models[0]->jointCount();
    safety::RobotVector q(size * static_cast<Eigen::Index>(models.size()));
    for (std::size_t arm = 0; arm < models.size(); ++arm)
      q.segment(static_cast<Eigen::Index>(arm) * size, size) = joints[arm][static_cast<std::size_t>(k % kMost)];
    return q;
  }
  /// These tasks, 0.5 mm and 1 deg away; of the shaft beside the tip's axis, 50 mm behind the tip.
  planning::Reference reference(const std::vector<planning::TaskKind>& kinds) const {
    planning::Reference reference;
    const auto pose = [&](int arm) { return result.tip[static_cast<std::size_t>(arm)].pose; };
    for (const planning::TaskKind kind : kinds) {
      const kinematics::TaskKindEntry& entry = *kinematics::findTaskKind(kind);
      const int other = entry.relative() ? 1 : 0;
      const kinematics::TaskPlace place = entry.place(pose(0), pose(other));
      planning::TaskReference& task = reference.tasks[static_cast<std::size_t>(reference.task_count++)];
      task = {kind, 0, other, place.position + Eigen::Vector3d(0, 5e-4, 0)};
      task.orientation = kinematics::rotationBy({0.0175, 0, 0}) * place.orientation;
      if (entry.point == kinematics::TaskPoint::kShaft)
        task.position -= 0.05 * pose(0).linear().col(2);
    }
    return reference;
  }

  static constexpr int kMost = 200;
  std::vector<std::unique_ptr<kinematics::ArmModel>> owned;
  std::vector<const kinematics::ArmModel*> models;
  std::vector<std::vector<Eigen::VectorXd>> joints;
  safety::ArmLimits limits;
  std::unique_ptr<planning::ReferenceTracker> tracker;
  planning::TrackResult result;
};

/// The complete step of the tracker, models included.
Case cycle(int arms,
           const std::vector<planning::TaskKind>& kinds,
           control::Method method = control::Method::kNspqp,
           const std::string& model = "rigid") {
  return [=]() -> std::function<void(int)> {
    const auto loop = std::make_shared<Cycle>(arms, method, model);
    return [=](int k) {
      const safety::RobotVector q = loop->at(k);
      if (!loop->tracker->computeTips(q, loop->result))
        throw std::runtime_error("the model has no solution at joint vector " + std::to_string(k));
      const planning::Reference reference = loop->reference(kinds);
      loop->tracker->restart();
      measure([&] { loop->tracker->step(q, q, reference, loop->result); });
      if (loop->result.status != planning::TrackStatus::kOk)
        throw std::runtime_error("the control step has no solution at joint vector " + std::to_string(k));
    };
  };
}

std::map<std::string, Case> cases() {
  std::map<std::string, Case> all;
  for (const auto& [name, arm] : {std::pair{std::string("ark2024"), arkArm()}, {"timc2024", timcArm()}}) {
    all["rigid " + name] = tip("rigid", arm, true, false);
    all["compliant " + name + ", apart, cold"] = tip("compliant", arm, false, false);
    all["compliant " + name + ", overlap, cold"] = tip("compliant", arm, true, false);
    all["compliant " + name + ", overlap, 1 kHz"] = tip("compliant", arm, true, true);
    all["loaded " + name + ", apart, cold"] = loaded(arm, false, false);
    all["loaded " + name + ", overlap, cold"] = loaded(arm, true, false);
    all["loaded " + name + ", overlap, warm"] = loaded(arm, true, true);
  }
  for (const int rows : {5, 8}) {
    all["qp " + std::to_string(rows) + " rows, cold"] = program(rows, false);
    all["qp " + std::to_string(rows) + " rows, warm"] = program(rows, true);
  }
  for (int m = 0; m < control::kMethodCount; ++m) {
    const auto method = static_cast<control::Method>(m);
    all["step " + std::string(control::name(method))] = step(method, false);
    if (control::solvesProgrammes(method))
      all["step " + std::string(control::name(method)) + ", warm"] = step(method, true);
  }
  all["step snsqp, level 1"] = step(control::Method::kSnsqp, false, 1);
  all["step snsqp, level 1, warm"] = step(control::Method::kSnsqp, true, 1);
  using enum planning::TaskKind;
  all["cycle, one arm, tip"] = cycle(1, {kTipPosition});
  all["cycle, one arm, tip and orientation"] = cycle(1, {kTipPosition, kTipOrientation});
  all["cycle, one arm, pose"] = cycle(1, {kTipPose});
  all["cycle, one arm, remote centre and tip"] = cycle(1, {kRemoteCentre, kTipPosition});
  all["cycle, two arms, relative pose as one task, tip"] = cycle(2, {kRelativePose, kTipPosition});
  all["cycle, two arms, positions"] = cycle(2, {kRelativePosition, kTipPosition});
  all["cycle, two arms, positions and axis"] = cycle(2, {kRelativePosition, kTipPosition, kTipAxis});
  all["cycle, two arms, relative pose and tip"] = cycle(2, {kRelativePosition, kRelativeOrientation, kTipPosition});
  for (const char* const model : {"rigid", "compliant"}) {
    const std::string end = std::string(", snsqp, ") + model;
    all["cycle, one arm, tip" + end] = cycle(1, {kTipPosition}, control::Method::kSnsqp, model);
    all["cycle, eight arms, positions" + end] =
        cycle(8, {kRelativePosition, kTipPosition}, control::Method::kSnsqp, model);
  }
  return all;
}

}  // namespace
}  // namespace tandem::bench

int main(int argc, char** argv) {
  const auto all = tandem::bench::cases();
  if (argc == 2 && std::string(argv[1]) == "--list") {
    for (const auto& [name, make] : all)
      std::cout << name << '\n';
    return 0;
  }
  const auto found = argc == 3 ? all.find(argv[1]) : all.end();
  const int count = argc == 3 ? std::atoi(argv[2]) : 0;
  if (found == all.end() || count < 1) {
    std::cerr << "usage: bench_instructions --list | CASE COUNT\n";
    return 2;
  }
  const auto call = found->second();
  for (int k = 0; k < count; ++k)
    call(k);
  return 0;
}
