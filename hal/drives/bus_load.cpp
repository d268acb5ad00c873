// SPDX-License-Identifier: Apache-2.0
#include "hal/drives/bus_load.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

namespace tandem::hal {

int frameBits(int data_bytes) noexcept { return 8 * data_bytes + 47 + (34 + 8 * data_bytes - 1) / 4; }

/// frameBits() is linear: 8 data bits of a byte, and two more stuff bits.
double trafficBits(std::uint64_t frames, std::uint64_t data_bytes) noexcept {
  const int per_byte = frameBits(1) - frameBits(0);
  return static_cast<double>(frames) * frameBits(0) + static_cast<double>(data_bytes) * per_byte;
}

BusLoad computeLoad(const BusPlan& plan) {
  BusLoad result;
  double own_rate = 0.0;  // bit/s of the traffic that does not depend on the period
  for (const FrameStream& stream : plan.streams) {
    result.frames_per_cycle += stream.frames_per_cycle;
    result.cycle_bits += stream.frames_per_cycle * frameBits(stream.data_bytes);
    own_rate += stream.frames_per_second * frameBits(stream.data_bytes);
  }
  result.cycle_time = result.cycle_bits / plan.bit_rate;
  result.load = (result.cycle_bits / plan.period + own_rate) / plan.bit_rate;
  const double left = plan.load_limit * plan.bit_rate - own_rate;
  result.shortest_period = left > 0.0 ? result.cycle_bits / left : std::numeric_limits<double>::infinity();
  result.fits = result.load <= plan.load_limit;
  return result;
}

std::vector<FrameStream> streamsOf(const BusTraffic& traffic) {
  const auto of = [](int count, const char* kind) { return std::to_string(count) + " " + kind; };
  const int nodes = traffic.drives + traffic.encoders - traffic.guarded;
  std::vector<FrameStream> streams{{"SYNC", traffic.sync_bytes, 1.0, 0.0}};
  const auto add = [&](const std::string& what, const std::array<double, 9>& frames) {
    for (std::size_t bytes = 0; bytes < frames.size(); ++bytes) {
      if (frames[bytes] > 0.0)
        streams.push_back({what, static_cast<int>(bytes), frames[bytes], 0.0});
    }
  };
  add("commands to " + of(traffic.drives, "drives"), traffic.commands);
  add("feedback of " + of(traffic.drives, "drives"), traffic.feedback);
  streams.push_back({"positions of " + of(traffic.encoders, "encoders"), traffic.encoder_bytes,
                     static_cast<double>(traffic.encoders), 0.0});
  streams.push_back({"heartbeats of " + of(nodes, "nodes"), 1, 0.0, nodes / traffic.heartbeat_period});
  if (traffic.guarded > 0) {
    const double rate = traffic.guarded / traffic.guard_period;
    streams.push_back({"guarding of " + of(traffic.guarded, "drives"), 0, 0.0, rate});
    streams.push_back({"answers of " + of(traffic.guarded, "drives"), 1, 0.0, rate});
  }
  streams.push_back({"heartbeat of the HAL", 1, 0.0, 1.0 / traffic.master_heartbeat_period});
  streams.push_back({"SDO requests and answers", 8, 0.0, 2.0 / traffic.request_interval});
  return streams;
}

namespace {

/// Largest number of drives like these, each with an encoder if the plan has any, that fits at the present period and
/// rate.
int mostAxes(BusPlan plan, const BusTraffic& traffic) {
  constexpr int kMost = 63;  // two nodes each, of 127
  BusTraffic other = traffic;
  int most = 0;
  for (int n = 1; n <= kMost && traffic.drives > 0; ++n) {
    const double share = static_cast<double>(n) / traffic.drives;
    other.drives = n;
    other.encoders = traffic.encoders > 0 ? n : 0;
    other.guarded = static_cast<int>(std::ceil(share * traffic.guarded));
    for (std::size_t bytes = 0; bytes < traffic.commands.size(); ++bytes) {
      other.commands[bytes] = share * traffic.commands[bytes];
      other.feedback[bytes] = share * traffic.feedback[bytes];
    }
    plan.streams = streamsOf(other);
    if (computeLoad(plan).fits)
      most = n;
  }
  return most;
}

}  // namespace

std::string explainLoad(const BusPlan& plan, const BusTraffic& traffic) {
  const BusLoad load = computeLoad(plan);
  std::array<char, 320> text{};
  if (load.fits) {
    std::snprintf(text.data(), text.size(),
                  "%.1f %% of %.0f kbit/s at %.3g ms, limit %.0f %%; the shortest period within it is %.3g ms",
                  100.0 * load.load, 1e-3 * plan.bit_rate, 1e3 * plan.period, 100.0 * plan.load_limit,
                  1e3 * load.shortest_period);
    return text.data();
  }
  const int most = mostAxes(plan, traffic);
  std::snprintf(text.data(), text.size(),
                "%.1f %% of %.0f kbit/s at %.3g ms, over the limit of %.0f %%; what would fit: a period of %.3g ms or "
                "more, or at most %d axes%s at this period, or a bit rate of %.0f kbit/s (1000 is the highest)",
                100.0 * load.load, 1e-3 * plan.bit_rate, 1e3 * plan.period, 100.0 * plan.load_limit,
                1e3 * load.shortest_period, most, traffic.encoders > 0 ? " with encoders" : "",
                std::ceil(1e-3 * plan.bit_rate * load.load / plan.load_limit));
  return text.data();
}

}  // namespace tandem::hal
