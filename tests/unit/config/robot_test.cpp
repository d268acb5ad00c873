// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>

#include "support.h"

namespace tandem::config::test {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

/// All keys of a robot file, each with another value than its default.
const char* const kComplete = R"(tandem: robot/1
name: bench
hardware: true
arms:
  - name: left
    type: concentric_tubes
    base: {position_mm: [1, 2, 3], rpy_deg: [10, 20, 30]}
    tool: {position_m: [0, 0, 0.004], rpy_rad: [0, 0, 0.5]}
    tubes:
      - {outer_diameter_mm: 1, inner_diameter_mm: 0, youngs_modulus_GPa: 60, poisson_ratio: 0.3,
         sections: [{length_mm: 250, curvature_per_mm: 0},
                    {length_mm: 70, curvature_per_m: -5, bending_stiffness_Nm2: 0.002, torsional_stiffness_Nm2: 0.001},
                    {length_m: 0.03, curvature_per_mm: -0.01, torsion_per_mm: 0.02}]}
      - {outer_diameter_m: 0.0018, inner_diameter_m: 0.0012, youngs_modulus_Pa: 5.8e10, poisson_ratio: 0.33,
         straight_length_m: 0.2, curved_length_m: 0.04, curvature_per_m: 5}
    limits:
      carriage_spacing_mm: [2]
      minimum_extension_mm: 3
      stage_minimum_mm: [-330, -220]
      stage_maximum_mm: [-4, -1]
      translation:
        velocity_mm_per_s: 5
        approach_acceleration_mm_per_s2: 1
        slew_limit_m_per_s2: 0.2
        stop_deceleration_m_per_s2: 0.3
        max_step_mm: 0.5
      rotation:
        lower_deg: -180
        upper_deg: 270
        velocity_deg_per_s: 90
        approach_acceleration_rad_per_s2: 2
        slew_limit_rad_per_s2: 3
        stop_deceleration_rad_per_s2: 4
        max_step_deg: 2
    home: {beta_mm: [-100, -60], alpha_deg: [90, -45]}
control:
  period_ms: 20
  bounds: frozen
  backend: ipopt
  nsp_damping_mm: 0.2
  track_weight: 1e7
  translation_weight: 20
  rotation_weight: 0.002
  nspqp_zeta: 1e-5
  snsqp_zeta: 0.01
  snsqp_rotation_velocity_rad_per_s: 0.7
  translation_step_mm: 0.8
  singular_lever_mm: 0.4
  posture_gain_per_s: 1.5
  hqp_zeta: 0.002
  spread_distance_mm: 3
  spread_gain_per_s: 0.5
  barrier_gain_per_s: 4
  least_stability: 0.3
  least_distance_mm: 5
)";

Robot load(const std::string& text) {
  const Folder folder;
  return loadRobot(folder.write("robot.yaml", text));
}

