// SPDX-License-Identifier: Apache-2.0
/** @file Drives that lack objects: which protections are lost, what is refused, and what the hardware file accepts. */
#include "hal/drives/protections.h"

#include "services/hal/hal_events.h"
#include "tests/unit/hal_robot/robot_fixture.h"

namespace tandem::hal::test {
namespace {

using canopen::NodeFailure;
using canopen::ObjectAddress;

/// Changes one object of the drives' data sheet.
using Change = std::function<void(sim::drives::Eds&, std::size_t)>;

sim::drives::Eds sheetWith(ObjectAddress object, const Change& change) {
  sim::drives::Eds eds = sim::drives::driveEds();
  const auto found = std::ranges::find(eds.objects, object, &sim::drives::EdsObject::address);
  EXPECT_NE(found, eds.objects.end()) << canopen::describe(object);
  if (found != eds.objects.end())
    change(eds, static_cast<std::size_t>(found - eds.objects.begin()));
  return eds;
}

sim::drives::Eds without(std::initializer_list<ObjectAddress> objects) {
  sim::drives::Eds eds = sim::drives::driveEds();
  for (const ObjectAddress object : objects)
    EXPECT_EQ(std::erase_if(eds.objects, [&](const auto& o) { return o.address == object; }), 1u)
        << canopen::describe(object);
  return eds;
}

HardwareConfig accepting(std::initializer_list<Protection> losses) {
  HardwareConfig config = presetHardware();
  for (AxisConfig& axis : config.axes) {
    for (const Protection loss : losses)
      axis.accepted.push_back({loss, "test"});
  }
  return config;
}

ProtectionMask lostOf(const System& system) { return system.robot->arm(0).axis(0).driver().lostProtections(); }

/// The drives boot without these protections, and move.
void expectMoves(System& system, ProtectionMask lost) {
  ASSERT_TRUE(system.boot()) << system.story();
  EXPECT_EQ(lostOf(system), lost) << describeProtections(lostOf(system));
  const auto ready = std::ranges::find(system.events, HardwareEvent::Kind::kReady, &HardwareEvent::kind);
  ASSERT_NE(ready, system.events.end());
  EXPECT_EQ(ready->lost, lost);
  EXPECT_EQ(
      hal_service::describe(*ready, *system.robot).find("lacks " + describeProtections(lost)) != std::string::npos,
      lost != 0);
  ASSERT_TRUE(system.enable()) << system.story();
  const ArmVector before = system.truth(0);
  system.move(0, speeds(2e-3, 0.1));
  system.run(0.5);
  EXPECT_GT((system.truth(0) - before).minCoeff(), 5e-4);
}

/// No drive boots, and the reason is the object.
void expectRefused(System& system, ObjectAddress object, canopen::SdoAbort abort) {
  EXPECT_FALSE(system.boot());
  const canopen::Node& node = driveNode(system.robot->arm(0).axis(0));
  ASSERT_EQ(node.failure().reason, NodeFailure::Reason::kAborted);
  EXPECT_EQ(node.steps()[static_cast<std::size_t>(node.failure().step)].object, object);
  EXPECT_EQ(node.failure().abort, abort);
  const auto failed = std::ranges::find(system.events, HardwareEvent::Kind::kNode, &HardwareEvent::kind);
  ASSERT_NE(failed, system.events.end());
  EXPECT_NE(hal_service::describe(*failed, *system.robot).find("`accept` this axis in the hardware file"),
            std::string::npos);
  system.request(DriveRequest::kEnable);
  system.run(1.0);
  EXPECT_TRUE(system.robot->off());
}

struct Loss {
  ObjectAddress object;
  Protection protection;
  bool alone;  ///< a drive may lack it alone
};
class EachProtection : public testing::TestWithParam<Loss> {};

TEST_P(EachProtection, IsLostWithItsObjectAndMissedIfItIsNeeded) {
  const Loss& loss = GetParam();
  {
    System system(presetHardware(), 0.0, without({loss.object}));
    if (loss.alone) {
      expectMoves(system, bit(loss.protection));
    } else {
      expectRefused(system, loss.object, canopen::SdoAbort::kNoObject);
    }
  }
  System system(accepting({loss.protection}), 0.0, without({loss.object}));
  expectMoves(system, bit(loss.protection));
}

INSTANTIATE_TEST_SUITE_P(All,
                         EachProtection,
                         testing::Values(Loss{{0x1400, 5}, Protection::kCommandDeadline, true},
                                         Loss{{0x1016, 1}, Protection::kHeartbeatWatch, true},
                                         Loss{{0x6007, 0}, Protection::kConnectionReaction, false},
                                         Loss{{0x605A, 0}, Protection::kQuickStopRamp, false},
                                         Loss{{0x6085, 0}, Protection::kQuickStopRamp, false},
                                         Loss{{0x605E, 0}, Protection::kFaultReaction, true},
                                         Loss{{0x6065, 0}, Protection::kFollowingError, true},
                                         Loss{{0x6066, 0}, Protection::kFollowingError, true}));

TEST(Protections, SomeWatchOnTheHalIsNeeded) {
  System system(presetHardware(), 0.0, without({{0x1400, 5}, {0x1016, 1}}));
  expectRefused(system, {0x1400, 5}, canopen::SdoAbort::kNoSubIndex);
  System accepted(accepting({Protection::kHeartbeatWatch}), 0.0, without({{0x1400, 5}, {0x1016, 1}}));
  expectMoves(accepted, bit(Protection::kCommandDeadline) | bit(Protection::kHeartbeatWatch));
}

/// As in the data sheets of several vendors (2026): no event timer of RPDOs, no interpolation period, no behaviour
/// object.
TEST(Protections, ADriveWithTheObjectsOfManyDataSheetsMoves) {
  System system(presetHardware(), 0.0, without({{0x1400, 5}, {0x60C2, 1}, {0x60C2, 2}, {0x1029, 1}}));
  expectMoves(system, bit(Protection::kCommandDeadline));
}

TEST(Protections, AReadOnlyObjectIsLostUnlessItHasTheValue) {
  const auto fixed = [](std::int64_t value) {
    return sheetWith({0x605E, 0}, [value](sim::drives::Eds& eds, std::size_t k) {
      eds.objects[k].access = sim::drives::Access::kReadOnly;
      eds.objects[k].value = value;
    });
  };
  System right(presetHardware(), 0.0, fixed(2));
  expectMoves(right, 0);
  System wrong(presetHardware(), 0.0, fixed(1));
  expectMoves(wrong, bit(Protection::kFaultReaction));
}

TEST(Protections, ARangeThatDoesNotReachIsALoss) {
  const auto eds = sheetWith({0x6066, 0}, [](sim::drives::Eds& e, std::size_t k) {
    e.objects[k].low = e.objects[k].high = e.objects[k].value = 0;
  });
  System system(presetHardware(), 0.0, eds);
  expectMoves(system, bit(Protection::kFollowingError));
}

TEST(Protections, AnEventTimerThatRefusesTheDeadlineIsALoss) {
  for (const bool read_only : {true, false}) {
    const auto eds = sheetWith({0x1400, 5}, [read_only](sim::drives::Eds& e, std::size_t k) {
      if (read_only) {
        e.objects[k].access = sim::drives::Access::kReadOnly;
      } else {
        e.objects[k].high = 0;
      }
    });
    System system(presetHardware(), 0.0, eds);
    expectMoves(system, bit(Protection::kCommandDeadline));
  }
}

/// 1016 and 1400:05 are what a drive stops by when the HAL ends: each is enough.
TEST(Protections, EitherWatchStopsTheDriveWhenTheHalEnds) {
  for (const ObjectAddress object : {ObjectAddress{0x1400, 5}, ObjectAddress{0x1016, 1}}) {
    SCOPED_TRACE(canopen::describe(object));
    System system(presetHardware(), 0.0, without({object}));
    expectMoves(system, object.index == 0x1400 ? bit(Protection::kCommandDeadline) : bit(Protection::kHeartbeatWatch));
    system.hal_alive = false;
    system.run(0.1 + 0.3);  // the watch and the quick stop
    const ArmVector stood = system.truth(0);
    system.run(0.5);
    EXPECT_LE((system.truth(0) - stood).cwiseAbs().maxCoeff(), 1e-6);
  }
}

}  // namespace
}  // namespace tandem::hal::test
