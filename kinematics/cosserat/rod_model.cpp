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
                input.tip.allFinite() && input.wire.share.allFinite() && std::isfinite(input.wire.displacement) &&
                input.wire.elasticity >= 0.0;
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

namespace {

/// Newton correction of moment and pull, to be added.
template <int kColumns>
Eigen::Vector4d correction(const RodInput& input, const Shot<kColumns>& shot) {
  Eigen::Vector4d step = Eigen::Vector4d::Zero();
  step.head<3>() = -shot.momentStep();
  if constexpr (kColumns == kAllColumns) {
    if (input.wire.locked())
      step[3] = shot.pullStep(step.head<3>(), Vector3d::Zero());
  }
  return step;
}

/// In units of about one radian.
double sizeOf(const Eigen::Vector4d& step, double moment_scale) {
  return std::max(step.head<3>().norm() / moment_scale, std::abs(step[3]));
}

}  // namespace

/// Newton's method from `x`; false if its first correction is too long or the others do not shrink.
template <int kColumns>
bool RodModel::correct(const RodInput& input, double load, Unknowns& x) const noexcept {
  constexpr int kMaxIterations = 12;
  constexpr double kConverged = 1e-6;  // the next correction is about its square
  const double scale = momentScale(rod_, input);
  double allowed = 1.0;
  Shot<kColumns> shot;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    SweepStart start{rod_, input, x.head<3>(), load, accuracy_};
    start.pull = x[3];
    if (!shot.shoot(start, rod_.tool))
      return false;
    const Unknowns step = correction(input, shot);
    const double size = sizeOf(step, scale);
    if (!(size <= allowed) || !step.allFinite())
      return false;
    x += step;
    if (size < kConverged)
      return true;
    allowed = std::max(0.5 * size, kConverged);
  }
  return false;
}

bool RodModel::correct(const RodInput& input, double load, Unknowns& x) const noexcept {
  return input.wire.locked() ? correct<kAllColumns>(input, load, x) : correct<kMomentColumns>(input, load, x);
}

/// Increases the load from zero, where only the actuators act and the moment is zero.
bool RodModel::follow(const RodInput& input, Unknowns& x) const noexcept {
  constexpr double kLeastStep = 1.0 / 1024.0;
  constexpr int kMaxAttempts = 200;
  Unknowns here(0.0, 0.0, 0.0, input.wire.displacement), slope = Unknowns::Zero();
  double load = 0.0, step = 1.0;
  for (int attempt = 0; load < 1.0; ++attempt) {
    const double next = std::min(1.0, load + step);
    Unknowns there = here + (next - load) * slope;
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
  x = here;
  return true;
}

ModelStatus RodModel::find(const RodInput& input, const RodBranch& branch, Unknowns& x) const noexcept {
  const ModelStatus status = check(input);
  if (status != ModelStatus::kOk)
    return status;
  if (branch.known) {
    x << input.base.linear() * branch.base_moment, branch.pull;
    if (correct(input, 1.0, x))
      return ModelStatus::kOk;
  }
  return follow(input, x) ? ModelStatus::kOk : ModelStatus::kNotConverged;
}

/// Shot with all derivatives; adds corrections if the last one was not sufficient.
bool RodModel::polish(const SweepStart& from, Shot<kAllColumns>& shot, Unknowns& x) const noexcept {
  constexpr int kMaxIterations = 4;
  constexpr double kConverged = 1e-9;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    SweepStart start = from;
    HeldIndex index;
    start.base_moment = x.head<3>();
    start.pull = x[3];
    start.index = &index;
    if (!shot.shoot(start, rod_.tool))
      return false;
    const Unknowns step = correction(from.input, shot);
    if (sizeOf(step, momentScale(rod_, from.input)) < kConverged) {
      *from.index = index;
      return true;
    }
    x += step;
  }
  return false;
}

ModelStatus RodModel::solve(const RodInput& input, RodBranch& branch, RodAnswer& answer) const noexcept {
  Unknowns x = Unknowns::Zero();
  const ModelStatus status = find(input, branch, x);
  if (status != ModelStatus::kOk)
    return status;
  Shot<kAllColumns> shot;
  HeldIndex index;
  if (!polish({rod_, input, x.head<3>(), 1.0, accuracy_, &index}, shot, x))
    return ModelStatus::kNotConverged;
  answer = RodAnswer();
  answer.tip = shot.tip;
  answer.base_wrench << shot.end.base_force, x.head<3>();
  answer.compliance = shot.compliance();
  answer.by_base = shot.byBase();
  answer.by_length = answer.by_base * shot.end.base_strain;
  answer.by_input = shot.elastic<kMaxActuators>(kByInput);
  if (input.wire.locked())
    answer.by_displacement = shot.byDisplacement();
  answer.energy = shot.end.energy;
  answer.held_conjugate_points = index.count() - shot.removed;
  // C and its inverse, the stiffness of the tip, have the same signs; eigenvalues of C near zero belong to stiff
  // directions and do not count.
  constexpr double kStiff = 1e-12;
  answer.conjugate_points = answer.held_conjugate_points + negativeDirections(answer.compliance, kStiff);
  branch.known = true;
  branch.base_moment = input.base.linear().transpose() * x.head<3>();
  branch.pull = x[3];
  return ModelStatus::kOk;
}

ModelStatus RodModel::shape(const RodInput& input, RodBranch& branch, int points, std::vector<RodPoint>& shape) const {
  Unknowns x = Unknowns::Zero();
  const ModelStatus status = find(input, branch, x);
  if (status != ModelStatus::kOk)
    return status;
  std::vector<RodPoint> result(static_cast<std::size_t>(std::max(points, 0)));
  for (std::size_t k = 0; k < result.size(); ++k)
    result[k].s = lengthOf(rod_, input) * static_cast<double>(k) /
                  static_cast<double>(std::max<std::size_t>(result.size() - 1, 1));
  Shot<kMomentColumns> shot;
  SweepStart start{rod_, input, x.head<3>(), 1.0, accuracy_, nullptr, &result};
  start.pull = x[3];
  if (!shot.shoot(start, rod_.tool))
    return ModelStatus::kNotConverged;
  shape = std::move(result);
  branch.known = true;
  branch.base_moment = input.base.linear().transpose() * x.head<3>();
  branch.pull = x[3];
  return ModelStatus::kOk;
}

}  // namespace tandem::kinematics::cosserat
