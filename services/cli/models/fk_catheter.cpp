// SPDX-License-Identifier: Apache-2.0
#include <iostream>

#include "config/cooperative.h"
#include "services/cli/models/arm_options.h"
#include "services/cli/models/fk.h"
#include "services/cli/models/table.h"
#include "services/cli/subcommand.h"

namespace tandem::cli {
namespace {

namespace catheter = kinematics::catheter;
using kinematics::ModelStatus;

void checkCatheter(const FkOptions& o, bool elastic) {
  const auto refuse = [](bool wrong, const std::string& why) {
    if (wrong)
      throw Failure(kUsage, why);
  };
  refuse(o.branch, "--branch: a catheter has no windings; leave it out");
  refuse(o.end_angles, "--end-angles: a catheter has no tubes; leave it out");
  refuse(o.shape_details, "--shape-details: a catheter has no tubes; leave it out");
  refuse(o.shape > 0 && (o.jacobian || o.compliance),
         "--jacobian and --compliance apply to the tip; remove them or --shape");
  refuse(!elastic && (!o.wrench.empty() || o.compliance || o.follow),
         "--wrench, --compliance and --follow need --model cosserat");
}

std::vector<std::string> catheterHeader(const FkOptions& o) {
  std::vector<std::string> names{"x", "y", "z", "qx", "qy", "qz", "qw"};
  if (o.shape > 0) {
    names.insert(names.begin(), {"row", "s"});
    return names;
  }
  names.push_back("pull");
  if (o.jacobian)
    append(names, numbered("j", 6, catheter::kJoints));
  if (o.compliance)
    append(names, numbered("c", 6, 6));
  return names;
}

/** Answers rows of joints. */
class CatheterAnswerer {
 public:
  CatheterAnswerer(const FkOptions& options, const config::CatheterArm& arm, bool elastic)
      : options_(options), arm_(arm), elastic_(elastic), rigid_model_(arm.model.arm), elastic_model_(arm.model) {
    if (!options.wrench.empty())
      wrench_ = numbersOf("--wrench", options.wrench, 6);
  }

  std::string answer(const experiments::CsvRow& row, int index, Table& table) {
    std::string why = row.error;
    if (!options_.follow)
      branch_ = {};
    if (why.empty()) {
      const Eigen::Vector3d q(row.values[0], row.values[1], row.values[2]);
      const safety::LimitViolation outside = safety::worstLimitViolation(arm_.limits, q);
      if (outside.amount > experiments::kViolation)
        why = "outside the limits of the robot file: " +
              safety::describe(outside, arm_.limits,
                               config::kCatheterJoints.at(static_cast<std::size_t>(outside.joint))) +
              " outside";
      else
        why = options_.shape > 0 ? shape(q, index, table) : tip(q, table);
    }
    return why;
  }

  /// False where an equilibrium is not stable.
  bool allOk() const { return all_ok_; }

 private:
  std::string tip(const Eigen::Vector3d& q, Table& table) {
    kinematics::LoadedTip tip;
    const ModelStatus status = elastic_ ? elastic_model_.tip(q, wrench_, branch_, tip) : rigid_model_.tip(q, tip);
    const std::string text = statusOf(status, tip);
    if (status != ModelStatus::kOk)
      return text;
    std::vector<double> numbers = poseNumbers(tip.pose);
    // A wire off the axis by r is shorter by r b on the inside of a bend b: exact for arcs, and what the knob commands.
    numbers.push_back(arm_.tendon_offset * q[catheter::kBend]);
    for (int i = 0; options_.jacobian && i < 18; ++i)
      numbers.push_back(tip.jacobian(i / 3, i % 3));
    for (int i = 0; options_.compliance && i < 36; ++i)
      numbers.push_back(tip.compliance(i / 6, i % 6));
    all_ok_ = all_ok_ && text == "ok";
    table.add(numbers, text);
    return "";
  }

  std::string shape(const Eigen::Vector3d& q, int row, Table& table) {
    const auto add = [&](double s, const Eigen::Isometry3d& pose) {
      std::vector<double> numbers{static_cast<double>(row), s};
      append(numbers, poseNumbers(pose));
      table.add(numbers, "ok");
    };
    ModelStatus status = ModelStatus::kOk;
    if (elastic_) {
      std::vector<kinematics::cosserat::RodPoint> points;
      status = elastic_model_.shape(q, wrench_, branch_, options_.shape, points);
      for (const auto& point : points)
        add(point.s, point.pose);
    } else {
      std::vector<kinematics::ShapePoint> points;
      status = rigid_model_.shape(q, options_.shape, points);
      for (const auto& point : points)
        add(point.s, point.pose);
    }
    return status == ModelStatus::kOk ? "" : std::string(kinematics::describe(status));
  }

  const FkOptions& options_;
  const config::CatheterArm& arm_;
  bool elastic_;
  catheter::ConstantCurvature rigid_model_;
  catheter::ElasticCatheter elastic_model_;
  kinematics::Wrench wrench_ = kinematics::Wrench::Zero();
  kinematics::cosserat::RodBranch branch_;
  bool all_ok_ = true;
};

}  // namespace

int catheterFk(const FkOptions& options, const std::filesystem::path& file) {
  const bool elastic = options.model == "compliant" || options.model == "cosserat";
  checkCatheter(options, elastic);
  const config::CooperativeRobot robot = config::loadCooperative(file);
  static const std::vector<config::CsvColumn> columns{
      {"insertion", config::Quantity::kLength}, {"roll", config::Quantity::kAngle}, {"bend", config::Quantity::kAngle}};
  CatheterAnswerer answerer(options, armOf(robot, options.arm), elastic);
  Table table(std::cout, catheterHeader(options), options.json, options.millimetres);
  const bool answered = answerRows(options, columns, std::bind_front(&CatheterAnswerer::answer, &answerer), table);
  return answered && answerer.allOk() ? kOk : kFailure;
}

}  // namespace tandem::cli
