// SPDX-License-Identifier: Apache-2.0
/** @file Robot files of all types, loaded as one struct for the services. */
#pragma once

#include "config/config.h"
#include "config/cooperative.h"

namespace tandem::config {

/** A robot/1 or cooperative/1 file.
 *
 * Of a cooperative file the arms are those that take part, in the order of the mechanism's joints: those that hold the
 * object in the order of its contacts, or the target and then the one that assists; without a tube model.
 * @throw Error as loadRobot() and loadCooperative() do; for a cooperative file that says of both object and assistance,
 * or of neither, or names an arm that takes no part, or margins, which only tubes have. */
Robot loadAnyRobot(const std::filesystem::path& file);

/// The arms that take part, by their numbers in the file, in the order of the mechanism's joints.
std::vector<int> armsInOrder(const CooperativeRobot& robot);

}  // namespace tandem::config