TEST(Robot, Ark2024HasTheTubesOfTable1AndTheTenthOfItsCurvatures) {
  const Robot robot = loadRobot(presets() / "robots/ark2024.yaml");
  EXPECT_EQ(robot.name, "ark2024");
  EXPECT_FALSE(robot.hardware);
  ASSERT_EQ(robot.arms.size(), 2u);
  const double outer[] = {1.524e-3, 1.8e-3, 2.164e-3};
  const double inner[] = {1.3e-3, 1.62e-3, 2e-3};
  const double straight[] = {0.387, 0.267, 0.149};
  const double curvature[] = {10.0, 5.0, 7.0};
  for (const Arm& arm : robot.arms) {
    ASSERT_EQ(arm.model.tubeCount(), 3);
    for (int i = 0; i < 3; ++i) {
      const kinematics::Tube& tube = arm.model.tubes[i];
      EXPECT_DOUBLE_EQ(tube.outer_diameter, outer[i]);
      EXPECT_DOUBLE_EQ(tube.inner_diameter, inner[i]);
      EXPECT_DOUBLE_EQ(tube.youngs_modulus, 58e9);
      EXPECT_DOUBLE_EQ(tube.poisson_ratio, 0.6);
      EXPECT_DOUBLE_EQ(tube.sections[0].length, straight[i]);
      EXPECT_DOUBLE_EQ(tube.sections[1].length, 0.05);
      EXPECT_DOUBLE_EQ(tube.sections[1].curvature, curvature[i]);
      EXPECT_DOUBLE_EQ(arm.limits.joints[i].velocity, 5e-3);
      EXPECT_DOUBLE_EQ(arm.limits.joints[i].approach_acceleration, 1e-3);
      EXPECT_EQ(arm.limits.joints[i].slew_limit, safety::kUnlimited);
      EXPECT_DOUBLE_EQ(arm.limits.joints[i].stop_deceleration, 0.1);
      EXPECT_EQ(arm.limits.joints[3 + i].upper, safety::kUnlimited);
      EXPECT_EQ(arm.limits.joints[3 + i].lower, -safety::kUnlimited);
      EXPECT_EQ(arm.limits.joints[3 + i].velocity, safety::kUnlimited);
      EXPECT_DOUBLE_EQ(arm.limits.joints[3 + i].stop_deceleration, 20.0);
    }
    EXPECT_LE(safety::largestViolation(arm.limits, arm.home), 0.0);
  }
  EXPECT_TRUE(robot.arms[0].model.base.translation().isApprox(Eigen::Vector3d(0, 5e-3, 0)));
  EXPECT_TRUE(robot.arms[1].model.base.translation().isApprox(Eigen::Vector3d(0, -5e-3, 0)));
  EXPECT_TRUE(robot.arms[0].model.base.linear().isIdentity());
}

TEST(Robot, Ark2024HasTheDefaultMethodParameters) {
  const control::MethodParameters read = loadRobot(presets() / "robots/ark2024.yaml").parameters;
  const control::MethodParameters usual;
  EXPECT_DOUBLE_EQ(read.period, usual.period);
  EXPECT_EQ(read.bounds, usual.bounds);
  EXPECT_DOUBLE_EQ(read.track_weight, usual.track_weight);
  EXPECT_DOUBLE_EQ(read.translation_weight, usual.translation_weight);
  EXPECT_DOUBLE_EQ(read.rotation_weight, usual.rotation_weight);
  EXPECT_DOUBLE_EQ(read.nspqp_zeta, usual.nspqp_zeta);
  EXPECT_DOUBLE_EQ(read.snsqp_zeta, usual.snsqp_zeta);
  EXPECT_DOUBLE_EQ(read.snsqp_rotation_velocity, usual.snsqp_rotation_velocity);
}

TEST(Robot, AsPrintedDiffersByTheCurvaturesAndWarnsOfStrain) {
  const Robot usual = loadRobot(presets() / "robots/ark2024.yaml");
  const Robot printed = loadRobot(presets() / "robots/ark2024-as-printed.yaml");
  EXPECT_EQ(usual.warnings.size(), 6u);     // Poisson's ratio of each tube
  EXPECT_EQ(printed.warnings.size(), 12u);  // ... and its strain
  for (int i = 0; i < 3; ++i) {
    const kinematics::Tube& tube = printed.arms[1].model.tubes[i];
    EXPECT_DOUBLE_EQ(tube.sections[1].curvature, 10.0 * usual.arms[1].model.tubes[i].sections[1].curvature);
  }
  EXPECT_NE(printed.warnings[1].find("strains the wall by 7.6 %"), std::string::npos) << printed.warnings[1];
  EXPECT_NE(printed.warnings[1].find("arms[0].tubes[0].curvature_per_mm"), std::string::npos) << printed.warnings[1];
}

