// SPDX-License-Identifier: Apache-2.0
/** @file Homing requests: only the lease owner can start homing runs. */
#include <fmt/format.h>

#include "services/hal/hal_core.h"
#include "services/hal/homing_log.h"
#include "tests/unit/hal_robot/robot_fixture.h"
#include "tests/unit/services/system.h"

namespace tandem::test {
namespace {

using dds::ControlKind;
using dds::ReplyCode;

constexpr std::uint64_t kHolder = 7, kOther = 8;

/** The linear stages of the first arm require homing. */
class HomingSystem {
 public:
  explicit HomingSystem(const hal::HardwareConfig& hardware = hal::test::homingHardware()) : hardware_(hardware) {
    for (int b = 0; b < static_cast<int>(hardware_.buses.size()); ++b) {
      wires_.push_back(std::make_unique<hal::test::Wire>(hardware_, b, now_));
      buses_.push_back(&wires_.back()->master);
    }
    hal_.emplace(of_hal_, hardware_, hal::canopenBuses(hardware_, buses_, of_hal_.deployment.budgets));
    hal_->start(now_);
    run(3.0);
  }

  void run(double seconds, std::uint64_t keeper = 0) {
    const auto ticks = static_cast<int>(1e3 * seconds);
    for (int i = 0; i < ticks; ++i) {
      now_ += 1'000'000;
      for (auto& wire : wires_) {
        wire->bus.now = now_;
        wire->drives->poll(now_);
      }
      if (i % 4 == 0)
        hal_->step(now_);
      if (i % 10 == 0 && commanding)
        cycle(keeper);
    }
  }
  ReplyCode sendRequest(std::uint64_t client, ControlKind kind) {
    operation::ParsedControlRequest o;
    o.client = client;
    o.kind = kind;
    o.control_session = output_.status.session;
    o.answers_control = output_.status.sequence;
    return control_.onRequest(o, now_).refusal.code();
  }
  ReplyCode home(std::uint64_t client) {
    answer = hal_->onRequest({client, 1, static_cast<std::uint8_t>(dds::HalKind::kHome), 0}, now_);
    note(log_.answered(answer, {}, now_));
    return answer.code;
  }
  ReplyCode measured(std::uint64_t client, std::uint8_t arm, std::uint8_t joint, double position) {
    answer =
        hal_->onRequest({client, 1, static_cast<std::uint8_t>(dds::HalKind::kMeasured), arm, joint, position}, now_);
    note(log_.answered(answer, {}, now_));
    return answer.code;
  }
  /// The lines of the log since the last call.
  std::vector<std::string> lines() {
    note(log_.look(now_));
    return std::exchange(lines_, {});
  }
  bool homed() const { return hal_->robot().homed(0); }
  bool homing() const { return hal_->robot().arm(0).homing(); }
  void stopControl() { control_.stop(); }
  bool raiseEncoderAlarm(const hal::AxisConfig& axis) {
    return wires_[static_cast<std::size_t>(axis.bus)]->drives->inject(
        {sim::drives::FaultKind::kEncoderAlarm, static_cast<std::uint8_t>(axis.node), 0.0, 0.0});
  }
  void boot() { hal_->start(now_); }

  hal_service::HalAnswer answer;
  bool commanding = true;
  std::optional<std::uint64_t> commander;  ///< client in commands instead of control's

 private:
  void note(const hal_service::HomingLog::Line& line) {
    if (line.text.empty())
      return;
    EXPECT_EQ(line.refused, line.text.starts_with("request refused: ")) << line.text;
    lines_.push_back(line.text);
  }
  void cycle(std::uint64_t keeper) {
    if (keeper != 0)
      sendRequest(keeper, ControlKind::kKeepLease);
    hal_->state(now_, state_);
    control_.onState(state_);
    control_.cycle(now_, false, output_);
    output_.command.commander = commander.value_or(output_.command.commander);
    hal_->onCommand(output_.command, now_);
  }
  static void fast(config::Deployment& deployment) { deployment.control_period = 0.01; }

