// SPDX-License-Identifier: Apache-2.0
#include "kinematics/grasp/grasp.h"

#include <Eigen/SVD>
#include <cmath>
#include <stdexcept>

namespace tandem::kinematics::grasp {

using Eigen::Isometry3d;
using Eigen::Vector3d;

namespace {

/// Singular values below this part of the largest one are none: Jacobians of solved rods are good to 1e-9.
constexpr double kRankTolerance = 1e-7;

constexpr int kMaxAll = kMaxColumns + 6;
using Any = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxAll, kMaxAll>;

/** Singular value decomposition with the rank reported: range and null space, pseudoinverse. */
class Decomposition {
 public:
  explicit Decomposition(const Any& matrix) : rows_(matrix.rows()), columns_(matrix.cols()) {
    if (rows_ == 0 || columns_ == 0)
      return;
    svd_.compute(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const auto& values = svd_.singularValues();
    while (rank_ < values.size() && values[rank_] > kRankTolerance * values[0] && values[rank_] > 0.0)
      ++rank_;
  }
  int rank() const { return static_cast<int>(rank_); }
  double value(int k) const { return svd_.singularValues()[k]; }
  Any range() const { return empty() ? Any(rows_, 0) : Any(svd_.matrixU().leftCols(rank_)); }
  Any outside() const {
    return empty() ? Any(Any::Identity(rows_, rows_)) : Any(svd_.matrixU().rightCols(rows_ - rank_));
  }
  Any null() const {
    return empty() ? Any(Any::Identity(columns_, columns_)) : Any(svd_.matrixV().rightCols(columns_ - rank_));
  }
  Any solve(const Any& right) const {
    if (empty())
      return Any::Zero(columns_, right.cols());
    const Any part = svd_.matrixU().leftCols(rank_).transpose() * right;
    return svd_.matrixV().leftCols(rank_) * svd_.singularValues().head(rank_).cwiseInverse().asDiagonal() * part;
  }

 private:
  bool empty() const { return rows_ == 0 || columns_ == 0; }
  Eigen::Index rows_, columns_, rank_ = 0;
  Eigen::JacobiSVD<Any> svd_;
};

/// Gauss and Jordan, full pivoting.
Any readable(const Any& basis) {
  constexpr double kNothing = 1e-9;
  Any rows = basis.transpose();
  for (Eigen::Index k = 0; k < rows.rows(); ++k) {
    Eigen::Index row = 0, column = 0;
    rows.bottomRows(rows.rows() - k).cwiseAbs().maxCoeff(&row, &column);
    rows.row(k).swap(rows.row(k + row));
    rows.row(k) /= rows(k, column);
    for (Eigen::Index other = 0; other < rows.rows(); ++other) {
      if (other != k)
        rows.row(other) -= rows(other, column) * rows.row(k).eval();
    }
  }
  for (Eigen::Index k = 0; k < rows.rows(); ++k)
    rows.row(k).normalize();
  return rows.transpose().unaryExpr([](double x) { return std::abs(x) < kNothing ? 0.0 : x; });
}

/// Columns of size one; those that are nothing but rounding stay.
Any equilibrated(Any matrix, Eigen::Index columns) {
  constexpr double kRounding = 1e-11;
  const double least = matrix.size() > 0 ? kRounding * matrix.cwiseAbs().maxCoeff() : 0.0;
  for (Eigen::Index k = 0; k < columns; ++k) {
    const double size = matrix.col(k).norm();
    if (size > least)
      matrix.col(k) /= size;
  }
  return matrix;
}

/// Everything in metres: angular components times this length.
template <class Rows>
Any scaled(const Rows& matrix, const ContactVector& rows) {
  return rows.asDiagonal() * matrix;
}

/// Components that are angular count `length` each; others one.
ContactVector rowScale(const std::vector<Contact>& contacts, int rows, double length) {
  ContactVector scale(rows);
  Eigen::Index row = 0;
  for (const Contact& contact : contacts) {
    const Selection b = selection(contact.type);
    for (Eigen::Index k = 0; k < b.rows(); ++k)
      scale[row++] = b.row(k).tail<3>().any() ? length : 1.0;
  }
  return scale;
}

/// (v, omega) by (v, length omega).
Twist objectScale(double length) {
  Twist scale = Twist::Ones();
  scale.tail<3>().setConstant(1.0 / length);
  return scale;
}

}  // namespace

Eigen::MatrixXd readable(const Eigen::MatrixXd& basis) { return readable(Any(basis)); }

Eigen::MatrixXd leftNullSpace(const Eigen::MatrixXd& matrix) {
  return Decomposition(equilibrated(Any(matrix), matrix.cols())).outside();
}

std::string describeDegeneracies(unsigned degeneracies) {
  const std::pair<Degeneracy, const char*> words[] = {
      {kNotRestrained, "the object can move although every arm stands still"},
      {kNoSqueeze, "no internal force presses the arms onto the object"},
      {kArmSingular, "an arm is singular at its contact"},
      {kContactsCoincide, "two contacts are in one place"}};
  std::string text;
  for (const auto& [flag, word] : words) {
    if (degeneracies & flag)
      text += (text.empty() ? "" : "; ") + std::string(word);
  }
  return text;
}

Grasp::Grasp(std::vector<Contact> contacts, double length) : contacts_(std::move(contacts)), length_(length) {
  checkContacts(contacts_);
  if (!(length > 0.0) || !std::isfinite(length))
    throw std::invalid_argument("size of the object: found " + std::to_string(length) +
                                " m, expected a length above zero");
  for (std::size_t k = 0; k < contacts_.size(); ++k) {
    first_row_[k] = rows_;
    rows_ += static_cast<int>(selection(contacts_[k].type).rows());
  }
  first_row_[contacts_.size()] = rows_;
}

bool Grasp::evaluate(const Isometry3d& object, ArmTips tips, GraspState& state) const noexcept {
  if (tips.size() != contacts_.size() || !object.matrix().allFinite())
    return false;
  for (const Tip* tip : tips) {
    if (!tip->pose.matrix().allFinite() || !tip->jacobian.allFinite())
      return false;
  }
  stack(object, tips, state);
  ranks(state);
  directions(state);
  state.degeneracies = degeneracies(state, tips);
  return true;
}

/// B G^T of (2) and B J of (1), (10), and by how much contacts are open.
void Grasp::stack(const Isometry3d& object, ArmTips tips, GraspState& state) const {
  Eigen::Index columns = 0, column = 0;
  for (const Tip* tip : tips)
    columns += tip->jacobian.cols();
  state.by_object.setZero(rows_, 6);
  state.by_joints.setZero(rows_, columns);
  state.residual.setZero(rows_);
  for (std::size_t k = 0; k < contacts_.size(); ++k) {
    const Tip& tip = *tips[k];
    const Touch touch(contacts_[k], object, tip.pose);
    const Selection b = selection(contacts_[k].type);
    const Eigen::Index row = first_row_[k];
    state.by_object.middleRows(row, b.rows()) = b * touch.rows(touch.to_body);
    state.by_joints.block(row, column, b.rows(), tip.jacobian.cols()) = b * touch.rows(touch.to_tip) * tip.jacobian;
    state.residual.segment(row, b.rows()) = b * touch.residual();
    column += tip.jacobian.cols();
  }
}

void Grasp::ranks(GraspState& state) const {
  const Eigen::Index joints = state.by_joints.cols();
  const ContactVector rows = rowScale(contacts_, rows_, length_);
  const Twist object_scale = objectScale(length_);
  const Any object = scaled(state.by_object, rows) * object_scale.asDiagonal();
  const Any arms = scaled(state.by_joints, rows);
  const Decomposition object_part(object);
  state.jacobian = object_scale.asDiagonal() * object_part.solve(arms);

  const Any seen = object_part.outside();  // orthonormal: contact velocities that no motion of the object makes
  state.internal_forces = rows.asDiagonal() * seen;
  state.consistency = seen.transpose() * arms;

  Any both(rows_, joints + 6);
  both << arms, -object;
  const Decomposition all(equilibrated(both, joints));
  state.rank = all.rank();
  state.mobility = static_cast<int>(joints) + 6 - state.rank;
  const Decomposition moved(Any(all.null().bottomRows(6)));
  // Null vectors are of size one; what is left of the object's part of them after rounding is no motion.
  state.object_mobility = state.mobility > 0 && moved.rank() > 0 && moved.value(0) > kRankTolerance ? moved.rank() : 0;
  const Any movable = state.object_mobility > 0 ? moved.range() : Any(6, 0);
  state.movable = object_scale.asDiagonal() * readable(movable);
  state.missing = object_scale.asDiagonal() * readable(Decomposition(movable).outside());
  state.unrestrained = object_scale.asDiagonal() * readable(object_part.null());
  state.self_motions = static_cast<int>(joints) - Decomposition(equilibrated(arms, joints)).rank();
}

/// Effect of joint velocities on squeeze and object.
void Grasp::directions(GraspState& state) const {
  const Eigen::Index joints = state.by_joints.cols();
  const Decomposition squeeze(equilibrated(state.consistency, joints));
  state.squeezes = squeeze.rank();
  const Any admissible = Decomposition(Any(state.consistency)).null();
  const Any gains = objectScale(length_).cwiseInverse().asDiagonal() * state.jacobian * admissible / length_;
  const Decomposition gain(gains);
  state.manipulability = gain.rank() > 0 ? 1.0 : 0.0;
  for (int k = 0; k < gain.rank(); ++k)
    state.manipulability *= gain.value(k);
  state.least_gain = gain.rank() > 0 ? gain.value(gain.rank() - 1) : 0.0;
}

unsigned Grasp::degeneracies(const GraspState& state, ArmTips tips) const {
  unsigned found = state.unrestrained.cols() > 0 ? kNotRestrained : 0u;
  if (state.internal_forces.cols() == 0)
    found |= kNoSqueeze;
  const ContactVector rows = rowScale(contacts_, rows_, length_);
  Eigen::Index column = 0;
  for (std::size_t k = 0; k < contacts_.size(); ++k) {
    const Eigen::Index joints = tips[k]->jacobian.cols(), count = first_row_[k + 1] - first_row_[k];
    const Any block =
        rows.segment(first_row_[k], count).asDiagonal() * state.by_joints.block(first_row_[k], column, count, joints);
    if (Decomposition(equilibrated(block, joints)).rank() < std::min(joints, count))
      found |= kArmSingular;
    column += joints;
    for (std::size_t j = 0; j < k; ++j) {
      const double distance = (contacts_[k].frame.translation() - contacts_[j].frame.translation()).norm();
      if (distance < 1e-6 * length_)
        found |= kContactsCoincide;
    }
  }
  return found;
}

Twist Grasp::outside(const GraspState& state, const Twist& twist) const {
  const Twist scale = objectScale(length_);
  const Twist wanted = twist.cwiseQuotient(scale);
  const Any basis = scale.cwiseInverse().asDiagonal() * state.movable;
  const Any range = Decomposition(basis).range();
  return scale.cwiseProduct(wanted - range * (range.transpose() * wanted));
}

JointVector Grasp::jointsFor(const GraspState& state, const Twist& twist) const {
  const ContactVector rows = rowScale(contacts_, rows_, length_);
  return Decomposition(scaled(state.by_joints, rows)).solve(scaled(Any(state.by_object * twist), rows));
}

ContactVector Grasp::contactForces(const GraspState& state, const Twist& wrench, double squeeze, Twist& left) const {
  const ContactVector rows = rowScale(contacts_, rows_, length_);
  const Twist scale = objectScale(length_);
  const Any map = (scaled(state.by_object, rows) * scale.asDiagonal()).transpose();
  ContactVector force = rows.asDiagonal() * Decomposition(map).solve(Any(-scale.cwiseProduct(wrench)));
  ContactVector normal = ContactVector::Zero(rows_);
  for (std::size_t k = 0; k < contacts_.size(); ++k) {
    const Selection b = selection(contacts_[k].type);
    for (Eigen::Index j = 0; j < b.rows(); ++j)
      normal[first_row_[k] + j] = b(j, 2) * squeeze;
  }
  const Any internal = rows.cwiseInverse().asDiagonal() * state.internal_forces;  // orthonormal
  force += rows.asDiagonal() * (internal * (internal.transpose() * rows.cwiseInverse().asDiagonal() * normal));
  left = wrench + state.by_object.transpose() * force;
  return force;
}

Matrix6 Grasp::objectStiffness(const Isometry3d& object, ArmTips tips, std::span<const Matrix6> compliances) const {
  Matrix6 stiffness = Matrix6::Zero();
  for (std::size_t k = 0; k < contacts_.size(); ++k) {
    const Touch touch(contacts_[k], object, tips[k]->pose);
    const Selection b = selection(contacts_[k].type);
    const Selection at_tip = b * touch.rows(touch.to_tip), at_object = b * touch.rows(touch.to_body);
    const Any compliance = at_tip * compliances[k] * at_tip.transpose();
    stiffness += at_object.transpose() * compliance.partialPivLu().solve(Any(at_object));
  }
  return stiffness;
}

}  // namespace tandem::kinematics::grasp
