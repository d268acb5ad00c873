// SPDX-License-Identifier: Apache-2.0
/** @file Homing methods of a simulated drive (CiA 402-2): directions of motion, position of the reference. */
#pragma once

#include <cstdint>
#include <limits>
#include <optional>

namespace tandem::sim::drives {

/** Places of the switches and of the index pulse of one motor, in its counts. */
struct Switches {
  std::optional<double> negative;  ///< negative limit switch: active from here downwards
  std::optional<double> positive;  ///< positive limit switch: active from here upwards
  bool at_ends = true;             ///< limit switches without a place are at the mechanical ends, if there are any
  /// Home switch: active from `home_from` to `home_to`, which may be infinite; not fitted: an empty range.
  double home_from = std::numeric_limits<double>::infinity();
  double home_to = -std::numeric_limits<double>::infinity();
  double index = 0.0;  ///< one index pulse per revolution: here, and at all whole revolutions from here

  bool negativeAt(double position) const noexcept { return negative && position <= *negative; }
  bool positiveAt(double position) const noexcept { return positive && position >= *positive; }
  bool homeAt(double position) const noexcept { return position >= home_from && position <= home_to; }
  bool hasHome() const noexcept { return home_from < home_to; }
};

/** A homing method: the reference is an edge of a switch, a mechanical stop, an index pulse, or the present position.
 */
struct HomingMethod {
  enum class Switch : std::uint8_t { kNone, kNegative, kPositive, kHome };
  Switch of = Switch::kNone;
  int edge = 0;         ///< -1: the left (lower) edge of the active range, 1: the right one
  bool rising = false;  ///< the reference is where the switch becomes active; else where it becomes inactive
  int search = 0;       ///< first direction while the switch is inactive; without a switch: towards the index pulse
  bool turns = false;   ///< turns around at the limit switch of that direction
  bool index = false;   ///< ends at the first index pulse after the edge or stop
  bool stop = false;    ///< searches a mechanical stop in the direction `search`, without a switch

  /// Methods 1 to 14, 17 to 30, 33 to 35 and 37; nothing for the others.
  static std::optional<HomingMethod> ofNumber(std::int64_t number) noexcept;
  /// Against the mechanical stop in this direction, -1 or 1. Manufacturers give such methods negative numbers.
  static HomingMethod toStop(int direction, bool index) noexcept;
};

/** One search. Nothing allocates or throws. */
class HomingSearch {
 public:
  enum class State : std::uint8_t { kIdle, kRunning, kDone, kError };

  State state() const noexcept { return state_; }
  void reset() noexcept { state_ = State::kIdle; }
  /// @param method  nothing: an unknown one. @param revolution  distance of two index pulses, counts. An error at once:
  /// an unknown method, or one whose switch is not fitted.
  void start(const std::optional<HomingMethod>& method,
             const Switches& switches,
             double position,
             double revolution) noexcept;
  /// The motor has moved to this position. @param blocked  it stands, although it should move: the mechanical stop that
  /// is searched, or an error.
  void step(double position, bool blocked) noexcept;
  int direction() const noexcept { return direction_; }
  /// The speed is that for the edge (6099:2); else that for the switch (6099:1).
  bool slow() const noexcept { return slow_; }

 private:
  enum class Leg : std::uint8_t { kSearch, kLeave, kEnter, kStop, kIndex };
  void go(Leg leg) noexcept;
  void search(double position) noexcept;
  bool active(double position) const noexcept;
  bool fitted() const noexcept;
  /// A limit switch in the present direction, other than the one that is searched, is active.
  bool atOtherLimit(double position) const noexcept;
  void findEdge() noexcept;

  HomingMethod method_;
  Switches switches_;
  double revolution_ = 1.0;
  double last_ = 0.0;
  State state_ = State::kIdle;
  Leg leg_ = Leg::kSearch;
  int direction_ = 0;
  bool slow_ = false;
  bool turned_ = false;
};

}  // namespace tandem::sim::drives
