// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>

#include "hal/canopen/detail/eds_number.h"

namespace tandem::hal::canopen {
namespace {

constexpr auto kLargest64 = std::numeric_limits<std::int64_t>::max();

/// A text that is one number and nothing else.
template <class T, class... Base>
std::optional<T> whole(const std::string& text, Base... base) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base...);
  if (text.empty() || error != std::errc{} || end != text.data() + text.size())
    return std::nullopt;
  return value;
}

/// Removes "$nodeid" and the plus sign beside it. @return false: there is something else beside it.
bool takeNodeId(std::string& text, EdsNumber& number) {
  const std::size_t at = text.find("nodeid");
  if (at == std::string::npos)
    return true;
  const bool dollar = at > 0 && text[at - 1] == '$';
  if (!dollar)
    number.odd.push_back("NODEID without '$' is read as $NODEID");
  std::string before = trimmed(text.substr(0, dollar ? at - 1 : at));
  std::string after = trimmed(text.substr(at + 6));
  number.adds_node_id = true;
  if (before.empty() && after.empty()) {
    text = "0";
  } else if (before.empty() && after[0] == '+') {
    text = trimmed(after.substr(1));
  } else if (after.empty() && before.back() == '+') {
    text = trimmed(before.substr(0, before.size() - 1));
  } else {
    return false;
  }
  return true;
}

std::optional<std::uint64_t> readMagnitude(const std::string& text, std::vector<std::string>& odd) {
  if (text.starts_with("0x"))
    return whole<std::uint64_t>(text.substr(2), 16);
  const bool zero = text.size() > 1 && text[0] == '0';
  const auto decimal = whole<std::uint64_t>(text, 10);
  const auto octal = zero ? whole<std::uint64_t>(text, 8) : decimal;
  if (octal != decimal && octal) {
    odd.push_back("'" + text + "' begins with 0 and is read as octal (CiA 306): " + std::to_string(*octal) + ", not " +
                  std::to_string(*decimal));
    return octal;
  }
  if (octal != decimal)
    odd.push_back("'" + text + "' begins with 0 like an octal number and is read as decimal");
  return decimal;
}

}  // namespace

std::string withoutComment(const std::string& text, std::vector<std::string>& odd) {
  const std::size_t begin = text.find(';');
  if (begin != std::string::npos)
    odd.push_back("'" + text.substr(begin) + "' counts as a comment");
  return trimmed(text.substr(0, begin));
}

std::optional<EdsNumber> readNumber(const std::string& text) {
  EdsNumber number;
  std::string rest = lowerCase(withoutComment(text, number.odd));
  if (!takeNodeId(rest, number))
    return std::nullopt;
  if (rest.starts_with('-') || rest.starts_with('+')) {
    number.negative = rest[0] == '-';
    rest = rest.substr(1);
  }
  const auto magnitude = readMagnitude(rest, number.odd);
  if (!magnitude)
    return std::nullopt;
  number.magnitude = *magnitude;
  return number;
}

std::int64_t largest(DataType type) {
  const int bits = 8 * sizeOf(type);
  if (type == DataType::kBoolean)
    return 1;
  if (bits >= 64)
    return kLargest64;
  return (std::int64_t{1} << (isSigned(type) ? bits - 1 : bits)) - 1;
}

std::optional<std::int64_t> fit(const EdsNumber& number, DataType type) {
  const auto high = static_cast<std::uint64_t>(largest(type));
  const bool wide = sizeOf(type) == 8;
  if (number.negative) {
    const std::uint64_t most = isSigned(type) ? high + 1 : 0;
    return number.magnitude > most ? std::nullopt : std::optional(static_cast<std::int64_t>(0 - number.magnitude));
  }
  if (number.magnitude <= high || wide)
    return static_cast<std::int64_t>(number.magnitude);
  if (isSigned(type) && number.magnitude <= 2 * high + 1)
    return static_cast<std::int64_t>(number.magnitude - 2 * (high + 1));
  return std::nullopt;
}

std::optional<std::int64_t> readReal(const std::string& text, DataType type) {
  const bool single = type == DataType::kReal32;
  if (lowerCase(text).starts_with("0x")) {
    const auto bits = whole<std::uint64_t>(text.substr(2), 16);
    return !bits || (single && *bits > 0xFFFFFFFF) ? std::nullopt : std::optional(static_cast<std::int64_t>(*bits));
  }
  const auto value = whole<double>(text, std::chars_format::general);
  if (!value || (single && std::isfinite(*value) && std::abs(*value) > std::numeric_limits<float>::max()))
    return std::nullopt;
  return single ? std::int64_t{std::bit_cast<std::uint32_t>(static_cast<float>(*value))}
                : std::bit_cast<std::int64_t>(*value);
}

}  // namespace tandem::hal::canopen
