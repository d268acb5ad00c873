// SPDX-License-Identifier: Apache-2.0
/** @file Grasp of one object by several arms: mobility, grasp Jacobian, contact forces (Norouzi-Ghazbi et al.,
 * section III, algorithm 1). */
#pragma once

#include <array>
#include <span>

#include "kinematics/grasp/contact.h"

namespace tandem::kinematics::grasp {

/// By components of all contacts, and by joints of all arms.
using ContactVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxRows, 1>;
using ContactMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxRows, kMaxColumns>;
using ObjectMatrix = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::ColMajor, kMaxRows, 6>;
using JointVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxColumns, 1>;
using ObjectJacobian = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, kMaxColumns>;
/// Twists of the object as columns.
using Twists = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, 6>;

/// Tips of the arms in the order of the contacts, with Jacobians.
using ArmTips = std::span<const Tip* const>;

/// The space that columns span by as many vectors with as many zeros as can be, each of size one.
/// @param basis  linearly independent columns
Eigen::MatrixXd readable(const Eigen::MatrixXd& basis);

/// Orthonormal basis of the combinations of rows that are zero, with the rank as in GraspState::squeezes.
Eigen::MatrixXd leftNullSpace(const Eigen::MatrixXd& matrix);

/** Why a grasp is degenerate; several may hold. */
enum Degeneracy : unsigned {
  kNotRestrained = 1,     ///< the object can move although every arm stands still: see unrestrained
  kNoSqueeze = 2,         ///< no internal force: nothing presses the arms onto the object
  kArmSingular = 4,       ///< some joint velocity of one arm alone does nothing at its contact
  kContactsCoincide = 8,  ///< two contacts are in one place
};
/// In words, separated by "; "; empty for none.
std::string describeDegeneracies(unsigned degeneracies);

/** Matrices of a grasp at one pose of arms and object. Object twists are those of the object's origin, contact
 * components in contact frames, else robot base frame. */
struct GraspState {
  ObjectMatrix by_object;   ///< B G^T: velocity of the object at the contacts by its twist
  ContactMatrix by_joints;  ///< B J: velocity of the arms there by joint velocity; arms one after the other
  ObjectJacobian jacobian;  ///< H = (B G^T)^+ B J of (6), a radian counted as `length`: the object's twist for
                            ///< admissible joint velocities, and the nearest one for others
  /// Joint velocities are admissible where this times them is zero: the velocity, m/s, at which they squeeze, an entry
  /// for each internal force. No row if there is none.
  ContactMatrix consistency;
  /// Internal (squeeze) forces, N and N m: null space of G B^T; orthonormal columns if moments are counted per
  /// `length`.
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxRows, kMaxRows> internal_forces;
  ContactVector
      residual;  ///< by how much the contacts have come apart since they were closed, m and rad: arm less object

  int rank = 0;             ///< of B (J - G^T)
  int mobility = 0;         ///< independent motions of arms and object together: joints + 6 - rank
  int object_mobility = 0;  ///< of the object's among them
  int self_motions = 0;     ///< of the arms that leave object and contacts at standstill
  int squeezes = 0;         ///< independent ways in which joints can squeeze: rank of `consistency`
  Twists movable;           ///< directions in which the object can be moved, a readable basis, unit size
  Twists missing;           ///< what is missing to six, likewise
  Twists unrestrained;      ///< motions of the object that no contact constrains
  /// Size of the object's motions by admissible joint velocities of size one (m/s, rad/s): product and smallest of the
  /// singular values that are not zero, lengths in units of `length`.
  double manipulability = 0.0, least_gain = 0.0;
  unsigned degeneracies = 0;  ///< of Degeneracy
};

/** A grasp: contacts in the order of the arms, one an arm. */
class Grasp {
 public:
  /// @param length  size of the object, m: makes metres comparable to radians where ranks and directions are judged
  /// @throw std::invalid_argument as checkContacts() does, or for a length that is not above zero.
  Grasp(std::vector<Contact> contacts, double length);

  const std::vector<Contact>& contacts() const { return contacts_; }
  double length() const { return length_; }
  int rows() const { return rows_; }  ///< components of all contacts
  int firstRow(int contact) const { return first_row_[static_cast<std::size_t>(contact)]; }

  /// Allocates nothing. @param object  robot base frame <- object frame
  /// @return false where a number is NaN or infinite, or tips are not as many as contacts
  bool evaluate(const Eigen::Isometry3d& object, ArmTips tips, GraspState& state) const noexcept;

  /// The part of a twist in which the object cannot be moved; zero up to rounding where it can.
  Twist outside(const GraspState& state, const Twist& twist) const;

  /// Joint velocities of least size that move the object by `twist` without slip, if it is within `movable`.
  JointVector jointsFor(const GraspState& state, const Twist& twist) const;

  /// Contact forces on the object that answer a wrench on it (robot base frame, at its origin) together with a squeeze:
  /// the internal force nearest to this normal force at each contact, N.
  /// @param left  the part of the wrench that the grasp cannot answer
  ContactVector contactForces(const GraspState& state, const Twist& wrench, double squeeze, Twist& left) const;

  /// Stiffness of the object's pose: wrench at its origin by its twist, robot base frame.
  /// @param compliances  of the arms at their tool tips (LoadedTip::compliance, cosserat::RodAnswer::compliance)
  Matrix6 objectStiffness(const Eigen::Isometry3d& object, ArmTips tips, std::span<const Matrix6> compliances) const;

 private:
  void stack(const Eigen::Isometry3d& object, ArmTips tips, GraspState& state) const;
  void ranks(GraspState& state) const;
  void directions(GraspState& state) const;
  unsigned degeneracies(const GraspState& state, ArmTips tips) const;

  std::vector<Contact> contacts_;
  double length_;
  int rows_ = 0;
  std::array<int, kMaxContacts + 1> first_row_{};
};

}  // namespace tandem::kinematics::grasp