TEST(Robot, EveryKeyReachesItsField) {
  expectEveryKey(kComplete, robotTable());
  const Robot robot = load(kComplete);
  EXPECT_EQ(robot.name, "bench");
  EXPECT_TRUE(robot.hardware);
  EXPECT_TRUE(robot.warnings.empty());
  const Arm& arm = robot.arms.at(0);
  EXPECT_EQ(arm.name, "left");
  const Eigen::Matrix3d rotation = (Eigen::AngleAxisd(30 * kDegree, Eigen::Vector3d::UnitZ()) *
                                    Eigen::AngleAxisd(20 * kDegree, Eigen::Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(10 * kDegree, Eigen::Vector3d::UnitX()))
                                       .toRotationMatrix();
  EXPECT_TRUE(arm.model.base.linear().isApprox(rotation));
  EXPECT_TRUE(arm.model.base.translation().isApprox(Eigen::Vector3d(1e-3, 2e-3, 3e-3)));
  EXPECT_TRUE(arm.model.tool.translation().isApprox(Eigen::Vector3d(0, 0, 4e-3)));
  EXPECT_TRUE(arm.model.tool.linear().isApprox(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()).toRotationMatrix()));
  const kinematics::Tube& inner = arm.model.tubes[0];
  ASSERT_EQ(inner.sections.size(), 3u);
  EXPECT_DOUBLE_EQ(inner.length(), 0.35);
  EXPECT_DOUBLE_EQ(inner.sections[0].length, 0.25);
  EXPECT_EQ(inner.sections[0].curvature, 0.0);
  EXPECT_DOUBLE_EQ(inner.sections[0].bending_stiffness, inner.bendingStiffness());
  EXPECT_DOUBLE_EQ(inner.sections[0].torsional_stiffness, inner.torsionalStiffness());
  EXPECT_DOUBLE_EQ(inner.sections[1].curvature, -5.0);
  EXPECT_DOUBLE_EQ(inner.sections[1].bending_stiffness, 2e-3);
  EXPECT_DOUBLE_EQ(inner.sections[1].torsional_stiffness, 1e-3);
  EXPECT_DOUBLE_EQ(inner.sections[2].length, 0.03);
  EXPECT_DOUBLE_EQ(inner.sections[2].curvature, -10.0);
  EXPECT_DOUBLE_EQ(inner.sections[2].helix_torsion, 20.0);
  EXPECT_DOUBLE_EQ(arm.model.tubes[0].youngs_modulus, 60e9);
  EXPECT_DOUBLE_EQ(arm.model.tubes[1].outer_diameter, 1.8e-3);
  EXPECT_DOUBLE_EQ(arm.model.tubes[1].youngs_modulus, 58e9);
  EXPECT_DOUBLE_EQ(arm.model.tubes[1].sections[1].curvature, 5.0);
  EXPECT_TRUE(arm.home.isApprox(Eigen::Vector4d(-0.1, -0.06, 90 * kDegree, -45 * kDegree)));
  const control::MethodParameters& p = robot.parameters;
  EXPECT_DOUBLE_EQ(p.period, 0.02);
  EXPECT_EQ(p.bounds, control::BoundsKind::kFrozen);
  EXPECT_EQ(p.backend, control::Backend::kIpopt);
  EXPECT_DOUBLE_EQ(p.nsp_damping, 2e-4);
  EXPECT_DOUBLE_EQ(p.track_weight, 1e7);
  EXPECT_DOUBLE_EQ(p.translation_weight, 20.0);
  EXPECT_DOUBLE_EQ(p.rotation_weight, 0.002);
  EXPECT_DOUBLE_EQ(p.nspqp_zeta, 1e-5);
  EXPECT_DOUBLE_EQ(p.snsqp_zeta, 0.01);
  EXPECT_DOUBLE_EQ(p.snsqp_rotation_velocity, 0.7);
  EXPECT_DOUBLE_EQ(p.translation_step, 8e-4);
  EXPECT_DOUBLE_EQ(p.singular_lever, 4e-4);
  EXPECT_DOUBLE_EQ(p.posture_gain, 1.5);
  EXPECT_DOUBLE_EQ(p.hqp_zeta, 0.002);
  EXPECT_DOUBLE_EQ(p.spread_distance, 3e-3);
  EXPECT_TRUE(p.spread_gain == 0.5 && p.barrier_gain == 4.0);
  EXPECT_TRUE(p.least_stability == 0.3 && p.least_distance == 5e-3);
}

