// SPDX-License-Identifier: Apache-2.0
/** @file Random messages, and comparison member by member. */
#pragma once

#include <algorithm>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "services/dds/messages.h"

namespace tandem::msg {

/** Fills messages with random values. */
class Randomiser {
 public:
  explicit Randomiser(unsigned seed) : random_(seed) {}

  template <class T>
  void operator()(T& value) {
    if constexpr (std::is_same_v<T, bool>) {
      value = below(2) == 1;
    } else if constexpr (std::is_same_v<T, std::int64_t>) {
      // Stamps: the range of int32 seconds, before and after zero.
      value =
          std::uniform_int_distribution<std::int64_t>(-2'000'000'000'000'000'000, 2'000'000'000'000'000'000)(random_);
    } else if constexpr (std::is_integral_v<T>) {
      value = static_cast<T>(random_() * 0x9E3779B97F4A7C15u >> 3);
    } else if constexpr (std::is_floating_point_v<T>) {
      value = std::uniform_real_distribution<T>(-1e6, 1e6)(random_);
    } else {
      T::members(value, [this](const char*, auto& member, auto&&...) { (*this)(member); });
    }
  }
  template <class T, std::size_t N>
  void operator()(std::array<T, N>& values) {
    for (T& value : values) {
      (*this)(value);
    }
  }
  void operator()(std::string& text) {
    text.resize(below(40));
    for (char& letter : text) {
      letter = static_cast<char>(1 + below(255));
    }
  }
  template <class T>
  void operator()(std::vector<T>& values) {
    values.resize(below(20));
    for (T& value : values) {
      (*this)(value);
    }
  }

  std::size_t below(std::size_t limit) { return random_() % limit; }

 private:
  std::mt19937_64 random_;
};

template <class T>
bool same(const T& a, const T& b) {
  if constexpr (requires { T::kType; }) {
    std::vector<std::function<bool(const void*)>> members;
    T::members(a, [&]<class V>(const char*, const V& member, auto&&...) {
      members.push_back([&member](const void* other) { return same(member, *static_cast<const V*>(other)); });
    });
    bool equal = true;
    std::size_t next = 0;
    T::members(b, [&](const char*, const auto& member, auto&&...) { equal = members[next++](&member) && equal; });
    return equal;
  } else {
    return a == b;
  }
}
template <class T>
bool same(const std::vector<T>& a, const std::vector<T>& b) {
  bool equal = a.size() == b.size();
  for (std::size_t i = 0; equal && i < a.size(); ++i) {
    equal = same(a[i], b[i]);
  }
  return equal;
}
template <class T, std::size_t N>
bool same(const std::array<T, N>& a, const std::array<T, N>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), [](const T& x, const T& y) { return same(x, y); });
}

}  // namespace tandem::msg
