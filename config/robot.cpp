// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "config/detail/loaders.h"
#include "config/file_tables.h"
#include "config/translation_range.h"

namespace tandem::config {
namespace {

using kinematics::Tube;
using safety::JointLimit;

/// Strain that superelastic nitinol recovers.
constexpr double kRecoverableStrain = 0.04;
/// Poisson's ratio of an incompressible isotropic material.
constexpr double kLargestPoissonRatio = 0.5;

void warnOfStrain(const Map& map, const Tube& tube) {
  const double curvature = tube.sections.back().curvature;
  const double strain = std::abs(curvature) * tube.outer_diameter / 2.0;
  if (strain > kRecoverableStrain) {
    map.warn("curvature", "found " + map.inUnit("curvature", curvature) + ", which strains the wall by " +
                              formatNumber(std::round(strain * 1e3) / 10.0) + " %, expected at most 4 %");
  }
}

void checkTorsion(const Map& map, const Tube& tube) {
  const kinematics::TubeSection& section = tube.sections.back();
  if (section.curvature == 0.0 && section.helix_torsion != 0.0)
    map.fail("torsion", "found " + map.inUnit("torsion", section.helix_torsion) +
                            " where the curvature is 0, expected 0: a straight tube has no torsion");
}

void readSections(const Map& map, Tube& tube) {
  if (!map.has("sections")) {
    tube.addSection(map.number("straight_length"), 0.0);
    tube.addSection(map.number("curved_length"), map.number("curvature"), map.number("torsion"));
    warnOfStrain(map, tube);
    checkTorsion(map, tube);
    return;
  }
  if (map.has("torsion"))
    map.fail("torsion", "found together with sections, expected the key in the sections");
  map.each("sections", [&](const Map& section) {
    tube.addSection(section.number("length"), 0.0);  // with the stiffnesses of the cross-section
    section.read(tube.sections.back());
    warnOfStrain(section, tube);
    checkTorsion(section, tube);
  });
}

Tube readTube(const Map& map) {
  Tube tube = map.read<Tube>();
  checkWall(map, tube.outer_diameter, tube.inner_diameter);
  if (tube.poisson_ratio > kLargestPoissonRatio) {
    map.warn(
        "poisson_ratio",
        "found " + formatNumber(tube.poisson_ratio) +
            ", expected at most 0.5, the limit of an isotropic material; the value is used, for G = E / (2 (1 + nu)) "
            "only");
  }
  readSections(map, tube);
  return tube;
}

/// Checks that tube i fits into tube i + 1 and is longer.
void checkNesting(const Map& map, const Tube& inner, const Tube& tube) {
  if (inner.outer_diameter >= tube.inner_diameter) {
    map.fail("inner_diameter", "found " + map.inUnit("inner_diameter", tube.inner_diameter) +
                                   ", expected more than the outer diameter of the tube before, " +
                                   map.inUnit("inner_diameter", inner.outer_diameter) + "; swapped tubes?");
  }
  if (tube.length() >= inner.length()) {
    map.fail(map.has("sections") ? "sections" : "straight_length",
             "found a tube of " + map.inUnit("straight_length", tube.length()) +
                 ", expected less than the length of the tube before, " +
                 map.inUnit("straight_length", inner.length()) + "; swapped tubes?");
  }
}

std::vector<Tube> readTubes(const Map& arm) {
  std::vector<Tube> tubes;
  arm.each("tubes", [&](const Map& map) { tubes.push_back(readTube(map)); });
  std::size_t i = 0;
  arm.each("tubes", [&](const Map& map) {
    const std::size_t tube = i++;
    if (tube > 0)
      checkNesting(map, tubes[tube - 1], tubes[tube]);
  });
  return tubes;
}

JointLimit readRotation(const Map& map, bool hardware) {
  JointLimit limit = map.read<JointLimit>();
  // `unlimited` is read as plus infinity for both limits.
  if (std::isinf(limit.lower))
    limit.lower = -safety::kUnlimited;
  else
    map.expectBelow("lower", "upper");
  for (const auto& [key, value] :
       {std::pair{"lower", limit.lower}, {"upper", limit.upper}, {"velocity", limit.velocity}}) {
    if (hardware && std::isinf(value))
      map.fail(key, "found no limit, expected a finite one where `hardware: true`");
  }
  return limit;
}

JointLimit readTranslation(const Map& map, bool hardware) {
  const auto limit = map.read<JointLimit>();
  if (hardware && std::isinf(limit.velocity)) {
    map.fail("velocity", "found no limit, expected a finite one where `hardware: true`");
  }
  return limit;
}

/// Reads one limit of the linear stages' travel: inside [-l_i, 0], as equation (1) requires.
std::vector<double> readStage(const Map& map,
                              const std::string& key,
                              const std::vector<double>& lengths,
                              bool minimum) {
  std::vector<double> ends;
  for (const double length : lengths)
    ends.push_back(minimum ? -length : 0.0);
  if (!map.has(key))
    return ends;
  const std::vector<double> read = map.numbers(key, static_cast<int>(lengths.size()));
  for (std::size_t i = 0; i < read.size(); ++i) {
    if (read[i] < -lengths[i] || read[i] > 0.0) {
      map.fail(key,
               "found " + map.inUnit(key, read[i]) + ", expected " + map.inUnit(key, -lengths[i]) +
                   " (minus the tube's length) to " + map.inUnit(key, 0.0),
               static_cast<int>(i));
    }
  }
  return read;
}

safety::ArmLimits readLimits(const Map& arm, const std::vector<Tube>& tubes, bool hardware) {
  const Map map = arm.map("limits");
  const int n = static_cast<int>(tubes.size());
  safety::TubeLimitSpec spec;
  for (const Tube& tube : tubes)
    spec.tube_length.push_back(tube.length());
  map.together([&] { spec.carriage_spacing = map.numbers("carriage_spacing", n - 1); },
               [&] { spec.minimum_extension = map.numbers("minimum_extension", n - 1); },
               [&] { spec.stage_minimum = readStage(map, "stage_minimum", spec.tube_length, true); },
               [&] { spec.stage_maximum = readStage(map, "stage_maximum", spec.tube_length, false); },
               [&] { spec.translation = readTranslation(map.map("translation"), hardware); },
               [&] { spec.rotation = readRotation(map.map("rotation"), hardware); });
  try {
    return safety::makeTubeLimits(spec);
  } catch (const std::invalid_argument& error) {
    arm.fail("limits", "found limits without any feasible position: " + std::string(error.what()));
  }
}

/// Middle of the range under equation (1) and the stage limits, tube by tube from the innermost; without margins every
/// tube is half extended.
Eigen::VectorXd middleOf(const safety::ArmLimits& limits) {
  const TranslationRange range(limits);
  const int n = range.tubes();
  Eigen::VectorXd q = Eigen::VectorXd::Zero(2 * n);
  for (int i = 0; i < n; ++i) {
    const auto [lower, upper] = range.of(i, i == 0 ? 0.0 : q[i - 1]);
    q[i] = (lower + upper) / 2.0;
    q[n + i] = std::clamp(0.0, limits.joints[n + i].lower, limits.joints[n + i].upper);
  }
  return q;
}

Arm readArm(const Map& map, bool hardware) {
  auto arm = map.read<Arm>();
  arm.model.base = readPose(map.map("base"));
  arm.model.tool = readPose(map.map("tool"));
  arm.model.tubes = readTubes(map);
  try {
    kinematics::checkArm(arm.model);
  } catch (const std::invalid_argument& error) {
    map.fail("tubes", "found tubes that the model does not support: " + std::string(error.what()));
  }
  for (const char* joint : {"beta_", "alpha_"}) {
    for (int i = 1; i <= arm.model.tubeCount(); ++i)
      arm.joint_names.push_back(joint + std::to_string(i));
  }
  arm.limits = readLimits(map, arm.model.tubes, hardware);
  arm.home = map.has("home") ? readJoints(map.map("home"), arm.limits) : middleOf(arm.limits);
  return arm;
}

}  // namespace

Robot loadRobot(const std::filesystem::path& file) {
  Document document(file.string(), readFile(file));
  const Map map = document.check(robotTable());
  Robot robot = map.read<Robot>();
  robot.file = file;
  readArms(map, [&](const Map& arm) { robot.arms.push_back(readArm(arm, robot.hardware)); });
  document.finish();
  robot.warnings = document.warnings();
  return robot;
}

}  // namespace tandem::config
