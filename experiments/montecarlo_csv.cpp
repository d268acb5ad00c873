// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <istream>
#include <map>
#include <ostream>
#include <set>
#include <stdexcept>
#include <tuple>

#include "experiments/csv.h"
#include "experiments/montecarlo.h"

namespace tandem::experiments {
namespace {

std::string columnOf(const Condition& condition) {
  std::string column = condition.name;
  std::replace(column.begin(), column.end(), '-', '_');
  return column;
}

/// Between the columns of conditions; those of kAdded are missing in files of earlier versions.
constexpr const char* kFront = "seed,tasks,task,method";
constexpr const char* kBack =
    "kind,feasible,outcome,points,converged,iterations,rms_ab,std_ab,max_ab,rms_a,std_a,max_a,violations,held,"
    "gate_actions,stability,snaps,succeeded";
constexpr const char* kAdded =
    "contacts,steady_ab,steady_a,snap_energy,snap_distance,reason,further,rms_further,std_further,max_further";

/** Fields of one row by the names of their columns. */
class Fields {
 public:
  using Columns = std::map<std::string, std::size_t>;
  Fields(const std::string& line, std::string place, const Columns& columns)
      : fields_(config::csvFields(line)), place_(std::move(place)), columns_(columns) {}
  bool has(const std::string& column) const { return columns_.contains(column); }
  const std::string& text(const std::string& column) { return fields_[last_ = columns_.at(column)]; }
  template <class T>
  T number(const std::string& column) {
    const std::string& field = text(column);
    T value{};
    const auto [rest, code] = std::from_chars(field.data(), field.data() + field.size(), value);
    if (code != std::errc() || rest != field.data() + field.size())
      fail("a number");
    return value;
  }
  /// 0 where the file has no such column.
  template <class T>
  T numberIfAny(const std::string& column) {
    return has(column) ? number<T>(column) : T{};
  }
  std::size_t count() const { return fields_.size(); }
  /// About the last field that was taken.
  [[noreturn]] void fail(const std::string& expected) const {
    throw std::invalid_argument(place_ + " column " + std::to_string(last_ + 1) + ": found '" + fields_[last_] +
                                "', expected " + expected);
  }

