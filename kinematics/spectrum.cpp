// SPDX-License-Identifier: Apache-2.0
#include "kinematics/spectrum.h"

#include <Eigen/Eigenvalues>

namespace tandem::kinematics {

int negativeDirections(const Form& form, double vague) {
  const Form symmetric = 0.5 * (form + form.transpose());
  const Eigen::SelfAdjointEigenSolver<Form> eigen(symmetric, Eigen::EigenvaluesOnly);
  const auto values = eigen.eigenvalues().array();
  return static_cast<int>((values < -vague * values.abs().maxCoeff()).count());
}

int negativeRealParts(const Form& form) {
  const Eigen::EigenSolver<Form> eigen(form, false);
  return static_cast<int>((eigen.eigenvalues().real().array() < 0.0).count());
}

}  // namespace tandem::kinematics
