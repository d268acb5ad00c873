// SPDX-License-Identifier: Apache-2.0
/** @file tandem fk: forward kinematics, rows in, rows out. */
#include <iostream>
#include <nlohmann/json.hpp>

#include "experiments/csv.h"
#include "services/cli/arguments.h"

namespace tandem::cli {
namespace {

struct Options {
  std::string robot = "ark2024", arm = "a", model = "rigid", csv = "-";
  bool jacobian = false, json = false;
  int shape = 0;
};

int armIndex(const config::Robot& robot, const std::string& name) {
  for (std::size_t k = 0; k < robot.arms.size(); ++k) {
    if (robot.arms[k].name == name || robot.arms[k].name == "arm_" + name)
      return static_cast<int>(k);
  }
  std::string known;
  for (const config::Arm& arm : robot.arms)
    known += (known.empty() ? "" : ", ") + arm.name;
  throw Failure(kUsage, "--arm: found '" + name + "', expected one of: " + known);
}

/// Writes numbers, or as many empty fields.
void fields(std::ostream& out, const std::vector<double>& values, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i)
    out << (i == 0 ? "" : ",") << (values.empty() ? "" : experiments::number(values[i]));
}

std::vector<double> poseNumbers(const Eigen::Isometry3d& pose) {
  const Eigen::Vector3d p = pose.translation();
  const Eigen::Quaterniond q(pose.linear());
  return {p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()};
}

struct Answer {
  std::string status;
  std::vector<double> numbers;  ///< x..qw, stability, then the Jacobian by rows
  std::vector<kinematics::ShapePoint> shape;
};

Answer answer(const Options& options,
              const config::Arm& arm,
              const kinematics::ArmModel& model,
              const experiments::CsvRow& row) {
  Answer result;
  if (!row.error.empty()) {
    result.status = row.error;
    return result;
  }
  const Eigen::VectorXd q = Eigen::Map<const Eigen::VectorXd>(row.values.data(), arm.model.jointCount());
  const double violation = safety::largestViolation(arm.limits, q);
  if (violation > experiments::kViolation) {
    result.status =
        "outside the limits of the robot file (equation (1)) by " + experiments::number(violation) + " m or rad";
    return result;
  }
  kinematics::ModelStatus status;
  kinematics::Tip tip;
  if (options.shape > 0) {
    status = model.shape(q, options.shape, result.shape);
  } else {
    status = model.tip(q, tip);
  }
  if (status != kinematics::ModelStatus::kOk) {
    result.status = std::string(kinematics::describe(status));
    return result;
  }
  result.status = "ok";
  if (options.shape > 0)
    return result;
  result.numbers = poseNumbers(tip.pose);
  result.numbers.push_back(tip.stability);
  if (options.jacobian) {
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < arm.model.jointCount(); ++j)
        result.numbers.push_back(tip.jacobian(i, j));
    }
  }
  return result;
}

std::vector<std::string> header(const Options& options, const config::Arm& arm) {
  std::vector<std::string> names{"x", "y", "z", "qx", "qy", "qz", "qw"};
  if (options.shape > 0) {
    names.insert(names.begin(), {"row", "s"});
    for (int i = 1; i <= arm.model.tubeCount(); ++i)
      names.push_back("psi_" + std::to_string(i));
    return names;
  }
  names.push_back("stability");
  if (!options.jacobian)
    return names;
  for (int i = 1; i <= 6; ++i) {
    for (int j = 1; j <= arm.model.jointCount(); ++j)
      names.push_back("j" + std::to_string(i) + std::to_string(j));
  }
  return names;
}

std::vector<double> shapeNumbers(const kinematics::ShapePoint& point, int row, int tubes) {
  std::vector<double> numbers{static_cast<double>(row), point.s};
  for (double value : poseNumbers(point.pose))
    numbers.push_back(value);
  for (int i = 0; i < tubes; ++i)
    numbers.push_back(point.psi[static_cast<std::size_t>(i)]);
  return numbers;
}

int run(const Options& options) {
  const config::Robot robot = config::loadRobot(config::findFile(options.robot, "robot"));
  const config::Arm& arm = robot.arms[static_cast<std::size_t>(armIndex(robot, options.arm))];
  const auto model = kinematics::makeArmModel(options.model, arm.model);
  const auto input = openInput(options.csv);
  const std::vector<std::string> names = header(options, arm);
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  if (!options.json) {
    for (const std::string& name : names)
      std::cout << name << ',';
    std::cout << "status\n";
  }
  bool all = true;
  int index = 0;
  const auto emit = [&](const std::vector<double>& numbers, const std::string& status) {
    if (options.json) {
      nlohmann::ordered_json object;
      for (std::size_t i = 0; i < numbers.size(); ++i)
        object[names[i]] = numbers[i];
      object["status"] = status;
      json.push_back(object);
      return;
    }
    fields(std::cout, numbers, names.size());
    std::cout << ',' << statusField(status) << '\n';
  };
  for (const experiments::CsvRow& row : experiments::readRows(*input, arm.model.jointCount())) {
    const Answer result = answer(options, arm, *model, row);
    ++index;
    all = all && result.status == "ok";
    for (const kinematics::ShapePoint& point : result.shape) {
      emit(shapeNumbers(point, index, arm.model.tubeCount()), result.status);
    }
    if (options.shape > 0 && result.shape.empty()) {
      std::vector<double> blank(names.size(), std::nan(""));
      blank[0] = index;
      emit(blank, result.status);
    } else if (options.shape == 0) {
      emit(result.numbers, result.status);
    }
  }
  if (options.json)
    std::cout << json.dump(2) << '\n';
  return all ? kOk : kFailure;
}

}  // namespace

void registerFk(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* fk =
      app.add_subcommand("fk", "forward kinematics of one arm: tip pose, stability, Jacobian or shape per row");
  fk->add_option("-r,--robot", options->robot, "robot file or preset")->capture_default_str();
  fk->add_option("-a,--arm", options->arm, "arm: its name, or what stands behind arm_ in it")->capture_default_str();
  fk->add_option("-m,--model", options->model, "kinematic model: rigid")->capture_default_str();
  fk->add_flag("-j,--jacobian", options->jacobian, "add the 6 x 2n Jacobian by rows (linear rows first; base frame)");
  fk->add_option("-s,--shape", options->shape, "N backbone points a row instead of the tip")
      ->check(CLI::Range(2, 10000));
  fk->add_option("--csv", options->csv,
                 "rows beta_1..beta_n,alpha_1..alpha_n in m and rad, without header; - is standard input")
      ->capture_default_str();
  fk->add_flag("--json", options->json, "JSON instead of CSV");
  fk->footer("Example:\n  echo -0.1,-0.08,-0.05,0.785,0.785,0.785 | tandem fk --arm a --csv -");
  fk->callback([options, &exit_code] { guarded(exit_code, [&] { return run(*options); }); });
}

}  // namespace tandem::cli
