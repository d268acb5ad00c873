// SPDX-License-Identifier: Apache-2.0
#include "config/key_table.h"

#include <cmath>
#include <cstdio>
#include <stdexcept>

namespace tandem::config {
namespace {

Field make(const std::string& name, Type type, const std::string& description) {
  Field field;
  field.name = name;
  field.type = type;
  field.description = description;
  return field;
}

/// " from 0 to 232", " more than 0", in the unit.
std::string rangeForPeople(const Range& range, const Unit* unit) {
  const auto in_unit = [unit](double value) { return formatNumber(unit ? unit->fromSi(value) : value); };
  const bool has_minimum = std::isfinite(range.minimum);
  const bool has_maximum = std::isfinite(range.maximum);
  if (has_minimum && has_maximum) {
    return (range.exclusive_minimum ? " more than " : " from ") + in_unit(range.minimum) +
           (range.exclusive_minimum ? " and at most " : " to ") + in_unit(range.maximum);
  }
  if (has_minimum)
    return (range.exclusive_minimum ? " more than " : " of at least ") + in_unit(range.minimum);
  return has_maximum ? " of at most " + in_unit(range.maximum) : "";
}

std::string numberForPeople(const Field& field, const Unit* unit) {
  std::string text = field.type == Type::kInteger        ? "an integer"
                     : field.quantity == Quantity::kNone ? "a finite number"
                                                         : std::string(name(field.quantity));
  text += rangeForPeople(field.range, unit);
  if (unit)
    text += " in " + unit->forPeople();
  if (!field.words.empty())
    text += ", or " + join(field.words, " or ");
  return text;
}

std::string elementForPeople(const Field& field, const Unit* unit) {
  switch (field.type) {
    case Type::kBool:
      return "true or false";
    case Type::kInteger:
    case Type::kNumber:
      if (field.row_size > 0) {
        return "a list of " + std::to_string(field.row_size) + " (each " + numberForPeople(field, unit) + ")";
      }
      return numberForPeople(field, unit);
    case Type::kText:
      if (!field.words.empty())
        return field.words.size() == 1 ? field.words[0] : "one of " + join(field.words);
      return field.pattern.empty() ? "text" : field.pattern_meaning;
    case Type::kMapping:
      return "a mapping (" + field.mapping->name + ")" +
             (field.words.empty() ? "" : ", or " + join(field.words, " or "));
  }
  return "";
}

}  // namespace

std::string formatNumber(double value) {
  if (std::isinf(value))
    return "unlimited";
  char text[32];
  std::snprintf(text, sizeof text, "%.12g", value);
  return text;
}

std::string indexed(std::string path, std::size_t index) {
  path += '[';
  path += std::to_string(index);
  path += ']';
  return path;
}

std::string join(const std::vector<std::string>& words, const std::string& separator) {
  std::string text;
  for (const std::string& word : words)
    text += (text.empty() ? "" : separator) + word;
  return text;
}

std::string expectation(const Field& field, const Unit* unit, bool element) {
  const std::string one = elementForPeople(field, unit);
  if (!field.is_list || element)
    return one;
  const std::string sizes = field.min_size == field.max_size
                                ? std::to_string(field.min_size)
                                : std::to_string(field.min_size) + " to " + std::to_string(field.max_size);
  return (field.or_scalar ? one + ", or a list of " + sizes : "a list of " + sizes + " (each " + one + ")");
}

std::string usualForPeople(const Field& field, const Unit* unit) {
  if (!field.usual)
    return "";
  const auto number = [unit](double si) { return formatNumber(unit ? unit->fromSi(si) : si); };
  return "usually " + number(field.usual->minimum) + " to " + number(field.usual->maximum) +
         (unit ? " " + unit->forPeople() : "");
}

Field flag(const std::string& name, const std::string& description) { return make(name, Type::kBool, description); }

Field integer(const std::string& name, const std::string& description) {
  return make(name, Type::kInteger, description);
}

Field number(const std::string& name, Quantity quantity, const std::string& description) {
  Field field = make(name, Type::kNumber, description);
  field.quantity = quantity;
  return field;
}

Field text(const std::string& name, const std::string& description) { return make(name, Type::kText, description); }

Field mapping(const std::string& name, const Mapping& keys, const std::string& description) {
  Field field = make(name, Type::kMapping, description);
  field.mapping = &keys;
  return field;
}

Field Field::required() const {
  Field field = *this;
  field.is_required = true;
  field.default_number.reset();
  field.default_text.reset();
  return field;
}

Field Field::list(int minimum, int maximum) const {
  Field field = *this;
  field.is_list = true;
  field.min_size = minimum;
  field.max_size = maximum;
  return field;
}

Field Field::orScalar() const {
  Field field = *this;
  field.or_scalar = true;
  return field;
}

Field Field::unique() const {
  Field field = *this;
  field.is_unique = true;
  return field;
}

Field Field::rows(int size) const {
  Field field = *this;
  field.row_size = size;
  return field;
}

Field Field::above(double minimum) const {
  Field field = *this;
  field.range.minimum = minimum;
  field.range.exclusive_minimum = true;
  return field;
}

Field Field::atLeast(double minimum) const {
  Field field = *this;
  field.range.minimum = minimum;
  return field;
}

Field Field::atMost(double maximum) const {
  Field field = *this;
  field.range.maximum = maximum;
  return field;
}

Field Field::usually(double minimum, double maximum) const {
  Field field = *this;
  field.usual = Range{minimum, maximum};
  return field;
}

Field Field::within(double minimum, double maximum) const {
  Field field = *this;
  field.range = {minimum, maximum, false};
  return field;
}

Field Field::orUnlimited() const { return oneOf({"unlimited"}); }

Field Field::oneOf(std::vector<std::string> allowed) const {
  Field field = *this;
  field.words = std::move(allowed);
  return field;
}

Field Field::matching(const std::string& regular_expression, const std::string& meaning) const {
  Field field = *this;
  field.pattern = regular_expression;
  field.pattern_meaning = meaning;
  return field;
}

Field Field::orInteger() const {
  Field field = *this;
  field.numeric_text = true;
  return field;
}

Field Field::defaultsTo(double value) const {
  Field field = *this;
  field.default_number = value;
  return field;
}

Field Field::defaultsTo(const std::string& value) const {
  Field field = *this;
  field.default_text = value;
  return field;
}

Field Field::defaultNote(const std::string& note) const {
  Field field = *this;
  field.default_note = note;
  field.default_number.reset();
  field.default_text.reset();
  return field;
}

Field Field::optional() const {
  Field field = *this;
  field.is_optional = true;
  return field;
}

Field Field::withoutMotion() const {
  Field field = *this;
  field.moves = false;
  return field;
}

std::vector<std::pair<std::string, const Unit*>> Field::keys() const {
  if (quantity == Quantity::kNone)
    return {{name, nullptr}};
  std::vector<std::pair<std::string, const Unit*>> all;
  for (const Unit* unit : unitsOf(quantity))
    all.emplace_back(name + "_" + std::string(unit->suffix), unit);
  return all;
}

std::string Field::keysForPeople() const {
  std::vector<std::string> names;
  for (const auto& [key, unit] : keys())
    names.push_back(key);
  return join(names, " or ");
}

const Field& Mapping::field(const std::string& field_name) const {
  for (const Field& field : fields) {
    if (field.name == field_name)
      return field;
  }
  throw std::logic_error("internal error: the code reads key '" + field_name + "', which the key table '" + name +
                         "' lacks");
}

}  // namespace tandem::config
