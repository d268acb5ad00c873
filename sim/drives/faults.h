// SPDX-License-Identifier: Apache-2.0
/** @file Faults that can be injected into a running simulated bus. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace tandem::sim::drives {

/** Kinds of faults. `value` is that of the Injection; 0 selects the default in brackets. */
enum class FaultKind : std::uint8_t {
  kOff,              ///< node has no power
  kStuck,            ///< drive: rotor blocked; encoder: reading frozen
  kGarbage,          ///< position readings are random
  kWrong,            ///< position readings are off by `value` counts [5000]
  kSlow,             ///< drive reaches only this share of its speed [0.2]
  kDelayed,          ///< frames of the node leave `value` ms late [20]
  kIntermittent,     ///< intermittently off the bus: off for `value` ms, then on for as long [200]
  kOverCurrent,      ///< drive: fault 2310
  kOverTemperature,  ///< drive: winding too hot, fault 4310
  kEncoderAlarm,     ///< encoder: alarm bit and emergency; drive: fault 7305 of its motor encoder
  kFrameLoss,        ///< frames to and from the node are lost with this probability [0.1]; node 0: of all nodes
  kByteFlips,        ///< a bit of a frame from the node flips with this probability per frame [0.1]
  kBusOff,           ///< node 0: the master's controller reports bus-off and the bus is dead until the fault is cleared
  kBabbling,         ///< node sends `value` frames per second of highest priority [2000]
  kRunaway,          ///< drive: the motor runs at this share of its largest speed, whatever the command [1]
  kBrakeFailure,     ///< drive: its brake does not hold
  kEmergencyStop,    ///< drive: STO, and its input falls; node 0: of all drives, like the chain of a real robot
  kOverload,         ///< drive: the joint needs `value` per mille of the rated torque more, but still follows [900]
};
inline constexpr int kFaultKinds = 18;
std::string_view name(FaultKind kind);  ///< "off", "over_current" ...
std::optional<FaultKind> faultFromName(std::string_view name);

struct Injection {
  FaultKind kind = FaultKind::kOff;
  std::uint8_t node = 0;  ///< 0: the bus, or every node
  double value = 0.0;     ///< 0: the default
  double duration = 0.0;  ///< s; 0: until cleared
};

/** Command to a running simulation. */
struct FaultCommand {
  enum class Kind : std::uint8_t { kInject, kClear, kState, kMark, kTurn };
  Kind kind = Kind::kState;
  Injection injection;             ///< kInject
  std::optional<FaultKind> fault;  ///< kClear: empty means all
  std::uint8_t node = 0;           ///< kClear, kTurn
  double counts = 0.0;             ///< kTurn
};

/** Parses "inject NODE FAULT [VALUE] [for SECONDS]", "clear NODE [FAULT]", "state", "mark" or "turn NODE COUNTS" (by
 * hand).
 * @throw std::invalid_argument with the expected form. */
FaultCommand parseFaultCommand(const std::string& line);

}  // namespace tandem::sim::drives
