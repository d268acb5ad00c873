// SPDX-License-Identifier: Apache-2.0
/** @file Benchmark of one quadratic programme and of one control step: own active-set solver against Ipopt. */
#include <benchmark/benchmark.h>

#include <string>

#include "bench/enroll.h"
#include "bench/percentiles.h"
#include "bench/step_problems.h"
#include "control/methods.h"
#include "control/quadratic_program.h"
#include "control/resolver.h"

namespace tandem::bench {
namespace {

using control::Backend;
using control::Method;

constexpr std::uint32_t kSeed = 20240607;

/// @param call call(k) solves case k and returns whether it succeeded
void pass(benchmark::State& state,
          int count,
          const std::function<void(int)>& before,
          const std::function<bool(int)>& call) {
  Percentiles percentiles(static_cast<std::size_t>(count));
  int failed = 0;
  for (auto _ : state) {
    double seconds = 0.0;
    failed = 0;
    for (int k = 0; k < count; ++k) {
      bool answered = false;
      before(k);
      seconds += percentiles.time(static_cast<std::size_t>(k), [&] { answered = call(k); });
      failed += answered ? 0 : 1;
    }
    state.SetIterationTime(seconds / count);
  }
  percentiles.report(state);
  state.counters["failed"] = failed;
}

void timeProgram(benchmark::State& state, Backend backend, int rows, bool warm, int count) {
  std::vector<control::QuadraticProgram> programs;
  for (int k = 0; k < count; ++k)
    programs.push_back(randomProgram(kSeed + static_cast<std::uint32_t>(k), rows));
  const auto solver = control::makeQpBackend(backend);
  control::QpSolution solution;
  const auto prepare = [&](int k) {
    if (!warm) {
      solver->reset();
      return;
    }
    solver->solve(programs[static_cast<std::size_t>(k)], solution);
    programs[static_cast<std::size_t>(k)].g *= 1.01;  // the next control step requests slightly more
  };
  pass(state, count, prepare, [&](int k) {
    solver->solve(programs[static_cast<std::size_t>(k)], solution);
    benchmark::DoNotOptimize(solution.x.data());
    return solution.status == control::QpStatus::kSolved;
  });
}

/// One control step of two arms without the models: limits as bounds, the method, its result.
void timeStep(benchmark::State& state, Method method, Backend backend, int count) {
  const std::vector<control::StepProblem> problems = randomSteps(count, kSeed);
  control::MethodParameters parameters;
  parameters.backend = backend;
  const auto resolver = control::makeResolver(method, parameters);
  control::Solution solution;
  pass(
      state, count, [&](int) { resolver->reset(); },
      [&](int k) {
        resolver->solve(problems[static_cast<std::size_t>(k)], solution);
        benchmark::DoNotOptimize(solution.velocity.data());
        return solution.status == control::SolveStatus::kSolved || solution.status == control::SolveStatus::kInfeasible;
      });
}

}  // namespace

void enrollAll() {
  constexpr int kMany = 2000, kFew = 60;  // Ipopt is slow
  for (const int rows : {5, 8}) {
    const std::string name = "qp/12 variables 3 equalities " + std::to_string(rows) + " rows/";
    for (const bool warm : {false, true}) {
      enroll(name + "active-set/" + (warm ? "warm" : "cold"),
             [=](auto& state) { timeProgram(state, Backend::kActiveSet, rows, warm, kMany); });
    }
    enroll(name + "ipopt/cold", [=](auto& state) { timeProgram(state, Backend::kIpopt, rows, false, kFew); });
  }
  for (int m = 0; m < control::kMethodCount; ++m) {
    const auto method = static_cast<Method>(m);
    const std::string name = "step/" + std::string(control::name(method)) + "/";
    enroll(name + "active-set/cold", [=](auto& state) { timeStep(state, method, Backend::kActiveSet, kMany); });
    if (control::solvesProgrammes(method))
      enroll(name + "ipopt/cold", [=](auto& state) { timeStep(state, method, Backend::kIpopt, kFew); });
  }
}

}  // namespace tandem::bench
