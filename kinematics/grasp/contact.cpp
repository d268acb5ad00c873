// SPDX-License-Identifier: Apache-2.0
#include "kinematics/grasp/contact.h"

#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "kinematics/rotations.h"

namespace tandem::kinematics::grasp {

namespace {

struct Kind {
  std::string_view name;
  int count;                     ///< of components
  std::array<int, 6> component;  ///< that are passed on
};

constexpr std::array<Kind, 4> kKinds = {{{"frictionless", 1, {2}},
                                         {"point", 3, {0, 1, 2}},
                                         {"soft_finger", 4, {0, 1, 2, 5}},
                                         {"rigid", 6, {0, 1, 2, 3, 4, 5}}}};

const Kind& kindOf(ContactType type) { return kKinds[static_cast<std::size_t>(type)]; }

std::string describeAxis(const Eigen::Vector3d& direction) {
  constexpr double kAligned = 1e-3;
  const char* const axes[] = {"x", "y", "z"};
  for (int k = 0; k < 3; ++k) {
    if (std::abs(std::abs(direction[k]) - 1.0) < kAligned * kAligned)
      return axes[k];
  }
  std::string words = "(";
  for (int k = 0; k < 3; ++k) {
    char number[32];
    std::snprintf(number, sizeof number, "%.2g", std::abs(direction[k]) < kAligned ? 0.0 : direction[k]);
    words += std::string(k ? ", " : "") + number;
  }
  return words + ")";
}

}  // namespace

std::string_view nameOf(ContactType type) { return kindOf(type).name; }

ContactType contactType(std::string_view name) {
  std::string expected;
  for (std::size_t k = 0; k < kKinds.size(); ++k) {
    if (kKinds[k].name == name)
      return static_cast<ContactType>(k);
    expected += (k ? ", " : "") + std::string(kKinds[k].name);
  }
  throw std::invalid_argument("contact type: found '" + std::string(name) + "', expected one of: " + expected);
}

Selection selection(ContactType type) {
  const Kind& kind = kindOf(type);
  Selection b = Selection::Zero(kind.count, 6);
  for (int row = 0; row < kind.count; ++row)
    b(row, kind.component[static_cast<std::size_t>(row)]) = 1.0;
  return b;
}

void checkContacts(const std::vector<Contact>& contacts) {
  if (contacts.empty() || contacts.size() > kMaxContacts)
    throw std::invalid_argument("contacts: found " + std::to_string(contacts.size()) + ", expected 1 to " +
                                std::to_string(kMaxContacts));
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    const std::string name = "contact " + std::to_string(k + 1);
    if (!contacts[k].frame.matrix().allFinite() || !contacts[k].hand.matrix().allFinite())
      throw std::invalid_argument(name + ", frame or hand: found a number that is not finite");
    if (!(contacts[k].friction > 0.0) || !std::isfinite(contacts[k].friction))
      throw std::invalid_argument(name + ", friction: found " + std::to_string(contacts[k].friction) +
                                  ", expected a number above zero");
    if (!(contacts[k].spin_radius > 0.0) || !std::isfinite(contacts[k].spin_radius))
      throw std::invalid_argument(name + ", spin radius: found " + std::to_string(contacts[k].spin_radius) +
                                  " m, expected a length above zero");
  }
}

Touch::Touch(const Contact& contact, const Eigen::Isometry3d& object, const Eigen::Isometry3d& tip)
    : type(contact.type),
      frame(object * contact.frame),
      hand(tip * contact.hand),
      to_tip(hand.translation() - tip.translation()),
      to_body(hand.translation() - object.translation()) {
  const Eigen::Vector3d ours = frame.linear().col(2), theirs = hand.linear().col(2);
  spin = (ours + theirs) / (1.0 + ours.dot(theirs));
}

Matrix6 Touch::rows(const Eigen::Vector3d& lever) const {
  const Eigen::Matrix3d turn = frame.linear().transpose();
  Matrix6 result;
  result << turn, -turn * skew(lever), Eigen::Matrix3d::Zero(), turn;
  if (type == ContactType::kSoftFinger)
    result.bottomRightCorner<1, 3>() = spin.transpose();
  return result;
}

