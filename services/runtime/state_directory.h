// SPDX-License-Identifier: Apache-2.0
/** @file Folder for what a service keeps over its end. */
#pragma once

#include <filesystem>

namespace tandem::runtime {

/// $STATE_DIRECTORY (set by systemd), else $XDG_STATE_HOME/tandem, else ~/.local/state/tandem, else /var/lib/tandem. It
/// need not exist.
std::filesystem::path stateDirectory();

}  // namespace tandem::runtime
