// SPDX-License-Identifier: Apache-2.0
/** @file Inverse kinematics of all arms under all limits; the nearest reachable poses if there is no solution. */
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "idl/enumerations.h"
#include "planning/joint_sampler.h"
#include "planning/pose_problem.h"

namespace tandem::planning {

using idl::name;
using idl::Reach;

struct IkOptions {
  Demands demands;           ///< none by default
  double tolerance = 5e-7;   ///< of a tip, m; directions and orientations are accurate to 1e-6 rad
  int starts = 12;           ///< besides the reference
  int candidates = 600;      ///< random joints from which the starts are chosen
  int max_iterations = 120;  ///< of Ipopt, per problem
  std::uint64_t seed = 1;    ///< of the starts; the same seed gives the same answer
  bool local = false;        ///< the reference and its neighbourhood are the only starts
  /// Largest distance of joints from the reference, m and rad.
  double translation_trust = safety::kUnlimited, rotation_trust = safety::kUnlimited;
  std::function<bool()> cancelled;  ///< called at every iteration
};

/** An active limit that keeps a tip from its target. */
struct ActiveLimit {
  int arm = 0;
  std::string description;  ///< "tube 2 against tube 1 (carriage spacing)", "upper limit of translation 3"
  double force = 0.0;       ///< its multiplier, in units of the optimisation problem
};

struct IkAnswer {
  Reach reach = Reach::kInvalid;
  safety::RobotVector q;  ///< of the pose, or of the nearest one found, inside the limits
  std::vector<kinematics::Branch> branches;
  std::vector<Eigen::Vector3d> tips;      ///< of all arms at q, m
  std::vector<double> error;              ///< distance to each target, m
  std::vector<double> angle;              ///< TipTarget::turned() of each target, rad; 0 of positions
  std::vector<ActiveLimit> limits;        ///< at the nearest pose
  double stability = 1.0;                 ///< smallest of all arms
  double clearance = safety::kUnlimited;  ///< between arms, m; infinite if not computed
  int starts = 0, iterations = 0;         ///< totals
  std::string reason;                     ///< "arm a: 4.2 mm beyond the edge of the workspace"; empty if reached

  /// m; one radian counts as kinematics::kLengthPerRadian.
  double largestError() const;
};

/** Inverse kinematics with the optimisation problems of PoseProblem.
 *
 * Starts are, in this order: the reference; neighbours of it (a planar arm's Jacobian is singular, a small rotation
 * leaves the plane); random joints with tips near the targets. From each start it solves for the nearest pose and, if
 * that is the pose itself, for the joints nearest to the reference that reach it. Clearance and stability become
 * constraints once a solution without them violates them. If no start reaches the pose, the result is the best of the
 * nearest poses, improved by random descent steps. That no nearer pose exists is then likely, not proved. */
class InverseKinematics {
 public:
  explicit InverseKinematics(Arms arms, IkOptions options = {});

  /// @param reference  q_ref, all arms; may be outside the limits
  /// @param branches  equilibria to continue from, one per arm; empty: cold start
  /// @param keep_relative  a nearest pose keeps the difference of the first two targets if possible
  IkAnswer solve(const std::vector<TipTarget>& targets,
                 const safety::RobotVector& reference,
                 const std::vector<kinematics::Branch>& branches = {},
                 bool keep_relative = false) const;

  /// Whether joints reach the targets and satisfy limits and demands: kReached, or kIterationLimit.
  IkAnswer judge(const std::vector<TipTarget>& targets,
                 const safety::RobotVector& q,
                 const std::vector<kinematics::Branch>& branches) const;

  const Arms& arms() const { return arms_; }
  const IkOptions& options() const { return options_; }

 private:
  struct Search;
  std::vector<safety::RobotVector> starts(const PoseProblem& problem, std::uint64_t seed) const;
  /// q inside the limits, slightly away from their bounds, its rotations changed at random by up to `turn`, rad.
  safety::RobotVector neighbour(const safety::RobotVector& q, double turn, std::mt19937_64& engine) const;
  void attempt(Search& search, const safety::RobotVector& from) const;
  bool take(Search& search, const PoseProblem& problem, const PoseSolution& solution) const;
  void improve(Search& search, const safety::RobotVector& start) const;
  safety::RobotVector downhill(const PoseProblem& problem, const safety::RobotVector& q, std::mt19937_64& engine) const;
  void polish(Search& search, std::mt19937_64& engine) const;
  void explain(Search& search) const;
  bool cancelled() const { return options_.cancelled && options_.cancelled(); }

  Arms arms_;
  IkOptions options_;
  std::vector<JointSampler> samplers_;
};

}  // namespace tandem::planning
