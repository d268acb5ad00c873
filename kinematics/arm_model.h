// SPDX-License-Identifier: Apache-2.0
/** @file What every kinematic model of one arm answers. */
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "kinematics/concentric_tube.h"
#include "safety/dimensions.h"

namespace tandem::kinematics {

inline constexpr int kMaxTubes = 4;

/// 6 x 2n: rows are the tip's linear (m/s) and angular (rad/s) velocity in the robot base frame, columns the joints.
using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, safety::kMaxJointsPerArm>;

/// Joint vector seen by a model: [beta_1..beta_n, alpha_1..alpha_n], m and rad.
using JointsRef = Eigen::Ref<const Eigen::VectorXd>;

/** Whether a model can answer for a joint vector. */
enum class ModelStatus {
  kOk,
  kWrongSize,    ///< not 2n joints
  kNotFinite,    ///< NaN or infinite
  kNotExtended,  ///< tube 1 ends at or behind the entry point: there is no robot in front of it
  kProtruded,    ///< a tube's proximal end stands in front of the entry point, beta > 0
  kInnerInside,  ///< an outer tube ends ahead of an inner one: equation (1), distal side
};
std::string_view describe(ModelStatus status);

/** Tip of an arm. */
struct Tip {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< robot base frame <- tool tip frame
  Jacobian jacobian;                                       ///< of that pose
  double stability = 1.0;  ///< 1 where nothing interacts; a rigid model never snaps: always 1
};

/** One point of the backbone. */
struct ShapePoint {
  double s = 0.0;                                          ///< arc length from the entry point, m
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< robot base frame <- frame at s (z along the backbone)
  std::array<double, kMaxTubes> psi{};                     ///< angle of each tube, rad; NaN where the tube has ended
  int outermost_tube = 0;                                  ///< 1..n: the outermost tube present
};

/** A kinematic model of one arm. tip() is meant for the periodic path: it allocates nothing and throws nothing. */
class ArmModel {
 public:
  virtual ~ArmModel() = default;
  virtual const ConcentricTubeArm& arm() const = 0;

  /// Pose, Jacobian and stability at q; `tip` is untouched unless kOk is returned.
  virtual ModelStatus tip(const JointsRef& q, Tip& tip) const noexcept = 0;

  /// `points` backbone frames, evenly spaced from s = 0 to the end of tube 1 (the tool is not part of the backbone).
  virtual ModelStatus shape(const JointsRef& q, int points, std::vector<ShapePoint>& shape) const = 0;
};

/** Makes a model by name: "rigid".
 * @throw std::invalid_argument for another name, or an arm without 2 to 4 tubes. */
std::unique_ptr<ArmModel> makeArmModel(const std::string& name, const ConcentricTubeArm& arm);

}  // namespace tandem::kinematics
