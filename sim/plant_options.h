// SPDX-License-Identifier: Apache-2.0
/** @file Imperfections of the simulated plant; ideal by default, seeded where random. */
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "safety/limits.h"

namespace tandem::sim {

/** One value for the translations of an arm and one for its rotations, m or rad (or s), depending on the use. */
struct PerAxisKind {
  double translation = 0.0;
  double rotation = 0.0;
  double of(safety::JointKind kind) const noexcept {
    return kind == safety::JointKind::kTranslation ? translation : rotation;
  }
  bool isZero() const noexcept { return translation == 0.0 && rotation == 0.0; }
};

/** Chain from the reference of a joint to its tube: delay, then motor, then transmission. The encoder is at the
 * motor. */
struct JointMechanics {
  double delay = 0.0;    ///< delay of the reference to the motor, s
  PerAxisKind lag;       ///< time constant of the motor, a first-order lag, s
  PerAxisKind backlash;  ///< total backlash between motor and tube, m, rad
};

/** Encoders, one at each motor. */
struct EncoderOptions {
  PerAxisKind resolution;  ///< a reading is a multiple of this, m, rad; 0: exact
  PerAxisKind noise;       ///< standard deviation before quantisation, m, rad
};

/** Relative errors of one tube of the plant: 0.05 makes the plant's value 5 % larger than the robot file's. */
struct TubeErrors {
  double bending_stiffness = 0.0;
  double torsional_stiffness = 0.0;
  double curvature = 0.0;
  double length = 0.0;              ///< of all sections alike
  double residual_curvature = 0.0;  ///< of sections that are straight in the robot file; absolute, 1/m

  bool operator==(const TubeErrors&) const = default;
};

/** Known errors of one tube. */
struct FixedTubeErrors {
  int arm = 0;
  int tube = 0;  ///< counts from 0, tube 1 is the innermost
  TubeErrors errors;
};

/** Force on an arm's tool tip. */
struct TipForce {
  int arm = 0;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< N, robot base frame
};

/** Tip tracker that measures the plant's tips. */
struct TipTrackerOptions {
  bool present = false;
  double rate = 40.0;            ///< measurements per second
  double position_noise = 0.0;   ///< standard deviation per axis, m
  double rotation_noise = 0.0;   ///< standard deviation per axis of the rotation vector, rad
  double delay = 0.0;            ///< from measurement to arrival, s
  double drop_out = 0.0;         ///< probability that a measurement of one arm is marked invalid
  double delay_variation = 0.0;  ///< largest addition to the delay, uniformly distributed, s; arrival keeps the order
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();  ///< constant error of positions, m, robot base frame
  /// constant error of orientations, rad: rotation vector in the robot base frame, applied after the true orientation
  Eigen::Vector3d rotation_bias = Eigen::Vector3d::Zero();
  bool orientations = true;        ///< false: a tracker that measures positions alone
  double distortion = 0.0;         ///< largest error per axis that depends smoothly on the position, m
  double distortion_period = 0.2;  ///< spatial period of this error, m
};

/** Plant of a deployment. */
struct PlantOptions {
  std::string model = "rigid";  ///< kinematic model of the tips: "rigid" or "compliant"
  std::uint64_t seed = 1;
  JointMechanics mechanics;
  EncoderOptions encoders;
  TubeErrors tube_deviation;                 ///< standard deviations of random errors of every tube
  std::vector<FixedTubeErrors> tube_errors;  ///< replace the random errors of their tubes
  std::vector<TipForce> tip_forces;
  double friction = 0.0;   ///< Coulomb coefficient between tubes (sim/tube_friction.h)
  double clearance = 0.0;  ///< diametral, between neighbouring tubes, m (sim/tip_play.h)
  double ovality = 0.0;    ///< of the bores: largest less smallest diameter, m
  TipTrackerOptions tracker;
};

}  // namespace tandem::sim
