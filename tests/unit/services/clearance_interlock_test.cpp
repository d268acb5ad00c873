// SPDX-License-Identifier: Apache-2.0
/** @file Control with an interlock on the distance of bodies. */
#include <gtest/gtest.h>

#include "tests/unit/services/system.h"

namespace tandem::test {
namespace {

using dds::ControlKind;
using safety::Fault;
using safety::OperatingState;
using safety::StateCommand;

bool tooClose(const System& s) { return (s.output.status.faults[0] & bit(Fault::kClearance)) != 0; }

/// A run with an interlock of 1 mm on the distance of bodies, of which each cycle has a new measurement.
struct Near {
  System s{"laptop", [](config::Deployment& deployment) { deployment.least_clearance = 1e-3; }};

  void run(double seconds, double distance) {
    for (int i = 0; i < std::lround(1000 * seconds); ++i) {
      s.control.onClearance({distance, s.now});
      if (s.ticks % 200 == 0)
        s.sendRequest(ControlKind::kKeepLease);
      s.tick();
    }
  }
};

TEST(ControlCore, StopsArmsThatComeTooClose) {
  Near near;
  System& s = near.s;
  s.control.onClearance({2e-3, s.now + 3'000'000'000});  // while getMoving() runs
  s.getMoving();
  near.run(0.3, 2e-3);
  EXPECT_FALSE(s.standing());
  near.run(0.1 + 5e-3 / 0.1 + 0.01, 0.9e-3);  // one period, ramp
  EXPECT_TRUE(s.standing());
  EXPECT_TRUE(tooClose(s));
  EXPECT_EQ(describe(s.control.faultRecord(0)), "clearance: 0.9 mm, expected at least 1 mm");
  EXPECT_EQ(s.command(StateCommand::kEnable).refusal.code(), dds::ReplyCode::kWrongState) << "latched";
  near.run(0.2, 5e-3);
  EXPECT_TRUE(tooClose(s)) << "latched";
  near.run(0.2, 0.9e-3);
  EXPECT_EQ(s.command(StateCommand::kDisable).refusal.code(), dds::ReplyCode::kOk);
  near.run(0.3, 0.9e-3);
  EXPECT_EQ(s.command(StateCommand::kEnable).refusal.code(), dds::ReplyCode::kOk);
  near.run(0.5, 0.9e-3);
  ASSERT_TRUE(tooClose(s)) << "it was apart in between: a new approach";
  EXPECT_EQ(s.command(StateCommand::kDisable).refusal.code(), dds::ReplyCode::kOk);
  near.run(0.3, 0.9e-3);
  EXPECT_EQ(s.command(StateCommand::kEnable).refusal.code(), dds::ReplyCode::kOk);
  near.run(0.5, 0.92e-3);
  EXPECT_EQ(s.shown(0), OperatingState::kEnabled) << "can be moved apart";
  near.run(0.2, 0.85e-3);
  EXPECT_TRUE(tooClose(s)) << "but not closer";
}

TEST(ControlCore, StopsArmsWhoseDistanceIsNoLongerMeasured) {
  Near near;
  System& s = near.s;
  s.control.onClearance({2e-3, s.now + 3'000'000'000});
  s.getMoving();
  near.run(0.3, 2e-3);
  ASSERT_FALSE(s.standing());
  const double seconds = s.until(
      [&] {
        if (s.ticks % 200 == 0)
          s.sendRequest(ControlKind::kKeepLease);
        return s.standing();
      },
      2.0);
  EXPECT_GE(seconds, 0.4);
  EXPECT_LE(seconds, 0.5 + 0.1 + 5e-3 / 0.1 + 0.01);  // budget, one period, ramp
  EXPECT_TRUE(tooClose(s));
  EXPECT_EQ(s.control.faultRecord(0).cause, safety::FaultCause::kNoAnswer);
}

}  // namespace
}  // namespace tandem::test
