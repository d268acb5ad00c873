// SPDX-License-Identifier: Apache-2.0
/** @file Actuation chain between joint reference and tube: delay, motor lag, backlash, encoder. */
#pragma once

#include <cstdint>
#include <vector>

#include "safety/dimensions.h"
#include "sim/plant_options.h"

namespace tandem::sim {

/** Output after dt of a first-order lag y' = (u - y) / tau whose input goes evenly from u0 to u1 meanwhile: the exact
 * solution, whatever the step. tau 0: u1.
 * @param y output before; @param dt and tau s */
double lagged(double y, double u0, double u1, double dt, double tau) noexcept;

/// Where the driven side of a transmission with full play `width` is once the driving side stands at `motor`; `tube` is
/// where it was.
double withPlay(double tube, double motor, double width) noexcept;

/// The multiple of `resolution` next to x; x itself for 0.
double quantised(double x, double resolution) noexcept;

/** The reference of one arm on its way to the motors: delayed, then lagged.
 *
 * The reference is taken as going evenly from one step's value to the next one's. Delay and lag are exact for that, at
 * any step; the delay counts whole ns. Nothing after construction allocates. */
class Actuation {
 public:
  /// @param shortest_step of step(), s: sizes the memory of the delay
  Actuation(const JointMechanics& mechanics, const safety::JointKinds& kinds, double shortest_step);

  /// Stands at `position`, m, rad; whatever was on its way is forgotten.
  void place(const safety::ArmVector& position) noexcept;
  /// The same for one joint.
  void place(int joint, double position) noexcept;
  /// The reference went to `reference` within dt, s.
  void step(double dt, const safety::ArmVector& reference) noexcept;
  /// Where intact motors shall be now, m, rad.
  const safety::ArmVector& output() const noexcept { return output_; }
  /// Nothing is on its way.
  bool atRest() const noexcept;

 private:
  struct Segment {
    std::int64_t left = 0;  ///< ns that have not come out yet
    safety::ArmVector end;
  };
  Segment& at(std::size_t index) noexcept { return line_[(first_ + index) % line_.size()]; }
  const Segment& at(std::size_t index) const noexcept { return line_[(first_ + index) % line_.size()]; }
  void push(std::int64_t duration, const safety::ArmVector& end) noexcept;
  void lag(const safety::ArmVector& to, double dt) noexcept;

  JointMechanics mechanics_;
  safety::JointKinds kinds_;
  std::int64_t delay_;         ///< ns
  std::vector<Segment> line_;  ///< ring: what the delay still holds, oldest first; always `delay_` long
  std::size_t first_ = 0, count_ = 0;
  safety::ArmVector delayed_;  ///< what has come out of the delay
  safety::ArmVector output_;
};

}  // namespace tandem::sim
