// SPDX-License-Identifier: Apache-2.0
#include "control/method_names.h"

#include "control/parameters.h"

namespace tandem::control {

std::vector<std::string> methodNames() {
  std::vector<std::string> names;
  names.reserve(kMethodCount);
  for (int m = 0; m < kMethodCount; ++m)
    names.emplace_back(name(static_cast<Method>(m)));
  return names;
}

std::string methodList() {
  std::string list;
  for (const std::string& name : methodNames())
    list += name + ", ";
  return list + "or foreign with a method_library";
}

}  // namespace tandem::control
