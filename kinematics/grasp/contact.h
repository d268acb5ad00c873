// SPDX-License-Identifier: Apache-2.0
/** @file Contact models between an arm and an object. */
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <string_view>
#include <vector>

#include "kinematics/arm_model.h"

namespace tandem::kinematics::grasp {

inline constexpr int kMaxContacts = 4;
inline constexpr int kMaxRows = 6 * kMaxContacts;                            ///< components passed on by all contacts
inline constexpr int kMaxColumns = kMaxContacts * safety::kMaxJointsPerArm;  ///< joints of all arms

/// Linear, angular; or force, moment.
using Twist = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/** Kinds of contacts (Leon, Morales and Sancho-Bru 2014). */
enum class ContactType {
  kFrictionless,  ///< the force along the normal
  kPoint,         ///< point with friction: the force
  kSoftFinger,    ///< the force and the moment about the normal
  kRigid          ///< force and moment: a grip
};
/// "frictionless", "point", "soft_finger", "rigid".
std::string_view nameOf(ContactType type);
/// @throw std::invalid_argument for another name.
ContactType contactType(std::string_view name);

/// Selection matrix B_i: rows pick components of (force, moment) or (linear, angular) in the contact frame.
using Selection = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::ColMajor, 6, 6>;
Selection selection(ContactType type);

/** One arm's contact with the object. */
struct Contact {
  ContactType type = ContactType::kRigid;
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();  ///< object frame <- contact frame, z the normal inward
  Eigen::Isometry3d hand = Eigen::Isometry3d::Identity();   ///< arm's tool tip frame <- contact frame as it was closed
  double friction = 0.5;                                    ///< coefficient, above zero; no part in kRigid
  /// Radius at which the moment about the normal uses up friction as a tangential force does, m, above zero: of
  /// kSoftFinger alone.
  double spin_radius = 1e-3;
};

/** @throw std::invalid_argument that names the contact: none or too many, friction or radius not above zero, a number
 * that is not finite. */
void checkContacts(const std::vector<Contact>& contacts);

/** A contact as it is, robot base frame. The arm touches where its tip's contact frame is; directions are those of the
 * object's surface. A soft finger that has tilted passes its moment on about the axis `spin`, midway between the
 * object's normal and the tip's: the one for which the moment does the work of the turn that is left to it. */
struct Touch {
  Touch(const Contact& contact, const Eigen::Isometry3d& object, const Eigen::Isometry3d& tip);

  /// Contact components (all six) by the twist of a body whose origin is `lever` away from the contact: its transpose
  /// makes wrenches of contact components.
  Matrix6 rows(const Eigen::Vector3d& lever) const;
  /// By how much the contact has come apart, arm less object, m and rad, contact frame. rows() are its derivatives, the
  /// angular ones of a grip where it is closed.
  Twist residual() const;

  ContactType type;
  Eigen::Isometry3d frame;          ///< contact frame of the object
  Eigen::Isometry3d hand;           ///< the tip's: the same where the contact is a grip
  Eigen::Vector3d spin;             ///< axis of a soft finger's moment, of size 1 / cos(tilt / 2)
  Eigen::Vector3d to_tip, to_body;  ///< levers: from the tip's and from the object's origin to the contact
};

/** Geometric stiffness of a contact: change of its wrenches at constant components in the contact frame. Columns are
 * twists of the tip or the object, each at its own origin. */
struct TouchStiffness {
  Matrix6 on_arm_by_tip, on_arm_by_object;        ///< of rows(to_tip)^T force
  Matrix6 on_object_by_tip, on_object_by_object;  ///< of rows(to_body)^T force
};
/// @param force  components that the contact passes on, all six
TouchStiffness stiffnessOf(const Touch& touch, const Twist& force);

/** Forces at a contact, and its margin to slip. */
struct ContactLoad {
  double normal = 0.0;      ///< force into the object, N; a contact other than a grip cannot pull
  double tangential = 0.0;  ///< force across the normal, N
  double spin = 0.0;        ///< moment about the normal, N m
  /// Part of the friction that is used: sqrt(tangential^2 + (spin / spin_radius)^2) / (friction normal); 0 for grips
  /// and frictionless contacts, infinite where nothing presses.
  double used = 0.0;
  bool separates = false;  ///< it would have to pull
  bool slips = false;      ///< used above 1
};

/// @param force  components that the contact passes on to the object, contact frame
ContactLoad loadOf(const Contact& contact, const Eigen::Ref<const Eigen::VectorXd>& force);

/// A twist in words, e.g. "rotation about y" or "translation (0.71, 0.71, 0)"; axes of the frame it is given in.
/// @param length  that makes a radian as large as this many metres
std::string describe(const Twist& twist, double length);

}  // namespace tandem::kinematics::grasp
