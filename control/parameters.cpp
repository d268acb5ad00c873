// SPDX-License-Identifier: Apache-2.0
#include "control/parameters.h"

#include <array>
#include <cstddef>

namespace tandem::control {
namespace {

constexpr std::array<std::string_view, kMethodCount> kMethodNames{"nsp",   "nspwln", "nspwln-joint", "nspqp",
                                                                  "snsqp", "sns",    "hqp"};
constexpr std::array<std::string_view, 2> kBackendNames{"active-set", "ipopt"};
constexpr std::array<std::string_view, 2> kBoundsNames{"coupled", "frozen"};

template <class Enum, std::size_t N>
std::optional<Enum> find(const std::array<std::string_view, N>& names, std::string_view name) {
  for (std::size_t i = 0; i < N; ++i) {
    if (names[i] == name)
      return static_cast<Enum>(i);
  }
  return std::nullopt;
}

template <class Enum, std::size_t N>
std::string_view nameOf(const std::array<std::string_view, N>& names, Enum value) {
  const auto index = static_cast<std::size_t>(value);
  return index < N ? names[index] : "unknown";
}

}  // namespace

std::string_view name(Method method) { return nameOf(kMethodNames, method); }
std::string_view name(Backend backend) { return nameOf(kBackendNames, backend); }
std::string_view name(BoundsKind kind) { return nameOf(kBoundsNames, kind); }
std::optional<Method> methodFromName(std::string_view name) { return find<Method>(kMethodNames, name); }
std::optional<Backend> backendFromName(std::string_view name) { return find<Backend>(kBackendNames, name); }
std::optional<BoundsKind> boundsFromName(std::string_view name) { return find<BoundsKind>(kBoundsNames, name); }

}  // namespace tandem::control
