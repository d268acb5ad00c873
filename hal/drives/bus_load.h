// SPDX-License-Identifier: Apache-2.0
/** @file Worst-case load of a CAN bus, computed from the configuration.
 *
 * Classical frames with 11-bit identifiers and the most stuff bits that the protocol allows, after Davis, Burns, Bril
 * and Lukkien 2007, Controller Area Network (CAN) schedulability analysis: 8 n + 47 + floor((34 + 8 n - 1) / 4) bits
 * for n data bytes, interframe space included. */
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace tandem::hal {

/// Bits of the longest frame with so many data bytes (0 to 8).
int frameBits(int data_bytes) noexcept;
/// Bits of so many of these frames, with so many data bytes together.
double trafficBits(std::uint64_t frames, std::uint64_t data_bytes) noexcept;

/** Frames of one kind on a bus. */
struct FrameStream {
  std::string what;                ///< description: "RPDO of 6 drives"
  int data_bytes = 0;              ///< of each
  double frames_per_cycle = 0.0;   ///< cyclic traffic; 0 for traffic at a fixed rate
  double frames_per_second = 0.0;  ///< traffic at a fixed rate: heartbeats
};

/** Input of the load computation for one bus. */
struct BusPlan {
  double bit_rate = 1e6;    ///< bit/s
  double period = 4e-3;     ///< s, of SYNC
  double load_limit = 0.6;  ///< share of the bit rate that may be used
  std::vector<FrameStream> streams;
};

/** Result of the load computation. */
struct BusLoad {
  double frames_per_cycle = 0.0;  ///< cyclic frames only
  double cycle_bits = 0.0;        ///< of the cyclic frames
  double cycle_time = 0.0;        ///< time of the cyclic frames on the wire, s
  double load = 0.0;              ///< 0..1 and beyond, all traffic
  double shortest_period = 0.0;   ///< shortest period with a load within the limit, s; infinite: there is none
  bool fits = false;              ///< load <= limit
};
BusLoad computeLoad(const BusPlan& plan);

/** Use of a bus with drives and encoders by the HAL. */
struct BusTraffic {
  int drives = 0;
  int encoders = 0;
  int guarded = 0;     ///< drives with node guarding instead of a heartbeat
  int sync_bytes = 0;  ///< 1: SYNC has a counter
  /// PDOs to and from the drives in each period, by their number of data bytes (cyclic_objects.h).
  std::array<double, 9> commands{}, feedback{};
  int encoder_bytes = 6;                  ///< TPDO of an encoder: position and alarms
  double guard_period = 0.033;            ///< of the requests to each guarded drive, s
  double heartbeat_period = 0.05;         ///< of each node, s
  double master_heartbeat_period = 0.02;  ///< of the HAL, s
  /// Shortest time between two SDO requests while an arm moves, s: temperatures, the set-up of another arm's nodes.
  double request_interval = 0.04;
};
/// Streams of such a bus.
std::vector<FrameStream> streamsOf(const BusTraffic& traffic);

/// Reason why a plan does not fit, with remedies (a longer period, fewer axes, a higher rate); or its reserve if it
/// fits.
std::string explainLoad(const BusPlan& plan, const BusTraffic& traffic);

}  // namespace tandem::hal
