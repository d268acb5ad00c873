// SPDX-License-Identifier: Apache-2.0
#include "control/damping.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace tandem::control {

int dampSingularDirections(const TaskGram& plain, double threshold, TaskGram& gram) noexcept {
  const Eigen::SelfAdjointEigenSolver<TaskGram> eigen(plain);
  const double limit = threshold * threshold;
  int singular = 0;
  for (Eigen::Index i = 0; i < plain.rows(); ++i) {
    const double square = std::max(0.0, eigen.eigenvalues()[i]);  // sigma_i^2, ascending
    if (!(square < limit))
      break;
    const TaskVector direction = eigen.eigenvectors().col(i);
    ++singular;
    gram += (1.0 - square / limit) * 0.25 * limit * direction.lazyProduct(direction.transpose());
  }
  return singular;
}

int dampingFactor(const TaskGram& plain, double threshold, TaskGram& factor) noexcept {
  const Eigen::SelfAdjointEigenSolver<TaskGram> eigen(plain);
  const double limit = threshold * threshold;
  int singular = 0;
  factor.setZero(plain.rows(), plain.cols());
  for (Eigen::Index i = 0; i < plain.rows(); ++i, ++singular) {
    const double square = std::max(0.0, eigen.eigenvalues()[i]);  // sigma_i^2, ascending
    if (!(square < limit))
      break;
    const TaskVector direction = eigen.eigenvectors().col(i);
    factor += std::sqrt((1.0 - square / limit) * 0.25 * limit) * direction.lazyProduct(direction.transpose());
  }
  return singular;
}

}  // namespace tandem::control
