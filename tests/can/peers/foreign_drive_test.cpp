// SPDX-License-Identifier: Apache-2.0
/** @file One HAL axis with an independent CANopen drive and encoder (npm canopen, slave.js) on vcan0. */
#include <gtest/gtest.h>
#include <poll.h>

#include <algorithm>
#include <cmath>

#include "config/config.h"
#include "hal/axis.h"
#include "hal/can/clock.h"
#include "hal/can/detail/socketcan.h"

namespace tandem::hal {
namespace {

/** The first axis of the preset, on its own bus, in real time. */
class ForeignDrive : public testing::Test {
 protected:
  ForeignDrive() : hardware_(preset()), bus_("vcan0"), network_(bus_, options()) {
    safety::Budgets budgets;
    budgets.drive_heartbeat = kTimeout;
    axis_ = std::make_unique<Axis>(hardware_, hardware_.axes[0], network_, budgets);
  }

  static HardwareConfig preset() {
    HardwareConfig hardware =
        config::loadHardware(std::filesystem::path(TANDEM_SOURCE) / "config/presets/hardware/ark2024-two-buses.yaml");
    // A virtual machine with one slow processor, shared with an interpreter: budgets are tested elsewhere.
    hardware.period = 10e-3;
    hardware.feedback_budget = 1.0;
    hardware.axes[0].following_error = 5e-3;
    return hardware;
  }
  canopen::NetworkOptions options() const {
    canopen::NetworkOptions options;
    options.own_id = static_cast<std::uint8_t>(hardware_.buses[0].node_id);
    return options;
  }

  void period() {
    const std::int64_t next = can::monotonicNow() + static_cast<std::int64_t>(1e9 * hardware_.period);
    while (can::monotonicNow() < next) {
      pollfd source{bus_.fd(), POLLIN, 0};
      poll(&source, 1, 1);
      network_.receive(can::monotonicNow());
    }
    const std::int64_t now = can::monotonicNow();
    canopen::NetworkEvent event;
    while (network_.nextEvent(event)) {
      if (event.kind == canopen::NetworkEvent::Kind::kEmcy)
        axis_->onEmcy(event.node, event.emcy);
    }
    axis_->update(now);
    if (step_)
      step_();
    axis_->writeCommand(now);
    network_.transmit(now, {true, true});
  }
  bool until(const std::function<bool()>& condition, double seconds = 20.0) {
    const std::int64_t end = can::monotonicNow() + static_cast<std::int64_t>(1e9 * seconds);
    while (!condition() && can::monotonicNow() < end && axis_->phase() != AxisPhase::kFailed)
      period();
    return condition();
  }
  std::string story() const {
    return std::string(name(axis_->phase())) + ", guards " + describeGuards(axis_->guards()) + "; " +
           axis_->driveNode().describeFailure() + "; " + axis_->encoderNode()->describeFailure();
  }

  static constexpr double kTimeout = 1.0;  // s
  HardwareConfig hardware_;
  can::SocketCanBus bus_;
  canopen::Network network_;
  std::unique_ptr<Axis> axis_;
  std::function<void()> step_;
};

TEST_F(ForeignDrive, ComesUpMovesAndSwitchesOff) {
  network_.setHeartbeat(true);
  axis_->boot(can::monotonicNow());
  ASSERT_TRUE(until([&] { return axis_->phase() == AxisPhase::kReady; })) << story();
  for (const canopen::Node* node : {&std::as_const(*axis_).driveNode(), axis_->encoderNode()})
    EXPECT_EQ(node->stepsDone(), static_cast<int>(node->steps().size())) << "all written, all read back";
  const double start = axis_->position();
  EXPECT_NEAR(start, axis_->encoderPosition(), 1e-5);

  axis_->hold();
  axis_->setGoal(PowerGoal::kOperation, can::monotonicNow());
  ASSERT_TRUE(until([&] { return axis_->goalReached() && axis_->followsCommand(); })) << story();
  EXPECT_NEAR(axis_->position(), start, 2.0 * axis_->units().resolution()) << "enabled without a jump";

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
  EXPECT_EQ(network_.counters().total(), network_.counters().received);
  EXPECT_EQ(axis_->driveNode().tpdos()[0].bad_length, 0u);
  EXPECT_GT(axis_->driveNode().tpdos()[0].count, 100u);
}

}  // namespace
}  // namespace tandem::hal
