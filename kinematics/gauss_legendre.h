// SPDX-License-Identifier: Apache-2.0
/** @file Gauss-Legendre quadrature on [0, 1]. */
#pragma once

#include <array>

namespace tandem::kinematics {

/** Nodes and weights for polynomials up to degree 2 count - 1. */
struct GaussLegendre {
  static constexpr int kMaxNodes = 14;
  int count = 0;
  std::array<double, kMaxNodes> node{};
  std::array<double, kMaxNodes> weight{};

  /// Rule with `count` nodes, 1 to kMaxNodes; computed once before main().
  static const GaussLegendre& rule(int count) noexcept;
};

}  // namespace tandem::kinematics
