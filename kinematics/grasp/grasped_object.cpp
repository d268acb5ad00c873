// SPDX-License-Identifier: Apache-2.0
#include "kinematics/grasp/grasped_object.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>
#include <stdexcept>

#include "kinematics/spectrum.h"

namespace tandem::kinematics::grasp {

using Eigen::Vector3d;

namespace {

constexpr int kMaxIterations = 60;
constexpr double kClosed = 1e-11;      // m and rad, by which contacts may be open: what rods are solved to
constexpr double kUnanswered = 1e-10;  // N and N m per metre of size, of the load
constexpr double kLargestTurn = 0.3;   // rad, of the object (or as much of its size) in one step of Newton's method
constexpr double kNoStiffness = 1e-9;  // part of the largest one

using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 6, 6>;
using Wide = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::ColMajor, 6, 6>;
using Tall = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, 6>;

/// (v, omega) by (v, size omega).
Twist scaleOf(double length) {
  Twist scale = Twist::Ones();
  scale.tail<3>().setConstant(1.0 / length);
  return scale;
}

/// Least answer in units of the object's size; what has no stiffness is left alone.
Matrix6 inverseOf(const Matrix6& stiffness, const Twist& scale) {
  const Matrix6 scaled = scale.asDiagonal() * stiffness * scale.asDiagonal();
  const Eigen::JacobiSVD<Matrix6> svd(scaled, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Twist inverse = Twist::Zero();
  for (int k = 0; k < 6; ++k) {
    if (svd.singularValues()[k] > kNoStiffness * svd.singularValues()[0])
      inverse[k] = 1.0 / svd.singularValues()[k];
  }
  return scale.asDiagonal() * svd.matrixV() * inverse.asDiagonal() * svd.matrixU().transpose() * scale.asDiagonal();
}

Eigen::Isometry3d moved(const Eigen::Isometry3d& pose, const Twist& by) {
  Eigen::Isometry3d result = pose;
  result.translation() += by.head<3>();
  const Vector3d turn = by.tail<3>();
  if (const double angle = turn.norm(); angle > 0.0)
    result.linear() = Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix() * pose.linear())
                          .normalized()
                          .toRotationMatrix();
  return result;
}

/// Negative directions of the symmetric part: moments of constant direction have no potential.
int negatives(const Form& form) { return negativeDirections(form, kNoStiffness); }

}  // namespace

std::string_view describe(GraspStatus status) {
  switch (status) {
    case GraspStatus::kOk:
      return "ok";
    case GraspStatus::kArm:
      return "the model of an arm has no solution";
    case GraspStatus::kNotFinite:
      return "a joint, a pose or a force of the grasp is NaN or infinite";
    case GraspStatus::kNotHeld:
      return "the contacts cannot carry the object: no forces balance its load with all contacts closed";
  }
  return "";
}

/** Everything about one state of arms and object, changes of the tips eliminated: with t the object's twist,
 *
 *   tip = by_joints dq - by_force df - by_object t           beside what is still wrong with the tip's wrench
 *   0   = open + arms dq - soft df - seen t                  at each contact
 *   0   = balance + lever tip + answered df + geometric t    of the object: its stiffness is that of t */
struct GraspedObject::Linear {
  struct One {
    Wide by_tip, by_object;  ///< A and D
    TouchStiffness change;
    Eigen::Matrix<double, 6, catheter::kJoints> by_joints;
    Matrix6 compliance, tip_by_object;
    Tall tip_by_force;
    Wide seen;
    Tall answered;
    Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 6, 1> open;
    Eigen::PartialPivLU<Square> soft;
  };
  std::array<One, kMaxContacts> one;
  Matrix6 stiffness = Matrix6::Zero();
  Twist balance = Twist::Zero();
  double wrong = 0.0;  ///< of contacts, m and rad, and of forces, in the part of them that is allowed
};

GraspedObject::GraspedObject(const Grasp& grasp, const std::vector<catheter::ElasticArm>& arms) : grasp_(grasp) {
  if (arms.size() != grasp.contacts().size())
    throw std::invalid_argument("grasped object: found " + std::to_string(arms.size()) +
                                " arms, expected one for each of " + std::to_string(grasp.contacts().size()) +
                                " contacts");
  for (const catheter::ElasticArm& arm : arms)
    arms_.emplace_back(arm);
}

GraspEquilibrium GraspedObject::start(const Eigen::Isometry3d& object) const {
  GraspEquilibrium equilibrium;
  equilibrium.pose = object;
  equilibrium.force = ContactVector::Zero(grasp_.rows());
  return equilibrium;
}

Wrench GraspedObject::wrenchOn(int arm, const GraspEquilibrium& equilibrium) const {
  const auto k = static_cast<std::size_t>(arm);
  const Touch touch(grasp_.contacts()[k], equilibrium.pose, equilibrium.tips[k].pose);
  const Selection b = selection(touch.type);
  return -(b * touch.rows(touch.to_tip)).transpose() * equilibrium.force.segment(grasp_.firstRow(arm), b.rows());
}

/// Tips under wrenches, which are noted: those that the contact forces make at the tips as they were before.
GraspStatus GraspedObject::tips(const JointsRef& q, GraspEquilibrium& equilibrium, Wrenches& applied) const {
  for (std::size_t k = 0; k < arms_.size(); ++k) {
    const auto joints = q.segment(static_cast<Eigen::Index>(k) * catheter::kJoints, catheter::kJoints);
    const bool known = equilibrium.branches[k].known;
    applied[k] = known ? wrenchOn(static_cast<int>(k), equilibrium) : Wrench(Wrench::Zero());
    equilibrium.arm_status = arms_[k].tip(joints, applied[k], equilibrium.branches[k], equilibrium.tips[k]);
    if (equilibrium.arm_status != ModelStatus::kOk) {
      equilibrium.arm = static_cast<int>(k);
      return GraspStatus::kArm;
    }
  }
  return GraspStatus::kOk;
}

void GraspedObject::linearise(const GraspEquilibrium& equilibrium,
                              const Wrenches& applied,
                              const Wrench& load,
                              Linear& linear) const {
  const double size = grasp_.length();
  linear.stiffness.setZero();
  linear.balance = load;
  double open = 0.0, unanswered = 0.0;
  for (std::size_t k = 0; k < arms_.size(); ++k) {
    Linear::One& one = linear.one[k];
    const LoadedTip& tip = equilibrium.tips[k];
    const Touch touch(grasp_.contacts()[k], equilibrium.pose, tip.pose);
    const Selection b = selection(touch.type);
    const auto force = equilibrium.force.segment(grasp_.firstRow(static_cast<int>(k)), b.rows());
    one.by_tip = b * touch.rows(touch.to_tip);
    one.by_object = b * touch.rows(touch.to_body);
    one.change = stiffnessOf(touch, b.transpose() * force);
    const Matrix6 give = (Matrix6::Identity() + tip.compliance * one.change.on_arm_by_tip).inverse();
    const Matrix6 compliance = one.compliance = give * tip.compliance;
    one.by_joints = give * tip.jacobian;
    one.tip_by_force = compliance * one.by_tip.transpose();
    one.tip_by_object = compliance * one.change.on_arm_by_object;
    one.soft.compute(one.by_tip * one.tip_by_force);
    one.seen = one.by_object + one.by_tip * one.tip_by_object;
    one.answered = one.by_object.transpose() - one.change.on_object_by_tip * one.tip_by_force;
    const Wrench missing = -one.by_tip.transpose() * force - applied[k];
    const Twist yet = compliance * missing;
    one.open = b * touch.residual() + one.by_tip * yet;
    linear.balance += one.by_object.transpose() * force + one.change.on_object_by_tip * yet;
    linear.stiffness += one.answered * one.soft.solve(one.seen) - one.change.on_object_by_object +
                        one.change.on_object_by_tip * one.tip_by_object;
    open += (b * touch.residual()).squaredNorm();
    unanswered += missing.cwiseProduct(scaleOf(size)).squaredNorm();
  }
  unanswered += linear.balance.cwiseProduct(scaleOf(size)).squaredNorm();
  linear.wrong = std::sqrt(open) / kClosed + std::sqrt(unanswered) / kUnanswered;
}

GraspStatus GraspedObject::solveEquilibrium(const JointsRef& q,
                                            const Wrench& load,
                                            GraspEquilibrium& equilibrium) const noexcept {
  GraspEquilibrium at = equilibrium;
  Linear linear;
  Wrenches applied;
  const Twist scale = scaleOf(grasp_.length());
  const auto ended = [&equilibrium](GraspStatus status) { return equilibrium.status = status; };
  if (q.size() != static_cast<Eigen::Index>(arms_.size()) * catheter::kJoints || !load.allFinite())
    return ended(GraspStatus::kNotFinite);
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    if (tips(q, at, applied) != GraspStatus::kOk) {
      equilibrium.arm = at.arm;
      equilibrium.arm_status = at.arm_status;
      return ended(GraspStatus::kArm);
    }
    linearise(at, applied, load, linear);
    if (linear.wrong < 1.0) {
      if (!evaluate(at))
        return ended(GraspStatus::kNotFinite);
      differentiate(at, linear);
      at.unstable = instability(at, linear);
      at.status = GraspStatus::kOk;
      equilibrium = at;
      return GraspStatus::kOk;
    }
    Twist right = linear.balance;
    for (std::size_t k = 0; k < arms_.size(); ++k)
      right += linear.one[k].answered * linear.one[k].soft.solve(linear.one[k].open);
    Twist t = inverseOf(linear.stiffness, scale) * right;
    if (!t.allFinite())
      break;
    const double turn = t.cwiseQuotient(scale).norm() / grasp_.length();
    const double part = std::min(1.0, kLargestTurn / std::max(turn, kLargestTurn));
    for (std::size_t k = 0; k < arms_.size(); ++k) {
      const Linear::One& one = linear.one[k];
      at.force.segment(grasp_.firstRow(static_cast<int>(k)), one.open.size()) +=
          part * one.soft.solve(one.open - one.seen * t);
    }
    at.pose = moved(at.pose, part * t);
  }
  return ended(GraspStatus::kNotHeld);
}

