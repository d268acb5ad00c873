// SPDX-License-Identifier: Apache-2.0
#include <Eigen/SVD>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "kinematics/grasp/grasped_object.h"
#include "robots/catheters.h"
#include "robots/detail/places.h"

namespace tandem::robots {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using kinematics::Wrench;
namespace grasp = kinematics::grasp;
namespace catheter = kinematics::catheter;

namespace {

/// Part of the largest gain below which there is none.
constexpr double kNoGain = 1e-7;

std::vector<catheter::ElasticArm> elasticArmsOf(const config::CooperativeRobot& robot,
                                                const config::GraspedObject& object) {
  std::vector<catheter::ElasticArm> arms;
  for (const int arm : object.arms)
    arms.push_back(robot.arms[static_cast<std::size_t>(arm)].model);
  return arms;
}

}  // namespace

struct GraspedObjectMechanism::Parts {
  Parts(const config::CooperativeRobot& robot, const config::GraspedObject& object)
      : held(object), model(grasp::Grasp(object.contacts, object.size), elasticArmsOf(robot, object)) {
    equilibrium = model.start(object.pose);
    for (const int arm : object.arms) {
      arms.push_back(&robot.arms[static_cast<std::size_t>(arm)]);
      limits.push_back(&arms.back()->limits);
    }
  }

  const grasp::Grasp& grasp() const { return model.grasp(); }
  Eigen::Index rows(std::size_t k) const {
    return grasp().firstRow(static_cast<int>(k) + 1) - grasp().firstRow(static_cast<int>(k));
  }
  RobotVector::ConstSegmentReturnType jointsOf(const RobotVector& q, std::size_t k) const {
    return q.segment(static_cast<Eigen::Index>(k) * catheter::kJoints, catheter::kJoints);
  }
  grasp::ContactLoad loadAt(std::size_t k, const VectorXd& force) const {
    return grasp::loadOf(held.contacts[k], force.segment(grasp().firstRow(static_cast<int>(k)), rows(k)));
  }
  /// Contact forces with a specified squeeze.
  VectorXd wanted(double squeeze) const {
    grasp::Twist left;
    return grasp().contactForces(equilibrium.state, wrench(), squeeze, left);
  }
  /// Whether no contact slips or pulls under these forces, and friction contacts are under compression.
  bool holds(const VectorXd& force) const {
    for (std::size_t k = 0; k < arms.size(); ++k) {
      const grasp::ContactLoad load = loadAt(k, force);
      if (held.contacts[k].type != grasp::ContactType::kRigid && (!(load.normal > 0.0) || load.slips))
        return false;
    }
    return true;
  }

  Wrench wrench() const {
    Wrench load;
    load << held.load, Eigen::Vector3d::Zero();
    return load;
  }

  /// Largest norms of force and moment of forceError() at a contact, N and N m.
  std::pair<double, double> largestForceError() const {
    const VectorXd error = forceError();
    double force = 0.0, moment = 0.0;
    for (std::size_t k = 0; k < arms.size(); ++k) {
      const grasp::Selection b = grasp::selection(held.contacts[k].type);
      const Wrench wrench = b.transpose() * error.segment(grasp().firstRow(static_cast<int>(k)), rows(k));
      force = std::max(force, wrench.head<3>().norm());
      moment = std::max(moment, wrench.tail<3>().norm());
    }
    return {force, moment};
  }

  /// Norm of the part of strain() that is not controlled, m.
  double uncontrolled() const { return (fixed.transpose() * strain()).norm(); }

  /// Product of the gains from joint velocities of size one that keep the controlled internal forces to the object;
  /// lengths in units of length().
  double manipulability() const {
    const MatrixXd rates = strainRates(), rows = choice(rates) * rates;
    const MatrixXd admissible = rows.rows() == 0 ? MatrixXd(MatrixXd::Identity(rates.cols(), rates.cols()))
                                                 : MatrixXd(Eigen::JacobiSVD<MatrixXd>(rows, Eigen::ComputeFullV)
                                                                .matrixV()
                                                                .rightCols(rates.cols() - rows.rows()));
    MatrixXd gains = equilibrium.jacobian * admissible;
    gains.topRows<3>() /= grasp().length();
    double product = 0.0;
    const VectorXd values = Eigen::JacobiSVD<MatrixXd>(gains).singularValues();
    for (Eigen::Index k = 0; k < values.size() && values[k] > kNoGain * values[0]; ++k)
      product = (k == 0 ? 1.0 : product) * values[k];
    return product;
  }

