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

std::string columnOf(const ErrorSource& source) {
  std::string column = source.name;
  std::replace(column.begin(), column.end(), '-', '_');
  return column;
}

using Sources = std::vector<ErrorSource>;
const Sources kAllSources(kErrorSources.begin(), kErrorSources.end());

std::string header(const Sources& sources) {
  std::string line = "seed,tasks,task,method";
  for (const ErrorSource& source : sources)
    line += "," + columnOf(source);
  return line +
         ",kind,feasible,outcome,points,converged,iterations,rms_ab,std_ab,max_ab,rms_a,std_a,max_a,violations,held,"
         "gate_actions,stability,snaps,succeeded";
}

std::vector<std::string> fieldsOf(const std::string& line) {
  std::vector<std::string> fields{""};
  for (const char c : line) {
    if (c == ',')
      fields.emplace_back();
    else if (c != '\r')
      fields.back() += c;
  }
  return fields;
}

/** Fields of one row, one after the other. */
class Fields {
 public:
  Fields(const std::string& line, std::string place) : fields_(fieldsOf(line)), place_(std::move(place)) {}
  const std::string& text() { return fields_[next_++]; }
  template <class T>
  T number() {
    const std::string& field = text();
    T value{};
    const auto [rest, code] = std::from_chars(field.data(), field.data() + field.size(), value);
    if (code != std::errc() || rest != field.data() + field.size())
      fail("a number");
    return value;
  }
  std::size_t count() const { return fields_.size(); }
  /// About the last field that was taken.
  [[noreturn]] void fail(const std::string& expected) const {
    throw std::invalid_argument(place_ + " column " + std::to_string(next_) + ": found '" + fields_[next_ - 1] +
                                "', expected " + expected);
  }

 private:
  std::vector<std::string> fields_;
  std::string place_;
  std::size_t next_ = 0;
};

/// The value of an enumeration by its name. @param count  how many it has
template <class Enum>
Enum named(Fields& fields, int count) {
  const std::string& text = fields.text();
  std::string names;
  for (int i = 0; i < count; ++i) {
    const auto value = static_cast<Enum>(i);
    if (name(value) == text)
      return value;
    names += (i == 0 ? "" : ", ") + std::string(name(value));
  }
  fields.fail("one of " + names);
}

ErrorStatistics readStatistics(Fields& fields) {
  const double rms = fields.number<double>(), deviation = fields.number<double>(), max = fields.number<double>();
  return {rms, deviation, max};
}

TaskResult readRow(Fields& fields, const Sources& sources) {
  TaskResult r;
  r.seed = fields.number<std::uint64_t>();
  r.tasks = fields.number<int>();
  r.task = fields.number<int>();
  r.method = named<control::Method>(fields, control::kMethodCount);
  for (const ErrorSource& source : sources)
    r.errors.*source.member = fields.number<double>();
  r.kind = named<PathKind>(fields, kPathKinds);
  r.feasible = fields.number<int>() != 0;
  r.outcome = named<Outcome>(fields, 3);
  r.points = fields.number<int>();
  r.converged = fields.number<int>();
  r.iterations = fields.number<int>();
  r.ab = readStatistics(fields);
  r.a = readStatistics(fields);
  r.violations = fields.number<int>();
  r.held = fields.number<int>();
  r.gate_actions = fields.number<std::uint64_t>();
  r.stability = fields.number<double>();
  r.snaps = fields.number<int>();
  if (fields.number<int>() != (r.succeeded() ? 1 : 0))
    fields.fail("what outcome, points and converged say");
  return r;
}

auto sizesOf(const ErrorSizes& errors) {
  std::array<double, kErrorSources.size()> sizes{};
  for (std::size_t i = 0; i < sizes.size(); ++i)
    sizes[i] = errors.*kErrorSources[i].member;
  return sizes;
}

}  // namespace

void writeResults(std::ostream& out, const std::vector<TaskResult>& results) {
  out << header(kAllSources) << '\n';
  for (const TaskResult& r : results) {
    out << r.seed << ',' << r.tasks << ',' << r.task << ',' << control::name(r.method);
    for (const ErrorSource& source : kErrorSources)
      out << ',' << number(r.errors.*source.member);
    out << ',' << name(r.kind) << ',' << (r.feasible ? 1 : 0) << ',' << name(r.outcome) << ',' << r.points << ','
        << r.converged << ',' << r.iterations;
    for (const ErrorStatistics& e : {r.ab, r.a})
      out << ',' << number(e.rms) << ',' << number(e.deviation) << ',' << number(e.max);
    out << ',' << r.violations << ',' << r.held << ',' << r.gate_actions << ',' << number(r.stability) << ',' << r.snaps
        << ',' << (r.succeeded() ? 1 : 0) << '\n';
  }
}

std::vector<TaskResult> readResults(std::istream& in, const std::string& origin) {
  std::string line;
  std::getline(in, line);
  const std::vector<std::string> found = fieldsOf(line);
  // Files of earlier versions have fewer sources of error.
  Sources sources = kAllSources;
  std::erase_if(sources, [&](const ErrorSource& source) { return std::ranges::count(found, columnOf(source)) == 0; });
  if (found != fieldsOf(header(sources))) {
    throw std::invalid_argument(origin + ":1: found '" + line.substr(0, 60) +
                                "', expected the header of a file of tandem montecarlo");
  }
  std::vector<TaskResult> results;
  for (int number = 2; std::getline(in, line); ++number) {
    const std::string place = origin + ":" + std::to_string(number) + ":";
    Fields fields(line, place);
    if (fields.count() != found.size()) {
      throw std::invalid_argument(place + " found " + std::to_string(fields.count()) + " columns, expected " +
                                  std::to_string(found.size()));
    }
    results.push_back(readRow(fields, sources));
  }
  return results;
}

std::vector<TaskResult> merge(std::vector<TaskResult> results) {
  if (results.empty())
    throw std::invalid_argument("found no rows to merge, expected those of at least one task");
  // Cases and methods stand in every shard in the same order, that of the run.
  std::map<std::array<double, kErrorSources.size()>, int> cases;
  std::map<control::Method, int> methods;
  const TaskResult& first = results.front();
  for (const TaskResult& r : results) {
    if (r.seed != first.seed || r.tasks != first.tasks) {
      const auto run = [](const TaskResult& of) {
        return std::to_string(of.tasks) + " tasks of seed " + std::to_string(of.seed);
      };
      throw std::invalid_argument("found rows of different runs, " + run(first) + " and " + run(r) +
                                  ", expected shards of one");
    }
    cases.emplace(sizesOf(r.errors), static_cast<int>(cases.size()));
    methods.emplace(r.method, static_cast<int>(methods.size()));
  }
  const auto key = [&](const TaskResult& r) {
    return std::tuple(cases.at(sizesOf(r.errors)), r.task, methods.at(r.method));
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
    throw std::invalid_argument("task " + std::to_string(results[i].task) + " is a duplicate or of another run");
  return results;
}

}  // namespace tandem::experiments
