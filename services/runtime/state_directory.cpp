// SPDX-License-Identifier: Apache-2.0
#include "services/runtime/state_directory.h"

#include <cstdlib>

namespace tandem::runtime {
namespace {

const char* stateVariable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr || *value == '\0' ? nullptr : value;
}

}  // namespace

std::filesystem::path stateDirectory() {
  if (const char* systemd = stateVariable("STATE_DIRECTORY"))
    return systemd;
  if (const char* xdg = stateVariable("XDG_STATE_HOME"))
    return std::filesystem::path(xdg) / "tandem";
  if (const char* home = stateVariable("HOME"))
    return std::filesystem::path(home) / ".local" / "state" / "tandem";
  return "/var/lib/tandem";
}

}  // namespace tandem::runtime
