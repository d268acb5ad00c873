// SPDX-License-Identifier: Apache-2.0
#include <Eigen/QR>
#include <Eigen/SVD>
#include <cmath>
#include <stdexcept>

#include "experiments/catheters.h"
#include "experiments/object_path.h"
#include "kinematics/rotations.h"

namespace tandem::experiments {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using kinematics::LoadedTip;
using kinematics::Tip;
using kinematics::Wrench;
namespace grasp = kinematics::grasp;
namespace catheter = kinematics::catheter;

namespace {

constexpr int kMaxIterations = 60;
constexpr double kClosed = 1e-10;     // m and rad, by which contacts may be open
constexpr double kUnanswered = 1e-7;  // N and N m per metre of size, of the load

/// Wrench by contact components: B_i R_i^T shifted from the tool tip to the contact, transposed.
Eigen::Matrix<double, 6, Eigen::Dynamic> toTip(const grasp::Contact& contact,
                                               const Eigen::Isometry3d& frame,
                                               const Eigen::Vector3d& tip) {
  const grasp::Selection b = grasp::selection(contact.type);
  const Eigen::Matrix<double, 6, Eigen::Dynamic> local = b.transpose();
  Eigen::Matrix<double, 6, Eigen::Dynamic> wrench(6, b.rows());
  for (Eigen::Index k = 0; k < b.rows(); ++k) {
    const Eigen::Vector3d force = frame.linear() * local.col(k).head<3>();
    const Eigen::Vector3d moment = frame.linear() * local.col(k).tail<3>();
    wrench.col(k) << force, moment + (frame.translation() - tip).cross(force);
  }
  return wrench;
}

}  // namespace

struct HeldObjectMechanism::Parts {
  Parts(const config::CooperativeRobot& robot, const config::HeldObject& object)
      : held(object), grasp(object.contacts, object.size), rest() {
    rest.pose = object.pose;
    rest.force = VectorXd::Zero(grasp.rows());
    for (const int arm : object.arms) {
      arms.push_back(&robot.arms[static_cast<std::size_t>(arm)]);
      models.emplace_back(arms.back()->model);
      limits.push_back(&arms.back()->limits);
    }
    rest.tips.resize(arms.size());
    rest.branches.resize(arms.size());
  }

  Eigen::Index rows(std::size_t k) const {
    return grasp.firstRow(static_cast<int>(k) + 1) - grasp.firstRow(static_cast<int>(k));
  }
  RobotVector::ConstSegmentReturnType jointsOf(const RobotVector& q, std::size_t k) const {
    return q.segment(static_cast<Eigen::Index>(k) * catheter::kJoints, catheter::kJoints);
  }

  /** Where everything comes to rest, and all that is known there. */
  struct Rest {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    VectorXd force;  ///< on the object, contact components
    std::vector<kinematics::cosserat::RodBranch> branches;
    std::vector<LoadedTip> tips;
    MatrixXd compliance;
    grasp::GraspState state;
  };

  /// Tips under the contact forces of a rest; the contacts' compliance beside them.
  std::string load(const RobotVector& q, Rest& at) const {
    at.compliance.setZero(grasp.rows(), grasp.rows());
    for (std::size_t k = 0; k < arms.size(); ++k) {
      const Eigen::Isometry3d frame = at.pose * held.contacts[k].frame;
      const Eigen::Index row = grasp.firstRow(static_cast<int>(k));
      // The force acts where contact and tip are held together: the lever is fixed to the tip.
      const Eigen::Vector3d lever = -(frame.linear() * held.contacts[k].hand.inverse().translation());
      const auto map = toTip(held.contacts[k], frame, frame.translation() - lever);
      const Wrench wrench = -map * at.force.segment(row, rows(k));
      const auto status = models[k].tip(jointsOf(q, k), wrench, at.branches[k], at.tips[k]);
      if (status != kinematics::ModelStatus::kOk)
        return arms[k]->name + ": " + std::string(kinematics::describe(status));
      at.compliance.block(row, row, rows(k), rows(k)) = map.transpose() * at.tips[k].compliance * map;
    }
    return {};
  }

  std::string evaluate(Rest& at) const {
    std::vector<const Tip*> pointers;
    for (const LoadedTip& tip : at.tips)
      pointers.push_back(&tip);
    return grasp.evaluate(at.pose, pointers, at.state) ? "" : "a number of the grasp is not finite";
  }

  /// From the rest given to the one at other joints; what is left in `at` is one only if the answer is empty.
  std::string find(const RobotVector& q, Rest& at) const;

  /// How pose and forces change with the joints, by differences of rests: forces turn with the object, which the
  /// Jacobians of unloaded contacts leave out.
  std::string differentiate();

