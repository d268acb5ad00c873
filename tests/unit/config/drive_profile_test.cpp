// SPDX-License-Identifier: Apache-2.0
/** @file Drive profiles: what a hardware file takes from them, and what they may not contain. */
#include "config/drive_profile.h"

#include <random>
#include <set>

#include "config/values.h"
#include "hal/hardware.h"
#include "support.h"

namespace tandem::config::test {
namespace {

constexpr const char* kProfile = R"(tandem: drive/1
name: mine
model: a drive
tried: data_sheet
modes: [csp, pv]
lacks: [command_deadline]
drive:
  sdo_timeout_ms: 250
  velocity_unit: rpm
  acceleration_unit: rpm_per_s
  reports_following: false
  temperature_object: "3201:1"
  sdo:
    - {object: "3001:2", type: i32, value: -5, tolerance: 2, why: "first"}
facts:
  - {fact: "it has a shaft", source: assumed}
)";

/// A hardware file whose translations name the profile; `more` are further keys of their `drive`.
std::string withProfile(const std::string& more = "") {
  const std::string text = readAll(presets() / "hardware/ark2024-two-buses.yaml");
  return replaced(replaced(text, "../robots/ark2024.yaml", (presets() / "robots/ark2024.yaml").string()),
                  "  - drive:\n", "  - drive:\n      profile: mine.yaml\n" + more);
}

/// Both files in one folder.
class Lab {
 public:
  explicit Lab(const std::string& hardware, const std::string& profile = kProfile)
      : hardware_(folder_.write("hardware.yaml", hardware)), profile_(folder_.write("mine.yaml", profile)) {}
  hal::HardwareConfig load() const { return loadHardware(hardware_); }
  std::string values() const {
    Deployment deployment;
    deployment.robot = presets() / "robots/ark2024.yaml";
    deployment.hardware = hardware_;
    return valuesOfFiles(deployment);
  }
  const std::filesystem::path& profile() const { return profile_; }
  const std::filesystem::path& hardware() const { return hardware_; }

