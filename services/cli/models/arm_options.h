// SPDX-License-Identifier: Apache-2.0
/** @file Options and output shared by the subcommands that evaluate the model of one arm. */
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "config/config.h"
#include "experiments/csv.h"
#include "kinematics/arm_model.h"

namespace tandem::cli {

/// The arm of that name, or of arm_NAME. @throw Failure(kUsage) that lists the arms.
const config::Arm& armOf(const config::Robot& robot, const std::string& name);

/// Numbers of a list "1,2,3", finite. @throw Failure(kUsage) that names the option where there are not `count`.
Eigen::VectorXd numbersOf(const std::string& option, const std::string& text, int count);

/// x, y, z, then the unit quaternion qx, qy, qz, qw.
std::vector<double> poseNumbers(const Eigen::Isometry3d& pose);

/// Columns of an arm's joints in a table. @param prefix  of their names: "arm_a."  @param end_angles  theta_i, not
/// alpha_i
std::vector<config::CsvColumn> jointColumns(const config::Arm& arm,
                                            const std::string& prefix = "",
                                            bool end_angles = false);

/// Why a row of joints cannot be answered: a bad row, or joints outside the robot's limits; empty if it can.
std::string refusal(const config::Arm& arm, const experiments::CsvRow& row);

/// "unstable: 2 conjugate points".
std::string unstable(int conjugate_points);

/// Status of a model's answer: "ok", "unstable: ...", or the reason why there is none.
std::string statusOf(kinematics::ModelStatus status, const kinematics::Tip& tip);

}  // namespace tandem::cli
