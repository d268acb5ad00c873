// SPDX-License-Identifier: Apache-2.0
#include "planning/tips.h"

#include <stdexcept>

namespace tandem::planning {

TipFollower::TipFollower(std::vector<const kinematics::ArmModel*> models, std::vector<const safety::ArmLimits*> limits)
    : models_(std::move(models)), limits_(std::move(limits)), offset_{0} {
  if (models_.empty() || models_.size() > safety::kMaxArms)
    throw std::invalid_argument("1 to 8 arms expected");
  if (!limits_.empty() && limits_.size() != models_.size())
    throw std::invalid_argument("limits of every arm expected, or of none");
  for (const kinematics::ArmModel* model : models_)
    offset_.push_back(offset_.back() + model->jointCount());
}

void TipFollower::restart() noexcept {
  for (Arm& arm : arms_) {
    arm.branch = {};
    arm.q.resize(0);
  }
}

void TipFollower::continueFrom(const TipFollower& other) noexcept {
  arms_ = other.arms_;
  status_ = other.status_;
  failed_arm_ = other.failed_arm_;
}

bool TipFollower::update(const safety::RobotVector& q) noexcept {
  status_ = kinematics::ModelStatus::kWrongSize;
  failed_arm_ = 0;
  if (q.size() != jointCount())
    return false;
  status_ = kinematics::ModelStatus::kOk;
  for (int k = 0; k < armCount(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    Arm& arm = arms_[i];
    const safety::ArmVector joints = q.segment(offset_[i], offset_[i + 1] - offset_[i]);
    if (arm.q.size() == joints.size() && arm.q == joints)
      continue;
    const kinematics::ModelStatus status = models_[i]->tip(joints, arm.branch, arm.tip);
    if (status == kinematics::ModelStatus::kOk) {
      arm.q = joints;
      arm.snaps += arm.branch.snapped ? 1 : 0;
    } else if (status_ == kinematics::ModelStatus::kOk) {
      status_ = status;
      failed_arm_ = k;
    }
  }
  return status_ == kinematics::ModelStatus::kOk;
}

kinematics::Avoidance TipFollower::avoidance(int arm, kinematics::TaskPoint from, double distance) const noexcept {
  const safety::ArmLimits none;
  const auto k = static_cast<std::size_t>(arm);
  const Arm& own = arms_[k];
  if (from == kinematics::TaskPoint::kStability)
    return kinematics::stabilityAvoidance(*models_[k], own.q, own.branch, own.tip.stability, distance);
  return kinematics::jointLimitAvoidance(limits_.empty() ? none : *limits_[k], own.q, distance);
}

kinematics::ModelStatus TipFollower::shaft(int arm, int count, std::vector<kinematics::BackbonePoint>& points) const {
  const Arm& own = arms_[static_cast<std::size_t>(arm)];
  const kinematics::ArmModel& model = *models_[static_cast<std::size_t>(arm)];
  if (own.q.size() != model.jointCount())
    return kinematics::ModelStatus::kWrongSize;
  kinematics::BodySections sections;
  const int last = model.sections(own.q, sections) - 1;
  const double length = last < 0 ? 0.0 : sections[static_cast<std::size_t>(last)].end;
  std::vector<double> s(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i)
    s[static_cast<std::size_t>(i)] = length * i / (count - 1);
  kinematics::Branch aside = own.branch;
  return model.backbone(own.q, aside, s, false, points);
}

}  // namespace tandem::planning
