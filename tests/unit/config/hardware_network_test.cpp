// SPDX-License-Identifier: Apache-2.0
/** @file Hardware files: what the nodes of a bus and the HAL agree on. */
#include "hal/hardware.h"
#include "support.h"

namespace tandem::config::test {
namespace {

/// The preset with an absolute path to its robot, so that it loads from anywhere.
std::string twoBuses() {
  return replaced(readAll(presets() / "hardware/ark2024-two-buses.yaml"), "../robots/ark2024.yaml",
                  (presets() / "robots/ark2024.yaml").string());
}

hal::HardwareConfig loadNetwork(const std::string& text) {
  const Folder folder;
  return loadHardware(folder.write("file.yaml", text));
}

TEST(HardwareNetwork, ABusHasASyncCounterAndDrivesAreGuardedWhereTheFileAsks) {
  const std::string bus = "bit_rate_kbit_per_s: 1000}\n  - {name: bus_b";
  const auto counting = [&](const std::string& value) {
    return replaced(twoBuses(), bus, "bit_rate_kbit_per_s: 1000, sync_counter: " + value + "}\n  - {name: bus_b");
  };
  const hal::HardwareConfig plain = loadHardware(presets() / "hardware/ark2024-two-buses.yaml");
  EXPECT_EQ(plain.buses[0].sync_counter, 0);
  const hal::HardwareConfig counted = loadNetwork(counting("240"));
  EXPECT_EQ(counted.buses[0].sync_counter, 240);
  EXPECT_EQ(counted.buses[1].sync_counter, 0);
  const auto bits = [](const hal::HardwareConfig& hardware) {
    return hal::computeLoad(hardware.planOf(0, 0.1)).cycle_bits;
  };
  EXPECT_EQ(bits(counted) - bits(plain), hal::frameBits(1) - hal::frameBits(0));
  for (const char* wrong : {"1", "241", "-2", "two"})
    EXPECT_THROW(loadNetwork(counting(wrong)), Error) << wrong;
  // Two frames per request, three requests within the drives' time-out, instead of a heartbeat.
  const std::string key = "holds_without_power: self_locking\n";
  const hal::HardwareConfig guarded = loadNetwork(replaced(twoBuses(), key, key + "      watch: node_guarding\n"));
  EXPECT_EQ(guarded.axes[0].watch, hal::MutualWatch::kNodeGuarding);
  EXPECT_EQ(guarded.axes[3].watch, hal::MutualWatch::kHeartbeat);
  const auto rate = [](const hal::HardwareConfig& hardware) {
    double bits_per_second = 0.0;
    for (const hal::FrameStream& stream : hardware.planOf(0, 0.1).streams) {
      if (stream.what != "SDO requests and answers")  // take what is left
        bits_per_second += stream.frames_per_second * hal::frameBits(stream.data_bytes);
    }
    return bits_per_second;
  };
  EXPECT_NEAR(rate(guarded) - rate(plain),
              3 * ((hal::frameBits(0) + hal::frameBits(1)) / 0.033 - hal::frameBits(1) / plain.node_heartbeat), 1.0);
}

}  // namespace
}  // namespace tandem::config::test
