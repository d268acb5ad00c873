// SPDX-License-Identifier: Apache-2.0
/** @file Worst-case load of a CAN bus, computed from the configuration.
 *
 * Classical frames with 11-bit identifiers and the most stuff bits that the protocol allows, after Davis, Burns, Bril
 * and Lukkien 2007, Controller Area Network (CAN) schedulability analysis: 8 n + 47 + floor((34 + 8 n - 1) / 4) bits
 * for n data bytes, interframe space included. */
#pragma once

#include <string>
#include <vector>

namespace tandem::hal {

/// Bits of the longest frame with so many data bytes (0 to 8).
int frameBits(int data_bytes) noexcept;

/** Frames of one kind on a bus. */
struct FrameStream {
  std::string what;                ///< for people: "RPDO of 6 drives"
  int data_bytes = 0;              ///< of each
  double frames_per_cycle = 0.0;   ///< cyclic traffic; 0 for what comes by the clock
  double frames_per_second = 0.0;  ///< traffic of its own rate: heartbeats
};

/** A bus as the calculator sees it. */
struct BusPlan {
  double bit_rate = 1e6;    ///< bit/s
  double period = 4e-3;     ///< s, of SYNC
  double load_limit = 0.6;  ///< share of the bit rate that may be used
  std::vector<FrameStream> streams;
};

/** What the calculator says. */
struct BusLoad {
  double frames_per_cycle = 0.0;  ///< cyclic ones
  double cycle_bits = 0.0;        ///< of the cyclic frames
  double cycle_time = 0.0;        ///< s that the cyclic frames need on the wire
  double load = 0.0;              ///< 0..1 and beyond, all traffic
  double shortest_period = 0.0;   ///< s at which the load is just at the limit; infinite where nothing helps
  bool fits = false;              ///< load <= limit
};
BusLoad computeLoad(const BusPlan& plan);

/** How a bus of drives and encoders is used by the HAL. */
struct BusTraffic {
  int drives = 0;
  int encoders = 0;
  int torques = 0;                        ///< drives whose feedback carries torque or current, 2 bytes more
  int inputs = 0;                         ///< drives that send their digital inputs 60FD in a PDO of their own
  int command_bytes = 6;                  ///< RPDO of a drive: controlword and target
  int feedback_bytes = 6;                 ///< TPDO of a drive: statusword and position
  int encoder_bytes = 6;                  ///< TPDO of an encoder: position and alarms
  double heartbeat_period = 0.05;         ///< of each node, s
  double master_heartbeat_period = 0.02;  ///< of the HAL, s
};
/// The streams of such a bus; parameter access (SDO) happens outside of operation and is left out.
std::vector<FrameStream> streamsOf(const BusTraffic& traffic);

/// Why a plan does not fit and what would: a longer period, fewer axes, a higher rate; or by how much it fits.
std::string explainLoad(const BusPlan& plan, const BusTraffic& traffic);

}  // namespace tandem::hal
