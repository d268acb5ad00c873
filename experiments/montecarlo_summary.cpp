// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>

#include "experiments/detail/format.h"
#include "experiments/montecarlo.h"
#include "planning/report_unit.h"

namespace tandem::experiments {
namespace {

/// 50th, 90th and 99th: the smallest value that so many do not exceed.
std::array<double, 3> percentiles(std::vector<double> values) {
  if (values.empty())
    return {std::nan(""), std::nan(""), std::nan("")};
  std::sort(values.begin(), values.end());
  const auto at = [&](double part) {
    const auto rank = static_cast<std::size_t>(std::ceil(part * static_cast<double>(values.size())));
    return values[std::max<std::size_t>(rank, 1) - 1];
  };
  return {at(0.5), at(0.9), at(0.99)};
}

std::string inMillimetres(const std::array<double, 3>& e, bool relative = true) {
  return !relative ? "-" : format("%.3f %.3f %.3f", 1e3 * e[0], 1e3 * e[1], 1e3 * e[2]);
}

std::string tableHead() {
  return format("%-13s %17s %8s %13s  %-17s %-21s %-21s %8s %6s %7s %9s %6s %8s\n", "method", "succeeded", "%",
                "95 % interval", "iterations/point", "eps_AB RMS mm", "eps_A RMS mm", "outside", "gate", "margin",
                "no reach", "snaps", "contact") +
         format("%-13s %17s %8s %13s  %-17s %-21s %-21s %47s %8s\n", "", "of feasible", "", "", "p50 p90 p99",
                "p50 p90 p99", "p50 p90 p99", "", "runs");
}

std::string tableLine(const MethodSummary& row) {
  const auto& n = row.iterations;
  const Interval interval = row.interval();
  return format("%-13s %17s %8.2f %13s  %-17s %-21s %-21s %8d %6llu %7.3f %9s %6d %8d\n",
                std::string(control::name(row.method)).c_str(),
                (std::to_string(row.succeeded) + "/" + std::to_string(row.feasible)).c_str(), 100.0 * row.rate(),
                format("%.2f %.2f", 100.0 * interval.lower, 100.0 * interval.upper).c_str(),
                format("%.1f %.1f %.1f", n[0], n[1], n[2]).c_str(), inMillimetres(row.ab, row.relative).c_str(),
                inMillimetres(row.a).c_str(), row.violations, static_cast<unsigned long long>(row.gate_actions),
                row.stability, (std::to_string(row.reported) + "/" + std::to_string(row.infeasible)).c_str(), row.snaps,
                row.contacts);
}

std::string trackingHead() {
  return format("%-13s %-21s %-21s %-21s %-21s\n", "on the path", "eps_AB max mm", "eps_A max mm", "eps_AB steady mm",
                "eps_A steady mm");
}

std::string trackingLine(const MethodSummary& row) {
  return format("%-13s %-21s %-21s %-21s %-21s\n", std::string(control::name(row.method)).c_str(),
                inMillimetres(row.max_ab, row.relative).c_str(), inMillimetres(row.max_a).c_str(),
                inMillimetres(row.steady_ab, row.relative).c_str(), inMillimetres(row.steady_a).c_str());
}

std::string furtherLine(const MethodSummary& row) {
  const planning::ReportUnit unit = planning::reportUnit(row.further);
  const auto& e = row.further_error;
  return format("%s: error of %s, RMS of a run, %s, p50 p90 p99: %.3f %.3f %.3f\n",
                std::string(control::name(row.method)).c_str(),
                std::string(kinematics::findTaskKind(row.further)->name).c_str(), unit.name, unit.per_si * e[0],
                unit.per_si * e[1], unit.per_si * e[2]);
}

}  // namespace

std::vector<MethodSummary> summarise(const std::vector<TaskResult>& results) {
  struct Values {
    std::vector<double> iterations, ab, a, max_ab, max_a, steady_ab, steady_a, further;
  };
  std::vector<MethodSummary> rows;
  std::vector<Values> values;
  for (const TaskResult& r : results) {
    auto found = std::find_if(rows.begin(), rows.end(), [&](const MethodSummary& row) {
      return row.conditions == r.conditions && row.method == r.method;
    });
    if (found == rows.end()) {
      found = rows.insert(rows.end(), MethodSummary{});
      found->conditions = r.conditions;
      found->method = r.method;
      found->further = r.further;
      values.emplace_back();
    }
    MethodSummary& row = *found;
    Values& all = values[static_cast<std::size_t>(found - rows.begin())];
    row.violations += r.violations;
    row.gate_actions += r.gate_actions;
    row.stability = std::min(row.stability, r.stability);
    row.snaps += r.snaps;
    row.snap_energy += r.snap_energy;
    row.snap_distance = std::max(row.snap_distance, r.snap_distance);
    if (r.outcome == Outcome::kRefused)
      ++row.refusals[r.reason.empty() ? "reason unknown" : r.reason];
    if (!r.feasible) {
      ++row.infeasible;
      row.reported += r.outcome != Outcome::kCompleted ? 1 : 0;
      continue;
    }
    ++row.feasible;
    all.ab.push_back(r.ab.rms);
    all.a.push_back(r.a.rms);
    all.max_ab.push_back(r.ab.max);
    all.max_a.push_back(r.a.max);
    row.relative = row.relative || r.ab.count > 0;
    all.steady_ab.push_back(r.steady_ab);
    all.steady_a.push_back(r.steady_a);
    all.further.push_back(r.further_error.rms);
    row.contacts += r.contacts > 0 ? 1 : 0;
    if (r.succeeded()) {
      ++row.succeeded;
      all.iterations.push_back(static_cast<double>(r.iterations) / r.points);
    }
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i].iterations = percentiles(std::move(values[i].iterations));
    rows[i].ab = percentiles(std::move(values[i].ab));
    rows[i].a = percentiles(std::move(values[i].a));
    rows[i].max_ab = percentiles(std::move(values[i].max_ab));
    rows[i].max_a = percentiles(std::move(values[i].max_a));
    rows[i].steady_ab = percentiles(std::move(values[i].steady_ab));
    rows[i].steady_a = percentiles(std::move(values[i].steady_a));
    rows[i].further_error = percentiles(std::move(values[i].further));
  }
  return rows;
}

