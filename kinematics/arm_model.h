// SPDX-License-Identifier: Apache-2.0
/** @file Interface of all kinematic models of one arm. */
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "kinematics/branch.h"
#include "kinematics/concentric_tube.h"
#include "safety/dimensions.h"

namespace tandem::kinematics {

/// 6 x 2n: rows are the tip's linear (m/s) and angular (rad/s) velocity in the robot base frame, columns the joints.
using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, safety::kMaxJointsPerArm>;
/// 1 x 2n: derivative of a scalar by the joints.
using Gradient = Eigen::Matrix<double, 1, Eigen::Dynamic, Eigen::RowMajor, 1, safety::kMaxJointsPerArm>;
/// Force (N) and moment about the point of application (N m), in the robot base frame.
using Wrench = Eigen::Matrix<double, 6, 1>;

/// Joint vector of a model: [beta_1..beta_n, alpha_1..alpha_n], m and rad.
using JointsRef = Eigen::Ref<const Eigen::VectorXd>;

/** Result of a model for a joint vector. */
enum class ModelStatus {
  kOk,
  kWrongSize,      ///< not 2n joints
  kNotFinite,      ///< NaN or infinite
  kNotExtended,    ///< tube 1 ends at or behind the entry point: no part of the arm is in front of it
  kProtruded,      ///< the proximal end of a tube is in front of the entry point, beta > 0
  kInnerInside,    ///< an outer tube ends ahead of an inner one: equation (1), distal side
  kNotConverged,   ///< no equilibrium found within the bounded number of iterations
  kCarriesNoLoad,  ///< a wrench on a model without elastic deformation
  kDistalInside,   ///< a catheter's bending end is not completely in front of the entry point
  kTendonPushes,   ///< the tension of a tendon is below zero
};
std::string_view describe(ModelStatus status);

/** Tip of an arm. */
struct Tip {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< robot base frame <- tool tip frame
  Jacobian jacobian;                                       ///< of that pose
  /// Smallest value along the arm of the determinant that vanishes where the arm snaps (kinematics/stability.h): 1
  /// without elastic interaction. A rigid model never snaps: always 1.
  double stability = 1.0;
  double stability_at = 0.0;  ///< arc length s of this value, m; below zero in the transmission
  int conjugate_points = 0;   ///< directions in which the equilibrium is not a minimum of energy; 0: stable
};

/** Tip of an arm with a wrench at its tool tip. */
struct LoadedTip : Tip {
  /// Twist of the tool tip (m, rad; rows linear first) per wrench (columns force first), robot base frame. Symmetric
  /// unless the wrench has a moment: a moment of constant direction in space has no potential.
  Eigen::Matrix<double, 6, 6> compliance = Eigen::Matrix<double, 6, 6>::Zero();
};

/** One point of the backbone. */
struct ShapePoint {
  double s = 0.0;  ///< arc length from the entry point, m
  /// robot base frame <- frame at s: z along the backbone, x the direction in which tube 1 bends there. Rotated by
  /// -psi_1 about z it is the torsion-free frame that starts as the arm's base frame.
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  std::array<double, kMaxTubes>
      psi{};  ///< direction in which each tube bends, torsion-free frame, rad; NaN beyond its end
  std::array<double, kMaxTubes> moment{};               ///< torsional moment in each tube, N m; NaN beyond its end
  Eigen::Vector2d curvature = Eigen::Vector2d::Zero();  ///< of the backbone, x and y of the torsion-free frame, 1/m
  int outermost_tube = 0;                               ///< 1..n: the outermost tube present
};

/** Point of the backbone at an arc length, with its derivatives by the joints. */
struct BackbonePoint {
  double s = 0.0;                                      ///< arc length from the entry point, m
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, robot base frame
  Eigen::Vector3d tangent = Eigen::Vector3d::UnitZ();  ///< unit vector toward the tip, robot base frame
  Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, safety::kMaxJointsPerArm> jacobian;  ///< at constant s
};

/// Most sections of an arm's body.
inline constexpr int kMaxBodySections = kMaxTubes;

/** Part of an arm's body with constant radius, from the end of the previous section. */
struct BodySection {
  double end = 0.0;     ///< arc length from the entry point, m; at or beyond the end of the previous section
  double radius = 0.0;  ///< m
  Gradient by_joints;   ///< of `end`
};
using BodySections = std::array<BodySection, kMaxBodySections>;

/** Kinematic model of one arm of any type. tip() and loadedTip() are for the periodic path: they allocate nothing and
 * throw nothing. A model has no state: the state between calls is in the caller's Branch, so several threads may use
 * one model. */
class ArmModel {
 public:
  virtual ~ArmModel() = default;
  virtual int jointCount() const noexcept = 0;
  /// robot base frame <- arm base frame
  virtual const Eigen::Isometry3d& base() const noexcept = 0;
  /// A faster model of the same arm with similar results, for searches; this model if there is none.
  virtual const ArmModel& approximation() const noexcept { return *this; }
  /// Sections of the body from the entry point to the tip, for joints of the right number. @return their number
  virtual int sections(const JointsRef& q, BodySections& sections) const noexcept = 0;

