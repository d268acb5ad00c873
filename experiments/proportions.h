// SPDX-License-Identifier: Apache-2.0
/** @file Statistics of proportions: confidence interval, paired comparison. */
#pragma once

namespace tandem::experiments {

/** Both ends of an interval of a probability. */
struct Interval {
  double lower = 0.0, upper = 1.0;
};

/// Score interval of 95 % of a binomial proportion (Wilson, J. Am. Stat. Assoc. 22, 1927). Of no trials: [0, 1].
Interval wilson(int successes, int trials);

/// Two-sided exact p of McNemar's test (Psychometrika 12, 1947): of `first` + `second` pairs in which one side alone
/// succeeds, the probability of a split at least as uneven if both sides are equally likely. 1 without such pairs.
double mcnemar(int first, int second);

}  // namespace tandem::experiments
