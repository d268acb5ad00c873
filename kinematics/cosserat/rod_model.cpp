// SPDX-License-Identifier: Apache-2.0
#include "kinematics/cosserat/rod_model.h"

#include <algorithm>
#include <cmath>

#include "kinematics/spectrum.h"

namespace tandem::kinematics::cosserat {

using Eigen::Vector3d;

RodModel::RodModel(Rod rod, Accuracy accuracy) : rod_(std::move(rod)), accuracy_(accuracy) { checkRod(rod_); }

ModelStatus RodModel::check(const RodInput& input) const noexcept {
  bool finite = input.base.matrix().allFinite() && std::isfinite(input.first_length) && input.inputs.allFinite() &&
                input.tip.allFinite();
  for (std::size_t k = 0; k < kMaxSections; ++k)
    finite = finite && input.force[k].allFinite() && input.moment[k].allFinite();
  if (!finite)
    return ModelStatus::kNotFinite;
  if (input.first_length < 0.0)
    return ModelStatus::kDistalInside;
  if (!(lengthOf(rod_, input) > 0.0))
    return ModelStatus::kNotExtended;
  for (std::size_t i = 0; i < rod_.actuators.size(); ++i) {
    if (rod_.actuators[i].kind == Actuator::kTendon && input.inputs[static_cast<Eigen::Index>(i)] < 0.0)
      return ModelStatus::kTendonPushes;
  }
  return ModelStatus::kOk;
}

/// Newton's method from `moment`; false if its first correction is too long or the others do not shrink.
bool RodModel::correct(const RodInput& input, double load, Vector3d& moment) const noexcept {
  constexpr int kMaxIterations = 12;
  constexpr double kConverged = 1e-6;  // the next correction is about its square
  const double scale = momentScale(rod_, input);
  double allowed = 1.0;
  Shot<kMomentColumns> shot;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    if (!shot.shoot({rod_, input, moment, load, accuracy_}, rod_.tool))
      return false;
    const Vector3d step = shot.momentStep();
    const double size = step.norm() / scale;
    if (!(size <= allowed))  // also for NaN
      return false;
    moment -= step;
    if (size < kConverged)
      return true;
    allowed = std::max(0.5 * size, kConverged);
  }
  return false;
}

/// Increases the load from zero, where only the actuators act and the moment is zero.
bool RodModel::follow(const RodInput& input, Vector3d& moment) const noexcept {
  constexpr double kLeastStep = 1.0 / 1024.0;
  constexpr int kMaxAttempts = 200;
  Vector3d here = Vector3d::Zero(), slope = Vector3d::Zero();
  double load = 0.0, step = 1.0;
  for (int attempt = 0; load < 1.0; ++attempt) {
    const double next = std::min(1.0, load + step);
    Vector3d there = here + (next - load) * slope;
    if (attempt > kMaxAttempts)
      return false;
    if (!correct(input, next, there)) {
      if ((step *= 0.5) < kLeastStep)
        return false;
      continue;
    }
    slope = (there - here) / (next - load);
    here = there;
    load = next;
    step *= 1.5;
  }
  moment = here;
  return true;
}

ModelStatus RodModel::find(const RodInput& input, const RodBranch& branch, Vector3d& moment) const noexcept {
  const ModelStatus status = check(input);
  if (status != ModelStatus::kOk)
    return status;
  if (branch.known) {
    moment = input.base.linear() * branch.base_moment;
    if (correct(input, 1.0, moment))
      return ModelStatus::kOk;
  }
  return follow(input, moment) ? ModelStatus::kOk : ModelStatus::kNotConverged;
}

/// Shot with all derivatives; adds corrections if the last one was not sufficient.
bool RodModel::polish(const SweepStart& from, Shot<kAllColumns>& shot, Vector3d& moment) const noexcept {
  constexpr int kMaxIterations = 4;
  constexpr double kConverged = 1e-9;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    SweepStart start = from;
    HeldIndex index;
    start.base_moment = moment;
    start.index = &index;
    if (!shot.shoot(start, rod_.tool))
      return false;
    const Vector3d step = shot.momentStep();
    if (step.norm() < kConverged * momentScale(rod_, from.input)) {
      *from.index = index;
      return true;
    }
    moment -= step;
  }
  return false;
}

ModelStatus RodModel::solve(const RodInput& input, RodBranch& branch, RodAnswer& answer) const noexcept {
  Vector3d moment = Vector3d::Zero();
  const ModelStatus status = find(input, branch, moment);
  if (status != ModelStatus::kOk)
    return status;
  Shot<kAllColumns> shot;
  HeldIndex index;
  if (!polish({rod_, input, moment, 1.0, accuracy_, &index}, shot, moment))
    return ModelStatus::kNotConverged;
  answer = RodAnswer();
  answer.tip = shot.tip;
  answer.base_wrench << shot.end.base_force, moment;
  answer.compliance = shot.compliance();
  answer.by_base = shot.byBase();
  answer.by_length = answer.by_base * shot.end.base_strain;
  answer.by_input = shot.elastic<kMaxActuators>(kByInput);
  answer.energy = shot.end.energy;
  answer.held_conjugate_points = index.count();
  // C and its inverse, the stiffness of the tip, have the same signs; eigenvalues of C near zero belong to stiff
  // directions and do not count.
  constexpr double kStiff = 1e-12;
  answer.conjugate_points = index.count() + negativeDirections(answer.compliance, kStiff);
  branch.known = true;
  branch.base_moment = input.base.linear().transpose() * moment;
  return ModelStatus::kOk;
}

ModelStatus RodModel::shape(const RodInput& input, RodBranch& branch, int points, std::vector<RodPoint>& shape) const {
  Vector3d moment = Vector3d::Zero();
  const ModelStatus status = find(input, branch, moment);
  if (status != ModelStatus::kOk)
    return status;
  std::vector<RodPoint> result(static_cast<std::size_t>(std::max(points, 0)));
  for (std::size_t k = 0; k < result.size(); ++k)
    result[k].s = lengthOf(rod_, input) * static_cast<double>(k) /
                  static_cast<double>(std::max<std::size_t>(result.size() - 1, 1));
  Shot<kMomentColumns> shot;
  if (!shot.shoot({rod_, input, moment, 1.0, accuracy_, nullptr, &result}, rod_.tool))
    return ModelStatus::kNotConverged;
  shape = std::move(result);
  branch.known = true;
  branch.base_moment = input.base.linear().transpose() * moment;
  return ModelStatus::kOk;
}

}  // namespace tandem::kinematics::cosserat
