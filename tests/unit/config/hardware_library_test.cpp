// SPDX-License-Identifier: Apache-2.0
/** @file Buses behind a library of one's own in hardware files. */
#include "hal/fieldbus.h"
#include "support.h"

namespace tandem::config::test {
namespace {

/// The preset with an absolute path to its robot, and its first bus behind this interface, at the slowest bit rate.
std::string slowBus(const std::string& interface) {
  const std::string text = replaced(readAll(presets() / "hardware/ark2024-two-buses.yaml"), "../robots/ark2024.yaml",
                                    (presets() / "robots/ark2024.yaml").string());
  return replaced(text, "\"unix:/tmp/tandem-bus-a\", bit_rate_kbit_per_s: 1000",
                  "\"" + interface + "\", bit_rate_kbit_per_s: 10");
}

TEST(HardwareLibrary, HasNoBusLoad) {
  const Folder folder;
  const std::string address = "library:/opt/lab/libboard.so,/dev/ttyUSB0";
  const hal::HardwareConfig hardware = loadHardware(folder.write("file.yaml", slowBus(address)));
  EXPECT_EQ(hardware.buses[0].address, address);
  EXPECT_TRUE(hal::inLibrary(hardware.buses[0]));
  EXPECT_FALSE(hal::inLibrary(hardware.buses[1]));
  EXPECT_NE(validate(folder.path() / "file.yaml").text.find("bus_a on " + address + "; bus_b on"), std::string::npos);
  EXPECT_THROW(loadHardware(folder.write("slow.yaml", slowBus("unix:/tmp/tandem-bus-a"))), Error);
}

TEST(HardwareLibrary, IsNamedByItsFullPath) {
  const Folder folder;
  for (const char* wrong : {"library:libboard.so", "library:", "library:/opt/my lab/a.so", "library:/a.so,"}) {
    try {
      loadHardware(folder.write("file.yaml", slowBus(wrong)));
      ADD_FAILURE() << wrong;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("library:/PATH,TEXT"), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace tandem::config::test
