// SPDX-License-Identifier: Apache-2.0
#include "experiments/payload.h"

#include <algorithm>
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

Payload PayloadStudy::carried(std::size_t carrier,
                              const Eigen::Vector3d& direction,
                              const PayloadOptions& options) const {
  Payload result;
  result.limit = refusals_[carrier];
  if (!result.limit.empty())
    return result;
  const grasp::GraspedObject& model = mechanisms_[carrier]->model();
  grasp::GraspEquilibrium good = equilibria_[carrier];
  result.stiffness = 1.0 / direction.dot(good.displacement_by_load.topLeftCorner<3, 3>() * direction);
  result.limit = limitOf(carrier, good, options.most_sag);
  if (!result.limit.empty())
    return result;
  const double part = 0.1 * options.most_sag;
  double step = options.most_load;
  while (result.load < options.most_load) {
    const double softness = (good.displacement_by_load.topLeftCorner<3, 3>() * direction).norm();
    step = std::min({step, part / softness, options.most_load - result.load});
    grasp::GraspEquilibrium next = good;
    Wrench load = loads_[carrier];
    load.head<3>() += (result.load + step) * direction;
    const grasp::GraspStatus status = model.solveEquilibrium(joints_[carrier], load, next);
    const std::string why = status == grasp::GraspStatus::kOk ? limitOf(carrier, next, options.most_sag)
                                                              : "no equilibrium: " + std::string(describe(status));
    if (why.empty()) {
      good = next;
      result.load += step;
      continue;
    }
    result.limit = why;
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
