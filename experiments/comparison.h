// SPDX-License-Identifier: Apache-2.0
/** @file Comparison table of computed and published errors. */
#pragma once

#include <span>
#include <string>
#include <vector>

#include "experiments/run_record.h"

namespace tandem::experiments {

/** Average of a method's runs over all configurations of one trajectory, as the paper prints its rows; errors in m. */
struct ComparisonRow {
  std::string trajectory;
  control::Method method = control::Method::kNspqp;
  int runs = 0;
  int points = 0;
  int converged = 0;
  double iterations = 0.0;
  ErrorStatistics ab, a;  ///< each the mean over the runs
  int limit_violations = 0;
  double largest_excess = 0.0;  ///< of all runs, m
  std::uint64_t gate_actions = 0;
  const config::PublishedRow* published = nullptr;  ///< nullptr where there is none
  std::vector<RunSummary> configurations;           ///< the runs, in their order
};

/// Rows in the order in which trajectories and methods first appear in `runs`.
std::vector<ComparisonRow> compare(std::span<const RunSummary> runs, std::span<const config::PublishedRow> published);

/// The table for people, mm: ours, and below each row the paper's.
/// @param by_configuration  below them a line for each start configuration
/// @param gate  false: runs without a gate: marked "off", with the largest excess
std::string formatTable(std::span<const ComparisonRow> rows, bool by_configuration = false, bool gate = true);

/// A line for each further task of each run, deg.
std::string formatFurther(std::span<const RunSummary> runs, const config::Robot& robot);

/// A line for each run in which an arm of the plant snapped: how often, released energy, longest way of a tip.
std::string formatSnaps(std::span<const RunSummary> runs);

/// A line for each run that ended before its last point, with the reason.
std::string formatFailures(std::span<const RunSummary> runs);

}  // namespace tandem::experiments
