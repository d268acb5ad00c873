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

TEST(HardwareNetwork, SyncCounterAndNodeGuardingAreAsInTheFile) {
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

TEST(HardwareNetwork, AnAxisAcceptsTheLossOfProtectionsWithAReason) {
  const std::string first = "{arm: arm_a, tube: 1, bus: bus_a, node: 1,";
  const auto with = [&](const std::string& entry) {
    return replaced(twoBuses(), first, first + " accept: [" + entry + "],");
  };
  const hal::HardwareConfig hardware = loadNetwork(with("{protection: heartbeat_watch, reason: 'a relay'}"));
  ASSERT_EQ(hardware.axes[0].accepted.size(), 1u);
  EXPECT_EQ(hardware.axes[0].accepted[0].protection, hal::Protection::kHeartbeatWatch);
  EXPECT_EQ(hardware.axes[0].accepted[0].reason, "a relay");
  EXPECT_TRUE(hardware.axes[1].accepted.empty());
  const auto expect = [&](const std::string& entry, std::size_t offset, const std::string& place,
                          const std::string& message) {
    expectRefusal(
        twoBuses(),
        {first, first + " accept: [" + entry + "],", entry, offset, "translations[0].axes[0].accept" + place, message},
        [](const auto& file) { loadHardware(file); });
  };
  const auto refused = [&](const std::string& entry, std::size_t offset, const std::string& key,
                           const std::string& message) { expect(entry, offset, "[0]." + key, message); };
  refused("{protection: luck, reason: x}", 13, "protection",
          "found the text \"luck\", expected one of command_deadline");
  refused("{protection: heartbeat_watch}", 0, "reason", "the key is missing");
  refused("{protection: heartbeat_watch, reason: '  '}", 38, "reason", "found nothing but blanks");
  const std::string twice = "{protection: heartbeat_watch, reason: a relay}, {protection: heartbeat_watch, reason: b}";
  expect(twice, 61, "[1].protection", "found heartbeat_watch a second time");
}

/// `tandem validate` foretells what tandem-hal will refuse, from the profiles of the drives.
TEST(HardwareNetwork, ProfilesNameTheLossesThatAFileHasToAccept) {
  const Folder folder;
  const auto summary_of = [&](const std::string& profile, const std::string& accepted) {
    std::string text = replaced(twoBuses(), "period_ms: 4", "period_ms: 8");  // room for drives with more PDOs
    if (!profile.empty())
      text = replaced(text, "  - drive:\n", "  - drive:\n      profile: " + profile + "\n      mode: pv\n");
    const std::string axis = "{arm: arm_a, tube: 1, bus: bus_a, node: 1,";
    if (!accepted.empty())
      text = replaced(text, axis, axis + " accept: [" + accepted + "],");
    return validate(folder.write("hardware.yaml", text));
  };
  const Summary none = summary_of("", "");
  EXPECT_TRUE(none.warnings.empty());
  EXPECT_EQ(none.text.find("lack"), std::string::npos) << none.text;
  // What costs no watch and no stop has to be known, but not accepted.
  const Summary mc3 = summary_of("mc3", "");
  EXPECT_TRUE(mc3.warnings.empty());
  EXPECT_NE(mc3.text.find("by their profile 6 axes may lack command_deadline (1400:05), speed_limit"),
            std::string::npos)
      << mc3.text;
  const Summary ipos = summary_of("ipos", "");
  ASSERT_EQ(ipos.warnings.size(), 12u) << "two sets of protections of six axes";
  EXPECT_NE(ipos.warnings[0].find("arm_a translation 1: the profile of its drive lacks connection_reaction (6007)"),
            std::string::npos)
      << ipos.warnings[0];
  EXPECT_EQ(summary_of("ipos", "{protection: connection_reaction, reason: x}").warnings.size(), 11u);
  const Summary both =
      summary_of("ipos", "{protection: connection_reaction, reason: x}, {protection: quick_stop_ramp, reason: x}");
  EXPECT_EQ(both.warnings.size(), 10u);
  for (const std::string& warning : both.warnings)
    EXPECT_EQ(warning.find("arm_a translation 1:"), std::string::npos) << warning;
}

/// What the presets permit their simulated drives on a busy host is copied with them.
TEST(HardwareNetwork, AWideFirstMotionOfRealDrivesIsAWarning) {
  const Folder folder;
  const auto warnings_of = [&](const std::string& text) { return validate(folder.write("real.yaml", text)).warnings; };
  const std::string real = replaced(replaced(readAll(presets() / "hardware/handheld.yaml"), "simulated: true\n", ""),
                                    "../robots/handheld.yaml", (presets() / "robots/handheld.yaml").string());
  const std::vector<std::string> found = warnings_of(real);
  ASSERT_EQ(found.size(), 4u);
  EXPECT_EQ(found[0],
            "arm translation 1: first_motion is 1 mm, expected at most 0.2 mm for real drives: with a wrong unit the "
            "first motion may go that far");
  EXPECT_EQ(found[3].find("arm rotation 2: first_motion is 5 deg, expected at most 0.5 deg"), 0u) << found[3];
  EXPECT_TRUE(warnings_of(replaced(replaced(real, "first_motion_mm: 1", "first_motion_mm: 0.2"), "first_motion_deg: 5",
                                   "first_motion_deg: 0.5"))
                  .empty());
}

}  // namespace
}  // namespace tandem::config::test
