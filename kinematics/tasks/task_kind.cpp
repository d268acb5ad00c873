// SPDX-License-Identifier: Apache-2.0
#include "kinematics/tasks/task_kind.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kinematics/rotations.h"

namespace tandem::kinematics {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using idl::TaskKind;
using PlaneRows = Eigen::Matrix<double, 2, 3>;

/// A target nearer to the tip than this counts as this far away, m: its direction is unknown at the tip itself.
constexpr double kNearestTarget = 1e-3;

Vector3d axisOf(const TaskPlace& place) { return place.orientation.toRotationMatrix().col(2); }

/// Orthonormal rows that span the plane perpendicular to a unit vector.
PlaneRows planeOf(const Vector3d& normal) {
  const Vector3d first = normal.unitOrthogonal();
  PlaneRows rows;
  rows << first.transpose(), normal.cross(first).transpose();
  return rows;
}

TaskPlace placeOfTip(const Isometry3d& arm, const Isometry3d&) noexcept {
  return {arm.translation(), Quaterniond(arm.linear())};
}

/* Position of a tip, m:            e = p_d - p_a,           v_a = lambda e + v_d.
 * Relative position, m (eq. (2)):  e = p_d - (p_a - p_b),   v_a - v_b = lambda e + v_d. */

TaskPlace positionOfTip(const Isometry3d& arm, const Isometry3d&) noexcept {
  return {arm.translation(), Quaterniond::Identity()};
}

TaskPlace relativePosition(const Isometry3d& arm, const Isometry3d& other) noexcept {
  return {arm.translation() - other.translation(), Quaterniond::Identity()};
}

TaskResidual positionResidual(const TaskPlace& at, const TaskPlace& wanted) noexcept {
  return wanted.position - at.position;
}

void positionMaps(const TaskPlace&, const TaskPlace&, const Isometry3d&, TaskRows& rows) noexcept {
  rows.by_arm.setZero(3, 6);
  rows.by_arm.leftCols<3>().setIdentity();
  rows.by_other = -rows.by_arm;
  rows.by_feed_forward = rows.by_arm;
}

/* Axis of a tip, rad, two rows. r is the smallest rotation from z_a to z_d: |r| is the angle between them, up to pi,
 * and r is perpendicular to both. With B_d, orthonormal rows of the plane perpendicular to z_d, and S = exp([r]x),
 * which takes the plane perpendicular to z_a into it:
 *
 *     e = B_d r,   B_d S w_a = lambda e + B_d w_d.
 *
 * The rows of B_d S are orthonormal at every angle up to a half turn; the derivative of e itself, which equals
 * -(n n^T + |r| / sin|r| (I - n n^T)) B_d S w_a with n = e / |e|, is not bounded there. Both have the same solution
 * w_a for velocity lambda e. Rotation about z_a is free. */

TaskResidual axisResidualTo(const Vector3d& axis, const Vector3d& wanted) {
  return planeOf(wanted) * smallestRotation(axis, wanted);
}

/// B_d S.
PlaneRows transportedPlane(const Vector3d& axis, const Vector3d& wanted) {
  return planeOf(wanted) * rotationBy(smallestRotation(axis, wanted)).toRotationMatrix();
}

TaskResidual axisResidual(const TaskPlace& at, const TaskPlace& wanted) noexcept {
  return axisResidualTo(axisOf(at), axisOf(wanted));
}

void axisMaps(const TaskPlace& at, const TaskPlace& wanted, const Isometry3d&, TaskRows& rows) noexcept {
  const Vector3d axis = axisOf(at), to = axisOf(wanted);
  rows.by_arm.setZero(2, 6);
  rows.by_arm.rightCols<3>() = transportedPlane(axis, to);
  rows.by_feed_forward.setZero(2, 6);
  rows.by_feed_forward.rightCols<3>() = planeOf(to);
}

/* Orientation of a tip, rad, three rows:
 *
 *     e = log(R_d R_a^T),   w_a = lambda e + w_d.
 *
 * e' = -J_r(e)^-1 w_a with the right Jacobian of SO(3), for which J_r(e)^-1 e = e: with a constant R_d, w_a = lambda e
 * gives e' = -lambda e at every angle below pi. */

TaskResidual orientationResidual(const TaskPlace& at, const TaskPlace& wanted) noexcept {
  return logarithm(wanted.orientation * at.orientation.conjugate());
}

void orientationMaps(const TaskPlace&, const TaskPlace&, const Isometry3d&, TaskRows& rows) noexcept {
  rows.by_arm.setZero(3, 6);
  rows.by_arm.rightCols<3>().setIdentity();
  rows.by_feed_forward = rows.by_arm;
}

/* Relative orientation of two tips, rad, three rows in the frame of tip b, with R_ab = R_b^T R_a; the desired R_d is a
 * value of R_ab, and w_d its angular velocity in that frame:
 *
 *     e = log(R_d R_ab^T),   R_b^T (w_a - w_b) = lambda e + w_d. */

TaskPlace relativeOrientation(const Isometry3d& arm, const Isometry3d& other) noexcept {
  return {Vector3d::Zero(), Quaterniond(Matrix3d(other.linear().transpose() * arm.linear()))};
}

void relativeOrientationMaps(const TaskPlace&, const TaskPlace&, const Isometry3d& other, TaskRows& rows) noexcept {
  rows.by_arm.setZero(3, 6);
  rows.by_arm.rightCols<3>() = other.linear().transpose();
  rows.by_other = -rows.by_arm;
  rows.by_feed_forward.setZero(3, 6);
  rows.by_feed_forward.rightCols<3>().setIdentity();
}

/* Pose of a tip as one task, m, six rows, with l = kLengthPerRadian:
 *
 *     e = (p_d - p_a, l log(R_d R_a^T)),   (v_a, l w_a) = lambda e + (v_d, l w_d).
 *
 * Relative pose of two tips, likewise in the frame of tip b, with p_ab = R_b^T (p_a - p_b) and R_ab = R_b^T R_a:
 *
 *     e = (p_d - p_ab, l log(R_d R_ab^T)),
 *     (R_b^T (v_a - v_b + (p_a - p_b) x w_b), l R_b^T (w_a - w_b)) = lambda e + (v_d, l w_d). */

TaskPlace relativePose(const Isometry3d& arm, const Isometry3d& other) noexcept {
  const Isometry3d relative = other.inverse() * arm;
  return {relative.translation(), Quaterniond(relative.linear())};
}

TaskResidual poseResidual(const TaskPlace& at, const TaskPlace& wanted) noexcept {
  TaskResidual residual(6);
  residual << positionResidual(at, wanted), kLengthPerRadian * orientationResidual(at, wanted);
  return residual;
}

/// diag(I, l I).
TwistRows scaledTwist() {
  Eigen::Matrix<double, 6, 1> scale;
  scale << Vector3d::Ones(), Vector3d::Constant(kLengthPerRadian);
  return scale.asDiagonal().toDenseMatrix();
}

void poseMaps(const TaskPlace&, const TaskPlace&, const Isometry3d&, TaskRows& rows) noexcept {
  rows.by_arm = rows.by_feed_forward = scaledTwist();
}

void relativePoseMaps(const TaskPlace& at, const TaskPlace&, const Isometry3d& other, TaskRows& rows) noexcept {
  const Matrix3d into_b = other.linear().transpose();
  rows.by_feed_forward = scaledTwist();
  rows.by_arm.setZero(6, 6);
  rows.by_arm.topLeftCorner<3, 3>() = into_b;
  rows.by_arm.bottomRightCorner<3, 3>() = kLengthPerRadian * into_b;
  rows.by_other = -rows.by_arm;
  rows.by_other.topRightCorner<3, 3>() = skew(at.position) * into_b;
}

/* Looking at a target p_d, rad, two rows. With c = (p_d - p_a) / D, D = |p_d - p_a|, the direction to the target, which
 * rotates by c x c' = c x (v_d - v_a) / D, and r the smallest rotation from z_a to c, S = exp([r]x):
 *
 *     e = B_c r,   B_c (S w_a + [c]x v_a / D) = lambda e + B_c [c]x v_d / D. */

struct View {
  Vector3d axis, to;
  double distance;  ///< m, not below kNearestTarget
};

View viewOf(const TaskPlace& at, const TaskPlace& wanted) {
  const Vector3d way = wanted.position - at.position;
  const double distance = way.norm();
  const Vector3d axis = axisOf(at);
  return {axis, distance > 0.0 ? Vector3d(way / distance) : axis, std::max(distance, kNearestTarget)};
}

TaskResidual viewResidual(const TaskPlace& at, const TaskPlace& wanted) noexcept {
  const View view = viewOf(at, wanted);
  return axisResidualTo(view.axis, view.to);
}

void viewMaps(const TaskPlace& at, const TaskPlace& wanted, const Isometry3d&, TaskRows& rows) noexcept {
  const View view = viewOf(at, wanted);
  const PlaneRows of_motion = planeOf(view.to) * skew(view.to) / view.distance;
  rows.by_arm.resize(2, 6);
  rows.by_arm << of_motion, transportedPlane(view.axis, view.to);
  rows.by_feed_forward.setZero(2, 6);
  rows.by_feed_forward.leftCols<3>() = of_motion;
}

/* Remote centre: the shaft passes the point p_d, m, two rows. p_f is the foot of the perpendicular from p_d to the
 * shaft, the point p(s) of the backbone with t . (p_d - p(s)) = 0, t its tangent, and J_f the Jacobian of p(s) at
 * constant s. With B_t, orthonormal rows of the plane perpendicular to t:
 *
 *     e = B_t (p_d - p_f),   B_t J_f q' = lambda e + B_t v_d.
 *
 * |e| is the distance of p_d from the shaft. The foot slides along t, to which p_d - p_f is perpendicular: so |e|' =
 * -e . B_t J_f q' / |e| with constant s, and |e|' = -lambda |e|. Beyond the end of the arm the shaft is the straight
 * line along the tip's axis, so the axis passes p_d. Behind the entry point J_f = 0: the joints do not move the shaft.
 */

TaskResidual centreResidual(const TaskPlace& at, const TaskPlace& wanted) noexcept {
  return planeOf(axisOf(at)) * (wanted.position - at.position);
}

void centreMaps(const TaskPlace& at, const TaskPlace&, const Isometry3d&, TaskRows& rows) noexcept {
  rows.by_arm.setZero(2, 6);
  rows.by_arm.leftCols<3>() = planeOf(axisOf(at));
  rows.by_feed_forward = rows.by_arm;
}

/* Soft tasks, one row: C of Avoidance, m from joint limits, dimensionless from elastic stability, shall be zero,
 *
 *     e = -C,   grad C q' = lambda e,
 *
 * with e = 0 and no row where nothing is near. The row is by joints, not by a twist. */

TaskResidual softResidual(const TaskPlace& at, const TaskPlace&) noexcept {
  return TaskResidual::Constant(1, -at.position.x());
}

void softMaps(const TaskPlace&, const TaskPlace&, const Isometry3d&, TaskRows& rows) noexcept {
  rows.by_arm.setZero(1, 6);
  rows.by_feed_forward.setZero(1, 6);
}

TaskPlace nowhere(const Isometry3d&, const Isometry3d&) noexcept { return {}; }

constexpr std::array kKinds{
    TaskKindEntry{TaskKind::kRelativePosition, "relative", "relative position of", 2, 3, TaskUnit::kMetre,
                  TaskPart::kPosition, TaskPoint::kTip, relativePosition, positionResidual, positionMaps},
    TaskKindEntry{TaskKind::kTipPosition, "tip", "tip of", 1, 3, TaskUnit::kMetre, TaskPart::kPosition, TaskPoint::kTip,
                  positionOfTip, positionResidual, positionMaps},
    TaskKindEntry{TaskKind::kTipAxis, "axis", "axis of", 1, 2, TaskUnit::kRadian, TaskPart::kOrientation,
                  TaskPoint::kTip, placeOfTip, axisResidual, axisMaps},
    TaskKindEntry{TaskKind::kTipOrientation, "orientation", "orientation of", 1, 3, TaskUnit::kRadian,
                  TaskPart::kOrientation, TaskPoint::kTip, placeOfTip, orientationResidual, orientationMaps},
    TaskKindEntry{TaskKind::kRelativeOrientation, "relative_orientation", "relative orientation of", 2, 3,
                  TaskUnit::kRadian, TaskPart::kOrientation, TaskPoint::kTip, relativeOrientation, orientationResidual,
                  relativeOrientationMaps},
    TaskKindEntry{TaskKind::kLookAt, "look_at", "direction of view of", 1, 2, TaskUnit::kRadian, TaskPart::kPosition,
                  TaskPoint::kTip, placeOfTip, viewResidual, viewMaps},
    TaskKindEntry{TaskKind::kRemoteCentre, "remote_centre", "remote centre of", 1, 2, TaskUnit::kMetre,
                  TaskPart::kPosition, TaskPoint::kShaft, placeOfTip, centreResidual, centreMaps},
    TaskKindEntry{TaskKind::kTipPose, "pose", "pose of", 1, 6, TaskUnit::kMetre, TaskPart::kPose, TaskPoint::kTip,
                  placeOfTip, poseResidual, poseMaps},
    TaskKindEntry{TaskKind::kRelativePose, "relative_pose", "relative pose of", 2, 6, TaskUnit::kMetre, TaskPart::kPose,
                  TaskPoint::kTip, relativePose, poseResidual, relativePoseMaps},
    TaskKindEntry{TaskKind::kJointLimits, "joint_limits", "joint limits of", 1, 1, TaskUnit::kMetre,
                  TaskPart::kPosition, TaskPoint::kJointLimits, nowhere, softResidual, softMaps},
    TaskKindEntry{TaskKind::kElasticStability, "elastic_stability", "elastic stability of", 1, 1, TaskUnit::kNone,
                  TaskPart::kPosition, TaskPoint::kStability, nowhere, softResidual, softMaps},
};

template <class Predicate>
const TaskKindEntry* firstOf(Predicate predicate) noexcept {
  const auto found = std::find_if(kKinds.begin(), kKinds.end(), predicate);
  return found == kKinds.end() ? nullptr : &*found;
}

}  // namespace

const TaskKindEntry* findTaskKind(TaskKind kind) noexcept {
  return firstOf([=](const TaskKindEntry& entry) { return entry.kind == kind; });
}

const TaskKindEntry* findTaskKind(std::string_view name) noexcept {
  return firstOf([=](const TaskKindEntry& entry) { return entry.name == name; });
}

Vector3d smallestRotation(const Vector3d& from, const Vector3d& to) noexcept {
  constexpr double kParallel = 1e-14;  // sine: the product of unit vectors is rounding
  Vector3d normal = from.cross(to);
  const double sine = normal.norm(), cosine = from.dot(to);
  normal -= from.dot(normal) * from;  // near a half turn rounding turns it
  if (const double length = normal.norm(); length > kParallel)
    return std::atan2(sine, cosine) / length * normal;
  return cosine < 0.0 ? Vector3d(M_PI * from.unitOrthogonal()) : Vector3d(Vector3d::Zero());
}

}  // namespace tandem::kinematics