  /// Z^T C (f - f*).
  VectorXd strain() const {
    return equilibrium.state.internal_forces.transpose() * (equilibrium.compliance * forceError());
  }

  /// Z^T C d(f - f*)/dq; without loads Z^T B J. The specified forces f* are given in the object frame, in which the
  /// load rotates in the opposite direction.
  MatrixXd strainRates() const {
    MatrixXd rates = equilibrium.force_by_joints;
    for (Eigen::Index j = 0; j < rates.cols(); ++j) {
      const Eigen::Vector3d turn = equilibrium.jacobian.col(j).tail<3>();
      Wrench change;
      change << held.load.cross(turn), Eigen::Vector3d::Zero();
      grasp::Twist left;
      rates.col(j) -= grasp().contactForces(equilibrium.state, change, 0.0, left);
    }
    return equilibrium.state.internal_forces.transpose() * (equilibrium.compliance * rates);
  }

  /// Orthonormal combinations of the internal forces that joints control, largest gain first: as many rows as unloaded
  /// arms can change. @param rates  strainRates()
  MatrixXd choice(const MatrixXd& rates) const {
    const Eigen::Index count = rates.rows() - fixed.cols();
    if (count == 0)
      return {0, rates.rows()};
    const MatrixXd changed = rates - fixed * (fixed.transpose() * rates);
    return Eigen::JacobiSVD<MatrixXd>(changed, Eigen::ComputeThinU).matrixU().leftCols(count).transpose();
  }

  /// Sets `fixed`: the left null space of Z^T B J, with J of the arms without contact forces. A load gives these
  /// combinations of the internal forces gains too, but only in proportion to it: to control them would take large
  /// motions of the joints.
  std::string findFixed(const RobotVector& q) {
    MatrixXd arms_part = MatrixXd::Zero(grasp().rows(), q.size());
    for (std::size_t k = 0; k < arms.size(); ++k) {
      kinematics::LoadedTip free;
      const kinematics::ModelStatus status =
          model.arms()[k].tip(jointsOf(q, k), Wrench::Zero(), free_branches[k], free);
      if (status != kinematics::ModelStatus::kOk)
        return arms[k]->name + " without load: " + std::string(kinematics::describe(status));
      const grasp::Touch touch(held.contacts[k], equilibrium.pose, equilibrium.tips[k].pose);
      arms_part.block(grasp().firstRow(static_cast<int>(k)), static_cast<Eigen::Index>(k) * catheter::kJoints, rows(k),
                      catheter::kJoints) = grasp::selection(touch.type) * touch.rows(touch.to_tip) * free.jacobian;
    }
    const MatrixXd consistency = equilibrium.state.internal_forces.transpose() * arms_part;
    fixed = kinematics::grasp::leftNullSpace(consistency);
    return {};
  }

  /// The internal force that differs from the desired one, by contacts, N and N m.
  VectorXd forceError() const { return equilibrium.force - wanted(held.squeeze); }

  const config::GraspedObject& held;
  grasp::GraspedObject model;
  std::vector<const config::CatheterArm*> arms;
  std::vector<const safety::ArmLimits*> limits;

