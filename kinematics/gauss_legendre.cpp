// SPDX-License-Identifier: Apache-2.0
#include "kinematics/gauss_legendre.h"

#include <cmath>
#include <numbers>

namespace tandem::kinematics {
namespace {

/// Newton's method on the Legendre polynomial, from Chebyshev's nodes (Abramowitz and Stegun, 25.4.29).
GaussLegendre make(int count) {
  GaussLegendre rule;
  rule.count = count;
  for (int i = 0; i < count; ++i) {
    double x = std::cos(std::numbers::pi * (i + 0.75) / (count + 0.5));
    double slope = 0.0;
    for (int iteration = 0; iteration < 50; ++iteration) {
      double p = 1.0, before = 0.0;
      for (int k = 1; k <= count; ++k) {
        const double next = ((2.0 * k - 1.0) * x * p - (k - 1.0) * before) / k;
        before = p;
        p = next;
      }
      slope = count * (x * p - before) / (x * x - 1.0);
      const double step = p / slope;
      x -= step;
      if (std::abs(step) < 1e-16)
        break;
    }
    rule.node[count - 1 - i] = 0.5 * (1.0 + x);
    rule.weight[count - 1 - i] = 1.0 / ((1.0 - x * x) * slope * slope);
  }
  return rule;
}

const std::array<GaussLegendre, GaussLegendre::kMaxNodes> kRules = [] {
  std::array<GaussLegendre, GaussLegendre::kMaxNodes> rules;
  for (int i = 0; i < GaussLegendre::kMaxNodes; ++i)
    rules[i] = make(i + 1);
  return rules;
}();

}  // namespace

const GaussLegendre& GaussLegendre::rule(int count) noexcept { return kRules[count - 1]; }

}  // namespace tandem::kinematics