  /// Pose, Jacobian and stability at q, on the given branch; `tip` and `branch` change only if kOk is returned.
  virtual ModelStatus tip(const JointsRef& q, Branch& branch, Tip& tip) const noexcept = 0;
  /// The same from a cold start.
  ModelStatus tip(const JointsRef& q, Tip& tip) const noexcept;

  /// A wrench deforms the arm.
  virtual bool carriesLoad() const noexcept { return false; }
  /// The same under a wrench at the tool tip of constant direction in the base frame, with the tip's compliance.
  /// Default implementation, for models without deformation: kCarriesNoLoad unless the wrench is zero; compliance zero.
  virtual ModelStatus loadedTip(const JointsRef& q,
                                const Wrench& wrench,
                                Branch& branch,
                                LoadedTip& tip) const noexcept;

  /// `points` backbone frames, evenly spaced from s = 0 to the end of the body (without the tool).
  virtual ModelStatus shape(const JointsRef& q,
                            const Wrench& wrench,
                            Branch& branch,
                            int points,
                            std::vector<ShapePoint>& shape) const = 0;
  /// The same without a load, from a cold start.
  ModelStatus shape(const JointsRef& q, int points, std::vector<ShapePoint>& shape) const;

  /** Backbone points at arc lengths in ascending order, m, without a load; straight beyond the end of tube 1.
   *
   * Default implementation: shape() at 129 points with cubic Hermite interpolation between them, and central
   * differences for the Jacobians, along the branch. Its error is below 1e-6 m except within one 128th of the arm from
   * a jump of curvature, where it can reach (jump) h^2 / 8. RigidModel is exact.
   * @param derivatives fill jacobian */
  virtual ModelStatus backbone(const JointsRef& q,
                               Branch& branch,
                               const std::vector<double>& s,
                               bool derivatives,
                               std::vector<BackbonePoint>& points) const;

  /// Angle by which the direction in which a body bends turns between its motor and the entry point although nothing
  /// twists it, rad: of a helical tube, 0 for others. A tube that turns so much less or more as it moves, so that this
  /// angle plus its rotation stays, moves along its own helix. @param body from 0, the innermost
  virtual double helixAngle(const JointsRef& q, int body) const noexcept;

  /// The arm can lose elastic stability: Tip::stability changes with the joints.
  virtual bool canSnap() const noexcept { return false; }
  /// Derivative of Tip::stability by the joints, 1/m and 1/rad. @param branch of the model's result for q itself
  virtual Gradient stabilityGradient(const JointsRef& q, const Branch& branch) const;
};

}  // namespace tandem::kinematics