 private:
  Folder folder_;
  std::filesystem::path hardware_, profile_;
};

/// The error of a load, as text, and the name of its file.
std::pair<std::string, std::string> refusal(const Lab& lab) {
  try {
    lab.load();
  } catch (const Error& error) {
    return {error.what(), error.file()};
  }
  return {};
}

TEST(DriveProfile, GivesAnAxisWhatItsFileHasNot) {
  const hal::HardwareConfig hardware = Lab(withProfile()).load();
  const hal::AxisConfig& axis = hardware.axes[0];
  EXPECT_EQ(axis.sdo_timeout, 0.25);
  EXPECT_EQ(axis.units.velocity, hal::RateUnit::kRevolutionsPerMinute);
  EXPECT_EQ(axis.units.acceleration, hal::RateUnit::kRevolutionsPerMinute);
  EXPECT_FALSE(axis.reports_following);
  EXPECT_EQ(axis.sdo.size(), 1u);
  EXPECT_EQ(hardware.axes[3].units.velocity, hal::RateUnit::kCounts) << "a group without profile";
  EXPECT_TRUE(hardware.axes[3].sdo.empty());
}

TEST(DriveProfile, KeysOfTheFileComeFirst) {
  const std::string own =
      "      sdo_timeout_s: 0.05\n      velocity_unit: rev_per_s\n      reports_following: true\n"
      "      sdo: [{object: '3001:3', type: u8, value: 0x10, read_back: false, optional: true, why: second}]\n";
  const std::string first = "{arm: arm_a, tube: 1, bus: bus_a, node: 1,";
  const hal::HardwareConfig hardware =
      Lab(replaced(withProfile(own), first, first + " sdo: [{object: '3001:4', type: u16, value: 7, why: third}],"))
          .load();
  const hal::AxisConfig& axis = hardware.axes[0];
  EXPECT_EQ(axis.sdo_timeout, 0.05) << "the same key with another unit";
  EXPECT_EQ(axis.units.velocity, hal::RateUnit::kRevolutionsPerSecond);
  EXPECT_EQ(axis.units.acceleration, hal::RateUnit::kRevolutionsPerMinute) << "of the profile";
  EXPECT_TRUE(axis.reports_following);
  ASSERT_EQ(axis.sdo.size(), 3u) << "of the profile, the drives of the group, the axis";
  EXPECT_EQ(axis.sdo[0].value, -5);
  EXPECT_EQ(axis.sdo[0].tolerance, 2u);
  EXPECT_EQ(axis.sdo[0].size, 4);
  EXPECT_TRUE(axis.sdo[0].read_back);
  EXPECT_EQ(axis.sdo[1].index, 0x3001);
  EXPECT_EQ(axis.sdo[1].sub, 3);
  EXPECT_EQ(axis.sdo[1].value, 16);
  EXPECT_FALSE(axis.sdo[1].read_back);
  EXPECT_TRUE(axis.sdo[1].optional);
  EXPECT_EQ(axis.sdo[2].why, "third");
  EXPECT_EQ(hardware.axes[1].sdo.size(), 2u);
}

TEST(DriveProfile, IsPartOfWhatProcessesCompare) {
  const std::string before = Lab(withProfile()).values();
  const std::string after = Lab(withProfile(), replaced(kProfile, "value: -5", "value: -6")).values();
  EXPECT_NE(differences(before, after).find("sdo[0].value"), std::string::npos) << differences(before, after);
  EXPECT_EQ(before,
            Lab(withProfile(), replaced(kProfile, "model: a drive", "model: a drive  # and a comment")).values());
}

TEST(DriveProfile, ItsErrorsNameItsOwnFile) {
  const Lab broken(withProfile(), replaced(kProfile, "velocity_unit: rpm", "velocity_unit: mph"));
  const auto [message, file] = refusal(broken);
  EXPECT_EQ(file, broken.profile().string());
  EXPECT_NE(message.find("mine.yaml:9:18: drive.velocity_unit: found the text \"mph\""), std::string::npos) << message;
}

TEST(DriveProfile, AProfileThatIsNotThereAndAModeThatItHasNotAreRefused) {
  const Lab gone(replaced(withProfile(), "profile: mine.yaml", "profile: epos5"));
  const auto [message, file] = refusal(gone);
  EXPECT_EQ(file, gone.hardware().string());
  EXPECT_NE(message.find("translations[0].drive.profile: found 'epos5'"), std::string::npos) << message;
  EXPECT_NE(message.find("epos4, generic, gold, ipos, mc3"), std::string::npos) << message;
  const auto [mode, at] = refusal(Lab(withProfile("      mode: csv\n")));
  EXPECT_NE(mode.find("drive.mode: found 'csv', expected csp or pv: a drive has no other"), std::string::npos) << mode;
}

/// Of random objects, exactly those that command a drive or belong to the communication are refused, at load time.
TEST(DriveProfile, ObjectsThatCommandTheDriveAreRefused) {
  std::mt19937 random(static_cast<unsigned>(::testing::UnitTest::GetInstance()->random_seed()) + 1u);
  const std::set<int> commands{0x6040, 0x6042, 0x6060, 0x6071, 0x607A, 0x60B0, 0x60B1, 0x60B2, 0x60C1, 0x60FE, 0x60FF};
  const std::set<int> communication{0x1006, 0x1007};
  std::vector<int> objects(commands.begin(), commands.end());
  objects.insert(objects.end(), communication.begin(), communication.end());
  for (const int index :
       {0x1000, 0x1005, 0x100C, 0x100D, 0x1019, 0x1010, 0x1011, 0x1016, 0x1017, 0x1400, 0x1600, 0x1800, 0x1A00, 0x1F51})
    objects.push_back(index);
  for (int k = 0; k < 40; ++k)
    objects.push_back(std::uniform_int_distribution<int>(0, 0xFFFF)(random));
  for (const int index : objects) {
    char name[8];
    std::snprintf(name, sizeof name, "%04X", index);
    const bool permitted = index >= 0x2000 ? commands.count(index) == 0 : communication.count(index) == 1;
    const std::string message = refusal(Lab(withProfile(), replaced(kProfile, "3001", name))).first;
    EXPECT_EQ(message.empty(), permitted) << name << ": " << message;
    if (!permitted) {
      EXPECT_NE(message.find("drive.sdo[0].object: found " + std::string(name)), std::string::npos) << message;
    }
  }
}

TEST(DriveProfile, ValuesFitTheirTypes) {
  struct Limit {
    const char* type;
    std::int64_t least, most;
  };
  for (const Limit& limit :
       {Limit{"u8", 0, 255}, Limit{"u16", 0, 65535}, Limit{"u32", 0, 4294967295}, Limit{"i8", -128, 127},
        Limit{"i16", -32768, 32767}, Limit{"i32", -2147483648LL, 2147483647}}) {
    for (const std::int64_t value : {limit.least - 1, limit.least, limit.most, limit.most + 1}) {
      const std::string text = replaced(kProfile, "type: i32, value: -5",
                                        std::string("type: ") + limit.type + ", value: " + std::to_string(value));
      const std::string message = refusal(Lab(withProfile(), text)).first;
      EXPECT_EQ(message.empty(), value >= limit.least && value <= limit.most) << limit.type << " " << value << message;
    }
  }
}

/// A single-turn encoder cannot tell where a joint is whose limits are farther apart than one turn.
TEST(EncoderRange, NeedsLimitsWithinIt) {
  const std::string encoder = "encoder: {counts_per_revolution: 65536, lead_mm: 2, tolerance_mm: 0.3";
  const auto with = [&](const std::string& counts) {
    return replaced(withProfile(), encoder, encoder + ", range: " + counts);
  };
  EXPECT_EQ(Lab(with("14400000")).load().axes[0].encoder->range, 14400000.0) << "439 mm";
  const std::string message = refusal(Lab(with("14000000"))).first;
  EXPECT_NE(message.find("translations[0].axes[0].upper_mm: found a travel of 0.437"), std::string::npos) << message;
}

TEST(DriveProfile, TheTableOfTheDocumentationIsMadeOfThem) {
  const std::string page = readAll(std::filesystem::path(TANDEM_SOURCE) / "docs/hardware.md");
  EXPECT_NE(page.find(triedWith(presets() / "drives")), std::string::npos)
      << "run `ninja -C build/release config-reference`";
}

/// The hardware of withProfile() with this homing method, whose carriages end at their stops.
std::string withMethod(int method) {
  return withHomes(replaced(withProfile(), "reference: absolute_encoder",
                            "reference: homing\n      homing: {method: " + std::to_string(method) +
                                ", fast_mm_per_s: 4, slow_mm_per_s: 1, acceleration_mm_per_s2: 50}"));
}

TEST(DriveProfile, NamesTheHomingMethodsOfTheManufacturer) {
  const std::string profile = replaced(kProfile, "drive:\n",
                                       "vendor: 0x147\nmakers: [Faulhaber]\nhoming_methods:\n"
                                       "  - {method: -2, stop: positive, index: true, source: page 1}\n"
                                       "  - {method: -3, stop: negative, source: page 2}\ndrive:\n");
  const hal::HomingConfig negative = Lab(withMethod(-3), profile).load().axes[0].homing;
  EXPECT_EQ(negative.method, -3);
  EXPECT_EQ(negative.stop, -1);
  EXPECT_FALSE(negative.stop_index);
  const hal::HomingConfig positive = Lab(withMethod(-2), profile).load().axes[0].homing;
  EXPECT_EQ(positive.stop, 1);
  EXPECT_TRUE(positive.stop_index);
  EXPECT_EQ(Lab(withMethod(17), profile).load().axes[0].homing.stop, 0);
  const auto refusal = [](int method, const std::string& of) {
    try {
      Lab(withMethod(method), of).load();
    } catch (const Error& error) {
      EXPECT_EQ(error.key(), "translations[0].drive.homing.method");
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_NE(refusal(-4, profile).find("names in `homing_methods`: -2, -3"), std::string::npos) << refusal(-4, profile);
  EXPECT_NE(refusal(-3, kProfile).find("it names none"), std::string::npos) << refusal(-3, kProfile);
  const DriveProfile loaded = loadDriveProfile(Lab(withProfile(), profile).profile());
  EXPECT_EQ(loaded.vendor, 0x147u);
  EXPECT_EQ(loaded.makers, std::vector<std::string>{"Faulhaber"});
}

}  // namespace
}  // namespace tandem::config::test
