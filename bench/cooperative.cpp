// SPDX-License-Identifier: Apache-2.0
#include "bench/cooperative.h"

#include <cmath>
#include <numbers>
#include <random>

#include "bench/enroll.h"
#include "bench/percentiles.h"
#include "kinematics/assist/target_assist.h"
#include "kinematics/grasp/grasp.h"

namespace tandem::bench {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using kinematics::ModelStatus;
using kinematics::Wrench;

constexpr int kCases = 500;
constexpr int kPathLength = 50;  ///< steps of one path
constexpr std::uint32_t kSeed = 20240607;

/// A steerable catheter of 8 French, nylon over braid, with a softer bending end of 60 mm.
kinematics::catheter::ElasticArm catheter() {
  kinematics::catheter::ElasticArm arm;
  arm.arm.bending_length = 0.06;
  arm.arm.tool.translation().z() = 0.004;
  arm.proximal = kinematics::cosserat::tubeSection(0.1, 2.67e-3, 1.6e-3, 1.5e9, 0.4);
  arm.distal = kinematics::cosserat::tubeSection(0.06, 2.67e-3, 1.6e-3, 0.3e9, 0.4);
  return arm;
}

/// Cases one by one, or along paths of small steps: `call(x, first)` solves for the inputs x in [-1, 1]; `first` at the
/// start of a path, or for a cold start.
template <int kNumbers, class Call>
void pass(benchmark::State& state, bool tracking, const Call& call) {
  std::mt19937 engine(kSeed);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  std::vector<Eigen::Matrix<double, kNumbers, 1>> cases(kCases);
  Eigen::Matrix<double, kNumbers, 1> from = Eigen::Matrix<double, kNumbers, 1>::Zero(), to = from;
  const auto draw = [&] { return Eigen::Matrix<double, kNumbers, 1>::NullaryExpr([&] { return any(engine); }).eval(); };
  for (int k = 0; k < kCases; ++k) {
    if (k % kPathLength == 0) {
      from = draw();
      to = from + 0.3 * (draw() - from);
    }
    cases[k] = tracking ? (from + (k % kPathLength) / double(kPathLength) * (to - from)).eval() : draw();
  }
  Percentiles percentiles(cases.size());
  int failed = 0;
  for (auto _ : state) {
    double seconds = 0.0;
    failed = 0;
    for (std::size_t k = 0; k < cases.size(); ++k) {
      if (tracking && k % kPathLength == 0) {
        call(cases[k], true);
        continue;
      }
      bool answered = false;
      seconds += percentiles.time(k, [&] { answered = call(cases[k], !tracking); });
      failed += answered ? 0 : 1;
    }
    state.SetIterationTime(seconds / kCases);
  }
  percentiles.report(state);
  state.counters["failed"] = failed;
}

/// Tip, Jacobian and compliance of one catheter as a Cosserat rod.
void timeRod(benchmark::State& state, bool loaded, bool tracking) {
  const kinematics::catheter::ElasticCatheter model(catheter());
  kinematics::cosserat::RodBranch branch;
  kinematics::LoadedTip tip;
  pass<6>(state, tracking, [&](const auto& x, bool first) {
    if (first)
      branch.known = false;
    Wrench wrench = Wrench::Zero();
    if (loaded)
      wrench.head<3>() = 0.1 * x.template tail<3>();  // N
    const bool answered =
        model.tip(Vector3d(0.1 + 0.05 * x[0], 3.0 * x[1], 2.0 * x[2]), wrench, branch, tip) == ModelStatus::kOk;
    benchmark::DoNotOptimize(tip.compliance.data());
    return answered;
  });
}

/// One rod with four tendons, a force at its tip and its weight: solution with all derivatives.
void timeTendons(benchmark::State& state, bool tracking) {
  namespace cosserat = kinematics::cosserat;
  cosserat::Rod rod;
  rod.sections = {catheter().distal, catheter().distal};
  for (int k = 0; k < 4; ++k) {
    const double around = k * std::numbers::pi / 2;
    rod.actuators.push_back(
        {cosserat::Actuator::kTendon, k % 2, 1e-3 * Vector3d(std::cos(around), std::sin(around), 0.0)});
  }
  const cosserat::RodModel model(rod);
  cosserat::RodBranch branch;
  cosserat::RodAnswer answer;
  pass<7>(state, tracking, [&](const auto& x, bool first) {
    if (first)
      branch.known = false;
    cosserat::RodInput input(rod);
    input.inputs = 4.0 * (x.template head<4>() + Eigen::Vector4d::Ones());  // N
    input.tip.template head<3>() = 0.05 * x.template tail<3>();             // N
    input.force[0] = input.force[1] = Vector3d(0.0, -0.05, 0.0);            // N/m
    const bool answered = model.solve(input, branch, answer) == ModelStatus::kOk;
    benchmark::DoNotOptimize(answer.by_input.data());
    return answered;
  });
}

/// The closed chain of target and assist arm: pose, contact wrench and Jacobian by six joints.
void timeChain(benchmark::State& state, kinematics::grasp::ContactType type, bool tracking) {
  namespace assist = kinematics::assist;
  assist::Pair pair;
  pair.target = pair.assist = catheter();
  pair.type = type;
  pair.pushes_only = false;
  assist::Joints home;
  home << 0.12, 0.0, 0.5, 0.05, 0.0, 0.3;
  // The assist arm comes from the side, its free tip at the start of the bending section and pointing into it.
  const Isometry3d place =
      Eigen::Translation3d(0.0, 0.0, home[0]) * Eigen::Isometry3d(Eigen::AngleAxisd(1.2, Vector3d::UnitY()));
  pair.assist.arm.base =
      place * (Eigen::Translation3d(0.0, 0.0, home[0]) * assist::TargetAssist::touching(pair, home)).inverse();
  pair.contact = assist::TargetAssist::touching(pair, home);
  const assist::TargetAssist model(pair);
  assist::ChainBranch branch;
  assist::Chain chain;
  assist::Joints range;
  range << 0.005, 3.0, 1.5, 0.005, 0.3, 0.2;
  pass<6>(state, tracking, [&](const auto& x, bool first) {
    if (first)
      branch.known = false;
    const bool answered = model.solve(home + range.cwiseProduct(x), branch, chain) == assist::Status::kOk;
    benchmark::DoNotOptimize(chain.tip.jacobian.data());
    return answered;
  });
}

/// Two catheters that grasp one object: all of GraspState.
void timeGrasp(benchmark::State& state, kinematics::grasp::ContactType type) {
  using kinematics::grasp::Contact;
  const kinematics::catheter::Arm arm = catheter().arm;
  const kinematics::catheter::ConstantCurvature model(arm);
  std::vector<Contact> contacts(2);
  for (Contact& contact : contacts)
    contact.type = type;
  contacts[0].frame.translation().x() = -0.01;
  contacts[1].frame = Eigen::Translation3d(0.01, 0.0, 0.0) * Eigen::AngleAxisd(std::numbers::pi, Vector3d::UnitY());
  const kinematics::grasp::Grasp grasp(contacts, 0.02);
  kinematics::grasp::GraspState result;
  kinematics::Tip tips[2];
  const kinematics::Tip* const pointers[] = {&tips[0], &tips[1]};
  pass<6>(state, false, [&](const auto& x, bool) {
    model.tip(Vector3d(0.1 + 0.05 * x[0], 3.0 * x[1], 2.0 * x[2]), tips[0]);
    model.tip(Vector3d(0.1 + 0.05 * x[3], 3.0 * x[4], 2.0 * x[5]), tips[1]);
    const bool answered = grasp.evaluate(Isometry3d::Identity(), pointers, result);
    benchmark::DoNotOptimize(result.jacobian.data());
    return answered;
  });
}

}  // namespace

void enrollCooperative() {
  using kinematics::grasp::ContactType;
  for (const bool tracking : {false, true}) {
    const std::string start = tracking ? "/track" : "/cold";
    enroll("rod/catheter/free" + start, [=](auto& state) { timeRod(state, false, tracking); });
    enroll("rod/catheter/tip force" + start, [=](auto& state) { timeRod(state, true, tracking); });
    enroll("rod/four tendons/tip force" + start, [=](auto& state) { timeTendons(state, tracking); });
    for (const ContactType type : {ContactType::kRigid, ContactType::kPoint}) {
      enroll("chain/pair/" + std::string(kinematics::grasp::nameOf(type)) + start,
             [=](auto& state) { timeChain(state, type, tracking); });
    }
  }
  for (const ContactType type : {ContactType::kRigid, ContactType::kPoint}) {
    enroll("grasp/two catheters/" + std::string(kinematics::grasp::nameOf(type)) + "/cold",
           [=](auto& state) { timeGrasp(state, type); });
  }
}

}  // namespace tandem::bench
