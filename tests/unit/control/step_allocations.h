// SPDX-License-Identifier: Apache-2.0
/** @file Allocation check of a control step, for every method. */
#pragma once

#include <gtest/gtest.h>

#include "control/resolver.h"
#include "tests/unit/safety/allocation_counter.h"
#include "tests/unit/support/ark_problem.h"

namespace tandem::test {

/// No method allocates in a step. @param set  generates a random problem of `ark`, false if there is none.
template <class Set>
void expectStepsAllocateNothing(const Set& set) {
  for (int m = 0; m < control::kMethodCount; ++m) {
    const auto resolver = control::makeResolver(static_cast<control::Method>(m), {});
    ArkProblem ark;
    control::Solution solution;
    Random random(baseSeed());
    std::size_t allocated = 0;
    for (int i = 0; i < 50; ++i) {
      if (!set(ark, random))
        continue;
      const std::size_t before = allocationCount();
      resolver->solve(ark.problem, solution);
      allocated += allocationCount() - before;
    }
    EXPECT_EQ(allocated, 0u) << control::name(static_cast<control::Method>(m));
  }
}

}  // namespace tandem::test