TEST(Robot, LimitsReachTheirFields) {
  const safety::ArmLimits limits = load(kComplete).arms[0].limits;
  const safety::JointLimit& beta = limits.joints[0];
  EXPECT_DOUBLE_EQ(beta.lower, -0.33);
  EXPECT_DOUBLE_EQ(beta.upper, -0.004);
  EXPECT_DOUBLE_EQ(beta.velocity, 5e-3);
  EXPECT_DOUBLE_EQ(beta.approach_acceleration, 1e-3);
  EXPECT_DOUBLE_EQ(beta.slew_limit, 0.2);
  EXPECT_DOUBLE_EQ(beta.stop_deceleration, 0.3);
  EXPECT_DOUBLE_EQ(beta.max_step, 5e-4);
  const safety::JointLimit& alpha = limits.joints[3];
  EXPECT_DOUBLE_EQ(alpha.lower, -std::numbers::pi);
  EXPECT_DOUBLE_EQ(alpha.upper, 1.5 * std::numbers::pi);
  EXPECT_DOUBLE_EQ(alpha.velocity, std::numbers::pi / 2);
  EXPECT_DOUBLE_EQ(alpha.approach_acceleration, 2.0);
  EXPECT_DOUBLE_EQ(alpha.slew_limit, 3.0);
  EXPECT_DOUBLE_EQ(alpha.stop_deceleration, 4.0);
  EXPECT_DOUBLE_EQ(alpha.max_step, 2 * kDegree);
  ASSERT_EQ(limits.rows.size(), 2u);
  for (const safety::LinearRow& row : limits.rows) {
    const bool spacing = row.kind == safety::RowKind::kCarriageSpacing;
    EXPECT_NEAR(row.b, spacing ? -2e-3 : 0.35 - 0.24 - 3e-3, 1e-15);
  }
}

TEST(Robot, WithoutAHomeEveryTubeIsHalfExtended) {
  std::string text = readAll(presets() / "robots/ark2024.yaml");
  text = replaced(text, "    home: {beta_mm: [-150, -100, -50], alpha_deg: [180, 90, 45]}\n", "");
  const Robot robot = load(text);
  const Arm& arm = robot.arms[0];
  for (int i = 0; i < 3; ++i)
    EXPECT_NEAR(arm.home[i], -arm.model.tubes[i].length() / 2, 1e-12);
  EXPECT_EQ(arm.home.tail(3).norm(), 0.0);
  EXPECT_LE(safety::largestViolation(arm.limits, arm.home), 0.0);
}