std::vector<MethodPair> pairMethods(const std::vector<TaskResult>& results) {
  struct Case {
    Conditions conditions;
    std::vector<control::Method> methods;                      // in the order of the run
    std::map<int, std::map<control::Method, bool>> succeeded;  // by task
  };
  std::vector<Case> cases;
  for (const TaskResult& r : results) {
    auto found = std::find_if(cases.begin(), cases.end(), [&](const Case& c) { return c.conditions == r.conditions; });
    if (found == cases.end())
      found = cases.insert(cases.end(), Case{r.conditions, {}, {}});
    if (std::find(found->methods.begin(), found->methods.end(), r.method) == found->methods.end())
      found->methods.push_back(r.method);
    if (r.feasible)
      found->succeeded[r.task][r.method] = r.succeeded();
  }
  std::vector<MethodPair> pairs;
  for (Case& c : cases) {
    for (std::size_t i = 0; i + 1 < c.methods.size(); ++i) {
      MethodPair pair{c.conditions, c.methods.back(), c.methods[i]};
      for (auto& [task, succeeded] : c.succeeded) {
        pair.method_alone += succeeded[pair.method] && !succeeded[pair.other] ? 1 : 0;
        pair.other_alone += succeeded[pair.other] && !succeeded[pair.method] ? 1 : 0;
      }
      pairs.push_back(pair);
    }
  }
  return pairs;
}

std::string describe(const Conditions& conditions) {
  std::string text;
  for (const Condition& condition : kConditions) {
    const double size = conditions.*condition.member / condition.unit;
    if (size == 0.0)
      continue;
    text += (text.empty() ? "" : ", ") + std::string(condition.name) + " ";
    text += condition.relative ? format("%g%%", 100.0 * size) : format("%g", size);
  }
  return text.empty() ? "no errors" : text;
}

std::string formatTable(const std::vector<MethodSummary>& rows, const std::vector<MethodPair>& pairs) {
  std::string text;
  for (std::size_t first = 0, end = 0; first < rows.size(); first = end) {
    const Conditions& conditions = rows[first].conditions;
    while (end < rows.size() && rows[end].conditions == conditions)
      ++end;
    text += (first == 0 ? "" : "\n") + describe(conditions) + "\n" + tableHead();
    for (std::size_t i = first; i < end; ++i)
      text += tableLine(rows[i]);
    if (conditions.speed > 0.0) {
      text += trackingHead();
      for (std::size_t i = first; i < end; ++i)
        text += trackingLine(rows[i]);
    }
    for (std::size_t i = first; i < end; ++i)
      text += rows[i].further == planning::TaskKind::kNone ? "" : furtherLine(rows[i]);
    for (std::size_t i = first; i < end; ++i) {
      const MethodSummary& row = rows[i];
      if (row.snaps > 0)
        text += format("%s: %d snaps, released energy %.3g mJ, longest way of a tip %.2f mm\n",
                       std::string(control::name(row.method)).c_str(), row.snaps, 1e3 * row.snap_energy,
                       1e3 * row.snap_distance);
    }
    for (std::size_t i = first; i < end; ++i) {
      for (const auto& [reason, count] : rows[i].refusals)
        text +=
            format("%s: %d refused: %s\n", std::string(control::name(rows[i].method)).c_str(), count, reason.c_str());
    }
    for (const MethodPair& pair : pairs) {
      if (pair.conditions == conditions)
        text += format("%s against %s, tasks that one alone completed: %d : %d, p = %.2g\n",
                       std::string(control::name(pair.method)).c_str(), std::string(control::name(pair.other)).c_str(),
                       pair.method_alone, pair.other_alone, pair.p());
    }
  }
  return text;
}

}  // namespace tandem::experiments
