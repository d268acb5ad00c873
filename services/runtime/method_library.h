// SPDX-License-Identifier: Apache-2.0
/** @file Loader of shared libraries with a redundancy-resolution method (docs/own-method.md). */
#pragma once

#include <filesystem>
#include <string>

#include "config/config.h"
#include "control/foreign_method.h"

namespace tandem::runtime {

/** Loads the method of a library as Method::kForeign of the robot's parameters. Before that, a child process opens the
 * library and checks the method with the robot's limits (control::checkMethod): code that throws, crashes or hangs
 * ends only that process. The library stays loaded. No effect for an empty path.
 * @param period  control period, s; 0: the robot's, and the duration of calls is not checked
 * @return description: name, file, remarks of the check (limits, duration); empty without a library
 * @throw std::invalid_argument "FILE: found ..., expected ..." if the library cannot be used. */
std::string loadMethod(const std::filesystem::path& library, double period, config::Robot& robot);

/// The same for a deployment; the duration is not checked in lock-step. @throw std::invalid_argument that also names
/// the deployment and its key.
std::string loadMethod(const config::Deployment& deployment, config::Robot& robot);

/// Key of the method in control's diagnostics.
inline constexpr const char* kMethodKey = "method";
/// "nspqp"; for Method::kForeign "foreign: NAME of LIBRARY".
std::string describeMethod(control::Method method, const config::Deployment& deployment, const config::Robot& robot);

}  // namespace tandem::runtime
