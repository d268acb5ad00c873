// SPDX-License-Identifier: Apache-2.0
/** @file tandem fk: forward kinematics of CSV rows. */
#include <cmath>
#include <iostream>

#include "config/robot_files.h"
#include "kinematics/compliant_model.h"
#include "robots/robot_type.h"
#include "services/cli/models/arm_options.h"
#include "services/cli/models/table.h"
#include "services/cli/subcommand.h"

namespace tandem::cli {
namespace {

using kinematics::ModelStatus;

struct FkCommand {
  std::string robot = "ark2024", arm = "a", model = "rigid", csv = "-", wrench;
  bool jacobian = false, compliance = false, branch = false, follow = false, end_angles = false;
  bool shape_details = false, json = false, millimetres = false;
  int shape = 0;
};

/** One arm of a robot, with the model that the command names. */
struct FkArm {
  FkArm(const FkCommand& options, const config::Robot& of)
      : file(armOf(of, options.arm)),
        index(static_cast<int>(&file - of.arms.data())),
        robot(of),
        type(robots::typeOf(of)),
        model(makeModel(options.model)) {}

  const config::Arm& file;
  int index;
  const config::Robot& robot;
  const robots::RobotType& type;
  std::unique_ptr<kinematics::ArmModel> model;

 private:
  std::unique_ptr<kinematics::ArmModel> makeModel(const std::string& name) const {
    try {
      return type.makeModel(robot, index, name);
    } catch (const std::invalid_argument& error) {
      throw Failure(kUsage, "--" + std::string(error.what()));
    }
  }
};

void check(const FkCommand& o, const FkArm& arm) {
  const auto refuse = [](bool wrong, const std::string& why) {
    if (wrong)
      throw Failure(kUsage, why);
  };
  for (const auto& [given, option] :
       {std::pair(o.branch, "--branch"), {o.end_angles, "--end-angles"}, {o.shape_details, "--shape-details"}})
    refuse(given && arm.file.model.tubes.empty(), std::string(option) + ": the arm has no tubes; leave it out");
  const bool rigid = !arm.model->carriesLoad();
  const std::string elastic = arm.type.elasticModel();
  const std::string use = elastic.empty() ? "; leave it out" : "; loads and torsion need --model " + elastic;
  refuse(o.shape > 0 && o.jacobian, "--jacobian applies to the tip; remove --jacobian or --shape");
  refuse(o.shape > 0 && o.compliance, "--compliance applies to the tip; remove --compliance or --shape");
  refuse(o.shape > 0 && o.branch, "--branch applies to the tip; remove --branch or --shape");
  refuse(o.shape == 0 && o.shape_details, "--shape-details: needs --shape N");
  refuse(rigid && !o.wrench.empty(), "--wrench: the " + o.model + " model does not deform under a load" + use);
  refuse(rigid && o.compliance, "--compliance: the " + o.model + " model has none" + use);
  refuse(rigid && o.branch, "--branch: the " + o.model + " model has one solution" + use);
  refuse(rigid && o.end_angles, "--end-angles: the " + o.model + " model does not twist" + use);
  refuse(o.end_angles && (o.shape > 0 || o.compliance || o.follow || !o.wrench.empty()),
         "--end-angles: determine the shape of an unloaded arm, one row at a time; leave out --shape, --compliance, "
         "--follow and --wrench");
}

std::vector<std::string> header(const FkCommand& options, const FkArm& arm) {
  const int n = arm.file.model.tubeCount();
  std::vector<std::string> names{"x", "y", "z", "qx", "qy", "qz", "qw"};
  if (options.shape > 0) {
    names.insert(names.begin(), {"row", "s"});
    append(names, numbered("psi", n));
    if (options.shape_details) {
      append(names, {"curvature_x", "curvature_y"});
      append(names, numbered("moment", n));
    }
    return names;
  }
  names.push_back(arm.type.tipColumn());
  if (options.jacobian)
    append(names, numbered("j", 6, arm.file.jointCount()));
  if (options.compliance)
    append(names, numbered("c", 6, 6));
  if (options.end_angles)
    append(names, numbered("alpha", n));
  if (options.branch) {
    append(names, {"stability_at", "conjugate_points"});
    append(names, numbered("winding", n));
    append(names, numbered("theta", n));
  }
  return names;
}

/** Answers rows; remembers the branch from row to row if asked to follow it. */
class Answerer {
 public:
  Answerer(const FkCommand& options, const FkArm& arm) : options_(options), arm_(arm), n_(arm.file.model.tubeCount()) {
    if (!options.wrench.empty())
      wrench_ = numbersOf("--wrench", options.wrench, 6);
  }

