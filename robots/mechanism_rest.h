// SPDX-License-Identifier: Apache-2.0
/** @file Equilibrium of a mechanism as input of a control step. */
#pragma once

#include <memory>

#include "planning/reference_tracker.h"
#include "robots/mechanism.h"

namespace tandem::robots {

/// Writes the rest that a mechanism is in. @param q  where it has settled
/// @throw std::invalid_argument for more tasks or rows than control/ takes.
void fillRest(const Mechanism& mechanism, const RobotVector& q, planning::Rest& rest);

/** A mechanism that follows joints on their way: it settles where they have moved, and walks in small steps where that
 * is far, so that it stays in the equilibrium that it is in. Allocates. */
class RestFollower {
 public:
  /// Comes to rest at home. @throw std::invalid_argument where there is no rest there, and why.
  explicit RestFollower(std::unique_ptr<Mechanism> mechanism);

  /// @return empty, or why there is no rest on the way or there; the last rest then stays
  std::string settle(const RobotVector& q);
  const RobotVector& joints() const { return joints_; }  ///< of the last rest
  const Mechanism& mechanism() const { return *mechanism_; }

 private:
  std::unique_ptr<Mechanism> mechanism_;
  RobotVector joints_;
};

/** One control period of a mechanism by the velocities of its middle, which are those of the whole to the second order:
 * arms turn by so much in one that velocities of its beginning would open the contacts.
 *
 * Settles at the joints, solves, settles where they will be in the middle, and solves again. `result` then is of the
 * middle, but for the error, which is of the beginning.
 * @param settle  comes to rest at joints, as Mechanism::settle() does  @param q  joints, from which limits are counted
 * @return empty, or why there is no rest; result.status says the rest */
template <class Settle>
std::string stepByMiddle(const Mechanism& mechanism,
                         const Settle& settle,
                         planning::ReferenceTracker& tracker,
                         const RobotVector& q,
                         const planning::FrameReference& reference,
                         double period,
                         planning::Rest& rest,
                         planning::TrackResult& result) {
  if (std::string why = settle(q); !why.empty())
    return why;
  fillRest(mechanism, q, rest);
  tracker.step(rest, q, q, reference, result);
  if (result.status != planning::TrackStatus::kOk)
    return {};
  const double error = result.error[0];
  const RobotVector middle = tracker.moved(q, 0.5 * period * result.solution.velocity);
  if (std::string why = settle(middle); !why.empty())
    return why;
  fillRest(mechanism, middle, rest);
  tracker.step(rest, middle, q, reference.after(0.5 * period), result);
  result.error[0] = error;
  return {};
}

}  // namespace tandem::robots
