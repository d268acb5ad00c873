// SPDX-License-Identifier: Apache-2.0
#include "experiments/csv.h"

#include <charconv>
#include <cmath>
#include <istream>
#include <ostream>

#include "config/arm_names.h"

namespace tandem::experiments {
namespace {

constexpr double kMillimetres = 1e3;

std::string_view trim(std::string_view text) {
  const auto begin = text.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos)
    return {};
  return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

CsvRow parseRow(int line, std::string_view text, int columns) {
  CsvRow row;
  row.line = line;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string_view field = trim(text.substr(begin, end - begin));
    double value = 0.0;
    const auto [rest, code] =
        std::from_chars(field.data() + (field.starts_with('+') ? 1 : 0), field.data() + field.size(), value);
    const std::string place = "line " + std::to_string(line) + " column " + std::to_string(row.values.size() + 1);
    if (code != std::errc() || rest != field.data() + field.size()) {
      row.error = place + ": found '" + std::string(field.substr(0, 40)) + "', expected a number";
      return row;
    }
    if (!std::isfinite(value)) {
      row.error = place + ": found '" + std::string(field) + "', expected a finite number";
      return row;
    }
    row.values.push_back(value);
    begin = end + 1;
  }
  if (static_cast<int>(row.values.size()) != columns) {
    row.error = "line " + std::to_string(line) + ": found " + std::to_string(row.values.size()) +
                " numbers, expected " + std::to_string(columns);
  }
  return row;
}

/// The tip that follows the shape: the last task of the reference.
const planning::TaskReference& tipTask(const Row& row) {
  return row.data.reference.tasks[static_cast<std::size_t>(row.data.reference.task_count - 1)];
}

}  // namespace

std::string number(double value) {
  if (std::isnan(value))
    return "";
  if (std::isinf(value))
    return value > 0 ? "inf" : "-inf";
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, value).ptr;
  return {text, end};
}

std::vector<CsvRow> readRows(std::istream& in, int columns) {
  std::vector<CsvRow> rows;
  std::string line;
  for (int i = 1; std::getline(in, line); ++i) {
    if (i == 1 && line.starts_with("\xEF\xBB\xBF"))
      line.erase(0, 3);  // spreadsheets write a byte order mark
    rows.push_back(parseRow(i, line, columns));
  }
  return rows;
}

void writeRun(std::ostream& out, const RunRecord& record, const config::Robot& robot) {
  // beta_a1 of arm_a, beta_left_1 of left.
  const std::vector<std::string> names = config::shortArmNames(robot);
  std::vector<std::string> joints;
  std::vector<std::string> translations;
  for (std::size_t k = 0; k < names.size(); ++k) {
    const config::Arm& arm = robot.arms[k];
    const std::string letter = names[k].size() == 1 ? names[k] : names[k] + '_';
    for (int j = 0; j < arm.jointCount(); ++j) {
      std::string name = arm.joint_names[static_cast<std::size_t>(j)];
      const std::size_t number = name.rfind('_') + 1;  // of "beta_1"; 0 where there is none
      if (arm.limits.isTranslation(j))
        translations.push_back(letter + name.substr(number));
      joints.push_back(name.insert(number, letter));
    }
  }
  out << "point,iteration";
  for (const std::string& joint : joints)
    out << ',' << joint;
  out << ",target_x,target_y,target_z,err_ab,err_a,scale_ab,scale_a,active_limits,solver_iterations,gate_actions";
  for (const std::string& t : translations)
    out << ",lower_" << t << ",upper_" << t;
  out << ",tip_x,tip_y,tip_z\n";
  for (const Row& row : record.rows()) {
    out << row.data.point << ',' << row.data.iteration;
    for (double q : row.data.position)
      out << ',' << number(q);
    for (double x : tipTask(row).position)
      out << ',' << number(x);
    const bool pair = row.data.reference.task_count > 1;
    out << ',' << number(row.error_ab) << ',' << number(row.error_a) << ',' << number(pair ? row.data.scale[0] : 1.0)
        << ',' << number(row.data.scale[pair ? 1 : 0]) << ',' << row.data.active_limits << ','
        << row.data.solver_iterations << ',' << row.data.gate_actions;
    int joint = 0;
    for (const config::Arm& arm : robot.arms) {
      for (int i = 0; i < arm.jointCount(); ++i) {
        if (arm.limits.isTranslation(i))
          out << ',' << number(row.lower[joint + i]) << ',' << number(row.upper[joint + i]);
      }
      joint += arm.jointCount();
    }
    for (double x : row.data.tip[static_cast<std::size_t>(tipTask(row).arm)])
      out << ',' << number(x);
    out << '\n';
  }
}

void writeSummary(std::ostream& out, std::span<const RunSummary> runs, bool gate) {
  out << "trajectory,configuration,method,points,converged,iterations,rms_ab,std_ab,max_ab,rms_a,std_a,max_a,"
         "limit_violations,gate_actions,mean_ab,mean_a,gate,largest_excess\n";
  for (const RunSummary& run : runs) {
    out << run.key.trajectory << ',' << run.key.configuration << ',' << control::name(run.key.method) << ','
        << run.points << ',' << run.converged << ',' << run.iterations;
    for (const ErrorStatistics* e : {&run.ab, &run.a}) {
      out << ',' << number(kMillimetres * e->rms) << ',' << number(kMillimetres * e->deviation) << ','
          << number(kMillimetres * e->max);
    }
    out << ',' << run.limit_violations << ',' << run.gate_actions << ',' << number(kMillimetres * run.ab.mean) << ','
        << number(kMillimetres * run.a.mean) << ',' << (gate ? "on" : "off") << ','
        << number(kMillimetres * run.largest_excess) << '\n';
  }
}

}  // namespace tandem::experiments
