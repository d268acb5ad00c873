// SPDX-License-Identifier: Apache-2.0
/** @file Loading of all robot types for the services, and keys refused for catheters. */
#include "config/cooperative.h"
#include "config/robot_files.h"

#include <algorithm>

#include "support.h"

namespace tandem::config::test {
namespace {

std::filesystem::path preset(const std::string& name) { return presets() / "cooperative" / (name + ".yaml"); }

/// Reason for which a call is refused; empty if it is not.
template <class Call>
std::string refusalOf(Call call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

TEST(AnyRobot, LoadsConcentricTubes) {
  const Robot robot = loadAnyRobot(presets() / "robots/ark2024.yaml");
  EXPECT_EQ(robot.type, "robot");
  EXPECT_EQ(robot.arms[0].jointCount(), 6);
  EXPECT_EQ(robot.arms[0].model.tubeCount(), 3);
}

TEST(AnyRobot, CathetersHaveTheirArmsInTheOrderOfTheMechanismsJoints) {
  Folder folder;
  std::string text = replaced(readAll(preset("ablation-pair")), "    - {arm: arm_a, type", "    - {arm: arm_B, type");
  text = replaced(replaced(text, "    - {arm: arm_b, type", "    - {arm: arm_a, type"), "arm: arm_B", "arm: arm_b");
  const Robot robot = loadAnyRobot(folder.write("pair.yaml", text));
  EXPECT_EQ(robot.type, "cooperative");
  const auto& file = static_cast<const CooperativeRobot&>(*robot.data);
  ASSERT_EQ(robot.arms.size(), 2u);
  EXPECT_EQ(robot.arms[0].name, "arm_b");
  EXPECT_EQ(robot.arms[0].home, file.arms[1].home);
  EXPECT_EQ(robot.arms[0].jointCount(), 3);
  EXPECT_EQ(robot.arms[0].model.tubeCount(), 0);
  EXPECT_EQ(robot.arms[1].limits.joints[0].upper, 0.12);
  EXPECT_NEAR(file.arms[0].outer_diameter, 2.333e-3, 1e-12);
  const Robot assist = loadAnyRobot(preset("ablation-assist"));
  const auto& assist_file = static_cast<const CooperativeRobot&>(*assist.data);
  const Assistance& relation = *assist_file.assistance;
  EXPECT_EQ(assist.arms[0].name, assist_file.arms[static_cast<std::size_t>(relation.target)].name);
  EXPECT_EQ(assist.arms[1].name, assist_file.arms[static_cast<std::size_t>(relation.assist)].name);
}

TEST(AnyRobot, RefusesRobotsThatServicesCannotControl) {
  Folder folder;
  const std::string good = readAll(preset("ablation-pair"));
  const auto refusal = [&](const std::string& text) {
    const auto file = folder.write("robot.yaml", text);
    return refusalOf([&] { loadAnyRobot(file); });
  };
  const std::string none = refusal(good.substr(0, good.find("object:\n")) + good.substr(good.find("control:\n")));
  EXPECT_NE(none.find("object: found neither `object` nor `assistance`"), std::string::npos) << none;
  std::string third = good.substr(good.find("  - name: arm_b"));
  third = replaced(third.substr(0, third.find("\n\n")), "arm_b", "arm_c") + "\n\n";
  const std::string idle = refusal(replaced(good, "# Assumption: a light", third + "# Assumption: a light"));
  EXPECT_NE(idle.find("arms[2].name: found 'arm_c', which takes no part"), std::string::npos) << idle;
  const std::string margin = refusal(replaced(good, "  period_ms: 10", "  period_ms: 10\n  least_distance_mm: 1"));
  EXPECT_NE(margin.find("control.least_distance_mm: found 1 mm, expected 0"), std::string::npos) << margin;
}

TEST(AnyRobot, DeploymentsOfCathetersRefuseWhatOnlyTubesHave) {
  Folder folder;
  const std::string good = replaced(readAll(presets() / "deployments/ablation-pair.yaml"),
                                    "../cooperative/ablation-pair.yaml", "ablation-pair");
  EXPECT_EQ(loadDeployment(folder.write("good.yaml", good)).robot, preset("ablation-pair")) << "by the preset's name";
  const std::pair<const char*, const char*> cases[] = {
      {"hardware: ark2024-two-buses", "hardware: found drives for the catheters of ablation-pair.yaml"},
      {"port: {radius_mm: 5, depth_mm: 10}", "port: found a port for the catheters"},
      {"plant: {seed: 3}", "plant: found a plant that differs for the catheters"},
      {"plant: {model: compliant, tube_errors: [{arm: arm_a, tube: 1, length: 0.1}]}", "plant: found a plant"},
      {"model: compliant", "model: found 'compliant' for the catheters"},
      {"feedback: sensor", "feedback: found 'sensor' for the catheters"},
  };
  const std::size_t place = good.find("prefix: tandem");
  const auto lines = std::count(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(place), '\n');
  const std::string at = "bad.yaml:" + std::to_string(lines + 1) + ":";
  for (const auto& [line, words] : cases) {
    const auto file =
        folder.write("bad.yaml", replaced(good, "prefix: tandem", std::string(line) + "\nprefix: tandem"));
    const std::string refusal = refusalOf([&] { loadDeployment(file); });
    EXPECT_NE(refusal.find(words), std::string::npos) << line << ": " << refusal;
    EXPECT_NE(refusal.find(at), std::string::npos) << "the line: " << refusal;
  }
}

}  // namespace
}  // namespace tandem::config::test
