// SPDX-License-Identifier: Apache-2.0
#include "sim/plant_tips.h"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>

#include "kinematics/clearance.h"
#include "sim/random_stream.h"

namespace tandem::sim {
namespace {

using kinematics::ConcentricTubeArm;

TubeErrors drawn(const TubeErrors& deviation, std::uint64_t seed, int arm, int tube) {
  RandomStream random(seed, Noise::kTubes, arm * kinematics::kMaxTubes + tube);
  TubeErrors errors;
  errors.bending_stiffness = deviation.bending_stiffness * random.normal();
  errors.torsional_stiffness = deviation.torsional_stiffness * random.normal();
  errors.curvature = deviation.curvature * random.normal();
  errors.length = deviation.length * random.normal();
  errors.residual_curvature = deviation.residual_curvature * random.normal();
  return errors;
}

}  // namespace

ConcentricTubeArm withErrors(ConcentricTubeArm tubes, int arm, const PlantOptions& options) {
  // Limits apply to the tubes of the robot file: with other lengths, or backlash, an outer tube may extend beyond the
  // inner one.
  constexpr double kBeyond = 0.02;  // m
  tubes.tolerance = kBeyond;
  for (int i = 0; i < tubes.tubeCount(); ++i) {
    TubeErrors errors = drawn(options.tube_deviation, options.seed, arm, i);
    for (const FixedTubeErrors& fixed : options.tube_errors) {
      if (fixed.arm == arm && fixed.tube == i)
        errors = fixed.errors;
    }
    for (kinematics::TubeSection& section : tubes.tubes[static_cast<std::size_t>(i)].sections) {
      section.bending_stiffness *= 1.0 + errors.bending_stiffness;
      section.torsional_stiffness *= 1.0 + errors.torsional_stiffness;
      section.curvature =
          section.curvature == 0.0 ? errors.residual_curvature : section.curvature * (1.0 + errors.curvature);
      section.length *= 1.0 + errors.length;
    }
  }
  return tubes;
}

TubeContact makeContact(const ConcentricTubeArm& plant, const ConcentricTubeArm& nominal, const PlantOptions& options) {
  TubeContact contact;
  if (options.friction > 0.0)
    contact.friction.emplace(plant, nominal, options.friction);
  if (options.clearance > 0.0 || options.ovality > 0.0)
    contact.play.emplace(plant, options.clearance, options.ovality);
  return contact;
}

PlantTips::PlantTips(ArmModels models, const PlantOptions& options, std::vector<TubeContact> contacts) {
  for (auto& model : models)
    arms_.emplace_back().model = std::move(model);
  for (std::size_t k = 0; k < contacts.size(); ++k)
    arms_.at(k).contact = std::move(contacts[k]);
  for (const TipForce& force : options.tip_forces) {
    if (force.arm < 0 || force.arm >= armCount())
      throw std::invalid_argument("plant.tip_forces: found arm " + std::to_string(force.arm + 1) + ", expected 1 to " +
                                  std::to_string(armCount()));
    Arm& arm = arms_[static_cast<std::size_t>(force.arm)];
    if (!force.force.isZero(0.0) && !arm.model->carriesLoad())
      throw std::invalid_argument("plant: a rigid arm carries no tip force; take model: compliant");
    arm.wrench.head<3>() = force.force;
  }
}

void PlantTips::restart() noexcept {
  for (Arm& arm : arms_) {
    arm.branch = {};
    arm.q.resize(0);
    if (arm.contact.friction)
      arm.contact.friction->restart();
    if (arm.contact.play)
      arm.contact.play->restart();
  }
}

void PlantTips::update(int k, const safety::ArmVector& q) noexcept {
  Arm& arm = arms_[static_cast<std::size_t>(k)];
  if (arm.q.size() == q.size() && arm.q == q)
    return;
  arm.q = q;
  arm.joints = arm.contact.friction ? arm.contact.friction->follow(q) : q;
  arm.status = arm.wrench.isZero(0.0) ? arm.model->tip(arm.joints, arm.branch, arm.tip)
                                      : arm.model->loadedTip(arm.joints, arm.wrench, arm.branch, arm.tip);
  if (arm.status != kinematics::ModelStatus::kOk)
    return;
  if (arm.branch.snapped) {
    ++arm.snaps.count;
    arm.snaps.energy += arm.branch.snap_energy;
    arm.snaps.distance = std::max(arm.snaps.distance, arm.branch.snap_distance);
  }
  if (arm.contact.friction)
    arm.contact.friction->update(arm.joints, arm.branch);
  if (arm.contact.play)
    arm.contact.play->apply(arm.joints, arm.tip.pose);
}

Snaps PlantTips::allSnaps() const noexcept {
  Snaps sum;
  for (const Arm& arm : arms_) {
    sum.count += arm.snaps.count;
    sum.energy += arm.snaps.energy;
    sum.distance = std::max(sum.distance, arm.snaps.distance);
  }
  return sum;
}

Eigen::Vector3d PlantTips::shaftPoint(int arm, double share) const {
  const Arm& own = arms_[static_cast<std::size_t>(arm)];
  kinematics::Branch branch = own.branch;
  std::vector<kinematics::BackbonePoint> points;
  kinematics::BodySections sections;
  const int count = valid(arm) ? own.model->sections(own.joints, sections) : 0;
  if (count == 0 || own.model->backbone(own.joints, branch, {share * sections[static_cast<std::size_t>(count - 1)].end},
                                        false, points) != kinematics::ModelStatus::kOk)
    return Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  return points.front().position;
}

void PlantTips::store(Configurations& configurations) const {
  configurations.resize(arms_.size());
  for (std::size_t k = 0; k < arms_.size(); ++k)
    configurations[k] = {arms_[k].joints, arms_[k].branch};
}

double PlantTips::clearance() const {
  Configurations configurations;
  store(configurations);
  return clearance(configurations);
}

double PlantTips::clearance(const Configurations& configurations) const {
  double least = std::numeric_limits<double>::infinity();
  std::vector<kinematics::Body> bodies(arms_.size());
  for (std::size_t k = 0; k < arms_.size(); ++k) {
    kinematics::Branch branch = configurations.at(k).branch;
    if (makeBody(*arms_[k].model, configurations[k].joints, branch, false, bodies[k]) != kinematics::ModelStatus::kOk)
      return least;
  }
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    for (std::size_t other = k + 1; other < bodies.size(); ++other)
      least = std::min(least, kinematics::clearance(bodies[k], bodies[other]).distance);
  }
  return least;
}

}  // namespace tandem::sim
