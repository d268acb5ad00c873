// SPDX-License-Identifier: Apache-2.0
/** @file Motion-relevant values (fingerprint): changes that affect them, and changes that do not. */
#include "config/values.h"

#include <regex>
#include <set>

#include "support.h"

namespace tandem::config::test {
namespace {

namespace fs = std::filesystem;

/** The presets in a temporary folder, where one file at a time is changed. */
class Values : public ::testing::Test {
 protected:
  void SetUp() override { fs::copy(presets(), folder_.path() / "presets", fs::copy_options::recursive); }

  fs::path at(const std::string& name) const { return folder_.path() / "presets" / name; }
  static void write(const fs::path& file, const std::string& text) { std::ofstream(file) << text; }
  static std::string of(const fs::path& deployment) { return loadDeployment(deployment).values; }

  /// The values of the deployment with this text in the file.
  std::string with(const fs::path& deployment, const fs::path& file, const std::string& text) {
    const std::string before = readAll(file);
    write(file, text);
    std::string values;
    try {
      values = of(deployment);
    } catch (const Error&) {  // a number outside its bounds
    }
    write(file, before);
    return values;
  }

  Folder folder_;
};

/// Keys of a deployment that no motion depends on.
const std::set<std::string> kAside{"domain", "interface_address", "peers",    "status_period_ms", "realtime_priority",
                                   "port",   "memory_mb",         "before_s", "after_s",          "files",
                                   "address"};

TEST_F(Values, EveryNumberOfEveryFileChangesThem) {
  const std::regex number(R"(([A-Za-z_0-9]+): *\[?(-?[0-9][0-9.e+-]*))");
  int changed = 0;
  for (const char* name : {"laptop", "drives", "teleop", "ablation-pair", "lockstep-compliant-plant"}) {
    const fs::path deployment = at(std::string("deployments/") + name + ".yaml");
    const std::string before = of(deployment);
    ASSERT_FALSE(before.empty());
    const Deployment loaded = loadDeployment(deployment);
    std::vector<fs::path> files{deployment, loaded.robot};
    if (!loaded.hardware.empty())
      files.push_back(loaded.hardware);
    for (const fs::path& file : files) {
      const std::string text = readAll(file);
      for (std::sregex_iterator found(text.begin(), text.end(), number), end; found != end; ++found) {
        const std::size_t line = text.rfind('\n', static_cast<std::size_t>(found->position())) + 1;
        if (text[text.find_first_not_of(' ', line)] == '#' || kAside.contains((*found)[1].str()))
          continue;
        const std::string value = (*found)[2].str();
        const double was = std::stod(value);
        const bool whole = value.find_first_of(".e") == std::string::npos;
        for (const double other : {whole ? was + 1.0 : was * 1.001, whole ? was - 1.0 : was * 0.999}) {
          std::string edited = text;
          edited.replace(static_cast<std::size_t>(found->position(2)), value.size(), formatNumber(other));
          const std::string after = with(deployment, file, edited);
          if (after.empty() || other == was)
            continue;
          EXPECT_NE(after, before) << file << ": " << found->str() << " -> " << other;
          EXPECT_NE(fingerprintOf(after, 1), fingerprintOf(before, 1));
          EXPECT_FALSE(differences(before, after).empty());
          ++changed;
        }
      }
    }
  }
  EXPECT_GT(changed, 300);
}

TEST_F(Values, KeysWithoutEffectOnMotionDoNotChangeThem) {
  const fs::path deployment = at("deployments/laptop.yaml"), robot = at("robots/ark2024.yaml");
  const std::string before = of(deployment), text = readAll(deployment), robot_text = readAll(robot);
  EXPECT_EQ(with(deployment, deployment, replaced(text, "domain: 0", "domain: 7   # of our own")), before);
  EXPECT_EQ(with(deployment, deployment, replaced(text, "prefix: tandem", "prefix: other")), before);
  EXPECT_EQ(with(deployment, deployment, replaced(text, "name: laptop", "name: bench")), before);
  EXPECT_EQ(with(deployment, deployment, replaced(text, "control_period_s: 0.1", "control_period_ms: 100")), before);
  EXPECT_EQ(with(deployment, deployment, replaced(text, "method: nspqp\n", "") + "method: nspqp\n"), before) << "order";
  EXPECT_EQ(with(deployment, deployment, text + "budgets: {lease_s: 1}\nblack_box: {files: 3}\n"), before)
      << "defaults";
  EXPECT_EQ(with(deployment, robot, "# ours\n" + robot_text), before);
  fs::rename(robot, at("robots/ours.yaml"));
  EXPECT_EQ(with(deployment, deployment, replaced(text, "ark2024.yaml", "ours.yaml")), before) << "names of files";
}

TEST_F(Values, ReportDifferingKeys) {
  const fs::path deployment = at("deployments/laptop.yaml");
  const std::string before = of(deployment), text = readAll(deployment);
  EXPECT_EQ(differences(before, with(deployment, deployment,
                                     replaced(text, "control_period_s: 0.1", "control_period_s: 0.05"))),
            "control_period: 0.1 here, 0.05 there");
  EXPECT_EQ(differences(before, with(deployment, deployment, text + "port: {radius_mm: 5}\n")),
            "port: none here, given there; port.depth: none here, 0 there; port.radius: none here, 0.005 there");
  EXPECT_EQ(differences(before, with(deployment, deployment, text + "plant: {tracker: {}}\n"), 1).substr(0, 40),
            "plant.tracker: none here, given there; a");
  EXPECT_EQ(differences(before, before), "");
  EXPECT_NE(fingerprintOf(before, 1), fingerprintOf(before, 2)) << "another version of the wire";
  EXPECT_NE(fingerprintOf(before, 1), 0u);
}

}  // namespace
}  // namespace tandem::config::test
