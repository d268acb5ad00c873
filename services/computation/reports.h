// SPDX-License-Identifier: Apache-2.0
/** @file Conversion of planning results to messages. */
#pragma once

#include "planning/rehearsal.h"
#include "planning/start_choice.h"
#include "planning/timing.h"
#include "services/dds/messages.h"

namespace tandem::computation {

std::vector<double> listOf(const Eigen::Ref<const Eigen::VectorXd>& numbers);
dds::TrajectoryReport reportOf(const planning::FeasibilityReport& report);
dds::RehearsalReport reportOf(const planning::Rehearsal& rehearsal);
dds::IkReport reportOf(const planning::IkAnswer& answer);
dds::TimingReport reportOf(const planning::Timing& timing);
dds::StartReport reportOf(const planning::StartCandidate& candidate, const safety::RobotVector& given);
bool reached(const dds::PointReport& point);
/// Number of unreachable points.
int unreachable(const dds::TrajectoryReport& report);

}  // namespace tandem::computation