bool GraspedObject::evaluate(GraspEquilibrium& equilibrium) const {
  std::array<const Tip*, kMaxContacts> pointers{};
  for (std::size_t k = 0; k < arms_.size(); ++k)
    pointers[k] = &equilibrium.tips[k];
  return grasp_.evaluate(equilibrium.pose, ArmTips(pointers.data(), arms_.size()), equilibrium.state);
}

void GraspedObject::differentiate(GraspEquilibrium& equilibrium, const Linear& linear) const {
  const auto joints = static_cast<Eigen::Index>(arms_.size()) * catheter::kJoints;
  equilibrium.stiffness = linear.stiffness;
  equilibrium.displacement_by_load = inverseOf(linear.stiffness, scaleOf(grasp_.length()));
  equilibrium.compliance.setZero(grasp_.rows(), grasp_.rows());
  equilibrium.jacobian.resize(6, joints);
  equilibrium.force_by_joints.setZero(grasp_.rows(), joints);
  equilibrium.force_by_load.resize(grasp_.rows(), 6);
  for (std::size_t k = 0; k < arms_.size(); ++k) {
    const Linear::One& one = linear.one[k];
    const Eigen::Index row = grasp_.firstRow(static_cast<int>(k)), count = one.open.size();
    const Eigen::Index column = static_cast<Eigen::Index>(k) * catheter::kJoints;
    equilibrium.compliance.block(row, row, count, count) =
        one.by_tip * equilibrium.tips[k].compliance * one.by_tip.transpose();
    const Eigen::Matrix<double, Eigen::Dynamic, catheter::kJoints, Eigen::ColMajor, 6> pressed =
        one.soft.solve(one.by_tip * one.by_joints);
    equilibrium.force_by_joints.block(row, column, count, catheter::kJoints) = pressed;
    equilibrium.jacobian.middleCols<catheter::kJoints>(column) =
        equilibrium.displacement_by_load * (one.answered * pressed + one.change.on_object_by_tip * one.by_joints);
  }
  for (std::size_t k = 0; k < arms_.size(); ++k) {
    const Linear::One& one = linear.one[k];
    const Eigen::Index row = grasp_.firstRow(static_cast<int>(k)), count = one.open.size();
    const Wide by_object = one.soft.solve(one.seen);
    equilibrium.force_by_joints.middleRows(row, count) -= by_object * equilibrium.jacobian;
    equilibrium.force_by_load.middleRows(row, count) = -by_object * equilibrium.displacement_by_load;
  }
}

/// Directions in which the energy of arms and load, contacts closed by multipliers, is no minimum. Eliminating the rods
/// with their tips held, then the tips, the multipliers and last the object, each leaves the negative eigenvalues of
/// what is eliminated (Haynsworth's inertia formula): as many multipliers as there are count themselves.
int GraspedObject::instability(GraspEquilibrium& equilibrium, const Linear& linear) const {
  const Twist scale = scaleOf(grasp_.length());
  const Matrix6 inverse_scale = scale.cwiseInverse().asDiagonal();
  int found = negatives(scale.asDiagonal() * linear.stiffness * scale.asDiagonal());
  for (std::size_t k = 0; k < arms_.size(); ++k) {
    const Linear::One& one = linear.one[k];
    const LoadedTip& tip = equilibrium.tips[k];
    equilibrium.buckled[k] = tip.conjugate_points - negatives(inverse_scale * tip.compliance * inverse_scale);
    found += equilibrium.buckled[k] + negatives(inverse_scale * one.compliance * inverse_scale) -
             negatives(one.by_tip * one.tip_by_force);
  }
  return found;
}

}  // namespace tandem::kinematics::grasp
