// SPDX-License-Identifier: Apache-2.0
#include "experiments/comparison.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "config/arm_names.h"
#include "experiments/detail/format.h"
#include "planning/report_unit.h"

namespace tandem::experiments {
namespace {

void addTo(ErrorStatistics& sum, const ErrorStatistics& add) {
  sum.rms += add.rms;
  sum.deviation += add.deviation;
  sum.max += add.max;
  sum.mean += add.mean;
  sum.count += add.count;
}

void divide(ErrorStatistics& sum, double by) {
  sum.rms /= by;
  sum.deviation /= by;
  sum.max /= by;
  sum.mean /= by;
}

}  // namespace

std::vector<ComparisonRow> compare(std::span<const RunSummary> runs, std::span<const config::PublishedRow> published) {
  std::vector<ComparisonRow> rows;
  for (const RunSummary& run : runs) {
    auto row = std::find_if(rows.begin(), rows.end(), [&](const ComparisonRow& r) {
      return r.trajectory == run.key.trajectory && r.method == run.key.method;
    });
    if (row == rows.end()) {
      row = rows.insert(rows.end(), ComparisonRow{});
      row->trajectory = run.key.trajectory;
      row->method = run.key.method;
    }
    ++row->runs;
    row->points += run.points;
    row->converged += run.converged;
    row->iterations += run.iterations;
    row->limit_violations += run.limit_violations;
    row->gate_actions += run.gate_actions;
    row->largest_excess = std::max(row->largest_excess, run.largest_excess);
    addTo(row->ab, run.ab);
    addTo(row->a, run.a);
    row->configurations.push_back(run);
  }
  for (ComparisonRow& row : rows) {
    row.iterations /= row.runs;
    divide(row.ab, row.runs);
    divide(row.a, row.runs);
    for (const config::PublishedRow& line : published) {
      if (line.trajectory == row.trajectory && line.method == control::name(row.method))
        row.published = &line;
    }
  }
  return rows;
}

std::string formatSnaps(std::span<const RunSummary> runs) {
  std::string text;
  for (const RunSummary& run : runs) {
    if (run.snaps.count > 0)
      text += format("%s: the plant snapped %u times, released energy %.3g mJ, longest way of a tip %.2f mm\n",
                     run.key.name().c_str(), run.snaps.count, 1e3 * run.snaps.energy, 1e3 * run.snaps.distance);
  }
  return text;
}

std::string formatFurther(std::span<const RunSummary> runs, const config::Robot& robot) {
  const std::vector<std::string> arms = config::shortArmNames(robot);
  std::string text;
  for (const RunSummary& run : runs) {
    for (const auto& [task, errors] : run.further) {
      const planning::ReportUnit unit = planning::reportUnit(task.kind);
      text +=
          format("%s: %s: mean %.3f, RMS %.3f, maximum %.3f %s\n", run.key.name().c_str(), describe(task, arms).c_str(),
                 unit.per_si * errors.mean, unit.per_si * errors.rms, unit.per_si * errors.max, unit.name);
    }
  }
  return text;
}

std::string formatFailures(std::span<const RunSummary> runs) {
  std::string text;
  for (const RunSummary& run : runs) {
    if (!run.failure.empty())
      text += format("%s ended after %d iterations: %s\n", run.key.name().c_str(), run.iterations, run.failure.c_str());
  }
  return text;
}

namespace {

/// RMS, standard deviation and maximum, m, as the paper prints them; before them the mean, or "-" where there is none.
std::string errors(const std::string& mean, double rms, double deviation, double max) {
  return format("%6s %6.3f +- %5.3f [%5.3f]", mean.c_str(), 1e3 * rms, 1e3 * deviation, 1e3 * max);
}

std::string errors(const ErrorStatistics& e) {
  return e.count == 0 ? format("%6s", "-") : errors(format("%.3f", 1e3 * e.mean), e.rms, e.deviation, e.max);
}

/// One line of ours: a mean over runs, or one run.
template <class Results>
std::string line(const std::string& trajectory, const std::string& method, const Results& r, bool gate) {
  const std::string done = std::to_string(r.converged) + "/" + std::to_string(r.points);
  const std::string actions = gate ? format("%6llu", static_cast<unsigned long long>(r.gate_actions))
                                   : format("%6s %9.3f", "off", 1e3 * r.largest_excess);
  return format("%-11s %-15s %10.1f  %-30s %-30s %9s %7d %s\n", trajectory.c_str(), method.c_str(),
                static_cast<double>(r.iterations), errors(r.ab).c_str(), errors(r.a).c_str(), done.c_str(),
                r.limit_violations, actions.c_str());
}

}  // namespace

std::string formatTable(std::span<const ComparisonRow> rows, bool by_configuration, bool gate) {
  std::string text = format("%-11s %-15s %10s  %-30s %-30s %9s %7s %6s%s\n", "trajectory", "method", "iterations",
                            "eps_AB  mean RMS+-StD [Max] mm", "eps_A   mean RMS+-StD [Max] mm", "converged", "outside",
                            "gate", gate ? "" : " excess mm");
  for (const ComparisonRow& row : rows) {
    text += line(row.trajectory, std::string(control::name(row.method)), row, gate);
    if (row.published != nullptr) {
      const config::PublishedRow& p = *row.published;
      text += format("%-11s %-15s %10.0f  %-30s %-30s\n", "", "  published", p.iterations,
                     errors("-", p.rms_ab, p.std_ab, p.max_ab).c_str(), errors("-", p.rms_a, p.std_a, p.max_a).c_str());
    }
    if (!by_configuration)
      continue;
    for (const RunSummary& run : row.configurations)
      text += line("", "  configuration " + run.key.configuration, run, gate);
  }
  return text;
}

}  // namespace tandem::experiments
