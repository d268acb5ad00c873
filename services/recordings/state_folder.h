// SPDX-License-Identifier: Apache-2.0
/** @file Folder of files that services write by themselves. */
#pragma once

#include <filesystem>
#include <string>

namespace tandem::recordings {

/// `name` in STATE_DIRECTORY (systemd), XDG_STATE_HOME/tandem, ~/.local/state/tandem or /var/lib/tandem.
std::filesystem::path stateFolder(const std::string& name);

}  // namespace tandem::recordings
