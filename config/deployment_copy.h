// SPDX-License-Identifier: Apache-2.0
/** @file Loader of a deployment file that is not in its folder, as the one in a recording. */
#pragma once

#include "config/config.h"

namespace tandem::config {

/** Files that belong to a deployment file, at other places than those that it names. */
struct CompanionFiles {
  std::filesystem::path robot;
  std::filesystem::path hardware;  ///< empty: the deployment is read as one without hardware
};
/// Loads a copy of a deployment file. The folder of its credentials is not looked for.
Deployment loadDeployment(const std::filesystem::path& copy, const CompanionFiles& companions);

}  // namespace tandem::config
