// SPDX-License-Identifier: Apache-2.0
#include "control/method_names.h"

#include "control/parameters.h"

namespace tandem::control {

std::vector<std::string> methodNames() {
  std::vector<std::string> names;
  names.reserve(idl::Enumeration<Method>::entries.size());
  for (const auto& method : idl::Enumeration<Method>::entries)
    names.emplace_back(method.name);
  return names;
}

std::string methodList() {
  std::string list;
  int left = kMethodCount;
  for (const std::string& name : methodNames()) {
    --left;
    list += name + (left > 1 ? ", " : left == 1 ? " or " : "");
  }
  return list;
}

}  // namespace tandem::control
