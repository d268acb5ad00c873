// SPDX-License-Identifier: Apache-2.0
/** @file tandem solve: one control step per row. */
#include <iostream>
#include <nlohmann/json.hpp>

#include "config/arm_names.h"
#include "config/robot_files.h"
#include "control/conflict.h"
#include "control/method_names.h"
#include "control/resolver.h"
#include "experiments/csv.h"
#include "robots/capability.h"
#include "services/cli/subcommand.h"
#include "services/runtime/method_library.h"

namespace tandem::cli {
namespace {

struct SolveCommand {
  std::string robot = "ark2024", method = "nspqp", library, backend = "active-set", bounds = "coupled", csv = "-";
  double period = 0.0, zeta = 0.0;
  bool json = false;
};

template <class Enum>
Enum parse(const std::string& option, const std::string& text, std::optional<Enum> value, const std::string& expected) {
  if (!value)
    throw Failure(kUsage, option + ": found '" + text + "', expected " + expected);
  return *value;
}

control::MethodParameters parameters(const SolveCommand& options, const config::Robot& robot) {
  control::MethodParameters p = robot.parameters;
  p.backend =
      parse("--backend", options.backend, idl::fromName<control::Backend>(options.backend), "active-set or ipopt");
  p.bounds = parse("--bounds", options.bounds, idl::fromName<control::BoundsKind>(options.bounds), "coupled or frozen");
  if (options.period > 0.0)
    p.period = options.period;
  if (options.zeta > 0.0)
    p.nspqp_zeta = p.snsqp_zeta = options.zeta;
  return p;
}

/** One step for one row: joints of both arms, v_ab, v_a; of one arm alone, v_a. */
struct SolvedRow {
  std::string status;
  std::vector<double> numbers;
};

class Stepper {
 public:
  Stepper(const SolveCommand& options, const config::Robot& robot)
      : robot_(robot), names_(config::shortArmNames(robot)), arms_(std::min(robot_.armCount(), 2)) {
    const auto method =
        parse("--method", options.method, idl::fromName<control::Method>(options.method), control::methodList());
    resolver_ = control::makeResolver(method, parameters(options, robot));
    problem_.setLimits(robot_.limits().data(), arms_);
    const std::vector<std::string> names = experiments::jointNames(robot);
    for (int k = 0, all = 0; k < arms_; ++k) {
      for (int j = 0; j < robot_.size(k); ++j)
        columns_.push_back({names[static_cast<std::size_t>(all++)],
                            robot_.limits()[static_cast<std::size_t>(k)]->isTranslation(j) ? config::Quantity::kLength
                                                                                           : config::Quantity::kAngle});
    }
    for (const char* task : {"v_ab", "v_a"}) {
      if (arms_ == 1 && std::string(task) == "v_ab")
        continue;
      for (const char* axis : {"_x", "_y", "_z"})
        columns_.push_back({std::string(task) + axis, config::Quantity::kSpeed});
    }
  }

  int joints() const { return problem_.joint_count; }
  int tasks() const { return arms_; }
  /// Joints, then the velocities of the tasks.
  std::vector<config::CsvColumn> columns() const { return columns_; }

  SolvedRow answer(const experiments::CsvRow& row) {
    if (!row.error.empty())
      return {row.error, {}};
    const safety::RobotVector q = Eigen::Map<const Eigen::VectorXd>(row.values.data(), joints());
    problem_.setPosition(q);
    problem_.task_count = arms_;
    control::Task& of_tip = problem_.task[static_cast<std::size_t>(arms_ - 1)];
    for (control::Task& task : problem_.task)
      task.jacobian.setZero(3, joints());
    for (int k = 0; k < arms_; ++k) {
      kinematics::Tip tip;
      const auto arm = static_cast<std::size_t>(k);
      const auto status = robot_.models()[arm]->tip(q.segment(robot_.offset(k), robot_.size(k)), tip);
      if (status != kinematics::ModelStatus::kOk) {
        return {"arm " + names_[arm] + ": " + std::string(kinematics::describe(status)), {}};
      }
      const auto columns = tip.jacobian.topRows<3>();
      problem_.task[0].jacobian.middleCols(robot_.offset(k), robot_.size(k)) = (k == 0 ? 1.0 : -1.0) * columns;
      if (k == 0)
        of_tip.jacobian.middleCols(0, robot_.size(0)) = columns;
    }
    const double* v = row.values.data() + joints();
    for (int t = 0; t < arms_; ++t)
      problem_.task[static_cast<std::size_t>(t)].velocity =
          Eigen::Vector3d::Map(v + 3 * static_cast<std::ptrdiff_t>(t));
    resolver_->solve(problem_, solution_);
    const bool infeasible = solution_.status == control::SolveStatus::kInfeasible;
    if (solution_.status != control::SolveStatus::kSolved && !infeasible)
      return {std::string(control::name(solution_.status)), {}};
    SolvedRow answer{infeasible ? "infeasible: " + control::describe(problem_, solution_.conflict, names_) : "ok",
                     {solution_.velocity.begin(), solution_.velocity.end()}};
    answer.numbers.insert(answer.numbers.end(), solution_.scale.begin(), solution_.scale.begin() + arms_);
    answer.numbers.insert(answer.numbers.end(), {static_cast<double>(solution_.iterations), solution_.kkt_residual});
    return answer;
  }