  runtime::Setup of_hal_ = makeSetup("drives", fast), of_control_ = makeSetup("drives", fast);
  hal::HardwareConfig hardware_;
  std::vector<std::unique_ptr<hal::test::Wire>> wires_;
  std::vector<hal::can::Bus*> buses_;
  std::optional<hal_service::HalCore> hal_;
  hal_service::HomingLog log_{of_hal_.robot};
  std::vector<std::string> lines_;
  robots::RobotModel model_{of_control_.robot};
  control_service::ControlRequestHandler handler_{of_control_, model_};
  operation::ControlCore control_{control_service::controlSetupOf(of_control_, model_), handler_.makeTracker()};
  operation::CycleOutput output_;
  dds::ActuationState state_;
  std::int64_t now_ = 1'000'000'000;
};

TEST(HomingRequest, IsTheCommandersAndEndsWithItsLease) {
  HomingSystem s;
  EXPECT_EQ(s.home(kHolder), ReplyCode::kNotLeaseOwner);
  EXPECT_NE(std::string(s.answer.reason.data()).find("acquire the control lease"), std::string::npos);
  ASSERT_EQ(s.sendRequest(kHolder, ControlKind::kAcquireLease), ReplyCode::kOk);
  s.run(0.1, kHolder);
  EXPECT_EQ(s.home(kOther), ReplyCode::kNotLeaseOwner);
  EXPECT_EQ(s.home(0), ReplyCode::kNotLeaseOwner);
  EXPECT_FALSE(s.homing());
  ASSERT_EQ(s.home(kHolder), ReplyCode::kOk) << s.answer.reason.data();
  s.run(0.5, kHolder);
  EXPECT_TRUE(s.homing());
  // Control stops sending: its requests, including late ones, no longer count.
  for (int i = 0; i < 30; ++i) {
    s.run(0.1);
    s.home(kHolder);
  }
  EXPECT_EQ(s.answer.code, ReplyCode::kNotLeaseOwner);
  EXPECT_FALSE(s.homing());
}

TEST(HomingRequest, NobodyPassesForTheCrtkClientsThatCommand) {
  HomingSystem s;
  s.commander = dds::kCrtkClient;
  s.run(0.1);
  EXPECT_EQ(s.home(dds::kCrtkClient), ReplyCode::kNotLeaseOwner);
  EXPECT_FALSE(s.homing());
}

TEST(HomingRequest, IsRefusedWhileControlIsInFaultOrSilent) {
  HomingSystem s;
  ASSERT_EQ(s.sendRequest(kHolder, ControlKind::kAcquireLease), ReplyCode::kOk);
  s.stopControl();
  s.run(0.1, kHolder);
  EXPECT_EQ(s.home(kHolder), ReplyCode::kWrongState);
  EXPECT_NE(std::string(s.answer.reason.data()).find("not DISABLED"), std::string::npos) << s.answer.reason.data();
  s.commanding = false;
  s.run(1.0);
  EXPECT_EQ(s.home(kHolder), ReplyCode::kWrongState);
  EXPECT_NE(std::string(s.answer.reason.data()).find("no recent command from control"), std::string::npos);
  EXPECT_FALSE(s.homing());
}

TEST(HomingLog, HasWhoAskedForWhichJointsAndTheResultOnce) {
  using Lines = std::vector<std::string>;
  const std::string what = "home the drives of arm_a (beta_1, beta_2, beta_3)";
  HomingSystem s;
  ASSERT_EQ(s.sendRequest(kHolder, ControlKind::kAcquireLease), ReplyCode::kOk);
  s.run(0.1, kHolder);
  const auto home = [&](double seconds) {
    for (double t = 0.0; t < seconds && !s.homed(); t += 0.2) {
      s.home(kHolder);
      s.home(kOther);  // is refused in between
      s.run(0.2, kHolder);
    }
  };
  home(1.0);
  Lines lines = s.lines();
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[0], "request: " + what + ", by client 0007");
  EXPECT_TRUE(lines[1].starts_with("request refused: " + what + ": arm_a: ")) << lines[1];
  EXPECT_TRUE(lines[1].ends_with(", by client 0008")) << lines[1];
  s.run(1.5, kHolder);  // it is let go
  EXPECT_EQ(s.lines(), (Lines{"request: " + what + ": ended before the joints were homed, by client 0007"}));
  EXPECT_EQ(s.lines(), Lines{});
  home(100.0);
  ASSERT_TRUE(s.homed());
  s.home(kHolder);
  s.home(kHolder);
  lines = s.lines();
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_TRUE(lines[0].starts_with("request: " + what.substr(0, 29))) << lines[0];
  EXPECT_TRUE(lines[2].ends_with("): done, by client 0007")) << lines[2];
  s.run(1.5, kHolder);
  s.home(kHolder);
  EXPECT_EQ(s.lines(), (Lines{"request: home the drives: nothing to do, all joints are homed, by client 0007"}));
}

TEST(ConfirmPosition, NeedsARequestOfTheCommanderThatIsRepeated) {
  hal::HardwareConfig hardware = hal::test::presetHardware();
  for (hal::AxisConfig& axis : hardware.axes)
    axis.jump_tolerance = 1e-3;
  HomingSystem s(hardware);
  const auto repeat = [&](std::uint64_t client, double seconds) {
    for (double t = 0.0; t < seconds && s.home(client) != ReplyCode::kOk; t += 0.2)
      s.run(0.2, kHolder);
    return s.answer.code;
  };
  EXPECT_FALSE(s.homed()) << "nothing is stored yet";
  ASSERT_EQ(s.sendRequest(kHolder, ControlKind::kAcquireLease), ReplyCode::kOk);
  s.run(0.1, kHolder);
  EXPECT_EQ(repeat(kOther, 5.0), ReplyCode::kNotLeaseOwner);
  EXPECT_FALSE(s.homed());
  EXPECT_EQ(repeat(kHolder, 2.5), ReplyCode::kWrongState);
  EXPECT_NE(std::string(s.answer.reason.data()).find("tandem home --confirm"), std::string::npos);
  s.run(1.5, kHolder);  // it is let go: it starts again
  EXPECT_EQ(repeat(kHolder, 2.5), ReplyCode::kWrongState);
  EXPECT_FALSE(s.homed());
  EXPECT_EQ(repeat(kHolder, 1.0), ReplyCode::kOk) << s.answer.reason.data();
  EXPECT_TRUE(s.homed());
  EXPECT_EQ(s.answer.value, 1u) << "nothing to do";
}

TEST(MeasuredPosition, IsTheCommandersAndNamesAJoint) {
  hal::HardwareConfig hardware = hal::test::presetHardware();
  hardware.axes[0].reference = hal::PositionReference::kMeasured;
  HomingSystem s(hardware);
  const auto says = [&](const char* text) {
    return std::string(s.answer.reason.data()).find(text) != std::string::npos;
  };
  const double position = 0.5 * (hardware.axes[0].lower + hardware.axes[0].upper);
  EXPECT_EQ(s.measured(kHolder, 0, 0, position), ReplyCode::kNotLeaseOwner);
  ASSERT_EQ(s.sendRequest(kHolder, ControlKind::kAcquireLease), ReplyCode::kOk);
  s.run(0.1, kHolder);
  EXPECT_EQ(s.measured(kOther, 0, 0, position), ReplyCode::kNotLeaseOwner);
  EXPECT_EQ(s.home(kHolder), ReplyCode::kWrongState);
  EXPECT_TRUE(says("tandem home --measured")) << s.answer.reason.data();
  for (const std::uint8_t arm : {std::uint8_t{2}, dds::kAllArms})
    EXPECT_EQ(s.measured(kHolder, arm, 0, position), ReplyCode::kMalformed);
  EXPECT_EQ(s.measured(kHolder, 0, 6, position), ReplyCode::kMalformed);
  EXPECT_EQ(s.measured(kHolder, 0, 1, position), ReplyCode::kMalformed);
  EXPECT_TRUE(says("another `reference`")) << s.answer.reason.data();
  EXPECT_EQ(s.measured(kHolder, 0, 0, 1e3 * position), ReplyCode::kOutsideLimits);
  EXPECT_TRUE(says("check its unit")) << s.answer.reason.data();
  EXPECT_FALSE(s.homed());
  s.lines();
  EXPECT_EQ(s.measured(kHolder, 0, 0, position), ReplyCode::kOk) << s.answer.reason.data();
  EXPECT_EQ(s.lines(), (std::vector<std::string>{"request: take a measured position of arm_a (beta_1): " +
                                                 fmt::format("{:.3f}", 1e3 * position) + " mm, by client 0007"}));
  s.run(0.5, kHolder);
  EXPECT_TRUE(s.homed());
}

TEST(MeasuredPosition, OfADriveThatIsNotReadyIsRefusedWithItsReason) {
  hal::HardwareConfig hardware = hal::test::presetHardware();
  hardware.axes[0].reference = hal::PositionReference::kMeasured;
  HomingSystem s(hardware);
  ASSERT_EQ(s.sendRequest(kHolder, ControlKind::kAcquireLease), ReplyCode::kOk);
  const auto refusal = [&] {
    EXPECT_EQ(s.measured(kHolder, 0, 0, 0.5 * (hardware.axes[0].lower + hardware.axes[0].upper)),
              ReplyCode::kWrongState);
    return std::string(s.answer.reason.data());
  };
  ASSERT_TRUE(s.raiseEncoderAlarm(hardware.axes[0]));
  s.run(0.1, kHolder);
  EXPECT_NE(refusal().find("a guard is active; see tandem status"), std::string::npos) << s.answer.reason.data();
  s.boot();
  EXPECT_NE(refusal().find("has not started; see tandem status"), std::string::npos) << s.answer.reason.data();
}

}  // namespace
}  // namespace tandem::test
