// SPDX-License-Identifier: Apache-2.0
/** @file Inverse kinematics of all arms under all limits; the nearest reachable poses where there is no solution. */
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
  double tolerance = 5e-7;   ///< of a tip, m; directions are good to 1e-6 rad
  int starts = 12;           ///< besides the reference
  int candidates = 600;      ///< random joints that the starts are chosen from
  int max_iterations = 120;  ///< of Ipopt, a programme
  std::uint64_t seed = 1;    ///< of the starts; the same seed gives the same answer
  bool local = false;        ///< the reference and its neighbourhood are the only starts
  /// How far joints may be from the reference, m and rad.
  double translation_trust = safety::kUnlimited, rotation_trust = safety::kUnlimited;
  std::function<bool()> cancelled;  ///< asked at every iteration
};

/** A limit that holds a tip back. */
struct ActiveLimit {
  int arm = 0;
  std::string words;   ///< "tube 2 against tube 1 (carriage spacing)", "upper limit of translation 3"
  double force = 0.0;  ///< its multiplier, units of the programme
};

struct IkAnswer {
  Reach reach = Reach::kInvalid;
  safety::RobotVector q;  ///< of the pose, or of the nearest one found, inside the limits
  std::vector<kinematics::Branch> branches;
  std::vector<Eigen::Vector3d> tips;      ///< of all arms at q, m
  std::vector<double> error;              ///< distance to each target, m
  std::vector<ActiveLimit> limits;        ///< at the nearest pose
  double stability = 1.0;                 ///< smallest of all arms
  double clearance = safety::kUnlimited;  ///< between arms, m; infinite where it was not asked for
  int starts = 0, iterations = 0;         ///< used, in total
  std::string words;                      ///< "arm a: 4.2 mm beyond the edge of the workspace"; empty where reached

  double largestError() const;
};

/** Inverse kinematics with the programmes of PoseProblem.
 *
 * The reference is tried first, then neighbours of it (a planar arm's Jacobian is singular; a little turn leaves the
 * plane), then random joints whose tips are near the targets: from each the nearest pose is looked for, and where that
 * is the pose itself, the joints nearest to the reference that reach it. Clearance and stability enter a programme once
 * a solution without them breaks them. Where no start leads to the pose, the best of the nearest ones is answered,
 * after random steps downhill from it; that nothing nearer exists is as certain as that a start would have led there.
 */
class InverseKinematics {
 public:
  explicit InverseKinematics(Arms arms, IkOptions options = {});

  /// @param reference  q_ref, all arms; need not be inside the limits
  /// @param branches  equilibria to follow from, one an arm; empty: cold
  /// @param keep_relative  a nearest pose keeps the difference of the first two targets if it can
  IkAnswer solve(const std::vector<TipTarget>& targets,
                 const safety::RobotVector& reference,
                 const std::vector<kinematics::Branch>& branches = {},
                 bool keep_relative = false) const;

  /// Whether joints reach the targets and keep limits and demands: kReached, or kIterationLimit.
  IkAnswer judge(const std::vector<TipTarget>& targets,
                 const safety::RobotVector& q,
                 const std::vector<kinematics::Branch>& branches) const;

  const Arms& arms() const { return arms_; }
  const IkOptions& options() const { return options_; }

 private:
  struct Search;
  std::vector<safety::RobotVector> starts(const PoseProblem& problem, std::uint64_t seed) const;
  /// q inside the limits, a little away from their edges, its rotations turned at random by up to `turn`, rad.
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