 private:
  robots::RobotModel robot_;
  std::vector<std::string> names_;
  int arms_;
  std::vector<config::CsvColumn> columns_;
  std::unique_ptr<control::Resolver> resolver_;
  control::StepProblem problem_;
  control::Solution solution_;
};

int runSolve(const SolveCommand& options) {
  config::Robot robot = config::loadAnyRobot(config::findFile(options.robot, config::robotKinds()));
  if (const std::string why = refusal(robot, robots::Capability::kTips); !why.empty())
    throw Failure(kUsage, why);
  if (const std::string found = runtime::loadMethod(options.library, 0.0, robot); !found.empty())
    std::cerr << found << '\n';
  Stepper stepper(options, robot);
  const auto input = openInput(options.csv);
  std::vector<std::string> names;
  for (int j = 1; j <= stepper.joints(); ++j)
    names.push_back("qd_" + std::to_string(j));
  for (int t = 1; t <= stepper.tasks(); ++t)
    names.push_back("s_" + std::to_string(t));
  names.insert(names.end(), {"iterations", "kkt_residual"});
  if (!options.json) {
    for (const std::string& name : names)
      std::cout << name << ',';
    std::cout << "status\n";
  }
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  bool all = true;
  for (const experiments::CsvRow& row : experiments::readRows(*input, stepper.columns(), options.csv)) {
    const SolvedRow answer = stepper.answer(row);
    all = all && answer.status == "ok";
    nlohmann::ordered_json object;
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (options.json && !answer.numbers.empty())
        object[names[i]] = answer.numbers[i];
      if (!options.json)
        std::cout << (answer.numbers.empty() ? "" : experiments::number(answer.numbers[i])) << ',';
    }
    object["status"] = answer.status;
    if (options.json)
      json.push_back(object);
    if (!options.json)
      std::cout << statusField(answer.status) << '\n';
  }
  if (options.json)
    std::cout << json.dump(2) << '\n';
  return all ? kOk : kFailure;
}

}  // namespace

void registerSolve(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<SolveCommand>();
  CLI::App* solve = app.add_subcommand("solve",
                                       "one control step per row: joint velocities for a desired relative velocity "
                                       "v_ab of the tips and velocity v_a of tip A");
  solve->add_option("-r,--robot", options->robot, "robot file or preset")->capture_default_str();
  solve->add_option("-m,--method", options->method, control::methodList())->capture_default_str();
  solve->add_option("--method-library", options->library, "shared library of the method foreign (docs/own-method.md)");
  solve->add_option("-b,--backend", options->backend, "active-set or ipopt")->capture_default_str();
  solve->add_option("--bounds", options->bounds, "coupled, or frozen: the paper's formula, with the inner tube fixed")
      ->capture_default_str();
  solve->add_option("-T,--period", options->period, "control period, s (default: the robot file's)")
      ->check(client::kPositive);
  solve
      ->add_option("-z,--zeta", options->zeta,
                   "damping zeta of equation (7) or (8) of Alsaka et al. 2024 (default: the robot file's)")
      ->check(client::kPositive);
  solve
      ->add_option("--csv", options->csv,
                   "rows q_a(6),q_b(6),v_ab(3),v_a(3) in SI, of one arm q_a(6),v_a(3), or with a header (docs/csv.md); "
                   "- is standard input")
      ->capture_default_str();
  solve->add_flag("--json", options->json, "JSON instead of CSV");
  solve->callback([options, &exit_code] { guarded(exit_code, [&] { return runSolve(*options); }); });
}

}  // namespace tandem::cli
