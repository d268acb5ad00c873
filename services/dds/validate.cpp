// SPDX-License-Identifier: Apache-2.0
#include "services/dds/validate.h"

#include <type_traits>

#include "services/dds/wire_detail.h"

namespace tandem::dds {
namespace {

/// Conditions between several members of a message.
template <class M>
const char* mismatch(const M&) {
  return nullptr;
}

const char* mismatch(const Shape& shape) {
  const std::size_t count = shape.tubes.size();
  return shape.points.size() != 3 * count || shape.outer_radius.size() != count
             ? "points, tubes and outer_radius of different lengths"
             : nullptr;
}

const char* mismatch(const Marker& marker) {
  return !marker.colors.empty() && marker.colors.size() != marker.points.size()
             ? "points and colors of different lengths"
             : nullptr;
}

/** Checks every member, also of nested structs; keeps the first defect. */
class Check {
 public:
  template <class T>
  void operator()(const char*, const T& value) {
    look(value, nullptr);
  }
  template <class T>
  void operator()(const char*, const T& value, const Range& range) {
    look(value, &range);
  }
  const char* problem() const { return problem_; }

 private:
  void note(bool wrong, const char* words) {
    if (wrong && problem_ == nullptr)
      problem_ = words;
  }
  /// Whether a value, or the length of a text or list, exceeds its range.
  static bool beyond(std::uint64_t value, const Range* range, std::size_t usual) {
    return range == nullptr ? value > usual : value > range->most && static_cast<std::int64_t>(value) != range->also;
  }

  template <class T>
  void look(const T& value, const Range* range) {
    if constexpr (Listed<T>) {
      T::members(value, *this);
      if (const char* words = mismatch(value))
        note(true, words);
    } else if constexpr (std::is_integral_v<T>) {
      note(range != nullptr && beyond(static_cast<std::uint64_t>(value), range, 0), range ? range->words : "");
    }
  }
  void look(const std::string& text, const Range* range) {
    note(beyond(text.size(), range, kMaxText), range ? range->words : "text too long");
    // CDR ends a text at its first NUL: the remainder would be lost.
    note(text.find('\0') != std::string::npos, "NUL within a text");
  }
  template <class T, std::size_t N>
  void look(const std::array<T, N>& values, const Range* range) {
    if constexpr (!std::is_floating_point_v<T>) {
      if (range == nullptr && std::is_integral_v<T>)
        return;
      for (const T& value : values)
        look(value, range);
    }
  }
  template <class T>
  void look(const std::vector<T>& values, const Range* range) {
    note(beyond(values.size(), range, kMaxList), range ? range->words : "list too long");
    if constexpr (!std::is_arithmetic_v<T>) {
      for (const T& value : values)
        look(value, nullptr);
    }
  }

  const char* problem_ = nullptr;
};

}  // namespace

template <class M>
const char* malformed(const M& message) {
  Check check;
  check(M::kType, message);
  return check.problem();
}

#define TANDEM_INSTANTIATE(M) template const char* malformed(const M&);
TANDEM_EACH_MESSAGE(TANDEM_INSTANTIATE)
#undef TANDEM_INSTANTIATE

}  // namespace tandem::dds