TEST(Robot, Refusals) {
  const std::string ark = readAll(presets() / "robots/ark2024.yaml");
  const auto load_file = [](const std::filesystem::path& file) { loadRobot(file); };
  const std::string tube = "arms[0].tubes[0].";
  const Refusal refusals[] = {
      {"{outer_diameter_mm:", "{outer_diameter:", "outer_diameter:", 0, tube + "outer_diameter",
       "a key without its unit; expected outer_diameter_mm or outer_diameter_m"},
      {"{outer_diameter_mm:", "{outer_diameter_cm:", "outer_diameter_cm:", 0, tube + "outer_diameter_cm",
       "'cm' is not a unit of a length here; expected outer_diameter_mm or outer_diameter_m"},
      {"youngs_modulus_GPa:", "youngs_modulus_mm:", "youngs_modulus_mm:", 0, tube + "youngs_modulus_mm",
       "'mm' is not a unit of a modulus here"},
      {"poisson_ratio:", "poison_ratio:", "poison_ratio:", 0, tube + "poison_ratio", "did you mean poisson_ratio?"},
      {"hardware: false", "colour: false", "colour", 0, "colour",
       "unknown key; expected one of tandem, name, hardware"},
      {"inner_diameter_mm: 1.3,", "inner_diameter_mm: 1.3, inner_diameter_mm: 1.3,", " inner_diameter_mm: 1.3, y", 1,
       tube + "inner_diameter_mm", "appears twice"},
      {"inner_diameter_mm: 1.3,", "inner_diameter_mm: 1.3, inner_diameter_m: 0.0013,", "inner_diameter_m:", 0,
       tube + "inner_diameter_m", "found together with inner_diameter_mm"},
      {"inner_diameter_mm: 1.3, ", "", "{outer_diameter_mm: 1.524", 0, tube + "inner_diameter_mm",
       "the key is missing"},
      {"1.524", ".nan", ".nan", 0, tube + "outer_diameter_mm",
       "found the text \".nan\", expected a length more than 0 in mm"},
      {"1.524", "inf", "inf,", 0, tube + "outer_diameter_mm", "expected a length more than 0 in mm"},
      {"1.524", "1e999", "1e999", 0, tube + "outer_diameter_mm", "expected a length"},
      {"1.524", "\"1.524\"", "\"1.524\"", 0, tube + "outer_diameter_mm", "found the text \"1.524\", expected a length"},
      {"1.524", "-1.524", "-1.524", 0, tube + "outer_diameter_mm", "found -1.524, expected a length more than 0"},
      {"1.524", "[1.524]", "[1.524]", 0, tube + "outer_diameter_mm", "found a list of 1, expected a length"},
      {"1.524", "", "outer_diameter_mm:", 0, tube + "outer_diameter_mm", "found nothing, expected a length"},
      {"1.3,", "1.6,", "1.6,", 0, tube + "inner_diameter_mm",
       "found 1.6 mm, expected less than the outer diameter of 1.524"},
      {"1.62,", "1.5,", "1.5, y", 0, "arms[0].tubes[1].inner_diameter_mm", "swapped tubes?"},
      {"straight_length_mm: 267", "straight_length_mm: 387",
       "straight_length_mm: 387, curved_length_mm: 50, curvature_per_mm: 0.005", 20,
       "arms[0].tubes[1].straight_length_mm", "swapped tubes?"},
      {"poisson_ratio: 0.6", "poisson_ratio: -1", "-1,", 0, tube + "poisson_ratio",
       "expected a finite number more than -1"},
      {"hardware: false", "hardware: yes", "yes", 0, "hardware", "found the text \"yes\", expected true or false"},
      {"name: arm_b", "name: arm_a", "name: arm_a\n    type: concentric_tubes\n    base: {position_mm: [0, -5", 6,
       "arms[1].name", "found 'arm_a' a second time"},
      {"name: arm_a", "name: Arm A", "Arm A", 0, "arms[0].name", "expected a name of lower-case letters"},
      {"concentric_tubes", "rods", "rods", 0, "arms[0].type", "found the text \"rods\", expected concentric_tubes"},
      {"[0, 5, 0]", "[0, 5]", "[0, 5]", 0, "arms[0].base.position_mm", "found a list of 2, expected a list of 3"},
      {"[0, 5, 0]", "[0, x, 0]", "x, 0]", 0, "arms[0].base.position_mm[1]",
       "found the text \"x\", expected a length in mm"},
      {"carriage_spacing_mm: 0", "carriage_spacing_mm: [1, 2, 3]", "[1, 2, 3]", 0, "arms[0].limits.carriage_spacing_mm",
       "found a list of 3, expected a list of 2"},
      {"carriage_spacing_mm: 0", "carriage_spacing_mm: 200", "carriage_spacing_mm: 200", 0, "arms[0].limits",
       "limits without any feasible position"},
      {"carriage_spacing_mm: 0", "stage_minimum_mm: [-500, -300, -100]", "-500", 0,
       "arms[0].limits.stage_minimum_mm[0]", "found -500 mm, expected -437 mm"},
      {"lower_deg: unlimited, upper_deg: unlimited", "lower_deg: 10, upper_deg: -10", "10, upper", 0,
       "arms[0].limits.rotation.lower_deg", "found 10 deg, expected less than upper_deg, -10 deg"},
      {"lower_deg: unlimited", "lower_deg: 60", "45]}", 0, "arms[0].home.alpha_deg[2]",
       "found 45 deg, expected at least 60 deg"},
      {"[-150, -100, -50]", "[-150, -160, -50]", "-160", 0, "arms[0].home.beta_mm[1]",
       "tube 2 against tube 1 (carriage spacing)"},
      {"[-150, -100, -50]", "[-150, -10, -5]", "-10,", 0, "arms[0].home.beta_mm[1]",
       "tube 2 against tube 1 (minimum extension)"},
      {"[-150, -100, -50]", "[-500, -100, -50]", "-500", 0, "arms[0].home.beta_mm[0]",
       "found -500 mm, expected -437 mm to 0 mm"},
      {"[-150, -100, -50]", "[-150, -100]", "[-150, -100]", 0, "arms[0].home.beta_mm",
       "found a list of 2, expected a list of 3"},
      {"period_s: 0.1", "period_s: 0", "0\n  bounds", 0, "control.period_s",
       "found 0, expected a time more than 0 in s"},
      {"bounds: coupled", "bounds: loose", "loose", 0, "control.bounds",
       "found the text \"loose\", expected one of coupled, frozen"},
      {"tandem: robot/1", "tandem: robot/2", "robot/2", 0, "tandem", "found the text \"robot/2\", expected robot/1"},
      {"tandem: robot/1", "tandem: experiment/1", "experiment/1", 0, "tandem", "found experiment/1, expected robot/1"},
      {"tandem: robot/1\n", "", "name: ark2024", 0, "tandem", "found the text \"name\" as the first key"},
  };
  for (const Refusal& refusal : refusals) {
    expectRefusal(ark, refusal, load_file);
  }
}

