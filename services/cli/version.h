// SPDX-License-Identifier: Apache-2.0
/** @file Text of `tandem --version`. */
#pragma once

#include <string>

namespace tandem::cli {

/// Version, wire version, commit of the sources (with a + if files differ from it), Fast DDS and build type.
std::string versionText();

}  // namespace tandem::cli
