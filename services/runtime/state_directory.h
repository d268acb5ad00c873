// SPDX-License-Identifier: Apache-2.0
/** @file State directory: folder of the files that a service writes for its next start. */
#pragma once

#include <filesystem>

namespace tandem::runtime {

/// $STATE_DIRECTORY (set by systemd), else $XDG_STATE_HOME/tandem, else ~/.local/state/tandem, else /var/lib/tandem. It
/// need not exist.
std::filesystem::path stateDirectory();

}  // namespace tandem::runtime
