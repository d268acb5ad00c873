// SPDX-License-Identifier: Apache-2.0
#include "experiments/proportions.h"

#include <algorithm>
#include <cmath>

namespace tandem::experiments {

Interval wilson(int successes, int trials) {
  if (trials <= 0)
    return {};
  constexpr double kZ = 1.959963984540054;  // 97.5th percentile of the normal distribution
  const double n = trials, p = successes / n, spread = 1.0 + kZ * kZ / n;
  const double centre = (p + kZ * kZ / (2.0 * n)) / spread;
  const double half = kZ / spread * std::sqrt(p * (1.0 - p) / n + kZ * kZ / (4.0 * n * n));
  // The ends of 0 and of all are exact; rounding is not.
  return {successes == 0 ? 0.0 : std::max(0.0, centre - half),
          successes == trials ? 1.0 : std::min(1.0, centre + half)};
}

double mcnemar(int first, int second) {
  const int n = first + second;
  double tail = 0.0;
  for (int k = 0; k <= std::min(first, second); ++k)
    tail += std::exp(std::lgamma(n + 1.0) - std::lgamma(k + 1.0) - std::lgamma(n - k + 1.0) - n * std::log(2.0));
  return std::min(1.0, 2.0 * tail);
}

}  // namespace tandem::experiments
