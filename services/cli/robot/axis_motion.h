// SPDX-License-Identifier: Apache-2.0
/** @file Motion of one joint at a speed, for commands that have the lease. */
#pragma once

#include <functional>

#include "services/client/client.h"

namespace tandem::cli {

/** A jog: repeated until its end, because control lets none outlive its repetitions. */
struct Jog {
  std::uint8_t arm = 0;
  int joint = 0;
  int joints = 0;        ///< of the arm
  double speed = 0.0;    ///< m/s or rad/s, signed
  double seconds = 0.0;  ///< duration
};

/// Jogs, then holds until the joint stands. @param wait  waits for so many seconds; true: the jog ends now
/// @return false if `wait` has ended it
bool jogJoint(client::Client& client,
              const config::Deployment& deployment,
              const Jog& jog,
              const std::function<bool(double)>& wait);

}  // namespace tandem::cli
