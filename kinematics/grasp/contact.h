// SPDX-License-Identifier: Apache-2.0
/** @file What an arm and an object pass on to each other where they touch. */
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

/** How near a contact is to slipping. */
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
