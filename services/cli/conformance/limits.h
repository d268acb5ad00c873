// SPDX-License-Identifier: Apache-2.0
/** @file Nearest limit by travel time: the one that a joint reaches first. */
#pragma once

#include <optional>
#include <string>

#include "config/config.h"
#include "services/dds/messages.h"

namespace tandem::cli {

/** Travel of one joint to a limit, while the other joints stand. */
struct LimitTravel {
  int arm = 0;
  int joint = 0;
  double distance = 0.0;  ///< m, rad
  double velocity = 0.0;  ///< towards the limit, m/s, rad/s
  bool coupled = false;   ///< to a coupled limit, not to one of the joint alone

  /// Travel time with a reserve, s.
  double seconds() const;
};

/// "arm_a beta_3 travels 50 mm to its limit at 4.5 mm/s".
std::string describe(const LimitTravel& travel, const config::Robot& robot);

/// The limit of that kind that is reached first; none where a robot has none, or where others are in the way.
std::optional<LimitTravel> nearestLimit(const config::Robot& robot, const dds::ActuationState& state, bool coupled);

}  // namespace tandem::cli
