// SPDX-License-Identifier: Apache-2.0
/** @file Electronic data sheets: objects are sorted and unique, limits are in order; errors and warnings have a line; a
 * simulated drive either runs with a data sheet or refuses it. */
#include "sim/drives/eds.h"

#include <sstream>

#include "hal/can/virtual_bus.h"
#include "sim/drives/drive_bus.h"
#include "tests/fuzz/harness.h"

using namespace tandem::sim::drives;

namespace {

void checkWarnings(const Eds& eds, std::string_view text) {
  const auto lines =
      static_cast<std::size_t>(1 + std::ranges::count_if(text, [](char c) { return c == '\n' || c == '\r'; }));
  for (const auto& warning : eds.warnings)
    tandem::fuzz::expect(warning.line >= 1 && warning.line <= lines, "a warning has a line of its file",
                         describe(eds, warning));
}

void check(const Eds& eds) {
  for (std::size_t i = 0; i < eds.objects.size(); ++i) {
    const EdsObject& object = eds.objects[i];
    tandem::fuzz::expect(i == 0 || eds.objects[i - 1].address < object.address, "objects are sorted, each once");
    const std::string name = tandem::hal::canopen::describe(object.address) + " " + object.name;
    tandem::fuzz::expect(!object.low || !object.high || *object.low <= *object.high, "limits are in order", name);
  }
}

void run(const Eds& eds) {
  tandem::hal::can::VirtualBus wire;
  auto& port = wire.join("drives");
  BusSpec spec;
  spec.drive_eds = eds;
  spec.encoder_eds = {};
  spec.drives.emplace_back();
  DriveBus drives(port, spec, 0);
  for (std::int64_t now = 1'000'000; now < 5'000'000; now += 1'000'000)
    drives.poll(now);
  tandem::fuzz::expect(drives.drives().front()->record().travel == 0.0, "a drive without master does not move");
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(tandem::fuzz::textOf(data, size));
  std::istringstream stream(text);
  try {
    const Eds eds = tandem::hal::canopen::parseEds(stream, "device.eds");
    checkWarnings(eds, text);
    check(eds);
    run(eds);
  } catch (const tandem::hal::canopen::IniError& error) {
    tandem::fuzz::expectPlace(error.what(), "device.eds", text);
  } catch (const std::invalid_argument& error) {
    tandem::fuzz::expect(std::strlen(error.what()) > 0, "a refused data sheet has a reason");
  }
  return 0;
}
