// SPDX-License-Identifier: Apache-2.0
#include "control/parameters.h"

#include <gtest/gtest.h>

#include "control/resolver.h"
#include "tests/unit/support/ark_problem.h"

namespace tandem::test {
namespace {

using control::Method;
using control::MethodParameters;
using control::TunableParameter;

/// True if the solution of a random problem, with or without a posture, depends on the changed parameters.
bool matters(Method method, const MethodParameters& changed) {
  const auto plain = control::makeResolver(method, {}), other = control::makeResolver(method, changed);
  ArkProblem ark;
  control::Solution as_before, now;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 300; ++seed) {
    Random random(seed);
    if (!ark.setRandom(random, std::pow(10.0, random.uniform(-4, -1))))
      continue;
    ark.problem.posture.resize(0);
    if (random.chance(0.5)) {
      control::RobotVector posture(12);
      posture << randomInside(ark.limits, random), randomInside(ark.limits, random);
      ark.problem.posture = posture;
    }
    plain->reset();
    other->reset();
    plain->solve(ark.problem, as_before);
    other->solve(ark.problem, now);
    if (as_before.velocity != now.velocity)
      return true;
  }
  return false;
}

/// The page and `/api/robot` show the parameters of each method.
TEST(TunableParameters, MatterToTheirReadersAndToNoOtherMethod) {
  SCOPED_TRACE(trace(baseSeed()));
  for (int m = 0; m < control::kMethodCount; ++m) {
    const auto method = static_cast<Method>(m);
    for (const TunableParameter& parameter : control::kTunableParameters) {
      MethodParameters changed;
      changed.*parameter.member *= 0.1;
      if (parameter.member == &MethodParameters::barrier_gain)
        continue;  // used for the rates of margins, which only hqp receives with a problem
      EXPECT_EQ(matters(method, changed), parameter.readBy(method)) << name(method) << ": " << parameter.name;
    }
  }
}

}  // namespace
}  // namespace tandem::test
