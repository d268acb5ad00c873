// SPDX-License-Identifier: Apache-2.0
/** @file Actuation chain between joint reference and tube: delay, motor lag, backlash, encoder. */
#pragma once

#include <cstdint>
#include <vector>

#include "safety/dimensions.h"
#include "sim/plant_options.h"

namespace tandem::sim {

/** Output after dt of a first-order lag y' = (u - y) / tau with an input that changes linearly from u0 to u1: the exact
 * solution for any step. tau 0: u1.
 * @param y output before; @param dt and tau s */
double lagged(double y, double u0, double u1, double dt, double tau) noexcept;

/// Position of the driven side of a transmission with total backlash `width` for a driving side at `motor`; `tube` is
/// its previous position.
double withBacklash(double tube, double motor, double width) noexcept;

/// Multiple of `resolution` nearest to x; x itself for 0.
double quantised(double x, double resolution) noexcept;

/** Delay and motor lag of the reference of one arm.
 *
 * The reference changes linearly from one step's value to the next one's. Delay and lag are exact for this input, at
 * any step; the delay counts whole ns. Nothing after construction allocates. */
class Actuation {
 public:
  /// @param shortest_step shortest dt of step(), s: sizes the memory of the delay
  Actuation(const JointMechanics& mechanics, const safety::JointKinds& kinds, double shortest_step);

  /// Sets the output to `position`, m, rad, at standstill; clears the delay.
  void place(const safety::ArmVector& position) noexcept;
  /// The same for one joint.
  void place(int joint, double position) noexcept;
  /// The reference changes to `reference` within dt, s.
  void step(double dt, const safety::ArmVector& reference) noexcept;
  /// Present positions of motors without faults, m, rad.
  const safety::ArmVector& output() const noexcept { return output_; }
  /// The output is constant: delay and lag have finished.
  bool atStandstill() const noexcept;

 private:
  struct Segment {
    std::int64_t left = 0;  ///< part that is still delayed, ns
    safety::ArmVector end;
  };
  Segment& at(std::size_t index) noexcept { return line_[(first_ + index) % line_.size()]; }
  const Segment& at(std::size_t index) const noexcept { return line_[(first_ + index) % line_.size()]; }
  void push(std::int64_t duration, const safety::ArmVector& end) noexcept;
  void lag(const safety::ArmVector& to, double dt) noexcept;

  JointMechanics mechanics_;
  safety::JointKinds kinds_;
  std::int64_t delay_;         ///< ns
  std::vector<Segment> line_;  ///< ring: contents of the delay, oldest first; always `delay_` long
  std::size_t first_ = 0, count_ = 0;
  safety::ArmVector delayed_;  ///< output of the delay
  safety::ArmVector output_;
};

}  // namespace tandem::sim
