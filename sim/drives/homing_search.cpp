// SPDX-License-Identifier: Apache-2.0
#include "sim/drives/homing_search.h"

#include <cmath>

namespace tandem::sim::drives {
namespace {

using Switch = HomingMethod::Switch;

/// Methods 17 to 30; 1 to 14 are the same with an index pulse behind the edge.
constexpr HomingMethod kEdges[] = {
    {Switch::kNegative, 1, false, -1},      // 17
    {Switch::kPositive, -1, false, 1},      // 18
    {Switch::kHome, -1, false, 1},          // 19: the home switch is active to the right of its edge
    {Switch::kHome, -1, true, 1},           // 20
    {Switch::kHome, 1, false, -1},          // 21: to the left of it
    {Switch::kHome, 1, true, -1},           // 22
    {Switch::kHome, -1, false, 1, true},    // 23: the home switch is active between two edges
    {Switch::kHome, -1, true, 1, true},     // 24
    {Switch::kHome, 1, true, 1, true},      // 25
    {Switch::kHome, 1, false, 1, true},     // 26
    {Switch::kHome, 1, false, -1, true},    // 27
    {Switch::kHome, 1, true, -1, true},     // 28
    {Switch::kHome, -1, true, -1, true},    // 29
    {Switch::kHome, -1, false, -1, true}};  // 30

}  // namespace

std::optional<HomingMethod> HomingMethod::ofNumber(std::int64_t number) noexcept {
  HomingMethod method;
  if ((number >= 1 && number <= 14) || (number >= 17 && number <= 30)) {
    method = kEdges[number <= 14 ? number - 1 : number - 17];
    method.index = number <= 14;
    return method;
  }
  if (number == 33 || number == 34) {
    method.search = number == 33 ? -1 : 1;
    method.index = true;
    return method;
  }
  if (number == 35 || number == 37)
    return method;
  return std::nullopt;
}

HomingMethod HomingMethod::toStop(int direction, bool index) noexcept {
  HomingMethod method;
  method.search = direction;
  method.index = index;
  method.stop = true;
  return method;
}

bool HomingSearch::active(double position) const noexcept {
  switch (method_.of) {
    case Switch::kNegative:
      return switches_.negativeAt(position);
    case Switch::kPositive:
      return switches_.positiveAt(position);
    case Switch::kHome:
      return switches_.homeAt(position);
    case Switch::kNone:
      break;
  }
  return false;
}

bool HomingSearch::fitted() const noexcept {
  if (method_.turns && !(method_.search < 0 ? switches_.negative : switches_.positive))
    return false;
  switch (method_.of) {
    case Switch::kNegative:
      return switches_.negative.has_value();
    case Switch::kPositive:
      return switches_.positive.has_value();
    case Switch::kHome:
      return switches_.hasHome();
    case Switch::kNone:
      break;
  }
  return true;
}

bool HomingSearch::atOtherLimit(double position) const noexcept {
  return direction_ < 0 ? method_.of != Switch::kNegative && switches_.negativeAt(position)
                        : method_.of != Switch::kPositive && switches_.positiveAt(position);
}

void HomingSearch::go(Leg leg) noexcept {
  leg_ = leg;
  switch (leg) {
    case Leg::kSearch:
      direction_ = method_.search;
      slow_ = false;
      break;
    case Leg::kLeave:
      direction_ = method_.edge;
      slow_ = !method_.rising;
      break;
    case Leg::kEnter:
      direction_ = -method_.edge;
      slow_ = true;
      break;
    case Leg::kStop:
      direction_ = method_.search;
      slow_ = false;
      break;
    case Leg::kIndex:
      slow_ = true;
      break;
  }
}

void HomingSearch::start(const std::optional<HomingMethod>& method,
                         const Switches& switches,
                         double position,
                         double revolution) noexcept {
  method_ = method.value_or(HomingMethod{});
  switches_ = switches;
  revolution_ = revolution;
  last_ = position;
  turned_ = false;
  state_ = method && fitted() ? State::kRunning : State::kError;
  if (state_ == State::kError)
    return;
  if (method_.of != Switch::kNone) {
    go(active(position) ? Leg::kLeave : Leg::kSearch);
  } else if (method_.stop) {
    go(Leg::kStop);
  } else if (method_.index) {
    direction_ = method_.search;
    go(Leg::kIndex);
  } else {
    state_ = State::kDone;
  }
}

void HomingSearch::findEdge() noexcept {
  if (method_.index) {
    go(Leg::kIndex);
  } else {
    state_ = State::kDone;
  }
}

void HomingSearch::search(double position) noexcept {
  if (active(position)) {
    go(Leg::kLeave);
  } else if (atOtherLimit(position)) {
    if (!method_.turns || turned_) {
      state_ = State::kError;
      return;
    }
    turned_ = true;
    direction_ = -direction_;
  }
}

void HomingSearch::step(double position, bool blocked) noexcept {
  if (state_ != State::kRunning)
    return;
  const double before = last_;
  last_ = position;
  const bool forward = (position - before) * direction_ > 0.0;
  if (blocked && leg_ == Leg::kStop) {
    direction_ = -direction_;
    findEdge();
    return;
  }
  if (blocked) {
    // A limit switch at the mechanical end turns the search round before the motor counts as blocked.
    state_ = State::kError;
    return;
  }
  switch (leg_) {
    case Leg::kSearch:
      return search(position);
    case Leg::kLeave:
      if (forward && active(before) && !active(position))
        method_.rising ? go(Leg::kEnter) : findEdge();
      else if (forward && atOtherLimit(position))
        state_ = State::kError;
      return;
    case Leg::kEnter:
      if (forward && !active(before) && active(position))
        findEdge();
      else if (forward && atOtherLimit(position))
        state_ = State::kError;
      return;
    case Leg::kStop:
      if (forward && atOtherLimit(position))
        state_ = State::kError;
      return;
    case Leg::kIndex: {
      const auto pulses = [&](double at) { return std::floor((at - switches_.index) / revolution_); };
      if (forward && pulses(before) != pulses(position))
        state_ = State::kDone;
      else if (forward && atOtherLimit(position))
        state_ = State::kError;
      return;
    }
  }
}

}  // namespace tandem::sim::drives
