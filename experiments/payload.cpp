// SPDX-License-Identifier: Apache-2.0
#include "experiments/payload.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace tandem::experiments {

namespace grasp = kinematics::grasp;
using kinematics::Wrench;

PayloadStudy::PayloadStudy(const config::CooperativeRobot& robot, const GraspedObjectMechanism& mechanism)
    : carriers_{"all"}, refusals_{""} {
  const config::GraspedObject& object = *robot.object;
  Wrench load;
  load << object.load, Eigen::Vector3d::Zero();
  mechanisms_.push_back(&mechanism);
  joints_.push_back(mechanism.joints());
  equilibria_.push_back(mechanism.equilibrium());
  loads_.push_back(load);
  alone_.reserve(object.arms.size());
  for (std::size_t k = 0; k < object.arms.size(); ++k) {
    config::CooperativeRobot one = robot;
    one.object->arms = {object.arms[k]};
    one.object->contacts = {object.contacts[k]};
    one.object->squeeze = 0.0;
    alone_.push_back(std::move(one));
    owned_.push_back(std::make_unique<GraspedObjectMechanism>(alone_.back()));
    mechanisms_.push_back(owned_.back().get());
    joints_.push_back(mechanism.joints().segment(static_cast<Eigen::Index>(k) * kinematics::catheter::kJoints,
                                                 kinematics::catheter::kJoints));
    loads_.push_back(load);
    carriers_.push_back(robot.arms[static_cast<std::size_t>(object.arms[k])].name);
    std::string why;
    if (object.contacts[k].type == grasp::ContactType::kRigid)
      why = owned_.back()->solveEquilibrium(joints_.back());
    else
      why = "a single contact of this type cannot hold an object";
    refusals_.push_back(why);
    equilibria_.push_back(owned_.back()->equilibrium());
  }
}

std::string PayloadStudy::limitOf(std::size_t carrier,
                                  const grasp::GraspEquilibrium& equilibrium,
                                  double most_sag) const {
  const std::string why = mechanisms_[carrier]->errorOf(equilibrium);
  if (!why.empty())
    return why;
  const double sag = (equilibrium.pose.translation() - equilibria_[carrier].pose.translation()).norm();
  return sag > most_sag ? "the displacement of the object exceeds the allowed value" : "";
}

PayloadStudy::Attempt PayloadStudy::add(std::size_t carrier,
                                        const grasp::GraspEquilibrium& from,
                                        const Eigen::Vector3d& force,
                                        double most_sag) const {
  Attempt attempt{from, ""};
  Wrench load = loads_[carrier];
  load.head<3>() += force;
  const grasp::GraspStatus status =
      mechanisms_[carrier]->model().solveEquilibrium(joints_[carrier], load, attempt.equilibrium);
  attempt.limit = status == grasp::GraspStatus::kOk ? limitOf(carrier, attempt.equilibrium, most_sag)
                                                    : "no equilibrium: " + std::string(describe(status));
  return attempt;
}

Payload PayloadStudy::carried(std::size_t carrier,
                              const Eigen::Vector3d& direction,
                              const PayloadOptions& options) const {
  Payload result;
  result.limit = refusals_[carrier];
  if (!result.limit.empty())
    return result;
  grasp::GraspEquilibrium good = equilibria_[carrier];
  result.stiffness = 1.0 / direction.dot(good.displacement_by_load.topLeftCorner<3, 3>() * direction);
  result.limit = limitOf(carrier, good, options.most_sag);
  if (!result.limit.empty())
    return result;
  // At the load at which an arm alone would buckle under a force of constant direction, the arm's model has no solution
  // although the grasp has one: a longer step passes that load, if it ends near where the stiffness predicts.
  constexpr std::array kLonger = {1.5, 2.0, 3.0, 4.0};
  double step = options.most_load;
  while (result.load < options.most_load) {
    const double softness = (good.displacement_by_load.topLeftCorner<3, 3>() * direction).norm();
    step = std::min({step, 0.1 * options.most_sag / softness, options.most_load - result.load});
    double added = step;
    Attempt attempt = add(carrier, good, (result.load + added) * direction, options.most_sag);
    const std::string limit = attempt.limit;
    for (std::size_t k = 0; k < kLonger.size() && attempt.equilibrium.status != grasp::GraspStatus::kOk; ++k) {
      added = std::min(kLonger[k] * step, options.most_load - result.load);
      attempt = add(carrier, good, (result.load + added) * direction, options.most_sag);
      const double sag = (attempt.equilibrium.pose.translation() - good.pose.translation()).norm();
      if (attempt.limit.empty() && sag > 2.0 * added * softness)
        attempt.limit = limit;
    }
    if (attempt.limit.empty()) {
      good = attempt.equilibrium;
      result.load += added;
      continue;
    }
    result.limit = limit;
    step *= 0.5;
    if (step < 1e-3 * result.load || step < 1e-9)
      break;
  }
  if (result.load >= options.most_load)
    result.limit = "none up to the end of the search";
  result.sag = (good.pose.translation() - equilibria_[carrier].pose.translation()).norm();
  return result;
}

}  // namespace tandem::experiments
