// SPDX-License-Identifier: Apache-2.0
#include "services/recordings/state_folder.h"

#include <cstdlib>

namespace tandem::recordings {
namespace {

const char* environment(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr && *value != '\0' ? value : nullptr;
}

}  // namespace

std::filesystem::path stateFolder(const std::string& name) {
  std::filesystem::path state = "/var/lib/tandem";
  if (const char* systemd = environment("STATE_DIRECTORY"))
    state = systemd;
  else if (const char* xdg = environment("XDG_STATE_HOME"))
    state = std::filesystem::path(xdg) / "tandem";
  else if (const char* home = environment("HOME"))
    state = std::filesystem::path(home) / ".local" / "state" / "tandem";
  return state / name;
}

}  // namespace tandem::recordings