TEST(Robot, ATubeIsEitherStraightAndCurvedOrMadeOfSections) {
  const auto load_file = [](const std::filesystem::path& file) { loadRobot(file); };
  const std::string first = "arms[0].tubes[0]", second = "arms[0].tubes[1]";
  const std::string section = "{length_mm: 1, curvature_per_mm: 0}";
  std::string nine = section;
  for (int i = 1; i < kinematics::kMaxTubeSections + 1; ++i)
    nine += ", " + section;
  const std::string curved = "straight_length_m: 0.2, curved_length_m: 0.04, curvature_per_m: 5";
  const Refusal refusals[] = {
      {"sections: [", "curvature_per_m: 5, sections: [", "[{length_mm: 250", 0, first + ".sections",
       "found together with curvature_per_m, expected either straight_length, curved_length, curvature or sections"},
      {curved, curved + ", sections: [" + section + "]", "[" + section + "]", 0, second + ".sections",
       "found together with straight_length_m"},
      {",\n         " + curved, "", "{outer_diameter_m:", 0, second,
       "found neither, expected either straight_length, curved_length, curvature or sections"},
      {", curvature_per_m: 5", "", "{outer_diameter_m:", 0, second + ".curvature_per_mm",
       "the key is missing although straight_length_m is present, expected curvature_per_mm or curvature_per_m: "},
      {"{length_mm: 250, curvature_per_mm: 0}", "{length_mm: 250}", "{length_mm: 250}", 0,
       first + ".sections[0].curvature_per_mm", "the key is missing"},
      {"length_mm: 250", "length_mm: 0", "0, curvature_per_mm: 0}", 0, first + ".sections[0].length_mm",
       "found 0, expected a length more than 0 in mm"},
      {"bending_stiffness_Nm2: 0.002", "bending_stiffness_Nm2: 0", "0, torsional", 0,
       first + ".sections[1].bending_stiffness_Nm2", "found 0, expected a stiffness more than 0 in Nm2"},
      {"bending_stiffness_Nm2: 0.002", "bending_stiffness: 0.002", "bending_stiffness:", 0,
       first + ".sections[1].bending_stiffness", "a key without its unit; expected bending_stiffness_Nm2"},
      {curved, "sections: []", "[]}", 0, second + ".sections", "found an empty list, expected a list of 1 to 8"},
      {curved, "sections: [" + nine + "]", "[" + section, 0, second + ".sections",
       "found a list of 9, expected a list of 1 to 8"},
      {curved, "sections: " + section, section, 0, second + ".sections", "expected a list of 1 to 8"},
      {curved, "sections: [{length_mm: 300, curvature_per_m: 1}, {length_mm: 50, curvature_per_m: 0}]",
       "[{length_mm: 300", 0, second + ".sections", "found a tube of 350 mm, expected less than"},
  };
  for (const Refusal& refusal : refusals)
    expectRefusal(kComplete, refusal, load_file);
}

