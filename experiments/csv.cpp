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

CsvRow parseRow(int line, const std::string& text, int columns) {
  CsvRow row;
  row.line = line;
  for (const std::string& field : config::csvFields(text)) {
    double value = 0.0;
    const auto [rest, code] =
        std::from_chars(field.data() + (field.starts_with('+') ? 1 : 0), field.data() + field.size(), value);
    const std::string place = "line " + std::to_string(line) + " column " + std::to_string(row.values.size() + 1);
    if (code != std::errc() || rest != field.data() + field.size()) {
      row.error = place + ": found '" + field.substr(0, 40) + "', expected a number";
      return row;
    }
    if (!std::isfinite(value)) {
      row.error = place + ": found '" + field + "', expected a finite number";
      return row;
    }
    row.values.push_back(value);
  }
  if (static_cast<int>(row.values.size()) != columns) {
    row.error = "line " + std::to_string(line) + ": found " + std::to_string(row.values.size()) +
                " numbers, expected " + std::to_string(columns);
  }
  return row;
}

/// A row of a table with a header.
CsvRow parseRow(int line, const std::string& text, const config::CsvLayout& layout) {
  const std::vector<std::string> fields = config::csvFields(text);
  if (fields.size() != layout.fields)
    return {line,
            {},
            "line " + std::to_string(line) + ": found " + std::to_string(fields.size()) + " fields, expected the " +
                std::to_string(layout.fields) + " of the header"};
  std::string wanted;
  for (const config::CsvLayout::Place& place : layout.places)
    wanted += (wanted.empty() ? "" : ",") + fields[place.field];
  CsvRow row = parseRow(line, wanted, static_cast<int>(layout.places.size()));
  for (std::size_t k = 0; k < row.values.size(); ++k) {
    if (const config::Unit* unit = layout.places[k].unit)
      row.values[k] = unit->toSi(row.values[k]);
  }
  return row;
}

/// Without the byte order mark that spreadsheets write.
std::string withoutMark(const std::string& line) { return line.starts_with("\xEF\xBB\xBF") ? line.substr(3) : line; }

/// The tip that follows the shape.
const planning::TaskReference& tipTask(const Row& row) {
  static const planning::TaskReference none;
  const planning::TaskReference* task = shapeTask(row.data.reference);
  return task == nullptr ? none : *task;
}

/// Scale of a task of the row's reference; 1 without one.
double scaleOf(const Row& row, const planning::TaskReference* task) {
  return task == nullptr ? 1.0 : row.data.scale[static_cast<std::size_t>(task - row.data.reference.tasks.data())];
}

/// "err_axis_a", of each further task; the number of tasks before them in the reference.
std::vector<std::pair<std::string, std::size_t>> furtherColumns(const RunRecord& record,
                                                                const std::vector<std::string>& arms) {
  std::vector<std::pair<std::string, std::size_t>> columns;
  const planning::Reference none, &reference = record.rows().empty() ? none : record.rows().back().data.reference;
  for (std::size_t t = 0; t < static_cast<std::size_t>(reference.task_count); ++t) {
    const planning::TaskReference& task = reference.tasks[t];
    if (!isFurther(task.kind))
      continue;
    const kinematics::TaskKindEntry& kind = *kinematics::findTaskKind(task.kind);
    std::string name = "err_" + std::string(kind.name) + '_' + arms[static_cast<std::size_t>(task.arm)];
    if (kind.relative())
      name += '_' + arms[static_cast<std::size_t>(task.other_arm)];
    columns.emplace_back(name, t);
  }
  return columns;
}

/// The part of a joint's name in tables that stands for its arm and number: "a1", "left_1".
std::string tubeName(const std::string& short_arm, const std::string& joint) {
  const std::size_t number = joint.rfind('_') + 1;  // of "beta_1"; 0 where there is none
  return (short_arm.size() == 1 ? short_arm : short_arm + '_') + joint.substr(number);
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
  for (int i = 1; std::getline(in, line); ++i)
    rows.push_back(parseRow(i, i == 1 ? withoutMark(line) : line, columns));
  return rows;
}

std::vector<CsvRow> readRows(std::istream& in, const std::vector<config::CsvColumn>& columns, const std::string& file) {
  const int count = static_cast<int>(columns.size());
  std::vector<CsvRow> rows;
  std::optional<config::CsvLayout> layout;
  std::string line;
  for (int i = 1; std::getline(in, line); ++i) {
    if (i == 1) {
      line = withoutMark(line);
      layout = config::readCsvHeader(line, columns, file);
      if (layout)
        continue;
    }
    rows.push_back(layout ? parseRow(i, line, *layout) : parseRow(i, line, count));
  }
  return rows;
}

std::vector<std::string> jointNames(const config::Robot& robot) {
  const std::vector<std::string> arms = config::shortArmNames(robot);
  std::vector<std::string> names;
  for (std::size_t k = 0; k < arms.size(); ++k) {
    for (const std::string& joint : robot.arms[k].joint_names)
      names.push_back(joint.substr(0, joint.rfind('_') + 1) + tubeName(arms[k], joint));
  }
  return names;
}

void writeRun(std::ostream& out, const RunRecord& record, const config::Robot& robot) {
  const std::vector<std::string> arms = config::shortArmNames(robot);
  std::vector<std::string> translations;
  for (std::size_t k = 0; k < arms.size(); ++k) {
    const config::Arm& arm = robot.arms[k];
    for (int j = 0; j < arm.jointCount(); ++j) {
      if (arm.limits.isTranslation(j))
        translations.push_back(tubeName(arms[k], arm.joint_names[static_cast<std::size_t>(j)]));
    }
  }
  out << "point,iteration";
  for (const std::string& joint : jointNames(robot))
    out << ',' << joint;
  out << ",target_x,target_y,target_z,err_ab,err_a,scale_ab,scale_a,active_limits,solver_iterations,gate_actions";
  for (const std::string& t : translations)
    out << ",lower_" << t << ",upper_" << t;
  out << ",tip_x,tip_y,tip_z";
  const auto further = furtherColumns(record, arms);
  for (const auto& [name, task] : further)
    out << ',' << name;
  out << '\n';
  for (const Row& row : record.rows()) {
    out << row.data.point << ',' << row.data.iteration;
    for (double q : row.data.position)
      out << ',' << number(q);
    for (double x : tipTask(row).position)
      out << ',' << number(x);
    out << ',' << number(row.error_ab) << ',' << number(row.error_a) << ','
        << number(scaleOf(row, taskOf(row.data.reference, planning::TaskKind::kRelativePosition))) << ','
        << number(scaleOf(row, shapeTask(row.data.reference))) << ',' << row.data.active_limits << ','
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
    for (const auto& [name, task] : further)
      out << ',' << number(row.error_further[task]);
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
