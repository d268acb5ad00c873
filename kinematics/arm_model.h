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
/// 1 x 2n: how a number changes with the joints.
using Gradient = Eigen::Matrix<double, 1, Eigen::Dynamic, Eigen::RowMajor, 1, safety::kMaxJointsPerArm>;
/// Force (N) and moment about the point of application (N m), in the robot base frame.
using Wrench = Eigen::Matrix<double, 6, 1>;

/// Joint vector seen by a model: [beta_1..beta_n, alpha_1..alpha_n], m and rad.
using JointsRef = Eigen::Ref<const Eigen::VectorXd>;

/** Whether a model can answer for a joint vector. */
enum class ModelStatus {
  kOk,
  kWrongSize,      ///< not 2n joints
  kNotFinite,      ///< NaN or infinite
  kNotExtended,    ///< tube 1 ends at or behind the entry point: there is no robot in front of it
  kProtruded,      ///< a tube's proximal end stands in front of the entry point, beta > 0
  kInnerInside,    ///< an outer tube ends ahead of an inner one: equation (1), distal side
  kNotConverged,   ///< no equilibrium was found within the bounded number of iterations
  kCarriesNoLoad,  ///< a wrench was given to a model that does not deform
  kDistalInside,   ///< a catheter's bending end is not wholly in front of the entry point
  kTendonPushes,   ///< a tendon's tension below zero
};
std::string_view describe(ModelStatus status);

/** Tip of an arm. */
struct Tip {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< robot base frame <- tool tip frame
  Jacobian jacobian;                                       ///< of that pose
  /// Smallest value along the arm of the determinant that vanishes where the arm snaps (kinematics/stability.h):
  /// 1 where nothing interacts. A rigid model never snaps: always 1.
  double stability = 1.0;
  double stability_at = 0.0;  ///< where along the arm that is, s, m; below zero in the transmission
  int conjugate_points = 0;   ///< directions in which the equilibrium is no minimum of energy; 0: stable
};

/** Tip of an arm that carries a wrench at its tool tip. */
struct LoadedTip : Tip {
  /// Twist of the tool tip (m, rad; rows linear first) per wrench (columns force first), robot base frame. Symmetric
  /// unless the wrench has a moment: one that keeps its direction in space has no potential.
  Eigen::Matrix<double, 6, 6> compliance = Eigen::Matrix<double, 6, 6>::Zero();
};

/** One point of the backbone. */
struct ShapePoint {
  double s = 0.0;  ///< arc length from the entry point, m
  /// robot base frame <- frame at s: z along the backbone, x the direction in which tube 1 bends there. Turned back by
  /// psi_1 about z it is the torsion-free frame that starts as the arm's base frame.
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  std::array<double, kMaxTubes> psi{};  ///< angle of each tube in the torsion-free frame, rad; NaN where it has ended
  std::array<double, kMaxTubes> moment{};               ///< torsional moment in each tube, N m; NaN where it has ended
  Eigen::Vector2d curvature = Eigen::Vector2d::Zero();  ///< of the backbone, x and y of the torsion-free frame, 1/m
  int outermost_tube = 0;                               ///< 1..n: the outermost tube present
};

/** A material place of the backbone, given by its arc length, and how it moves with the joints. */
struct BackbonePoint {
  double s = 0.0;                                      ///< arc length from the entry point, m
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, robot base frame
  Eigen::Vector3d tangent = Eigen::Vector3d::UnitZ();  ///< unit vector toward the tip, robot base frame
  Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, safety::kMaxJointsPerArm> jacobian;  ///< at constant s
};

/// Most sections of an arm's body.
inline constexpr int kMaxBodySections = kMaxTubes;

/** A part of an arm's body with constant radius, from the end of the section before it. */
struct BodySection {
  double end = 0.0;     ///< arc length from the entry point, m; where the section before it ends, or beyond
  double radius = 0.0;  ///< m
  Gradient by_joints;   ///< of `end`
};
using BodySections = std::array<BodySection, kMaxBodySections>;

/** A kinematic model of one arm of any type. tip() and loadedTip() are meant for the periodic path: they allocate
 * nothing and throw nothing. A model has no state of its own: what it has to remember from call to call is the caller's
 * Branch, so one model may serve many threads. */
class ArmModel {
 public:
  virtual ~ArmModel() = default;
  virtual int jointCount() const noexcept = 0;
  /// robot base frame <- arm base frame
  virtual const Eigen::Isometry3d& base() const noexcept = 0;
  /// A faster model of the same arm with similar answers, for searches; this one where there is none.
  virtual const ArmModel& approximation() const noexcept { return *this; }
  /// Sections of the body from the entry point to the tip, at joints of the right number. @return how many
  virtual int sections(const JointsRef& q, BodySections& sections) const noexcept = 0;

  /// Pose, Jacobian and stability at q, on the branch given; `tip` and `branch` are untouched unless kOk is returned.
  virtual ModelStatus tip(const JointsRef& q, Branch& branch, Tip& tip) const noexcept = 0;
  /// The same from a cold start.
  ModelStatus tip(const JointsRef& q, Tip& tip) const noexcept;

  /// Whether a wrench deforms the arm.
  virtual bool carriesLoad() const noexcept { return false; }
  /// The same under a wrench at the tool tip that keeps its direction in the base frame, with the tip's compliance.
  /// Here, for models that do not deform: kCarriesNoLoad unless the wrench is zero; compliance zero.
  virtual ModelStatus loadedTip(const JointsRef& q,
                                const Wrench& wrench,
                                Branch& branch,
                                LoadedTip& tip) const noexcept;

  /// `points` backbone frames, evenly spaced from s = 0 to the end of the body (the tool is not part of the backbone).
  virtual ModelStatus shape(const JointsRef& q,
                            const Wrench& wrench,
                            Branch& branch,
                            int points,
                            std::vector<ShapePoint>& shape) const = 0;
  /// The same without a load from a cold start.
  ModelStatus shape(const JointsRef& q, int points, std::vector<ShapePoint>& shape) const;

  /** Backbone points at arc lengths in ascending order, m, without a load; beyond the end of tube 1 straight on.
   *
   * Here: shape() at 129 points with cubic Hermite interpolation between them, and central differences for the
   * Jacobians, along the branch; good to 1e-6 m except within one 128th of the arm from a jump of curvature, where the
   * place can be off by (jump) h^2 / 8. RigidModel answers exactly.
   * @param derivatives  whether jacobian is filled */
  virtual ModelStatus backbone(const JointsRef& q,
                               Branch& branch,
                               const std::vector<double>& s,
                               bool derivatives,
                               std::vector<BackbonePoint>& points) const;

  /// How Tip::stability changes with the joints, 1/m and 1/rad. @param branch  of the model's answer for q itself
  virtual Gradient stabilityGradient(const JointsRef& q, const Branch& branch) const;
};

}  // namespace tandem::kinematics
