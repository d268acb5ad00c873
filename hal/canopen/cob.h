// SPDX-License-Identifier: Apache-2.0
/** @file Identifiers of CANopen frames (CiA 301, predefined connection set), NMT and heartbeat. */
#pragma once

#include <cstdint>
#include <string_view>

#include "hal/can/frame.h"

namespace tandem::hal::canopen {

using can::CanFrame;

inline constexpr int kMaxNodeId = 127;

namespace cob {
inline constexpr std::uint32_t kNmt = 0x000;
inline constexpr std::uint32_t kSync = 0x080;
inline constexpr std::uint32_t kEmcy = 0x080;  ///< + node
inline constexpr std::uint32_t kTime = 0x100;
inline constexpr std::uint32_t kSdoAnswer = 0x580;      ///< + node, server to client
inline constexpr std::uint32_t kSdoRequest = 0x600;     ///< + node, client to server
inline constexpr std::uint32_t kHeartbeat = 0x700;      ///< + node
inline constexpr std::uint32_t kInvalid = 0x80000000;   ///< bit of a PDO's COB-ID: not used
inline constexpr std::uint32_t kNoRemote = 0x40000000;  ///< bit of a TPDO's COB-ID: no remote frames
inline constexpr std::uint32_t kExtended = 0x20000000;  ///< 29-bit identifier
/// PDO `number` (1..4) of a node.
constexpr std::uint32_t tpdo(int number, int node) { return 0x080u + 0x100u * number + node; }
constexpr std::uint32_t rpdo(int number, int node) { return 0x100u + 0x100u * number + node; }
}  // namespace cob

/** Commands of an NMT frame. */
enum class NmtCommand : std::uint8_t {
  kStart = 1,
  kStop = 2,
  kPreOperational = 128,
  kResetNode = 129,
  kResetCommunication = 130,
};

/** State byte of a heartbeat. */
enum class NmtState : std::uint8_t {
  kBootUp = 0,
  kStopped = 4,
  kOperational = 5,
  kPreOperational = 127,
  kUnknown = 255,  ///< not a value on the wire: no heartbeat received yet
};
std::string_view name(NmtState state);  ///< "pre-operational" ...

/// @param node 0: all nodes.
CanFrame nmtFrame(NmtCommand command, int node) noexcept;
CanFrame heartbeatFrame(int node, NmtState state) noexcept;
/// @param counter 0: no counter; else 1..240.
CanFrame syncFrame(std::uint8_t counter, std::uint32_t id = cob::kSync) noexcept;

}  // namespace tandem::hal::canopen
