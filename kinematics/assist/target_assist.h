// SPDX-License-Identifier: Apache-2.0
/** @file Target-assist pair: closed chain of a target catheter and an assist catheter whose tip pushes the target's
 * base of bending (Norouzi-Ghazbi et al., section IV, algorithms 2 and 3). */
#pragma once

#include <string_view>

#include "kinematics/catheter/elastic.h"
#include "kinematics/grasp/contact.h"

namespace tandem::kinematics::assist {

using cosserat::Matrix6;
using cosserat::Vector6;

/// Joints: target's insertion, roll, bend, then the assist arm's; m and rad.
inline constexpr int kJoints = 2 * catheter::kJoints;
using Joints = Eigen::Matrix<double, kJoints, 1>;

enum class Status {
  kOk,
  kNotFinite,
  kDistalInside,  ///< the target's insertion not above zero, or the assist arm's below zero
  kNotConverged,  ///< no contact pose in which both rods agree was found, neither from the guess nor from the free arms
  kNoContact,     ///< both agree only if the assist arm pulls
  kBuckled        ///< both agree, but the equilibrium is unstable: an arm gives way
};
std::string_view describe(Status status);

/** Two catheters, and how the tip of one touches the base of bending of the other.
 *
 * Roll turns the plane of bending, not the contact: catheters turn inside it as in a collar. All rods
 * have to be as stiff in all directions across. */
struct Pair {
  catheter::ElasticArm target, assist;
  /// Frame of the target's base of bending, not rolled <- contact frame, z into the target. The assist arm's tool tip
  /// frame, not rolled, is in this place and, if gripped, in this orientation.
  Eigen::Isometry3d contact = Eigen::Isometry3d::Identity();
  /// kRigid: position and orientation agree; kPoint: position, and only a force is passed on.
  grasp::ContactType type = grasp::ContactType::kRigid;
  bool pushes_only = true;  ///< a force that would have to pull is no contact
};

/** The memory of a closed chain, or a guess from elsewhere. */
struct ChainBranch {
  bool known = false;
  Wrench wrench = Wrench::Zero();  ///< on the target at the contact, robot base frame
  Eigen::Vector3d target_moment = Eigen::Vector3d::Zero(), assist_moment = Eigen::Vector3d::Zero();  ///< at the clamps
  double assist_pull = 0.0;  ///< of the assist arm's wire, rad, if its displacement is given
};

/** The closed chain in equilibrium; robot base frame. */
struct Chain {
  Tip tip;                                                    ///< of the target, Jacobian by all six joints
  Eigen::Isometry3d contact = Eigen::Isometry3d::Identity();  ///< contact frame, on the target
  /// On the target at the contact, N and N m; the assist arm has the opposite.
  Wrench wrench = Wrench::Zero();
  Eigen::Matrix<double, 6, kJoints> wrench_by_joints = Eigen::Matrix<double, 6, kJoints>::Zero();
  Matrix6 compliance = Matrix6::Zero();  ///< twist of the target's tip by a wrench at its base of bending (its origin)
  double push = 0.0;                     ///< force along the contact's normal, N
  double gap = 0.0, turn = 0.0;          ///< by which the rods disagree, m and rad
  int conjugate_points = 0;              ///< of what was found; above zero where kBuckled is returned
  int sweeps = 0;                        ///< pairs of integrations it took
};

/** Solves the pair: proximal end of the target and the whole assist arm as Cosserat rods, the target's distal end as an
 * arc on the base of bending, equation (11). Both arms may be actuated at once.
 *
 * Unknown are the contact wrench and the moments at both clamps; Newton's method with exact derivatives, moments
 * eliminated. A cold start lets the gap between the free arms close step by step. Allocates and throws nothing. */
class TargetAssist {
 public:
  /// @throw std::invalid_argument as catheter::ElasticCatheter does, for an end that is not as stiff in all directions
  /// across, or a contact type other than kRigid and kPoint.
  explicit TargetAssist(Pair pair, cosserat::Accuracy accuracy = {});
  const Pair& pair() const { return pair_; }

  /// The contact frame at which the arms touch without a force for these joints: what `contact` has to be.
  static Eigen::Isometry3d touching(const Pair& pair, const Joints& q);

  /// `branch` is untouched unless kOk is returned. `chain` then is the answer; for kNoContact and kBuckled it tells of
  /// what was found, and is no equilibrium of the arms.
  Status solve(const Joints& q, ChainBranch& branch, Chain& chain) const noexcept;

  /// The target alone, without contact: constant curvature.
  Tip alone(const Joints& q) const noexcept;

 private:
  struct Task;
  template <int kColumns>
  struct Shots;
  struct Unknowns;

  Task taskOf(const Joints& q) const;
  template <int kColumns>
  bool shoot(const Task& task, const Eigen::Isometry3d& open, const Unknowns& x, Shots<kColumns>& shots) const;
  cosserat::SweepStart assistStart(const cosserat::RodInput& input,
                                   const Unknowns& x,
                                   cosserat::HeldIndex* index = nullptr) const;
  template <int kColumns>
  bool correct(const Task& task, const Eigen::Isometry3d& open, Unknowns& x, int& sweeps) const;
  bool correct(const Task& task, const Eigen::Isometry3d& open, Unknowns& x, int& sweeps) const;
  bool close(const Task& task, Unknowns& x, int& sweeps) const;
  bool complete(const Joints& q, const Task& task, Unknowns& x, Chain& chain) const;
  void differentiate(const Joints& q, const Task& task, const Shots<cosserat::kAllColumns>& shots, Chain& chain) const;
  Status judge(const Joints& q, const Task& task, Unknowns& x, Chain& chain) const;

  Pair pair_;
  cosserat::Rod target_, assist_;
  cosserat::Accuracy accuracy_;
  int rows_;  ///< components of the wrench: 6 or 3
};

}  // namespace tandem::kinematics::assist
