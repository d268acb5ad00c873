// SPDX-License-Identifier: Apache-2.0
/** @file Evaluation of a slow motion of one axis to and fro: following error, backlash, gearing against the encoder. */
#pragma once

#include <vector>

namespace tandem::hal {

/** Sample of one axis at one time; m or rad, s. */
struct SweepSample {
  double time = 0.0;
  double setpoint = 0.0;
  double position = 0.0;            ///< by the drive
  double following_error = 0.0;     ///< of the drive
  double encoder_difference = 0.0;  ///< absolute encoder minus drive
};

/** Result of a sweep with at least one stroke in each direction. */
struct SweepResult {
  double travel = 0.0;          ///< largest minus least position
  double following_max = 0.0;   ///< largest following error, without sign
  double following_mean = 0.0;  ///< mean of its size while the axis moved
  /// Difference of encoder_difference between the two directions, mean over the places that both passed: free travel
  /// between motor and encoder. NaN without strokes that overlap.
  double backlash = 0.0;
  /// Travel of the encoder per travel of the drive, fitted to each stroke behind its free travel; 1 if the gearings of
  /// both are right. NaN without a stroke that is long enough.
  double encoder_ratio = 0.0;
};

/// @param samples  in order of time
SweepResult evaluateSweep(const std::vector<SweepSample>& samples);

}  // namespace tandem::hal
