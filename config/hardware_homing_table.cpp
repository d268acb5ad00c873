// SPDX-License-Identifier: Apache-2.0
#include "config/detail/hardware_homing_table.h"

#include "config/detail/bind.h"
#include "hal/hardware.h"

namespace tandem::config {
namespace {

using enum Quantity;
constexpr double kLongestRun = 3600.0;  // s

}  // namespace

Mapping homingMapping(JointKind kind) {
  using H = hal::HomingConfig;
  return {
      kind.prefixed("homing"),
      "The homing run of a drive, CiA 402.",
      {
          integer(
              "method",
              "homing method of CiA 402-2, object 0x6098: 17 and 18 limit switch, 19 to 30 home switch, 1 to 14 the "
              "same with index pulse, 33 and 34 index pulse, 37 present position; negative: of the manufacturer, if "
              "the "
              "profile of the drive names it",
              &H::method)
              .required()
              .within(-128, 127),
          positive("fast", kind.speed(), "speed towards the switch; at most `velocity`", &H::fast).required(),
          positive("slow", kind.speed(), "speed off the switch, or to the index; at most `velocity`", &H::slow)
              .required(),
          positive("acceleration", kind.acceleration(), "acceleration of the homing run", &H::acceleration).required(),
          integer("order", "axes with the same number run together, smaller numbers first", &H::order).within(0, 64),
          positive("budget", kTime, "longest duration of the homing run", &H::budget).atMost(kLongestRun),
      }};
}

Mapping hardStopMapping(JointKind kind) {
  using H = hal::HardStopConfig;
  using R = hal::HomingConfig;
  return {
      kind.prefixed("hard_stop"),
      "A run against a mechanical stop, with the drive's torque limited (object 0x6072). The stop is where the joint "
      "stands although the drive pushes with the limit.",
      {
          text("direction", "direction of the joint in which the stop is", {{"negative", false}, {"positive", true}},
               &hal::AxisConfig::hard_stop, &H::positive)
              .required(),
          positive("speed", kind.speed(),
                   "speed towards the stop; at most `velocity`, and half of `following_error` in `time`",
                   &hal::AxisConfig::hard_stop, &H::speed)
              .required(),
          number("torque_per_mille", kNone, "torque limit of the run, in thousandths of the rated torque (0x6076)")
              .required()
              .within(10, 1000),
          number("time", kTime, "time at standstill with this torque after which the stop is found",
                 &hal::AxisConfig::hard_stop, &H::time)
              .within(0.02, 5.0),
          integer("order", "axes with the same number run together, smaller numbers first", &hal::AxisConfig::homing,
                  &R::order)
              .within(0, 64),
          positive("budget", kTime, "longest duration of the run", &hal::AxisConfig::homing, &R::budget)
              .atMost(kLongestRun),
      }};
}

}  // namespace tandem::config
