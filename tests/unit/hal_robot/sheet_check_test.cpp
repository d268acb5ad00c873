// SPDX-License-Identifier: Apache-2.0
/** @file The judgement of a data sheet: a drive that is made of the sheet boots, and lacks, what was foretold. */
#include "hal/cia402/sheet_check.h"

#include <random>

#include "tests/unit/hal_robot/robot_fixture.h"

namespace tandem::hal::test {
namespace {

using canopen::Access;
using canopen::Eds;
using canopen::EdsObject;
using canopen::ObjectAddress;
using Verdict = SheetFinding::Verdict;

constexpr double kDriveHeartbeat = safety::Budgets{}.drive_heartbeat;

SheetCheck check(const Eds& sheet, const HardwareConfig& config = presetHardware()) {
  return checkSheet(sheet, config, config.axes.front(), kDriveHeartbeat);
}

EdsObject& entry(Eds& sheet, ObjectAddress address) {
  const auto found = std::ranges::find(sheet.objects, address, &EdsObject::address);
  if (found == sheet.objects.end())
    throw std::runtime_error("no object " + describe(address));
  return *found;
}

TEST(SheetCheck, TheBuiltInDriveFits) {
  const SheetCheck result = check(sim::drives::driveEds());
  for (const SheetFinding& finding : result.findings) {
    // Statements of units that the built-in drive leaves to the profile: counts.
    const auto index = finding.step.object.index;
    const bool unit = index == 0x60A9 || index == 0x60AA || index == 0x6096 || index == 0x6097;
    EXPECT_EQ(finding.verdict, unit ? Verdict::kSkipped : Verdict::kFits)
        << describe(finding.step.object) << " " << finding.step.what << ": " << finding.reason;
  }
  EXPECT_TRUE(result.boots());
  EXPECT_EQ(result.lost, 0u);
}

TEST(SheetCheck, JudgesTheHomingMethodByTheListOfTheSheet) {
  const auto judged = [](const std::vector<int>& listed, int method) {
    Eds sheet = sim::drives::driveEds();
    for (std::size_t k = 0; k < listed.size(); ++k) {
      EdsObject item = entry(sheet, {0x6098, 0});
      item.address = {0x60E3, static_cast<std::uint8_t>(k + 1)};
      item.access = Access::kReadOnly;
      item.value = listed[k];
      sheet.objects.push_back(item);
    }
    std::ranges::sort(sheet.objects, {}, &EdsObject::address);
    HardwareConfig config = homingHardware();
    config.axes.front().homing.method = method;
    const SheetCheck result = check(sheet, config);
    // The simulated drive agrees.
    const DriveKind kind(sheet);
    System system(config, 0.0, kind);
    system.boot();
    EXPECT_EQ(system.robot->arm(0).axis(0).phase() == AxisPhase::kUnhomed, result.boots()) << method;
    const auto found = std::ranges::find_if(result.findings, [](const SheetFinding& finding) {
      return finding.step.object.index == 0x6098 && finding.verdict == Verdict::kRefused;
    });
    return found == result.findings.end() ? std::string() : found->reason;
  };
  EXPECT_EQ(judged({}, 17), "");
  EXPECT_EQ(judged({-3, 17, 37}, 17), "");
  EXPECT_EQ(judged({-3, 18, 37}, 17), "method 17, 60E3 lists -3, 18, 37");
}

TEST(SheetCheck, GivesTheReason) {
  struct Case {
    ObjectAddress object;
    std::function<void(EdsObject&)> change;
    Verdict verdict;
    std::string reason;
  };
  const auto read_only = [](EdsObject& o) { o.access = Access::kReadOnly; };
  const Case cases[] = {
      {{0x605A, 0}, read_only, Verdict::kFits, "read-only, with this value"},
      {{0x605E, 0},
       [](EdsObject& o) {
         o.access = Access::kReadOnly;
         o.value = 1;
       },
       Verdict::kLost,
       "read-only"},
      {{0x6085, 0}, [](EdsObject& o) { o.high = 32767; }, Verdict::kLost, "range 1 to 32767, the HAL writes"},
      {{0x6065, 0},
       [](EdsObject& o) { o.type = canopen::DataType::kUnsigned16; },
       Verdict::kRefused,
       "UNSIGNED16, expected 4 bytes"},
      {{0x6502, 0}, [](EdsObject& o) { o.value = 1; }, Verdict::kRefused, "found 0x1, expected 0x80 in the bits 0x80"},
      {{0x6502, 0}, [](EdsObject& o) { o.has_value = false; }, Verdict::kUnknown, "no value in the data sheet"},
      {{0x1017, 0}, [](EdsObject& o) { o.access = Access::kWriteOnly; }, Verdict::kRefused, "cannot be read back"},
      {{0x607D, 2}, read_only, Verdict::kLost, "read-only"},
  };
  for (const Case& one : cases) {
    SCOPED_TRACE(describe(one.object) + " " + one.reason);
    Eds sheet = sim::drives::driveEds();
    one.change(entry(sheet, one.object));
    const SheetCheck result = check(sheet);
    const auto found = std::find_if(result.findings.rbegin(), result.findings.rend(),
                                    [&](const SheetFinding& finding) { return finding.step.object == one.object; });
    ASSERT_NE(found, result.findings.rend());
    EXPECT_EQ(found->verdict, one.verdict);
    EXPECT_NE(found->reason.find(one.reason), std::string::npos) << found->reason;
  }
  Eds sheet = sim::drives::driveEds();
  entry(sheet, {0x6064, 0}).mappable = false;
  const SheetCheck result = check(sheet);
  EXPECT_TRUE(std::ranges::any_of(result.findings, [](const SheetFinding& finding) {
    return finding.verdict == Verdict::kRefused && finding.reason == "6064:00 cannot be mapped into a PDO";
  }));
}

/// One random change of an object that the setup uses. @return of which object, and how
std::string damage(Eds& sheet, const std::vector<canopen::SetupStep>& steps, std::mt19937& random) {
  const canopen::SetupStep& step = steps[random() % steps.size()];
  ObjectAddress address = step.object;
  const bool mapping = (address.index & 0xFE00) == 0x1600 || (address.index & 0xFE00) == 0x1A00;
  if (mapping && random() % 2 == 0)
    address = std::array{ObjectAddress{0x6040, 0}, ObjectAddress{0x607A, 0}, ObjectAddress{0x6041, 0},
                         ObjectAddress{0x6064, 0}}[random() % 4];
  const auto found = std::ranges::find(sheet.objects, address, &EdsObject::address);
  if (found == sheet.objects.end())
    return {};
  const unsigned way = random() % 7;
  switch (way) {
    case 0:
    case 1:
      sheet.objects.erase(found);
      break;
    case 2:
      found->access = random() % 3 == 0 ? Access::kWriteOnly : Access::kReadOnly;
      break;
    case 3:
      if (step.object.index == 0x607D)
        return {};  // the limits that are written depend on the position of the drive at boot
      found->low = found->high = found->value = static_cast<std::int64_t>(random() % 3);
      found->adds_node_id = false;
      break;
    case 4:
      found->type = sizeOf(found->type) == 2 ? canopen::DataType::kUnsigned32 : canopen::DataType::kUnsigned16;
      break;
    case 5:
      found->mappable = false;
      break;
    default:
      if (const auto index = address.index; index == 0x608F || index == 0x6091 || index == 0x6092)
        return {};  // counts that the sheet leaves open are set in the drive, and may be others
      // A value that is not in the sheet and cannot be written is lost by judgement, and may be right in the drive.
      found->has_value = step.protections != 0;
      found->value = found->has_value ? found->value : 0;
  }
  return describe(address) + " in way " + std::to_string(way) + ", ";
}

std::string describeRefusals(const SheetCheck& result) {
  std::string text;
  for (const SheetFinding& finding : result.findings) {
    if (finding.verdict != Verdict::kFits)
      text += describe(finding.step.object) + " " + finding.step.what + ": " + std::string(name(finding.verdict)) +
              ": " + finding.reason + "\n";
  }
  return text;
}

/// Boots drives that are made of this sheet: that succeeds, and loses, what was foretold. @return whether it did
bool bootsAsForetold(const Eds& sheet, const HardwareConfig& config) {
  System system(config, 0.0, sheet);
  const bool booted = system.boot();
  bool foretold = true;
  std::string why;
  for (const AxisConfig& axis : config.axes) {
    const SheetCheck result = checkSheet(sheet, config, axis, kDriveHeartbeat);
    foretold = foretold && result.boots() && !result.refuses_counts;
    why = describeRefusals(result);
  }
  EXPECT_EQ(booted, foretold) << why << system.story();
  for (std::size_t i = 0; booted && i < config.axes.size(); ++i) {
    const AxisConfig& axis = config.axes[i];
    EXPECT_EQ(system.robot->arm(axis.arm).axis(axis.joint).driver().lostProtections(),
              checkSheet(sheet, config, axis, kDriveHeartbeat).lost)
        << why;
  }
  return booted;
}

/// A write-only object that refuses its value cannot show that it has it: its protections are lost, no more.
TEST(SheetCheck, AWriteOnlyObjectThatRefusesItsValueCostsItsProtectionsAsInTheBoot) {
  Eds sheet = sim::drives::driveEds();
  EdsObject& timer = entry(sheet, {0x1400, 5});
  timer.access = Access::kWriteOnly;
  timer.low = timer.high = timer.value = 0;
  EXPECT_TRUE(bootsAsForetold(sheet, presetHardware()));
}

/// canopen::Node and the judgement of the same sheet agree.
TEST(SheetCheck, AgreesWithTheBootOfSuchDrives) {
  const char* const given = std::getenv("TANDEM_SEED");
  const unsigned seed = given != nullptr ? static_cast<unsigned>(std::stoul(given)) : std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  int boots = 0;
  constexpr int kSheets = 60;
  for (int k = 0; k < kSheets && !HasFailure(); ++k) {
    SCOPED_TRACE("sheet " + std::to_string(k));
    const HardwareConfig config = presetHardware(
        std::array{DriveMode::kCyclicPosition, DriveMode::kCyclicVelocity, DriveMode::kProfileVelocity}[random() % 3]);
    Eds sheet = sim::drives::driveEds();
    const auto steps = setupSteps(config, config.axes.front(), kDriveHeartbeat);
    std::string changed;
    for (unsigned n = 1 + random() % 3; n-- > 0;)
      changed += damage(sheet, steps, random);
    SCOPED_TRACE("changed: " + changed);
    boots += bootsAsForetold(sheet, config) ? 1 : 0;
  }
  EXPECT_GT(boots, 0);
  EXPECT_TRUE(boots < kSheets);
}

/// Data sheets of public facts about drives of vendors.
TEST(SheetCheck, AgreesWithTheBootOfDrivesOfVendors) {
  for (const auto& [file, boots] : {std::pair{"epos4-like.eds", true}, std::pair{"gold-like.eds", true},
                                    std::pair{"mc3-like.eds", false}, std::pair{"ipos-like.eds", true}}) {
    SCOPED_TRACE(file);
    const Eds sheet = canopen::loadEds(std::string(TANDEM_SOURCE) + "/tests/sheets/" + file);
    HardwareConfig config = presetHardware();
    if (std::string(file) == "epos4-like.eds") {
      for (AxisConfig& axis : config.axes)
        axis.units = {RateUnit::kRevolutionsPerMinute, RateUnit::kRevolutionsPerMinute, 1.0, 1.0};
      EXPECT_FALSE(bootsAsForetold(sheet, presetHardware())) << "counts";
    }
    if (std::string(file) == "ipos-like.eds") {
      config = presetHardware(DriveMode::kProfileVelocity);
      for (AxisConfig& axis : config.axes) {
        for (const Protection loss :
             {Protection::kHeartbeatWatch, Protection::kConnectionReaction, Protection::kQuickStopRamp})
          axis.accepted.push_back({loss, "test"});
      }
      EXPECT_FALSE(bootsAsForetold(sheet, config)) << "two objects in a PDO";
      for (AxisConfig& axis : config.axes)
        axis.pdo_objects = 1;
      EXPECT_TRUE(bootsAsForetold(sheet, config)) << "no watch, but that is accepted";
      for (AxisConfig& axis : config.axes) {
        axis.watch = MutualWatch::kNodeGuarding;
        std::erase_if(axis.accepted, [](const auto& loss) { return loss.protection == Protection::kHeartbeatWatch; });
      }
    }
    EXPECT_EQ(bootsAsForetold(sheet, config), boots);
  }
}

}  // namespace
}  // namespace tandem::hal::test
