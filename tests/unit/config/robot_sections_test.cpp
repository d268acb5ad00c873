// SPDX-License-Identifier: Apache-2.0
#include "support.h"

namespace tandem::config::test {
namespace {

const std::string kStraight = "straight_length_mm: 387, curved_length_mm: 50", kCurvature = "curvature_per_mm: 0.01}";

std::string ark() { return readAll(presets() / "robots/ark2024.yaml"); }

Robot load(const std::string& text) {
  const Folder folder;
  return loadRobot(folder.write("robot.yaml", text));
}

TEST(RobotSections, SectionsSayTheSameAsLengths) {
  const Robot usual = load(ark());
  const Robot robot =
      load(replaced(ark(), "straight_length_mm: 387, curved_length_mm: 50, curvature_per_mm: 0.01}",
                    "sections: [{length_mm: 387, curvature_per_mm: 0}, {length_mm: 50, curvature_per_mm: 0.01}]}"));
  const kinematics::Tube &a = usual.arms[0].model.tubes[0], &b = robot.arms[0].model.tubes[0];
  ASSERT_EQ(b.sections.size(), 2u);
  for (int k = 0; k < 2; ++k) {
    EXPECT_EQ(a.sections[k].length, b.sections[k].length);
    EXPECT_EQ(a.sections[k].curvature, b.sections[k].curvature);
    EXPECT_EQ(a.sections[k].bending_stiffness, b.sections[k].bending_stiffness);
    EXPECT_EQ(a.sections[k].torsional_stiffness, b.sections[k].torsional_stiffness);
  }
  EXPECT_EQ(usual.arms[0].home, robot.arms[0].home);
}

TEST(RobotSections, MayBeHelices) {
  const Robot robot = load(replaced(ark(), kCurvature, "curvature_per_mm: 0.01, torsion_per_m: -30}")),
              circles = load(ark());
  const auto& tubes = robot.arms[0].model.tubes;
  EXPECT_EQ(tubes[0].sections[0].helix_torsion, 0.0);
  EXPECT_DOUBLE_EQ(tubes[0].sections[1].helix_torsion, -30.0);
  EXPECT_TRUE(tubes[0].isHelical());
  EXPECT_FALSE(tubes[1].isHelical());
  EXPECT_FALSE(circles.arms[0].model.tubes[0].isHelical());
}

TEST(RobotSections, RefuseATorsionWithoutACurve) {
  const std::string tube = "arms[0].tubes[0]", both = kStraight + ", " + kCurvature;
  const std::string sections = "sections: [{length_mm: 387, curvature_per_mm: 0";
  const Refusal refusals[] = {
      {both, sections + "}, {length_mm: 50, curvature_per_mm: 0.01}], torsion_per_m: 3}", "torsion_per_m: 3", 15,
       tube + ".torsion_per_m", "found together with sections, expected the key in the sections"},
      {both, sections + ", torsion_per_m: 3}]}", "torsion_per_m: 3", 15, tube + ".sections[0].torsion_per_m",
       "where the curvature is 0, expected 0: a straight tube has no torsion"},
      {kCurvature, "curvature_per_mm: 0, torsion_per_m: -3}", "torsion_per_m: -3", 15, tube + ".torsion_per_m",
       "where the curvature is 0, expected 0: a straight tube has no torsion"},
      {kCurvature, "curvature_per_mm: 0.01, torsion_per_m: .inf}", ".inf", 0, tube + ".torsion_per_m",
       "expected a curvature"},
      {kCurvature, "curvature_per_mm: 0.01, torsion_per_mm: 0.02, torsion_per_m: 20}", "torsion_per_m: 20", 0,
       tube + ".torsion_per_m", "found together with torsion_per_mm"},
  };
  for (const Refusal& refusal : refusals)
    expectRefusal(ark(), refusal, [](const std::filesystem::path& file) { loadRobot(file); });
}

}  // namespace
}  // namespace tandem::config::test
