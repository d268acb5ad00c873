// SPDX-License-Identifier: Apache-2.0
/** @file Node setup: SDO accesses between boot-up and start. */
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "hal/canopen/sdo.h"

namespace tandem::hal::canopen {

/** One SDO access. */
struct SetupStep {
  enum class Kind : std::uint8_t {
    kWrite,        ///< write without read-back
    kWriteVerify,  ///< write and read back: the same bits under `mask`
    kCheck,        ///< read: must be `value` under `mask`
    kRead,         ///< read and store: Node::readValue()
    kAwait,        ///< read repeatedly until it is `value` under `mask`
  };
  Kind kind = Kind::kWriteVerify;
  ObjectAddress object;
  int size = 0;  ///< bytes, 1..8; a number read that does not fit is an error. Reads: 0 = any
  std::uint64_t value = 0;
  std::uint64_t mask = ~std::uint64_t{0};
  std::uint64_t tolerance = 0;  ///< largest difference to `value`, as signed numbers, instead of equal bits
  std::string what;             ///< description: "quick stop option"
  bool is_signed = false;       ///< messages show the number with its sign; of a negative one in any case
  bool optional = false;        ///< skipped if the node does not have the object
  bool dispensable = false;     ///< of a write: skipped, too, if the object does not take the value
  bool late = false;            ///< of kAwait: the next step follows after its time-out, too
  /// Bits, defined by the caller, of what is lost without this step, which then is optional. It is also skipped if the
  /// object is read-only or refuses the value; nothing is lost if it has the value already.
  std::uint32_t protections = 0;
  std::vector<std::uint64_t> refused{};  ///< of kCheck: if there are any, every other value passes
  std::int64_t timeout = 1'000'000'000;  ///< of kAwait, ns

  bool writes() const noexcept { return kind == Kind::kWrite || kind == Kind::kWriteVerify; }
  /// kCheck, kAwait, read-back: this number is what is expected.
  bool passes(std::uint64_t number) const noexcept;
};

/// Negative numbers keep their two's complement in `size` bytes.
SetupStep write(ObjectAddress object, std::int64_t value, int size, std::string what);      ///< kWriteVerify
SetupStep writeOnly(ObjectAddress object, std::int64_t value, int size, std::string what);  ///< kWrite
SetupStep check(ObjectAddress object, std::int64_t value, int size, std::string what);      ///< kCheck
SetupStep checkBits(ObjectAddress object, std::uint64_t value, std::uint64_t mask, int size, std::string what);
SetupStep read(ObjectAddress object, int size, std::string what);  ///< kRead

/** Identity; fields with value 0 are not checked. */
struct Identity {
  std::uint32_t device_type = 0;  ///< object 1000; profile in the low word: 402, 406
  std::uint32_t vendor = 0;       ///< 1018:1
  std::uint32_t product = 0;      ///< 1018:2
  std::uint32_t revision = 0;     ///< 1018:3
  std::uint32_t serial = 0;       ///< 1018:4
};
std::vector<SetupStep> identitySteps(const Identity& identity);

/** Mutual monitoring of master and node, by heartbeats or by node guarding. Times in ms, 0: none. */
struct Guarding {
  std::uint8_t our_id = 127;
  std::uint16_t our_heartbeat_timeout = 100;  ///< the node's time-out for our heartbeat: 1016:1
  std::uint16_t node_heartbeat = 25;          ///< the node's own period: 1017
  std::uint16_t guard_time = 0;               ///< period of the requests of node guarding, instead of both: 100C
  std::uint8_t life_factor = 0;               ///< guard times until the node notices their end: 100D
  std::uint8_t error_behaviour = 0;           ///< 1029:1: 0 pre-operational, 1 none, 2 stopped
  std::uint32_t protections = 0;              ///< lost if the node does not watch our heartbeat (SetupStep)
};
std::vector<SetupStep> guardingSteps(const Guarding& guarding);

}  // namespace tandem::hal::canopen