TEST(Robot, StrainWarningNamesTheSection) {
  const Robot robot = load(replaced(kComplete, "curvature_per_m: -5", "curvature_per_m: -100"));
  ASSERT_EQ(robot.warnings.size(), 1u);
  EXPECT_NE(robot.warnings[0].find("arms[0].tubes[0].sections[1].curvature_per_m: found -100 1/m, which strains the "
                                   "wall by 5 %"),
            std::string::npos)
      << robot.warnings[0];
}

TEST(Robot, HardwareNeedsFiniteLimits) {
  const auto load_file = [](const std::filesystem::path& file) { loadRobot(file); };
  const Refusal refusals[] = {
      {"velocity_mm_per_s: 5", "velocity_mm_per_s: unlimited", "unlimited", 0,
       "arms[0].limits.translation.velocity_mm_per_s", "found no limit, expected a finite one"},
      {"lower_deg: -180", "lower_deg: unlimited", "unlimited", 0, "arms[0].limits.rotation.lower_deg",
       "found no limit"},
      {"upper_deg: 270", "upper_deg: unlimited", "unlimited", 0, "arms[0].limits.rotation.upper_deg", "found no limit"},
      {"        velocity_deg_per_s: 90\n", "", "lower_deg", 0, "arms[0].limits.rotation.velocity_rad_per_s",
       "found no limit"},
  };
  for (const Refusal& refusal : refusals)
    expectRefusal(kComplete, refusal, load_file);
  EXPECT_NO_THROW(load(
      replaced(replaced(kComplete, "lower_deg: -180", "lower_deg: unlimited"), "hardware: true", "hardware: false")));
}

TEST(Robot, SyntaxErrorsHaveLineAndColumn) {
  const auto load_file = [](const std::filesystem::path& file) { loadRobot(file); };
  const std::string good = "tandem: robot/1\nname: x\narms: [a]\n";
  expectRefusal(good, {"[a]", "[a", "arms: [a\n", 9, "", "YAML syntax"}, load_file);
  expectRefusal(good, {"[a]", "]", "]", 0, "", "YAML syntax"}, load_file);
  expectRefusal(good, {good, "", "", 0, "", "found an empty file"}, load_file);
  expectRefusal(good, {"name", "---\nname", "---", 0, "", "found text after the end of the YAML document"}, load_file);
  expectRefusal(good, {good, "- 1\n", "- 1", 0, "tandem", "found a list of 1"}, load_file);
  expectRefusal(good, {"tandem", ", tandem", ", tandem", 0, "", "found text after the end"}, load_file);
  try {
    loadRobot("/nowhere/robot.yaml");
    ADD_FAILURE() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.line(), 0);
    EXPECT_STREQ(error.what(), "/nowhere/robot.yaml: found no such file, expected a readable YAML file");
  }
}

}  // namespace
}  // namespace tandem::config::test
