// SPDX-License-Identifier: Apache-2.0
/** @file Summary of a run for planning/summary. */
#pragma once

#include <limits>
#include <map>
#include <string>
#include <tuple>

#include "config/config.h"
#include "planning/reference.h"
#include "robots/run.h"
#include "safety/operating_state.h"
#include "services/dds/messages.h"

namespace tandem::planning_service {

/** Collects during a run what its summary states beside the errors: time, interventions of the gate, and limits that
 * restricted the tasks. For one thread. */
class RunRecorder {
 public:
  /// @param robot  outlives this
  explicit RunRecorder(const config::Robot& robot) : robot_(robot) {}

  /// @param now  ns  @param interventions  of the gate since the drive side started
  void start(std::int64_t now, std::uint64_t interventions);
  /// Distances of bodies during the run.
  void add(const dds::Clearances& clearances);
  /// One control period of the run; those while it is paused do not count.
  void add(const dds::ControlStatus& status);
  /// @param reference  the last one of the run  @param reason  of a failed run
  dds::RunSummary summary(std::int64_t now,
                          std::uint64_t interventions,
                          const robots::Run& run,
                          const planning::Reference& reference,
                          const std::string& reason) const;

 private:
  using Limit = std::tuple<std::uint8_t, std::uint8_t, std::uint8_t>;  // kind, arm, tube

  const config::Robot& robot_;
  std::int64_t started_ = 0;
  std::uint64_t interventions_ = 0;
  std::uint64_t periods_ = 0;
  double least_clearance_ = std::numeric_limits<double>::infinity();  ///< m
  std::map<Limit, std::uint64_t> limits_;  ///< number of periods in which each limit restricted the tasks
};

}  // namespace tandem::planning_service
