// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <future>
#include <set>
#include <stdexcept>
#include <system_error>

#include "hal/drives/units.h"
#include "services/drive_sim/bus_spec.h"
#include "services/drive_sim/control_socket.h"
#include "services/drive_sim/report.h"
#include "tests/unit/support/drive_rig.h"

namespace tandem::drive_sim {
namespace {

TEST(BusSpec, ReadsDrivesAndEncoders) {
  const auto drive = parseDrive("7,serial=4711,start=-250,low=-1e3,high=2e3,max_velocity=9e4,incremental");
  EXPECT_EQ(drive.id, 7);
  EXPECT_EQ(drive.serial, 4711u);
  EXPECT_EQ(drive.start, -250.0);
  EXPECT_EQ(drive.motor.low, -1000.0);
  EXPECT_EQ(drive.motor.max_velocity, 9e4);
  EXPECT_TRUE(drive.incremental);
  EXPECT_EQ(parseDrive("7").serial, 1007u);
  const auto switches = parseDrive("7,negative_switch=-5,positive_switch=9,home_from=2,home_to=4,index=7").switches;
  EXPECT_EQ(switches.negative, -5.0);
  EXPECT_EQ(switches.positive, 9.0);
  EXPECT_TRUE(switches.homeAt(3.0) && !switches.homeAt(1.0) && !switches.homeAt(5.0));
  EXPECT_EQ(switches.index, 7.0);
  EXPECT_TRUE(parseDrive("7,home_from=2").switches.homeAt(1e6)) << "one edge";
  EXPECT_TRUE(parseDrive("7,home_to=2").switches.homeAt(-1e6));
  EXPECT_FALSE(parseDrive("7").switches.hasHome());
  const auto encoder = parseEncoder("17=7,ratio=-0.25,offset=12");
  EXPECT_EQ(encoder.id, 17);
  EXPECT_EQ(encoder.drive, 7);
  EXPECT_EQ(encoder.ratio, -0.25);
  EXPECT_EQ(encoder.offset, 12);
  for (const char* text : {"", "0", "128", "1.5", "x", "7,serial=-1", "7,low=5,high=4", "7,home_from=5,home_to=4",
                           "7,color=red", "7,start=", "7,"})
    EXPECT_THROW(parseDrive(text), std::invalid_argument) << text;
  for (const char* text : {"17", "17=", "=7", "17=7,ratio=x", "17=7,serial"})
    EXPECT_THROW(parseEncoder(text), std::invalid_argument) << text;
}

TEST(BusSpec, SimulatedBusStartsAtEncoderZero) {
  const hal::HardwareConfig hardware = config::loadHardware(HARDWARE_FILE);
  for (std::size_t b = 0; b < hardware.buses.size(); ++b) {
    sim::drives::BusSpec spec;
    addNodes(hardware, hardware.buses[b].name, spec);
    ASSERT_EQ(spec.drives.size(), 6u);
    ASSERT_EQ(spec.encoders.size(), 6u);
    hal::can::VirtualBus wire;
    sim::drives::DriveBus bus(wire.join("drives"), spec, 0);
    std::size_t checked = 0;
    for (const hal::AxisConfig& axis : hardware.axes) {
      if (axis.bus != static_cast<int>(b))
        continue;
      const hal::AxisUnits drive(axis.gearing), encoder(axis.encoder->gearing);
      EXPECT_EQ(spec.drives[checked].counts_per_revolution, axis.gearing.counts_per_revolution);
      EXPECT_EQ(spec.drives[checked].temperature.index, axis.temperature_index);
      ASSERT_EQ(bus.encoders()[checked]->id(), axis.encoder->node);
      EXPECT_EQ(bus.encoders()[checked]->position(), 0.0);
      // One count of the drive moves the encoder by the same joint distance.
      EXPECT_NEAR(spec.encoders[checked].ratio * encoder.scale(), drive.scale(), 1e-15);
      EXPECT_GE(spec.drives[checked].motor.max_velocity, 1.5 * std::abs(drive.toCountSpeed(axis.velocity)));
      ++checked;
    }
    EXPECT_EQ(checked, 6u);
  }
  sim::drives::BusSpec spec;
  EXPECT_THROW(addNodes(hardware, "bus_z", spec), std::invalid_argument);
}

TEST(BusSpec, TheStandardNodesHaveIdsOfTheirOwn) {
  sim::drives::BusSpec spec;
  addStandardNodes(spec);
  std::set<int> ids;
  for (const auto& drive : spec.drives)
    ids.insert(drive.id);
  for (const auto& encoder : spec.encoders)
    ids.insert(encoder.id);
  EXPECT_EQ(ids, (std::set<int>{1, 2, 3, 4, 5, 6, 17, 18, 19, 20, 21, 22}));
}

TEST(Report, ServesLines) {
  test::DriveRig rig(1);
  ASSERT_TRUE(rig.ready());
  EXPECT_EQ(serveLine(rig.drives, "inject 1 stuck"), "ok");
  EXPECT_NE(serveLine(rig.drives, "state").find("\"injected\":[\"stuck\"]"), std::string::npos);
  EXPECT_NE(serveLine(rig.drives, "state").find("\"state\":\"operation enabled\""), std::string::npos);
  EXPECT_EQ(serveLine(rig.drives, "clear 1 stuck"), "ok");
  EXPECT_EQ(serveLine(rig.drives, "clear 1 stuck"), "error: node 1 has no such fault");
  EXPECT_EQ(serveLine(rig.drives, "inject 17 slow"), "error: node 17 cannot have the fault slow");
  EXPECT_EQ(serveLine(rig.drives, "nonsense").find("error: 'nonsense', expected inject"), 0u);
  const double before = rig.drive().position();
  EXPECT_EQ(serveLine(rig.drives, "turn 1 -250"), "ok");
  EXPECT_EQ(rig.drive().position(), before - 250.0);
  EXPECT_EQ(serveLine(rig.drives, "turn 17 5"), "error: node 17 is no drive");
  EXPECT_NE(serveLine(rig.drives, "turn 1").find("expected a number of counts"), std::string::npos);
  EXPECT_EQ(serveLine(rig.drives, "turn 1 250"), "ok");
  rig.command().set(test::kTarget, 500);
  rig.run(0.2);
  EXPECT_GT(rig.drive().record().travel, 400.0);
  EXPECT_EQ(serveLine(rig.drives, "mark"), "ok");
  EXPECT_EQ(rig.drive().record().travel, 0.0);
}

TEST(ControlSocket, AsksAndAnswers) {
  const std::string path = testing::TempDir() + "tandem-control-" + std::to_string(getpid());
  EXPECT_THROW(askControl(path, "state"), std::system_error);
  ControlSocket socket(path);
  auto answer = std::async(std::launch::async, [&] { return askControl(path, "hello"); });
  while (answer.wait_for(std::chrono::milliseconds(1)) != std::future_status::ready)
    socket.poll([](const std::string& line) { return line + " yourself"; });
  EXPECT_EQ(answer.get(), "hello yourself");
}

}  // namespace
}  // namespace tandem::drive_sim
