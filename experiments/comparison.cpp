// SPDX-License-Identifier: Apache-2.0
#include "experiments/comparison.h"

#include <algorithm>
#include <cstdio>

#include "experiments/detail/format.h"

namespace tandem::experiments {
namespace {

void addTo(ErrorStatistics& sum, const ErrorStatistics& add) {
  sum.rms += add.rms;
  sum.deviation += add.deviation;
  sum.max += add.max;
}

void divide(ErrorStatistics& sum, double by) {
  sum.rms /= by;
  sum.deviation /= by;
  sum.max /= by;
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
    addTo(row->ab, run.ab);
    addTo(row->a, run.a);
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

std::string formatFailures(std::span<const RunSummary> runs) {
  std::string text;
  for (const RunSummary& run : runs) {
    if (!run.failure.empty())
      text += format("%s ended after %d iterations: %s\n", run.key.name().c_str(), run.iterations, run.failure.c_str());
  }
  return text;
}

std::string formatTable(std::span<const ComparisonRow> rows) {
  std::string text = format("%-11s %-13s %10s  %-24s %-24s %11s %7s %6s\n", "trajectory", "method", "iterations",
                            "eps_AB RMS+-StD [Max] mm", "eps_A RMS+-StD [Max] mm", "converged", "outside", "gate");
  const auto errors = [](double rms, double deviation, double max) {
    return format("%6.3f +- %5.3f [%5.3f]", 1e3 * rms, 1e3 * deviation, 1e3 * max);
  };
  for (const ComparisonRow& row : rows) {
    const std::string done = std::to_string(row.converged) + "/" + std::to_string(row.points);
    text += format("%-11s %-13s %10.1f  %-24s %-24s %11s %7d %6llu\n", row.trajectory.c_str(),
                   std::string(control::name(row.method)).c_str(), row.iterations,
                   errors(row.ab.rms, row.ab.deviation, row.ab.max).c_str(),
                   errors(row.a.rms, row.a.deviation, row.a.max).c_str(), done.c_str(), row.limit_violations,
                   static_cast<unsigned long long>(row.gate_actions));
    if (row.published == nullptr)
      continue;
    const config::PublishedRow& p = *row.published;
    text += format("%-11s %-13s %10.0f  %-24s %-24s\n", "", "  published", p.iterations,
                   errors(p.rms_ab, p.std_ab, p.max_ab).c_str(), errors(p.rms_a, p.std_a, p.max_a).c_str());
  }
  return text;
}

}  // namespace tandem::experiments