  Wrench wrench() const {
    Wrench load;
    load << held.load, Eigen::Vector3d::Zero();
    return load;
  }

  /// Z^T C (f - wanted f).
  VectorXd strain() const {
    grasp::Twist left;
    const VectorXd wanted = grasp.contactForces(rest.state, wrench(), held.squeeze, left);
    return rest.state.internal_forces.transpose() * (rest.compliance * (rest.force - wanted));
  }

  /// Z^T C df/dq: Z^T B J where nothing is loaded.
  MatrixXd strainRates() const { return rest.state.internal_forces.transpose() * (rest.compliance * force_rates); }

  /// Orthonormal combinations of its rows, as many as joints can change independently.
  MatrixXd choice(const MatrixXd& rates) const {
    if (rates.rows() == 0)
      return rates;
    const Eigen::JacobiSVD<MatrixXd> svd(rates, Eigen::ComputeThinU);
    return svd.matrixU().leftCols(rest.state.squeezes).transpose();
  }

  const config::HeldObject& held;
  grasp::Grasp grasp;
  std::vector<const config::CatheterArm*> arms;
  std::vector<catheter::ElasticCatheter> models;
  std::vector<const safety::ArmLimits*> limits;

  RobotVector joints;
  Rest rest;
  MatrixXd force_rates;     ///< of contact forces by joint velocity
  MotionJacobian jacobian;  ///< of the object
};

std::string HeldObjectMechanism::Parts::find(const RobotVector& q, Rest& at) const {
  const double length = grasp.length();
  const Twist scale = (Twist() << 1, 1, 1, 1 / length, 1 / length, 1 / length).finished();
  for (int k = 0; k < kMaxIterations; ++k) {
    if (const std::string why = load(q, at); !why.empty())
      return why;
    if (const std::string why = evaluate(at); !why.empty())
      return why;
    const Twist balance = at.state.by_object.transpose() * at.force + wrench();
    if (at.state.drift.norm() + balance.cwiseProduct(scale).norm() * kClosed / kUnanswered < kClosed)
      return {};
    // d falls by C df + B G^T t to zero, and G B^T (f + df) + w = 0.
    const MatrixXd stiffness = at.compliance.ldlt().solve(MatrixXd(at.state.by_object * scale.asDiagonal()));
    const MatrixXd whole = scale.asDiagonal() * at.state.by_object.transpose() * stiffness;
    const VectorXd right = scale.cwiseProduct(balance) + stiffness.transpose() * at.state.drift;
    const Twist t = scale.cwiseProduct(Twist(whole.completeOrthogonalDecomposition().solve(right)));
    at.force += at.compliance.ldlt().solve(VectorXd(at.state.drift - at.state.by_object * t));
    at.pose = displaced(at.pose, t);
  }
  return "the contacts cannot hold the object: no forces carry its load with all contacts closed";
}

std::string HeldObjectMechanism::Parts::differentiate() {
  constexpr double kStep = 1e-5;  // m and rad: closed to 1e-10, so good to 1e-5
  force_rates.resize(grasp.rows(), joints.size());
  jacobian.resize(6, joints.size());
  for (Eigen::Index j = 0; j < joints.size(); ++j) {
    Rest back = rest, ahead = rest;
    RobotVector q = joints;
    q[j] = joints[j] - kStep;
    std::string why = find(q, back);
    q[j] = joints[j] + kStep;
    if (why.empty())
      why = find(q, ahead);
    if (!why.empty())
      return why;
    force_rates.col(j) = (ahead.force - back.force) / (2.0 * kStep);
    jacobian.col(j) = difference(back.pose, ahead.pose) / (2.0 * kStep);
  }
  return {};
}

HeldObjectMechanism::HeldObjectMechanism(const config::CooperativeRobot& robot) {
  if (!robot.object)
    throw std::invalid_argument(robot.name + ": found no object, expected one that the arms hold");
  parts_ = std::make_unique<Parts>(robot, *robot.object);
}
HeldObjectMechanism::~HeldObjectMechanism() = default;

const std::vector<const safety::ArmLimits*>& HeldObjectMechanism::limits() const { return parts_->limits; }

std::vector<control::JointKind> HeldObjectMechanism::kinds() const {
  std::vector<control::JointKind> kinds;
  for (std::size_t k = 0; k < parts_->arms.size(); ++k)
    kinds.insert(kinds.end(),
                 {control::JointKind::kTranslation, control::JointKind::kRotation, control::JointKind::kRotation});
  return kinds;
}

RobotVector HeldObjectMechanism::home() const {
  RobotVector q(static_cast<Eigen::Index>(parts_->arms.size()) * catheter::kJoints);
  for (std::size_t k = 0; k < parts_->arms.size(); ++k)
    q.segment(static_cast<Eigen::Index>(k) * catheter::kJoints, catheter::kJoints) = parts_->arms[k]->home;
  return q;
}

std::string HeldObjectMechanism::settle(const RobotVector& q) {
  Parts& parts = *parts_;
  const Parts::Rest before = parts.rest;
  if (const std::string why = parts.find(q, parts.rest); !why.empty()) {
    parts.rest = before;
    return why;
  }
  parts.joints = q;
  return parts.differentiate();
}

const Eigen::Isometry3d& HeldObjectMechanism::pose() const { return parts_->rest.pose; }
const MotionJacobian& HeldObjectMechanism::jacobian() const { return parts_->jacobian; }
double HeldObjectMechanism::length() const { return parts_->grasp.length(); }

std::vector<control::Task> HeldObjectMechanism::above(double gain) const {
  const MatrixXd rates = parts_->strainRates();
  // Only so many combinations of the rows as joints can change: the others are nothing that could be asked for.
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

double HeldObjectMechanism::drift() const { return (parts_->choice(parts_->strainRates()) * parts_->strain()).norm(); }

std::string HeldObjectMechanism::trouble() const {
  const Parts& parts = *parts_;
  std::string text;
  for (std::size_t k = 0; k < parts.arms.size(); ++k) {
    const grasp::Contact& contact = parts.held.contacts[k];
    const auto load =
        grasp::loadOf(contact, parts.rest.force.segment(parts.grasp.firstRow(static_cast<int>(k)), parts.rows(k)));
    if (load.separates)
      text += (text.empty() ? "" : "; ") + parts.arms[k]->name + " would have to pull at its contact";
    else if (load.slips)
      text += (text.empty() ? "" : "; ") + parts.arms[k]->name + " slips: its contact needs " +
              std::to_string(load.used).substr(0, 5) + " of its friction";
    if (parts.rest.tips[k].conjugate_points > 0)
      text += (text.empty() ? "" : "; ") + parts.arms[k]->name + " buckles";
  }
  return text;
}

std::vector<std::pair<std::string, double>> HeldObjectMechanism::facts() const {
  const Parts& parts = *parts_;
  std::vector<std::pair<std::string, double>> facts;
  for (std::size_t k = 0; k < parts.arms.size(); ++k) {
    const auto load = grasp::loadOf(parts.held.contacts[k],
                                    parts.rest.force.segment(parts.grasp.firstRow(static_cast<int>(k)), parts.rows(k)));
    facts.emplace_back("normal_N_" + parts.arms[k]->name, load.normal);
    facts.emplace_back("friction_used_" + parts.arms[k]->name, load.used);
  }
  facts.emplace_back("manipulability", parts.rest.state.manipulability);
  return facts;
}

std::vector<std::vector<Eigen::Vector3d>> HeldObjectMechanism::shapes() const {
  const Parts& parts = *parts_;
  std::vector<std::vector<Eigen::Vector3d>> shapes;
  for (std::size_t k = 0; k < parts.arms.size(); ++k) {
    const Eigen::Isometry3d frame = parts.rest.pose * parts.held.contacts[k].frame;
    const Wrench wrench = -toTip(parts.held.contacts[k], frame, parts.rest.tips[k].pose.translation()) *
                          parts.rest.force.segment(parts.grasp.firstRow(static_cast<int>(k)), parts.rows(k));
    auto branch = parts.rest.branches[k];
    std::vector<kinematics::cosserat::RodPoint> points;
    parts.models[k].shape(parts.jointsOf(parts.joints, k), wrench, branch, 60, points);
    std::vector<Eigen::Vector3d> places;
    for (const auto& point : points)
      places.push_back(point.pose.translation());
    places.push_back(parts.rest.tips[k].pose.translation());
    shapes.push_back(std::move(places));
  }
  return shapes;
}

const grasp::Grasp& HeldObjectMechanism::grasp() const { return parts_->grasp; }
const grasp::GraspState& HeldObjectMechanism::state() const { return parts_->rest.state; }

grasp::Matrix6 HeldObjectMechanism::stiffnessOf(int contact) const {
  const Parts& parts = *parts_;
  const Eigen::Index row = parts.grasp.firstRow(contact), count = parts.rows(static_cast<std::size_t>(contact));
  const MatrixXd at_object = parts.rest.state.by_object.middleRows(row, count);
  return at_object.transpose() * parts.rest.compliance.block(row, row, count, count).ldlt().solve(at_object);
}

grasp::Matrix6 HeldObjectMechanism::stiffness() const {
  grasp::Matrix6 sum = grasp::Matrix6::Zero();
  for (std::size_t k = 0; k < parts_->arms.size(); ++k)
    sum += stiffnessOf(static_cast<int>(k));
  return sum;
}

}  // namespace tandem::experiments