  std::string answer(const experiments::CsvRow& row, int index, Table& table) {
    std::string why = options_.end_angles ? row.error : refusal(arm_.file, row);
    if (!options_.follow)
      branch_ = {};
    first_ = !branch_.known;
    if (why.empty()) {
      const Eigen::Map<const Eigen::VectorXd> q(row.values.data(), arm_.file.jointCount());
      why = options_.shape > 0 ? shape(q, index, table) : options_.end_angles ? fromEnds(q, table) : tip(q, table);
    }
    return why;
  }

  /// False where an equilibrium is not stable.
  bool allOk() const { return all_ok_; }

 private:
  bool loaded() const { return options_.compliance || !options_.wrench.empty(); }

  /// "ok", with a snap on the way from the row before.
  std::string okStatus() const {
    if (first_ || !branch_.snapped)
      return "ok";
    std::string windings;
    for (int i = 1; i < n_; ++i)
      windings += " " + std::to_string(branch_.winding(i));
    return "ok, snapped: the followed equilibrium ended between the previous row and this one; windings now" + windings;
  }

  /// @param more  numbers behind the Jacobian
  void addTip(const kinematics::JointsRef& q,
              const kinematics::Tip& tip,
              const std::vector<double>& more,
              const std::string& status,
              Table& table) {
    std::vector<double> numbers = poseNumbers(tip.pose);
    numbers.push_back(arm_.type.tipValue(arm_.robot, arm_.index, q, tip));
    if (options_.jacobian) {
      for (int i = 0; i < 6; ++i) {
        for (int j = 0; j < arm_.file.jointCount(); ++j)
          numbers.push_back(tip.jacobian(i, j));
      }
    }
    append(numbers, more);
    if (options_.branch) {
      append(numbers, {tip.stability_at, static_cast<double>(tip.conjugate_points)});
      for (int i = 0; i < n_; ++i)
        numbers.push_back(branch_.winding(i));
      for (int i = 0; i < n_; ++i)
        numbers.push_back(branch_.end_angle[i]);
    }
    all_ok_ = all_ok_ && status.starts_with("ok");
    table.add(numbers, status);
  }

  std::string tip(const kinematics::JointsRef& q, Table& table) {
    kinematics::LoadedTip tip;
    const ModelStatus status =
        loaded() ? arm_.model->loadedTip(q, wrench_, branch_, tip) : arm_.model->tip(q, branch_, tip);
    const std::string text = statusOf(status, tip);
    if (status != ModelStatus::kOk)
      return text;
    std::vector<double> more;
    for (int i = 0; options_.compliance && i < 36; ++i)
      more.push_back(tip.compliance(i / 6, i % 6));
    addTip(q, tip, more, text == "ok" ? okStatus() : text, table);
    return "";
  }

  std::string fromEnds(const kinematics::JointsRef& ends, Table& table) {
    const auto& compliant = dynamic_cast<const kinematics::CompliantModel&>(*arm_.model);
    kinematics::Tip tip;
    Eigen::VectorXd q = ends;
    const ModelStatus status = compliant.tipFromEndAngles(ends, q.tail(n_), tip);
    const std::string text = statusOf(status, tip);
    if (status != ModelStatus::kOk)
      return text;
    if (const std::string why = refusal(arm_.file, {0, {q.begin(), q.end()}, ""}); !why.empty())
      return why;
    branch_.end_angle.head(n_) = ends.tail(n_);
    addTip(q, tip, {q.end() - n_, q.end()}, text, table);
    return "";
  }

  std::string shape(const kinematics::JointsRef& q, int row, Table& table) {
    std::vector<kinematics::ShapePoint> shape;
    const ModelStatus status = arm_.model->shape(q, wrench_, branch_, options_.shape, shape);
    if (status != ModelStatus::kOk)
      return std::string(kinematics::describe(status));
    const std::string text = okStatus();
    for (const kinematics::ShapePoint& point : shape) {
      std::vector<double> numbers{static_cast<double>(row), point.s};
      append(numbers, poseNumbers(point.pose));
      numbers.insert(numbers.end(), point.psi.begin(), point.psi.begin() + n_);
      if (options_.shape_details) {
        append(numbers, {point.curvature.x(), point.curvature.y()});
        numbers.insert(numbers.end(), point.moment.begin(), point.moment.begin() + n_);
      }
      table.add(numbers, text);
    }
    return "";
  }

