// SPDX-License-Identifier: Apache-2.0
/** @file Tables of the permitted keys of each kind of file. The loaders check files against them; the JSON Schemas and
 * the key tables of docs/configuration/ are generated from them. */
#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <typeinfo>
#include <utility>
#include <vector>

#include "config/units.h"

namespace tandem::config {

class Map;
struct Mapping;

enum class Type { kBool, kInteger, kNumber, kText, kMapping };

/** Allowed values, in SI. */
struct Range {
  double minimum = -std::numeric_limits<double>::infinity();
  double maximum = std::numeric_limits<double>::infinity();
  bool exclusive_minimum = false;
};

/** One key of a mapping. Built by the functions below and refined by the chained ones. */
struct Field {
  std::string name;  ///< without unit
  std::string description;
  Type type = Type::kText;
  Quantity quantity = Quantity::kNone;
  bool is_required = false;
  bool is_list = false;
  bool or_scalar = false;     ///< a list, or one value for all
  bool is_unique = false;     ///< a list without repeated values
  bool numeric_text = false;  ///< text that may be written as an integer without quotes
  bool is_optional = false;   ///< of kMapping: if absent, it has no value instead of its defaults
  bool moves = true;          ///< motion depends on it: part of config/values.h
  int min_size = 0;           ///< of the list
  int max_size = 0;
  int row_size = 0;  ///< > 0: the list's elements are lists of so many numbers
  Range range;
  std::optional<Range> usual;            ///< values outside of it are read with a warning, SI
  std::vector<std::string> words;        ///< the only texts allowed, or words allowed instead of a number or mapping
  std::string pattern;                   ///< ECMAScript regular expression of a text
  std::string pattern_meaning;           ///< description of the pattern for a person
  const Mapping* mapping = nullptr;      ///< of kMapping
  std::optional<double> default_number;  ///< SI; of every element of a list; 0 and 1 for kBool
  std::optional<std::string> default_text;
  std::string default_note;  ///< description of a default that is computed
  /// Struct with the member for the value, and the function that stores it (config/detail/bind.h); null: the loader
  /// reads the value itself.
  const std::type_info* owner = nullptr;
  std::function<void(const Map&, const Field&, void* owner)> store;

  Field required() const;  ///< without a default
  Field list(int minimum, int maximum) const;
  Field vector3() const { return list(3, 3); }
  Field orScalar() const;
  Field unique() const;
  Field rows(int size) const;
  Field above(double minimum) const;    ///< exclusive
  Field atLeast(double minimum) const;  ///< inclusive
  Field atMost(double maximum) const;
  Field within(double minimum, double maximum) const;
  Field usually(double minimum, double maximum) const;  ///< sets `usual`; for lists, of each element's size
  Field orUnlimited() const;                            ///< the word "unlimited" means infinity
  Field oneOf(std::vector<std::string> allowed) const;
  Field matching(const std::string& regular_expression, const std::string& meaning) const;
  Field orInteger() const;
  Field defaultsTo(double value) const;
  Field defaultsTo(const std::string& value) const;
  Field defaultNote(const std::string& note) const;  ///< instead of a default
  Field optional() const;                            ///< sets is_optional
  Field withoutMotion() const;                       ///< no motion depends on it

  /// All forms of the key: ("outer_diameter_mm", mm), ("outer_diameter_m", m); the unit is null for plain keys.
  std::vector<std::pair<std::string, const Unit*>> keys() const;
  /// The preferred form.
  std::string key() const { return keys().front().first; }
  /// "outer_diameter_mm or outer_diameter_m".
  std::string keysForPeople() const;
};

/** Keys of one mapping. */
struct Mapping {
  std::string name;  ///< of the definition in the schema
  std::string description;
  std::vector<Field> fields;
  bool exactly_one = false;  ///< of the fields must be present
  /// Names of optional fields with alternative definitions of the same thing: all of one group must be present, none of
  /// another.
  std::vector<std::vector<std::string>> alternatives = {};

  /// @throw std::logic_error for a name that is not in the table.
  const Field& field(const std::string& field_name) const;
};

Field flag(const std::string& name, const std::string& description);
Field integer(const std::string& name, const std::string& description);
Field number(const std::string& name, Quantity quantity, const std::string& description);
Field text(const std::string& name, const std::string& description);
Field mapping(const std::string& name, const Mapping& keys, const std::string& description);

/// Shortest decimal text of a number, to 12 digits: "0.88", "1e+08"; "unlimited" for infinities.
std::string formatNumber(double value);

/// Description of the permitted values of this field, in the unit of its key: "a length more than 0, in mm".
/// @param element of an element of the list instead of the whole
std::string expectation(const Field& field, const Unit* unit, bool element = false);

/// "usually 1 to 300 GPa", in the unit of its key; empty without such a range.
std::string usualForPeople(const Field& field, const Unit* unit);

/// Path of an element: "tubes[2]" for "tubes" and 2.
std::string indexed(std::string path, std::size_t index);

/// "a, b, c".
std::string join(const std::vector<std::string>& words, const std::string& separator = ", ");

}  // namespace tandem::config
