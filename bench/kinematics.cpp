// SPDX-License-Identifier: Apache-2.0
/** @file Benchmark of forward kinematics with Jacobian: rigid model, compliant model, textbook shooting method as
 * baseline. */
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <string>

#include "bench/cooperative.h"
#include "bench/enroll.h"
#include "bench/joint_paths.h"
#include "bench/percentiles.h"
#include "bench/shooting_baseline.h"
#include "kinematics/tube_model.h"

namespace tandem::bench {
namespace {

using kinematics::Branch;
using kinematics::ModelStatus;
using kinematics::Tip;

/// Sequence of the joint vectors.
enum class Use {
  kCold,         ///< random, cold start
  kWarm,         ///< the same joint vector again
  kTracking10,   ///< along a path, 10 Hz
  kTracking1000  ///< along a path, 1 kHz
};
constexpr int kPathLength = 200;  ///< steps of one path
constexpr const char* kUseName[] = {"cold", "warm", "track 10 Hz", "track 1 kHz"};

std::vector<Eigen::VectorXd> jointsFor(const kinematics::ConcentricTubeArm& arm, Use use, bool overlap) {
  constexpr std::uint32_t kSeed = 20240607;
  switch (use) {
    case Use::kTracking10:
    case Use::kTracking1000: {
      // Several paths in sequence: a single one is not representative.
      std::vector<Eigen::VectorXd> all;
      for (std::uint32_t path = 0; path < 50; ++path) {
        const auto part =
            controlPath(arm, overlap, use == Use::kTracking10 ? 0.1 : 1e-3, kPathLength, kSeed + 1000 * path);
        all.insert(all.end(), part.begin(), part.end());
      }
      return all;
    }
    default:
      return randomJoints(arm, overlap, 10000, kSeed);
  }
}

/// One pass over all joints; `call(q, first)` solves, `first` at the start of a path.
template <class Call>
void pass(benchmark::State& state, const std::vector<Eigen::VectorXd>& joints, Use use, const Call& call) {
  Percentiles percentiles(joints.size());
  std::size_t failed = 0;
  for (auto _ : state) {
    double seconds = 0.0;
    failed = 0;
    for (std::size_t k = 0; k < joints.size(); ++k) {
      const bool tracking = use == Use::kTracking10 || use == Use::kTracking1000;
      if (use == Use::kWarm || (tracking && k % kPathLength == 0)) {
        call(joints[k], true);  // starts from its equilibrium
        if (tracking)
          continue;
      }
      bool answered = false;
      seconds += percentiles.time(k, [&] { answered = call(joints[k], use == Use::kCold); });
      failed += answered ? 0 : 1;
    }
    state.SetIterationTime(seconds / static_cast<double>(joints.size()));
  }
  percentiles.report(state);
  state.counters["failed"] = static_cast<double>(failed);
}

void timeModel(benchmark::State& state,
               const std::string& name,
               const kinematics::ConcentricTubeArm& arm,
               Use use,
               bool over) {
  const auto model = kinematics::makeArmModel(name, arm);
  Branch branch;
  Tip tip;
  pass(state, jointsFor(arm, use, over), use, [&](const Eigen::VectorXd& q, bool first) {
    if (first)
      branch.known = false;
    const bool answered = model->tip(q, branch, tip) == ModelStatus::kOk;
    benchmark::DoNotOptimize(tip.jacobian.data());
    return answered;
  });
}

/// The compliant model with 50 mN perpendicular to the tip, and its compliance.
void timeLoaded(benchmark::State& state, const kinematics::ConcentricTubeArm& arm, Use use, bool over) {
  const auto model = kinematics::makeArmModel("compliant", arm);
  kinematics::Wrench wrench = kinematics::Wrench::Zero();
  wrench[0] = 0.05;
  Branch branch;
  kinematics::LoadedTip tip;
  auto joints = jointsFor(arm, use, over);
  joints.resize(std::min<std::size_t>(joints.size(), 2000));
  pass(state, joints, use, [&](const Eigen::VectorXd& q, bool first) {
    if (first)
      branch.known = false;
    const bool answered = model->loadedTip(q, wrench, branch, tip) == ModelStatus::kOk;
    benchmark::DoNotOptimize(tip.compliance.data());
    return answered;
  });
}

void timeBaseline(benchmark::State& state, const kinematics::ConcentricTubeArm& arm, Use use, bool over) {
  const ShootingBaseline baseline(arm);
  Eigen::VectorXd twist_rate = Eigen::VectorXd::Zero(arm.tubeCount());
  Tip tip;
  auto joints = jointsFor(arm, use, over);
  joints.resize(std::min<std::size_t>(joints.size(), 100));
  pass(state, joints, use, [&](const Eigen::VectorXd& q, bool first) {
    if (first)
      twist_rate.setZero();
    const bool answered = baseline.tip(q, twist_rate, tip);
    if (!answered)
      twist_rate.setZero();
    benchmark::DoNotOptimize(tip.jacobian.data());
    return answered;
  });
}

}  // namespace

void enrollAll() {
  const std::pair<std::string, kinematics::ConcentricTubeArm> arms[] = {{"ark2024", arkArm()}, {"timc2024", timcArm()}};
  for (const auto& [name, arm] : arms) {
    for (const bool overlap : {false, true}) {
      for (const Use use : {Use::kCold, Use::kWarm, Use::kTracking10, Use::kTracking1000}) {
        const std::string where =
            "/" + name + "/" + (overlap ? "overlap" : "apart") + "/" + kUseName[static_cast<int>(use)];
        for (const char* model : {"rigid", "compliant"}) {
          enroll(model + where, [=, a = arm](auto& state) { timeModel(state, model, a, use, overlap); });
        }
        enroll("loaded" + where, [=, a = arm](auto& state) { timeLoaded(state, a, use, overlap); });
        enroll("shooting" + where, [=, a = arm](auto& state) { timeBaseline(state, a, use, overlap); });
      }
    }
  }
  enrollCooperative();
}

}  // namespace tandem::bench