  RobotVector joints;
  grasp::GraspEquilibrium equilibrium;
  MotionJacobian jacobian;
  std::array<kinematics::cosserat::RodBranch, grasp::kMaxContacts> free_branches;  ///< of the arms without load
  MatrixXd fixed;  ///< orthonormal combinations of the internal forces that joints of unloaded arms cannot change
};

GraspedObjectMechanism::GraspedObjectMechanism(const config::CooperativeRobot& robot) {
  if (!robot.object)
    throw std::invalid_argument(robot.name + ": found no object, expected one that the arms hold");
  parts_ = std::make_unique<Parts>(robot, *robot.object);
}
GraspedObjectMechanism::~GraspedObjectMechanism() = default;

const std::vector<const safety::ArmLimits*>& GraspedObjectMechanism::limits() const { return parts_->limits; }

RobotVector GraspedObjectMechanism::home() const {
  RobotVector q(static_cast<Eigen::Index>(parts_->arms.size()) * catheter::kJoints);
  for (std::size_t k = 0; k < parts_->arms.size(); ++k)
    q.segment(static_cast<Eigen::Index>(k) * catheter::kJoints, catheter::kJoints) = parts_->arms[k]->home;
  return q;
}

std::string GraspedObjectMechanism::solveEquilibrium(const RobotVector& q) {
  Parts& parts = *parts_;
  const grasp::GraspStatus status = parts.model.solveEquilibrium(q, parts.wrench(), parts.equilibrium);
  if (status == grasp::GraspStatus::kArm)
    return parts.arms[static_cast<std::size_t>(parts.equilibrium.arm)]->name + ": " +
           std::string(kinematics::describe(parts.equilibrium.arm_status));
  if (status != grasp::GraspStatus::kOk)
    return std::string(grasp::describe(status));
  if (std::string why = parts.findFixed(q); !why.empty())
    return why;
  parts.joints = q;
  parts.jacobian = parts.equilibrium.jacobian;
  return {};
}

const Eigen::Isometry3d& GraspedObjectMechanism::pose() const { return parts_->equilibrium.pose; }
const MotionJacobian& GraspedObjectMechanism::jacobian() const { return parts_->jacobian; }
double GraspedObjectMechanism::length() const { return parts_->grasp().length(); }

std::vector<control::Task> GraspedObjectMechanism::higherTasks(double gain) const {
  const MatrixXd rates = parts_->strainRates();
  const MatrixXd choice = parts_->choice(rates);
  const MatrixXd rows = choice * rates;
  const VectorXd wanted = -gain * (choice * parts_->strain());
  std::vector<control::Task> tasks;
  for (Eigen::Index first = 0; first < rows.rows(); first += control::kMaxTaskRows) {
    const Eigen::Index count = std::min<Eigen::Index>(control::kMaxTaskRows, rows.rows() - first);
    tasks.push_back({rows.middleRows(first, count), wanted.segment(first, count)});
  }
  return tasks;
}

double GraspedObjectMechanism::residual() const {
  return (parts_->choice(parts_->strainRates()) * parts_->strain()).norm();
}

std::string GraspedObjectMechanism::infeasibility() const {
  const Parts& parts = *parts_;
  if (parts.holds(parts.wanted(parts.held.squeeze)))
    return {};
  // Smallest sufficient squeeze: doubling, then bisection.
  constexpr double kMost = 1e3;  // N
  double lower = parts.held.squeeze, upper = std::max(lower, 1e-6);
  while (upper < kMost && !parts.holds(parts.wanted(upper)))
    lower = upper, upper *= 2.0;
  char text[200];
  if (upper >= kMost) {
    std::snprintf(text, sizeof text,
                  "no squeeze prevents slip under the load: the contact normals do not oppose each other");
    return text;
  }
  while (upper - lower > 1e-3 * upper && upper > 1e-9) {
    const double middle = 0.5 * (lower + upper);
    (parts.holds(parts.wanted(middle)) ? upper : lower) = middle;
  }
  if (parts.held.load.isZero())
    std::snprintf(text, sizeof text, "the contacts rely on friction: found a squeeze of %g N, expected more than 0 N",
                  parts.held.squeeze);
  else
    std::snprintf(text, sizeof text,
                  "the contacts would slip under the load: found a squeeze of %g N, expected more than %.3g N",
                  parts.held.squeeze, upper);
  return text;
}

std::string GraspedObjectMechanism::errorOf(const grasp::GraspEquilibrium& equilibrium) const {
  const Parts& parts = *parts_;
  std::string text;
  const VectorXd force = equilibrium.force;
  const auto add = [&text](const std::string& what) { text += (text.empty() ? "" : "; ") + what; };
  for (std::size_t k = 0; k < parts.arms.size(); ++k) {
    const grasp::ContactLoad load = parts.loadAt(k, force);
    if (load.separates)
      add(parts.arms[k]->name + ": the contact force would be tensile");
    else if (load.slips)
      add(parts.arms[k]->name + " slips: its contact needs " + std::to_string(load.used).substr(0, 5) +
          " of its friction");
    if (equilibrium.buckled[k] > 0)
      add(parts.arms[k]->name + " buckles");
  }
  if (equilibrium.unstable > 0 && text.empty())
    add("the equilibrium of arms and grasped object is unstable; reduce squeeze or load");
  return text;
}

std::vector<std::pair<std::string, double>> GraspedObjectMechanism::columns() const {
  const Parts& parts = *parts_;
  std::vector<std::pair<std::string, double>> columns;
  for (std::size_t k = 0; k < parts.arms.size(); ++k) {
    const grasp::ContactLoad load = parts.loadAt(k, parts.equilibrium.force);
    columns.emplace_back("normal_N_" + parts.arms[k]->name, load.normal);
    columns.emplace_back("friction_used_" + parts.arms[k]->name, load.used);
  }
  columns.emplace_back("manipulability", parts.manipulability());
  const auto [force, moment] = parts.largestForceError();
  columns.emplace_back("internal_error_N", force);
  columns.emplace_back("internal_error_Nm", moment);
  columns.emplace_back("uncontrolled_m", parts.uncontrolled());
  return columns;
}

std::vector<Eigen::Isometry3d> GraspedObjectMechanism::tips() const {
  std::vector<Eigen::Isometry3d> tips;
  for (std::size_t k = 0; k < parts_->arms.size(); ++k)
    tips.push_back(parts_->equilibrium.tips[k].pose);
  return tips;
}

std::vector<std::optional<Twist>> GraspedObjectMechanism::tipWrenches() const {
  std::vector<std::optional<Twist>> wrenches;
  for (std::size_t k = 0; k < parts_->arms.size(); ++k)
    wrenches.emplace_back(parts_->model.wrenchOn(static_cast<int>(k), parts_->equilibrium));
  return wrenches;
}

std::vector<std::vector<Eigen::Vector3d>> GraspedObjectMechanism::shapes() const {
  const Parts& parts = *parts_;
  std::vector<std::vector<Eigen::Vector3d>> shapes;
  for (std::size_t k = 0; k < parts.arms.size(); ++k) {
    auto branch = parts.equilibrium.branches[k];
    std::vector<kinematics::cosserat::RodPoint> points;
    const Wrench wrench = parts.model.wrenchOn(static_cast<int>(k), parts.equilibrium);
    parts.model.arms()[k].shape(parts.jointsOf(parts.joints, k), wrench, branch, 60, points);
    shapes.push_back(placesOf(points, parts.equilibrium.tips[k].pose.translation()));
  }
  return shapes;
}

const grasp::Grasp& GraspedObjectMechanism::grasp() const { return parts_->grasp(); }
const grasp::GraspState& GraspedObjectMechanism::state() const { return parts_->equilibrium.state; }
const grasp::GraspEquilibrium& GraspedObjectMechanism::equilibrium() const { return parts_->equilibrium; }
const grasp::GraspedObject& GraspedObjectMechanism::model() const { return parts_->model; }
const RobotVector& GraspedObjectMechanism::joints() const { return parts_->joints; }

grasp::Matrix6 GraspedObjectMechanism::stiffnessOf(int contact) const {
  const Parts& parts = *parts_;
  const Eigen::Index row = parts.grasp().firstRow(contact), count = parts.rows(static_cast<std::size_t>(contact));
  const MatrixXd at_object = parts.equilibrium.state.by_object.middleRows(row, count);
  const MatrixXd compliance = parts.equilibrium.compliance.block(row, row, count, count);
  return at_object.transpose() * compliance.ldlt().solve(at_object);
}

grasp::Matrix6 GraspedObjectMechanism::stiffness() const { return parts_->equilibrium.stiffness; }

}  // namespace tandem::robots