  const FkCommand& options_;
  const FkArm& arm_;
  int n_;  ///< number of tubes
  kinematics::Wrench wrench_ = kinematics::Wrench::Zero();
  kinematics::Branch branch_;
  bool first_ = true;  ///< no answer yet on this path
  bool all_ok_ = true;
};

/// Answers all rows of a file; one without an answer has blanks and the reason, and among points of a shape its number.
/// @return whether all have an answer  @param columns  joints of a row
bool answerRows(const FkCommand& options,
                const std::vector<config::CsvColumn>& columns,
                Answerer& answerer,
                Table& table) {
  const auto input = openInput(options.csv);
  bool all = true;
  int index = 0;
  for (const experiments::CsvRow& row : experiments::readRows(*input, columns, options.csv)) {
    const std::string why = answerer.answer(row, ++index, table);
    if (why.empty())
      continue;
    all = false;
    std::vector<double> blank;
    if (options.shape > 0) {
      blank.assign(table.names().size(), std::nan(""));
      blank[0] = index;
    }
    table.add(blank, why);
  }
  table.finish();
  return all;
}

int runFk(const FkCommand& options) {
  const config::Robot robot = config::loadAnyRobot(config::findFile(options.robot, config::robotKinds()));
  const FkArm arm(options, robot);
  check(options, arm);
  Answerer answerer(options, arm);
  Table table(std::cout, header(options, arm), options.json, options.millimetres);
  const bool answered = answerRows(options, jointColumns(arm.file, "", options.end_angles), answerer, table);
  return answered && answerer.allOk() ? kOk : kFailure;
}

}  // namespace

void registerFk(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<FkCommand>();
  CLI::App* fk =
      app.add_subcommand("fk", "forward kinematics of one arm: tip pose, stability, Jacobian or shape per row");
  fk->add_option("-r,--robot", options->robot, "robot file or preset")->capture_default_str();
  fk->add_option("-a,--arm", options->arm, "name of the arm, with or without the prefix arm_")->capture_default_str();
  fk->add_option("-m,--model", options->model,
                 "kinematic model: rigid, or compliant (torsion, loads); of a catheter constant-curvature, or cosserat")
      ->check(CLI::IsMember({"rigid", "compliant", "constant-curvature", "cosserat"}))
      ->capture_default_str();
  fk->add_option("-w,--wrench", options->wrench,
                 "fx,fy,fz,mx,my,mz at the tool tip, N and N m; directions stay those of the base frame");
  fk->add_flag("-j,--jacobian", options->jacobian, "add the 6 x 2n Jacobian by rows (linear rows first; base frame)");
  fk->add_flag("-c,--compliance", options->compliance,
               "add the 6 x 6 compliance of the tool tip by rows: twist per wrench (base frame)");
  fk->add_flag(
      "--branch", options->branch,
      "add columns that identify the equilibrium: position of least stability, conjugate points, windings, end angles");
  fk->add_flag("--follow", options->follow,
               "treat the rows as one joint path and follow the equilibrium from row to row; `status` reports snaps");
  fk->add_flag(
      "--end-angles", options->end_angles,
      "rows are beta_1..beta_n,theta_1..theta_n: angles of the tube ends; adds the motor angles alpha_1..alpha_n");
  fk->add_option("-s,--shape", options->shape, "print N backbone points per input row instead of the tip")
      ->check(CLI::Range(2, 10000));
  fk->add_flag("--shape-details", options->shape_details, "add the points' curvature and the tubes' torsional moments");
  fk->add_option("--csv", options->csv,
                 "rows beta_1..beta_n,alpha_1..alpha_n (of a catheter insertion,roll,bend) in m and rad, or with a "
                 "header that names units (beta_1_mm); - is "
                 "standard input")
      ->capture_default_str();
  fk->add_flag("--mm", options->millimetres,
               "positions in mm and angles in degrees, with units in the names: x_mm, psi_1_deg");
  fk->add_flag("--json", options->json, "JSON instead of CSV");
  fk->footer("Each row is solved independently unless --follow is given. Exit code 1: a row has no stable solution.");
  fk->callback([options, &exit_code] { guarded(exit_code, [&] { return runFk(*options); }); });
}

}  // namespace tandem::cli
