// SPDX-License-Identifier: Apache-2.0
/** @file One HAL axis with an independent CANopen drive and encoder (npm canopen, slave.js) on vcan0. */
#include <gtest/gtest.h>
#include <poll.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "config/config.h"
#include "hal/axis.h"
#include "hal/can/clock.h"
#include "hal/can/detail/socketcan.h"
#include "hal/cia402/canopen_bus.h"

namespace tandem::hal {
namespace {

/** The first axis of the preset, or of the file TANDEM_HARDWARE, on its own bus, in real time. */
class ForeignDrive : public testing::Test {
 protected:
  ForeignDrive() : hardware_(preset()), can_("vcan0"), bus_(can_, hardware_, 0, budgets()) {
    axis_ = std::make_unique<Axis>(hardware_, hardware_.axes[0], bus_, budgets());
  }

  static safety::Budgets budgets() {
    safety::Budgets budgets;
    budgets.drive_heartbeat = kTimeout;
    return budgets;
  }

  static HardwareConfig preset() {
    const char* const file = std::getenv("TANDEM_HARDWARE");
    HardwareConfig hardware =
        config::loadHardware(file != nullptr ? file : TANDEM_SOURCE "/config/presets/hardware/ark2024-two-buses.yaml");
    // A virtual machine with one slow processor, shared with an interpreter: budgets are tested elsewhere.
    hardware.period = 10e-3;
    hardware.feedback_budget = 1.0;
    hardware.axes[0].following_error = 5e-3;
    return hardware;
  }
  void period() {
    const std::int64_t next = can::monotonicNow() + static_cast<std::int64_t>(1e9 * hardware_.period);
    while (can::monotonicNow() < next) {
      pollfd source{can_.fd(), POLLIN, 0};
      poll(&source, 1, 1);
      bus_.receive(can::monotonicNow());
    }
    const std::int64_t now = can::monotonicNow();
    FieldbusEvent event;
    while (bus_.nextEvent(event)) {
    }
    axis_->update(now);
    if (step_)
      step_();
    axis_->writeCommand(now);
    bus_.transmit(now, false);
  }
  bool until(const std::function<bool()>& condition, double seconds = 20.0) {
    const std::int64_t end = can::monotonicNow() + static_cast<std::int64_t>(1e9 * seconds);
    while (!condition() && can::monotonicNow() < end && axis_->phase() != AxisPhase::kFailed)
      period();
    return condition();
  }
  std::string story() const {
    return std::string(name(axis_->phase())) + ", guards " + describeGuards(axis_->guards()) + "; " +
           driver().driveNode().describeFailure() + "; " + driver().encoderNode()->describeFailure();
  }

  const Cia402Driver& driver() const { return dynamic_cast<const Cia402Driver&>(axis_->driver()); }

  static constexpr double kTimeout = 1.0;  // s
  HardwareConfig hardware_;
  can::SocketCanBus can_;
  CanopenBus bus_;
  std::unique_ptr<Axis> axis_;
  std::function<void()> step_;
};

TEST_F(ForeignDrive, ComesUpMovesAndSwitchesOff) {
  bus_.start(can::monotonicNow());
  axis_->boot(can::monotonicNow());
  ASSERT_TRUE(until([&] { return axis_->phase() == AxisPhase::kReady; })) << story();
  for (const canopen::Node* node : {&driver().driveNode(), driver().encoderNode()})
    EXPECT_EQ(node->stepsDone(), static_cast<int>(node->steps().size())) << "all written, all read back";
  const double start = axis_->position();
  EXPECT_NEAR(start, axis_->encoderPosition(), 1e-5);

  axis_->hold();
  axis_->setGoal(PowerGoal::kOperation, can::monotonicNow());
  ASSERT_TRUE(until([&] { return axis_->goalReached() && axis_->followsCommand(); })) << story();
  EXPECT_NEAR(axis_->position(), start, 2.0 * AxisUnits(hardware_.axes[0].gearing).resolution())
      << "enabled without a jump";

  // 4 mm at 5 mm/s and back.
  axis_->setOperating(true);
  for (const double goal : {start + 4e-3, start}) {
    double target = axis_->target();
    constexpr double kSpeed = 5e-3;
    step_ = [&] {
      const double way = std::clamp(goal - target, -kSpeed * hardware_.period, kSpeed * hardware_.period);
      target += way;
      axis_->setTarget(target, way / hardware_.period);
    };
    EXPECT_TRUE(until([&] { return std::abs(axis_->position() - goal) < 1e-6; })) << axis_->position() << story();
    EXPECT_NEAR(axis_->encoderPosition(), goal, 1e-4);
    EXPECT_EQ(axis_->guards(), 0u) << story();
    step_ = nullptr;
  }
  axis_->setOperating(false);
  axis_->hold();
  axis_->setGoal(PowerGoal::kOff, can::monotonicNow());
  ASSERT_TRUE(until([&] { return axis_->goalReached(); })) << story();
  EXPECT_EQ(axis_->driveState(), DriveState::kSwitchOnDisabled);
  EXPECT_EQ(bus_.network().counters().total(), bus_.network().counters().received);
  EXPECT_EQ(driver().driveNode().tpdos()[0].bad_length, 0u);
  EXPECT_GT(driver().driveNode().tpdos()[0].count, 100u);
}

}  // namespace
}  // namespace tandem::hal
