// SPDX-License-Identifier: Apache-2.0
/** @file Cosserat rod: parameters, loads, and solution. */
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "kinematics/arm_model.h"

namespace tandem::kinematics::cosserat {

inline constexpr int kMaxSections = 4;
inline constexpr int kMaxActuators = 4;

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
/// One number per actuator, zero for those that a rod does not have.
using Inputs = Eigen::Matrix<double, kMaxActuators, 1>;

/** Part of a rod with constant properties. Frames along the rod: z along it, x and y across. */
struct Section {
  double length = 0.0;                                            ///< m, unstretched
  Eigen::Vector3d moment_stiffness = Eigen::Vector3d::Zero();     ///< K_me = (E I_1, E I_2, G I_3), N m^2
  Eigen::Vector3d force_stiffness = Eigen::Vector3d::Zero();      ///< K_ne = (G A, G A, E A), N
  Eigen::Vector3d intrinsic_curvature = Eigen::Vector3d::Zero();  ///< kappa^0, 1/m, axes of the rod's frame
  double outer_radius = 0.0;                                      ///< m, for bending strains alone; 0: not known
};

/** A section with the stiffness of a round tube: I = pi (d_o^4 - d_i^4) / 64, I_3 = 2 I, G = E / (2 (1 + nu)).
 * @param outer_diameter, inner_diameter  m  @param youngs_modulus  Pa */
Section tubeSection(double length, double outer_diameter, double inner_diameter, double youngs_modulus, double poisson);

/** Internal actuation of a rod by one scalar input. */
struct Actuator {
  enum Kind {
    kTendon,    ///< input: tension, N, not below zero; the tendon runs without friction from the base to the end of
                ///< `section`, at `vector` in the rod's frame (z = 0), m
    kCurvature  ///< input times `vector` (axes of the rod's frame, 1/m per unit) is added to kappa^0 of `section`
  };
  Kind kind = kCurvature;
  int section = 0;
  Eigen::Vector3d vector = Eigen::Vector3d::Zero();
};

struct Rod {
  std::vector<Section> sections;                           ///< from the base, 1 to kMaxSections
  std::vector<Actuator> actuators;                         ///< up to kMaxActuators
  Eigen::Isometry3d tool = Eigen::Isometry3d::Identity();  ///< frame of the rod's end <- tool tip frame, rigid
};

/** @throw std::invalid_argument that names section or actuator: too many or none, a stiffness not above zero, a length
 * below zero or none at all, a section that does not exist, a tendon off its plane, a number that is not finite. */
void checkRod(const Rod& rod);

/** A wire whose displacement is given: its tension is unknown, as under a load with the actuator at standstill.
 *
 * The tension adds pull * share to the inputs of the curvature actuators of one section; pull is, in rad, the bend by
 * which the tension alone would curve the section, about the axis a = sum share_i L vector_i. With u the curvature of
 * the rod, u0 its intrinsic one, and e = E I / (k r^2 L) for wires of stiffness k (N/m) at the distance r from the
 * axis,
 *
 *   integral of (u - u0) . a over the section + e pull = (1 + e) displacement,
 *
 * whose left side is conjugate to the tension: the length of a wire that runs through the section at distance r, by r.
 * Without loads pull = displacement. e = 0: the wire does not stretch. */
struct Wire {
  Inputs share = Inputs::Zero();  ///< of curvature actuators; zero: no such wire, the tension is an input
  double displacement = 0.0;      ///< of the wire divided by r, rad
  double elasticity = 0.0;        ///< e, not below zero
  bool locked() const { return !share.isZero(0.0); }
};

/** Boundary conditions, inputs and loads of a rod. Forces and moments keep their direction in the robot base frame. */
struct RodInput {
  Eigen::Isometry3d base = Eigen::Isometry3d::Identity();  ///< robot base frame <- frame in which the rod is clamped
  double first_length = 0.0;                               ///< length of section 0 in front of the clamp, m, >= 0
  Inputs inputs = Inputs::Zero();                          ///< of the actuators
  Wire wire;                                               ///< whose displacement is given
  Wrench tip = Wrench::Zero();                             ///< force and moment at the tool tip, N and N m
  std::array<Eigen::Vector3d, kMaxSections> force{};       ///< F_ex, N per metre of the unstretched rod, by section
  std::array<Eigen::Vector3d, kMaxSections> moment{};      ///< L_ex, N m per metre, by section

  explicit RodInput(const Rod& rod);  ///< no load; section 0 with its length in `rod`
};

/** Equilibrium of a rod. Twists are (linear m; angular rad) of the tool tip, robot base frame. */
struct RodAnswer {
  Eigen::Isometry3d tip = Eigen::Isometry3d::Identity();  ///< robot base frame <- tool tip frame
  Wrench base_wrench = Wrench::Zero();                    ///< n and m in the rod at its clamp, robot base frame
  Matrix6 compliance = Matrix6::Zero();                   ///< twist by the wrench at the tool tip (columns force first)
  Matrix6 by_base = Matrix6::Identity();                  ///< twist by the twist of the clamp's frame at its own origin
  Vector6 by_length = Vector6::Zero();  ///< twist by first_length: insertion of the rod through the clamp
  Eigen::Matrix<double, 6, kMaxActuators> by_input = Eigen::Matrix<double, 6, kMaxActuators>::Zero();
  Vector6 by_displacement = Vector6::Zero();  ///< twist by Wire::displacement; all others at constant displacement
  double energy = 0.0;            ///< elastic energy of the rod, J, without the energy that keeps the tendons' tension
  int conjugate_points = 0;       ///< directions in which the energy is not minimal at constant load; 0: stable
  int held_conjugate_points = 0;  ///< the same for a tool tip with fixed position and orientation
};

/** One cross-section of a rod. */
struct RodPoint {
  double s = 0.0;                                          ///< arc length of the unstretched rod from the clamp, m
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< robot base frame <- rod's frame
  Eigen::Vector3d curvature = Eigen::Vector3d::Zero();     ///< kappa, 1/m, rod's frame
  Eigen::Vector3d stretch = Eigen::Vector3d::UnitZ();      ///< nu, rod's frame; (0, 0, 1) without stretch and shear
  Eigen::Vector3d force = Eigen::Vector3d::Zero();         ///< in rod and tendons together, N, robot base frame
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();        ///< in rod and tendons together, N m, robot base frame
};

/** State of a rod that is tracked along a path; see Branch. */
struct RodBranch {
  bool known = false;
  Eigen::Vector3d base_moment = Eigen::Vector3d::Zero();  ///< of the last result, N m, frame of the clamp
  double pull = 0.0;                                      ///< of the wire whose displacement is given, rad
};

}  // namespace tandem::kinematics::cosserat
