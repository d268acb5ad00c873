// SPDX-License-Identifier: Apache-2.0
/** @file Evaluation of the compliant model at neighbouring joint vectors, for finite differences. */
#pragma once

#include <algorithm>

#include "tests/unit/kinematics/arms.h"
#include "tests/unit/kinematics/differences.h"

namespace tandem::test {

/// A solution on a branch, and neighbouring solutions on the same branch.
class Neighbourhood {
 public:
  Neighbourhood(const kinematics::CompliantModel& model,
                const Eigen::VectorXd& q,
                const kinematics::Branch& branch = {})
      : model_(model), q_(q), branch_(branch) {
    status = model.tip(q, branch_, tip);
  }

  /// Change of the pose by a step in one joint; empty if the model has no solution on this branch.
  Eigen::VectorXd moved(int joint, double step) const {
    Eigen::VectorXd q = q_;
    q[joint] += step;
    kinematics::Branch branch = branch_;
    kinematics::Tip there;
    if (model_.tip(q, branch, there) != kinematics::ModelStatus::kOk || branch.snapped)
      return {};
    return poseDifference(tip.pose, there.pose);
  }

  /// The stability there; empty if the model has no solution on this branch.
  Eigen::VectorXd stabilityAt(int joint, double step) const {
    Eigen::VectorXd q = q_;
    q[joint] += step;
    kinematics::Branch branch = branch_;
    kinematics::Tip there;
    if (model_.tip(q, branch, there) != kinematics::ModelStatus::kOk || branch.snapped)
      return {};
    return Eigen::VectorXd::Constant(1, there.stability);
  }

  /// Distance of a translation until a boundary of its tube meets another place, m, without places that it already
  /// meets; number of those.
  struct Room {
    double gap = 1.0;
    int meetings = 0;
  };
  Room room(int tube) const {
    Room result;
    const auto see = [&](double distance) {
      if (std::abs(distance) < 1e-13)
        ++result.meetings;
      else
        result.gap = std::min(result.gap, std::abs(distance));
    };
    for (const double here : boundaries(tube)) {
      see(here);
      for (int i = 0; i < model_.arm().tubeCount(); ++i) {
        for (const double there : i == tube ? std::vector<double>() : boundaries(i))
          see(there - here);
      }
    }
    see(q_[tube]);
    return result;
  }

  /// Step in a joint over which the pose is smooth; 0 if it has a corner.
  double smoothStep(int joint) const {
    const double elastic = std::min(1.0, tip.stability * tip.stability);
    if (joint >= model_.arm().tubeCount())
      return 0.05 * elastic;
    const Room around = room(joint);
    return around.meetings > 0 ? 0.0 : std::min(1e-3 * elastic, 0.45 * around.gap);
  }

  kinematics::Tip tip;
  kinematics::ModelStatus status;

 private:
  std::vector<double> boundaries(int tube) const {
    std::vector<double> result;
    double s = q_[tube];
    for (const auto& section : model_.arm().tubes[tube].sections)
      result.push_back(s += section.length);
    return result;
  }

  const kinematics::CompliantModel& model_;
  Eigen::VectorXd q_;
  kinematics::Branch branch_;
};

}  // namespace tandem::test
