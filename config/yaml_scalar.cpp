// SPDX-License-Identifier: Apache-2.0
#include "config/detail/yaml_scalar.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <regex>

namespace tandem::config {
namespace {

constexpr std::size_t kLongestQuote = 40;

/// from_chars over the whole text; a leading plus is allowed as in YAML.
template <class Value>
std::optional<Value> parse(const std::string& text) {
  const char* begin = text.data();
  const char* const end = begin + text.size();
  if (text.size() > 1 && *begin == '+' && text[1] != '-')
    ++begin;
  Value value{};
  const auto [stopped, status] = std::from_chars(begin, end, value);
  if (status != std::errc{} || stopped != end)
    return std::nullopt;
  return value;
}

bool inside(const Range& range, double value) {
  return (range.exclusive_minimum ? value > range.minimum : value >= range.minimum) && value <= range.maximum;
}

/// Printable and short, for terminals and logs.
std::string clean(const std::string& text) {
  std::string shown;
  for (const char c : text.substr(0, kLongestQuote)) {
    shown += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? '?' : c;
  }
  return text.size() > kLongestQuote ? shown + "..." : shown;
}

}  // namespace

bool isPlain(const YAML::Node& node) { return node.IsScalar() && node.Tag() != "!"; }

std::string describeNode(const YAML::Node& node) {
  if (!node.IsDefined() || node.IsNull())
    return "nothing";
  if (node.IsMap())
    return "a mapping";
  if (node.IsSequence())
    return node.size() == 0 ? "an empty list" : "a list of " + std::to_string(node.size());
  const std::string& text = node.Scalar();
  if (isPlain(node) && (parse<double>(text) || readBool(node)))
    return clean(text);
  return "the text \"" + clean(text) + "\"";
}

bool isWord(const YAML::Node& node, const Field& field) {
  return node.IsScalar() && std::find(field.words.begin(), field.words.end(), node.Scalar()) != field.words.end();
}

std::optional<double> readNumber(const YAML::Node& node, const Field& field, const Unit* unit) {
  if (isWord(node, field))
    return std::numeric_limits<double>::infinity();
  if (!isPlain(node))
    return std::nullopt;
  const std::optional<double> value = parse<double>(node.Scalar());
  if (!value || !std::isfinite(*value))
    return std::nullopt;
  const double si = unit ? unit->toSi(*value) : *value;
  // A number that overflows or becomes 0 in the conversion is an error.
  if (!std::isfinite(si) || (si == 0.0 && *value != 0.0) || !inside(field.range, si))
    return std::nullopt;
  return si;
}

std::optional<long long> readInteger(const YAML::Node& node, const Field& field) {
  if (!isPlain(node))
    return std::nullopt;
  const std::optional<long long> value = parse<long long>(node.Scalar());
  if (!value || !inside(field.range, static_cast<double>(*value)))
    return std::nullopt;
  return value;
}

std::optional<bool> readBool(const YAML::Node& node) {
  if (!isPlain(node))
    return std::nullopt;
  if (node.Scalar() == "true")
    return true;
  if (node.Scalar() == "false")
    return false;
  return std::nullopt;
}

std::optional<std::string> readText(const YAML::Node& node, const Field& field) {
  if (!node.IsScalar() || node.Scalar().empty())
    return std::nullopt;
  const std::string& text = node.Scalar();
  if (isPlain(node)) {
    const bool is_integer = parse<long long>(text).has_value();
    const bool is_number = is_integer || parse<double>(text).has_value();
    if (readBool(node) || (is_number && !(is_integer && field.numeric_text)))
      return std::nullopt;
  }
  if (!field.words.empty() && !isWord(node, field))
    return std::nullopt;
  if (!field.pattern.empty() && !std::regex_match(text, std::regex(field.pattern)))
    return std::nullopt;
  return text;
}

}  // namespace tandem::config
