// SPDX-License-Identifier: Apache-2.0
/** @file Loader of shared libraries with a redundancy-resolution method (docs/own-method.md). */
#pragma once

#include <filesystem>
#include <string>

#include "config/config.h"
#include "control/foreign_method.h"

namespace tandem::runtime {

/** Loads the method of a library and makes it Method::kForeign of the robot's parameters. Before that, a child process
 * opens the library and checks the method with the robot's limits (control::checkMethod): code that throws, crashes or
 * hangs ends that process. The library stays loaded. An empty path: nothing.
 * @param period  s, of control; 0: the robot's, and the duration of calls is not judged
 * @return what was found, for people: name, file, who keeps the limits, duration; empty without a library
 * @throw std::invalid_argument "FILE: found ..., expected ..." where the library cannot be used. */
std::string loadMethod(const std::filesystem::path& library, double period, config::Robot& robot);

/// The same for a deployment; lock-step does not judge the duration. @throw std::invalid_argument that also names the
/// deployment and its key.
std::string loadMethod(const config::Deployment& deployment, config::Robot& robot);

/// Key of this in control's diagnostics.
inline constexpr const char* kMethodKey = "method";
/// "nspqp"; of Method::kForeign "foreign: NAME of LIBRARY".
std::string describeMethod(control::Method method, const config::Deployment& deployment, const config::Robot& robot);

}  // namespace tandem::runtime