 private:
  std::vector<std::string> fields_;
  std::string place_;
  const Columns& columns_;
  std::size_t last_ = 0;
};

/// The value of an enumeration by its name. @param count  how many it has
template <class Enum>
Enum named(Fields& fields, const std::string& column, int count) {
  const std::string& text = fields.text(column);
  std::string names;
  for (int i = 0; i < count; ++i) {
    const auto value = static_cast<Enum>(i);
    if (name(value) == text)
      return value;
    names += (i == 0 ? "" : ", ") + std::string(name(value));
  }
  fields.fail("one of " + names);
}

ErrorStatistics readStatistics(Fields& fields, const std::string& of) {
  return {fields.number<double>("rms_" + of), fields.number<double>("std_" + of), fields.number<double>("max_" + of)};
}

TaskResult readRow(Fields& fields) {
  TaskResult r;
  r.seed = fields.number<std::uint64_t>("seed");
  r.tasks = fields.number<int>("tasks");
  r.task = fields.number<int>("task");
  r.method = named<control::Method>(fields, "method", control::kMethodCount);
  for (const Condition& condition : kConditions)
    r.conditions.*condition.member = fields.numberIfAny<double>(columnOf(condition));
  r.kind = named<PathKind>(fields, "kind", kPathKinds);
  r.feasible = fields.number<int>("feasible") != 0;
  r.outcome = named<Outcome>(fields, "outcome", 3);
  r.points = fields.number<int>("points");
  r.converged = fields.number<int>("converged");
  r.iterations = fields.number<int>("iterations");
  r.ab = readStatistics(fields, "ab");
  r.a = readStatistics(fields, "a");
  r.violations = fields.number<int>("violations");
  r.held = fields.number<int>("held");
  r.gate_actions = fields.number<std::uint64_t>("gate_actions");
  r.stability = fields.number<double>("stability");
  r.snaps = fields.number<int>("snaps");
  r.contacts = fields.numberIfAny<int>("contacts");
  r.steady_ab = fields.numberIfAny<double>("steady_ab");
  r.steady_a = fields.numberIfAny<double>("steady_a");
  r.snap_energy = fields.numberIfAny<double>("snap_energy");
  r.snap_distance = fields.numberIfAny<double>("snap_distance");
  if (fields.has("reason"))
    r.reason = fields.text("reason");
  if (fields.has("further") && !fields.text("further").empty()) {
    const kinematics::TaskKindEntry* kind = kinematics::findTaskKind(fields.text("further"));
    if (kind == nullptr || !isRandomKind(kind->kind))
      fields.fail("a kind of further tasks, or nothing");
    r.further = kind->kind;
    r.further_error = readStatistics(fields, "further");
  }
  // Before contacts were counted, a snap was no failure.
  const bool succeeded = fields.has("contacts") ? r.succeeded() : r.reached();
  if (fields.number<int>("succeeded") != (succeeded ? 1 : 0))
    fields.fail("a value that agrees with outcome, points, converged, snaps and contacts");
  return r;
}

auto sizesOf(const Conditions& conditions) {
  std::array<double, kConditions.size()> sizes{};
  for (std::size_t i = 0; i < sizes.size(); ++i)
    sizes[i] = conditions.*kConditions[i].member;
  return sizes;
}

}  // namespace

void writeResults(std::ostream& out, const std::vector<TaskResult>& results) {
  out << kFront;
  for (const Condition& condition : kConditions)
    out << ',' << columnOf(condition);
  out << ',' << kBack << ',' << kAdded << '\n';
  for (const TaskResult& r : results) {
    out << r.seed << ',' << r.tasks << ',' << r.task << ',' << control::name(r.method);
    for (const Condition& condition : kConditions)
      out << ',' << number(r.conditions.*condition.member);
    out << ',' << name(r.kind) << ',' << (r.feasible ? 1 : 0) << ',' << name(r.outcome) << ',' << r.points << ','
        << r.converged << ',' << r.iterations;
    for (const ErrorStatistics& e : {r.ab, r.a})
      out << ',' << number(e.rms) << ',' << number(e.deviation) << ',' << number(e.max);
    out << ',' << r.violations << ',' << r.held << ',' << r.gate_actions << ',' << number(r.stability) << ',' << r.snaps
        << ',' << (r.succeeded() ? 1 : 0) << ',' << r.contacts << ',' << number(r.steady_ab) << ','
        << number(r.steady_a) << ',' << number(r.snap_energy) << ',' << number(r.snap_distance) << ',' << r.reason
        << ',' << (r.further == planning::TaskKind::kNone ? "" : kinematics::findTaskKind(r.further)->name);
    const ErrorStatistics& e = r.further_error;
    out << ',' << number(e.rms) << ',' << number(e.deviation) << ',' << number(e.max) << '\n';
  }
}

std::vector<TaskResult> readResults(std::istream& in, const std::string& origin) {
  std::string line;
  std::getline(in, line);
  Fields::Columns columns;
  for (const std::string& column : config::csvFields(line))
    columns.emplace(column, columns.size());
  for (const std::string& wanted : config::csvFields(std::string(kFront) + "," + kBack)) {
    if (!columns.contains(wanted)) {
      throw std::invalid_argument(origin + ":1: found '" + line.substr(0, 60) +
                                  "', expected the header of a file of tandem montecarlo, with column " + wanted);
    }
  }
  std::vector<TaskResult> results;
  for (int number = 2; std::getline(in, line); ++number) {
    const std::string place = origin + ":" + std::to_string(number) + ":";
    Fields fields(line, place, columns);
    if (fields.count() != columns.size()) {
      throw std::invalid_argument(place + " found " + std::to_string(fields.count()) + " columns, expected the " +
                                  std::to_string(columns.size()) + " of the header; the file may be incomplete");
    }
    results.push_back(readRow(fields));
  }
  return results;
}

std::vector<TaskResult> merge(std::vector<TaskResult> results) {
  if (results.empty())
    throw std::invalid_argument("found no rows to merge, expected those of at least one task");
  // Cases and methods stand in every shard in the same order, that of the run.
  std::map<std::array<double, kConditions.size()>, int> cases;
  std::map<control::Method, int> methods;
  const TaskResult& first = results.front();
  for (const TaskResult& r : results) {
    if (r.seed != first.seed || r.tasks != first.tasks || r.further != first.further) {
      const auto run = [](const TaskResult& of) {
        return std::to_string(of.tasks) + " tasks of seed " + std::to_string(of.seed);
      };
      throw std::invalid_argument("found rows of different runs, " + run(first) + " and " + run(r) +
                                  ", expected those of one run (the files of its --shard)");
    }
    cases.emplace(sizesOf(r.conditions), static_cast<int>(cases.size()));
    methods.emplace(r.method, static_cast<int>(methods.size()));
  }
  const auto key = [&](const TaskResult& r) {
    return std::tuple(cases.at(sizesOf(r.conditions)), r.task, methods.at(r.method));
  };
  std::sort(results.begin(), results.end(), [&](const auto& a, const auto& b) { return key(a) < key(b); });
  std::size_t i = 0;
  for (int c = 0; c < static_cast<int>(cases.size()); ++c) {
    for (int task = 0; task < first.tasks; ++task) {
      for (int m = 0; m < static_cast<int>(methods.size()); ++m, ++i) {
        const auto expected = std::tuple(c, task, m);
        if (i < results.size() && key(results[i]) == expected)
          continue;
        const bool twice = i > 0 && i < results.size() && key(results[i]) == key(results[i - 1]);
        throw std::invalid_argument("task " + std::to_string(twice ? results[i].task : task) +
                                    (twice ? " is present twice" : " is missing") + ", expected tasks 0 to " +
                                    std::to_string(first.tasks - 1) + " once each, of every shard");
      }
    }
  }
  if (i != results.size())
    throw std::invalid_argument(
        "task " + std::to_string(results[i].task) +
        ": found a second row of the same case and method, or a row of another run, expected one row each");
  return results;
}

}  // namespace tandem::experiments
