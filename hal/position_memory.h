// SPDX-License-Identifier: Apache-2.0
/** @file Plausibility of an absolute position after power on. */
#pragma once

#include <array>
#include <cmath>
#include <string_view>

#include "idl/enumerations.h"
#include "safety/dimensions.h"

namespace tandem::hal {

using idl::LastPosition;

/// Why there is no last position; empty: there is one.
constexpr std::string_view reasonOf(LastPosition state) noexcept {
  switch (state) {
    case LastPosition::kKnown:
      return {};
    case LastPosition::kDamaged:
      return "the file of last positions is damaged";
    case LastPosition::kChanged:
      return "the last position was stored with other keys of the conversion (counts, gear, offset, encoder)";
    default:
      return "no last position is stored";
  }
}

/** The last position of one axis that was known to be right, and whether a new one may follow it. Nothing allocates,
 * locks or throws. */
class PositionMemory {
 public:
  /// @param tolerance  largest jump, m or rad; 0: every position is plausible.
  explicit PositionMemory(double tolerance) noexcept : tolerance_(tolerance) {}

  bool watches() const noexcept { return tolerance_ > 0.0; }
  /// Takes the position stored by an earlier run of the HAL. @param position  m or rad, if it is known.
  void restore(LastPosition state, double position) noexcept {
    state_ = state;
    position_ = position;
  }
  /// A position that is right.
  void note(double position) noexcept { restore(LastPosition::kKnown, position); }
  bool plausible(double position) const noexcept {
    return !watches() || (known() && std::abs(position - position_) <= tolerance_);
  }
  bool known() const noexcept { return state_ == LastPosition::kKnown; }
  LastPosition state() const noexcept { return state_; }
  double position() const noexcept { return position_; }  ///< m or rad; 0 if it is not known
  double tolerance() const noexcept { return tolerance_; }

 private:
  double tolerance_;
  double position_ = 0.0;
  LastPosition state_ = LastPosition::kMissing;
};

/** Positions of all axes at one time, in the order of HardwareConfig::axes; a plain struct for the way between threads.
 */
struct PositionSnapshot {
  struct One {
    bool known = false;
    double position = 0.0;  ///< m or rad
    bool operator==(const One&) const = default;
  };
  std::array<One, safety::kMaxJoints> axes{};
  bool operator==(const PositionSnapshot&) const = default;
};

}  // namespace tandem::hal