Twist Touch::residual() const {
  const Eigen::Isometry3d apart = frame.inverse() * hand;
  Twist twist;
  twist << apart.translation(), logarithm(apart.linear());
  if (type == ContactType::kSoftFinger) {
    const Eigen::Quaterniond turn(apart.linear());  // the part about the normal, swing and twist
    twist[5] = 2.0 * std::atan2(turn.w() < 0.0 ? -turn.z() : turn.z(), std::abs(turn.w()));
  }
  return twist;
}

TouchStiffness stiffnessOf(const Touch& touch, const Twist& force) {
  using Eigen::Matrix3d;
  using Eigen::Vector3d;
  const Matrix3d pull = skew(touch.frame.linear() * force.head<3>());
  TouchStiffness result{Matrix6::Zero(), Matrix6::Zero(), Matrix6::Zero(), Matrix6::Zero()};
  // The force turns with the object, levers to the contact with tip and object.
  result.on_arm_by_tip.bottomRightCorner<3, 3>() = pull * skew(touch.to_tip);
  result.on_arm_by_object.topRightCorner<3, 3>() = -pull;
  result.on_arm_by_object.bottomRightCorner<3, 3>() = -skew(touch.to_tip) * pull;
  result.on_object_by_tip.bottomLeftCorner<3, 3>() = -pull;
  result.on_object_by_tip.bottomRightCorner<3, 3>() = pull * skew(touch.to_tip);
  result.on_object_by_object.topRightCorner<3, 3>() = -pull;
  result.on_object_by_object.bottomLeftCorner<3, 3>() = pull;
  result.on_object_by_object.bottomRightCorner<3, 3>() = -skew(touch.to_body) * pull;
  Matrix3d moment_by_tip = Matrix3d::Zero(), moment_by_object = Matrix3d::Zero();
  if (touch.type == ContactType::kSoftFinger) {
    const Vector3d ours = touch.frame.linear().col(2), theirs = touch.hand.linear().col(2);
    const double part = force[5] / (1.0 + ours.dot(theirs));
    moment_by_object = -part * (skew(ours) + touch.spin * ours.cross(theirs).transpose());
    moment_by_tip = -part * (skew(theirs) + touch.spin * theirs.cross(ours).transpose());
  } else {
    moment_by_object = -skew(touch.frame.linear() * force.tail<3>());
  }
  result.on_arm_by_tip.bottomRightCorner<3, 3>() += moment_by_tip;
  result.on_arm_by_object.bottomRightCorner<3, 3>() += moment_by_object;
  result.on_object_by_tip.bottomRightCorner<3, 3>() += moment_by_tip;
  result.on_object_by_object.bottomRightCorner<3, 3>() += moment_by_object;
  return result;
}

ContactLoad loadOf(const Contact& contact, const Eigen::Ref<const Eigen::VectorXd>& force) {
  const Twist wrench = selection(contact.type).transpose() * force;
  ContactLoad load;
  load.normal = wrench[2];
  load.tangential = wrench.head<2>().norm();
  load.spin = wrench[5];
  if (contact.type == ContactType::kRigid)
    return load;
  load.separates = load.normal < 0.0;
  const double asked = std::hypot(load.tangential, load.spin / contact.spin_radius);
  if (asked > 0.0)
    load.used = load.normal > 0.0 ? asked / (contact.friction * load.normal) : std::numeric_limits<double>::infinity();
  load.slips = load.used > 1.0;
  return load;
}

std::string describe(const Twist& twist, double length) {
  constexpr double kNothing = 1e-3;
  const double linear = twist.head<3>().norm() / length, angular = twist.tail<3>().norm();
  const double all = std::hypot(linear, angular);
  if (!(all > 0.0))
    return "no motion";
  const std::string translation = "translation along " + describeAxis(twist.head<3>().normalized());
  const std::string rotation = "rotation about " + describeAxis(twist.tail<3>().normalized());
  if (angular < kNothing * all)
    return translation;
  return linear < kNothing * all ? rotation : rotation + " with " + translation;
}

}  // namespace tandem::kinematics::grasp
