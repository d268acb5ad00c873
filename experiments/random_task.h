// SPDX-License-Identifier: Apache-2.0
/** @file Random tasks of one arm or of two cooperating ones, feasible by construction or out of reach. */
#pragma once

#include <string_view>

#include "experiments/closed_loop.h"

namespace tandem::experiments {

/** Curve in the space of all joints that a task's path is a piece of. */
enum class PathKind : std::uint8_t { kLine = 0, kCircle, kLissajous };
inline constexpr int kPathKinds = 3;
std::string_view name(PathKind kind);

/** A task: what a run of it needs, and what is known of it. */
struct RandomTask {
  PathKind kind = PathKind::kLine;
  bool feasible = true;
  RunPlan plan;                              ///< key.method is the caller's
  std::vector<safety::RobotVector> witness;  ///< joints of all arms that do it, one vector a point; infeasible: none
};

/** Task number `index` of `seed`: independent of all other tasks.
 *
 * Feasible: q(t), t in [0, 1], all arms at once, starts at random joints inside the limits,
 *
 *   line        q(t) = q_0 + t d
 *   circle      q(t) = q_0 + (cos(2 pi c t) - 1) u + sin(2 pi c t) w,   c in [1/2, 1]
 *   Lissajous   q_j(t) = q_0j + a_j (sin(2 pi c_j t + phi_j) - sin phi_j),   c_j one of 1, 2, 3 times a piece
 *
 * with random d, u, w, a; it is thrown away and drawn again, smaller, until it stays inside boxes and rows everywhere,
 * goes from each point to the next within the time that a run has for it with every joint's velocity inside the bounds
 * of velocityBounds() at both points and inside `rotation`, the plant neither snaps nor is unstable on it, and the
 * bodies of its arms do not overlap at the start and at any point. Targets are what the plant's tips do on that path:
 * x_A and x_A - x_B of the first two arms, x_A alone where there is one, at most 0.8 mm apart. So the plant can do it,
 * with all its errors.
 *
 * With a further kind of tasks: its places are those of the plant's tips, too, look_at's targets kSight along the tip's
 * axis, remote centres kShaftShare along the plant's shaft, which they move with; it is the last task, except that a
 * pose takes the place of the tip, and a relative pose that of the relative position, with the highest priority. Soft
 * tasks: the path keeps their activation distance everywhere.
 *
 * Infeasible: the same, whether bodies overlap or not, with the last third of the targets of x_A beyond the length of
 * tube 1 and the tool from the arm's entry point, where nothing can reach; x_A - x_B stays as it was.
 * @param rotation  rad/s, that of the slowest method
 * @param options  of the plant; its seed is the task's, see seedOf()
 * @throw std::runtime_error where no path is found. */
RandomTask randomTask(const config::Robot& robot,
                      const RobotModel& model,
                      const LoopOptions& options,
                      double rotation,
                      std::uint64_t seed,
                      int index,
                      bool feasible,
                      planning::TaskKind further = planning::TaskKind::kNone);

/// Whether randomTask() makes feasible tasks of a kind: all further ones.
bool isRandomKind(planning::TaskKind kind);

/// Distance of look_at's targets from the tip, m.
inline constexpr double kSight = 0.05;
/// Place of a remote centre on the plant's shaft, as a fraction of the shaft's length.
inline constexpr double kShaftShare = 0.75;

/// Activation distances d of soft tasks, m and a stability: a path keeps at least as far away.
inline constexpr double kKeptDistance = 0.005, kKeptStability = 0.3;

/// Seed of everything random in task `index`: neighbours have nothing to do with each other.
std::uint64_t seedOf(std::uint64_t seed, int index);

}  // namespace tandem::experiments
