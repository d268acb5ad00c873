// SPDX-License-Identifier: Apache-2.0
/** @file Binding of YAML keys to struct members. A field of a table names the member for its value; the member's
 * initialiser is its default unless the field has another one; Map::read() fills the struct:
 *
 *     number("lease", kTime, "silence after which the lease is lost", &Budgets::lease).above(0)
 */
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "config/detail/yaml_reader.h"
#include "idl/enumerations.h"

namespace tandem::config {

/// Words with their values.
template <class Value>
using Words = std::vector<std::pair<std::string, Value>>;

/// All values of an IDL enumeration, by their names.
template <idl::Enumerated E>
Words<E> allOf() {
  Words<E> words;
  for (const auto& entry : idl::Enumeration<E>::entries)
    words.emplace_back(entry.name, entry.value);
  return words;
}

namespace binding {

template <class Value>
inline constexpr bool kIsList = false;
template <class Element>
inline constexpr bool kIsList<std::vector<Element>> = true;
template <class Value>
inline constexpr bool kIsOptional = false;
template <class Value>
inline constexpr bool kIsOptional<std::optional<Value>> = true;

template <class Value>
struct ElementOf {
  using Type = Value;
};
template <class Element>
struct ElementOf<std::vector<Element>> {
  using Type = Element;
};

/// Member at the end of a path of members, for example `leash` of `guard`.
template <class Value>
Value& at(Value& value) {
  return value;
}
template <class Owner, class Base, class First, class... More>
auto& at(Owner& owner, First Base::*first, More... more) {
  return at(owner.*first, more...);
}
template <class Owner, class... Path>
using ValueAt = std::remove_reference_t<decltype(at(std::declval<Owner&>(), std::declval<Path>()...))>;

template <class Owner, class First, class... More>
using WordsOf = Words<typename ElementOf<ValueAt<Owner, First Owner::*, More...>>::Type>;

/// False if the key is absent and has no default: the member keeps its value.
inline bool isPresent(const Map& map, const Field& field) {
  return map.has(field.name) || field.default_number || field.default_text;
}

template <class Value>
void storeMapping(const Map& map, const Field& field, Value& value) {
  if constexpr (kIsOptional<Value>) {
    if (map.has(field.name))
      map.map(field.name).read(value.emplace());
  } else if constexpr (kIsList<Value>) {
    for (const Map& entry : map.maps(field.name))
      entry.read(value.emplace_back());
  } else {
    map.map(field.name).read(value);
  }
}

template <class Value>
void storeValue(const Map& map, const Field& field, Value& value) {
  const std::string& name = field.name;
  if constexpr (std::is_same_v<Value, bool>)
    value = field.type == Type::kBool ? map.flag(name) : map.integer(name) == 1;
  else if constexpr (std::is_same_v<Value, std::uint32_t>)
    value = map.unsigned32(name);
  else if constexpr (std::is_integral_v<Value>)
    value = static_cast<Value>(map.integer(name));
  else if constexpr (std::is_same_v<Value, double>)
    value = map.number(name);
  else if constexpr (std::is_same_v<Value, std::string>)
    value = map.text(name);
  else if constexpr (std::is_same_v<Value, std::filesystem::path>)
    value = map.path(name);
  else if constexpr (std::is_same_v<Value, std::vector<std::string>>)
    value = map.texts(name);
  else if constexpr (std::is_same_v<Value, Eigen::Vector3d>)
    value = map.vector3(name);
  else
    value = map.points(name);
}

template <class Value>
inline constexpr bool kIsPlain =
    std::is_arithmetic_v<Value> || std::is_same_v<Value, std::string> || std::is_same_v<Value, std::filesystem::path> ||
    std::is_same_v<Value, std::vector<std::string>> || std::is_same_v<Value, Eigen::Vector3d> ||
    std::is_same_v<Value, std::vector<Eigen::Vector3d>>;

template <class Value>
void setDefault(Field& field, const Value& value) {
  if constexpr (std::is_arithmetic_v<Value>) {
    field.default_number = static_cast<double>(value);
  } else if constexpr (std::is_same_v<Value, std::string>) {
    if (!value.empty())
      field.default_text = value;
  } else if constexpr (std::is_same_v<Value, Eigen::Vector3d>) {
    field.default_number = value.x();
  }
}

}  // namespace binding

/// Binds a field to a member of a struct, or to a member of a member: &Options::guard, &Guard::leash.
template <class Owner, class First, class... More>
Field bound(Field field, First Owner::*first, More... more) {
  using Value = binding::ValueAt<Owner, First Owner::*, More...>;
  Owner initial;
  binding::setDefault(field, binding::at(initial, first, more...));
  field.owner = &typeid(Owner);
  field.is_optional = binding::kIsOptional<Value>;
  field.store = [first, more...](const Map& map, const Field& key, void* owner) {
    Value& value = binding::at(*static_cast<Owner*>(owner), first, more...);
    if constexpr (!binding::kIsPlain<Value>)
      binding::storeMapping(map, key, value);
    else if (binding::isPresent(map, key))
      binding::storeValue(map, key, value);
  };
  return field;
}

/// The same for a text, or a list of texts, each one of these words.
template <class Owner, class First, class... More>
Field bound(const Field& text, binding::WordsOf<Owner, First, More...> words, First Owner::*first, More... more) {
  using Value = binding::ValueAt<Owner, First Owner::*, More...>;
  Field field = text.oneOf({});
  for (const auto& [word, value] : words)
    field.words.push_back(word);
  if constexpr (!binding::kIsList<Value>) {
    Owner initial;
    for (const auto& [word, value] : words) {
      if (!field.default_text && value == binding::at(initial, first, more...))
        field.default_text = word;
    }
  }
  field.owner = &typeid(Owner);
  field.store = [words = std::move(words), first, more...](const Map& map, const Field& key, void* owner) {
    Value& value = binding::at(*static_cast<Owner*>(owner), first, more...);
    const auto meaning = [&](const std::string& word) {
      return std::ranges::find(words, word, &std::pair<std::string, typename binding::ElementOf<Value>::Type>::first)
          ->second;
    };
    if constexpr (binding::kIsList<Value>) {
      for (const std::string& word : map.texts(key.name))
        value.push_back(meaning(word));
    } else if (binding::isPresent(map, key)) {
      value = meaning(map.text(key.name));
    }
  };
  return field;
}

template <class... Path>
Field flag(const std::string& key, const std::string& description, Path... path) {
  return bound(flag(key, description), path...);
}
template <class... Path>
Field integer(const std::string& key, const std::string& description, Path... path) {
  return bound(integer(key, description), path...);
}
template <class... Path>
Field number(const std::string& key, Quantity quantity, const std::string& description, Path... path) {
  return bound(number(key, quantity, description), path...);
}
/// Fields of a number > 0 and of a number >= 0.
template <class... Path>
Field positive(const std::string& key, Quantity quantity, const std::string& description, Path... path) {
  return number(key, quantity, description, path...).above(0);
}
template <class... Path>
Field notNegative(const std::string& key, Quantity quantity, const std::string& description, Path... path) {
  return number(key, quantity, description, path...).atLeast(0);
}
template <class Owner, class First, class... More>
Field text(const std::string& key, const std::string& description, First Owner::*first, More... more) {
  return bound(text(key, description), first, more...);
}
template <class Owner, class First, class... More>
Field text(const std::string& key,
           const std::string& description,
           binding::WordsOf<Owner, First, More...> words,
           First Owner::*first,
           More... more) {
  return bound(text(key, description), std::move(words), first, more...);
}
template <class... Path>
Field mapping(const std::string& key, const Mapping& keys, const std::string& description, Path... path) {
  return bound(mapping(key, keys, description), path...);
}

/// Enumerators by their name() or nameOf().
template <class Enum>
Words<Enum> named(std::initializer_list<Enum> enumerators) {
  Words<Enum> words;
  for (const Enum value : enumerators) {
    if constexpr (requires { nameOf(value); })
      words.emplace_back(nameOf(value), value);
    else
      words.emplace_back(name(value), value);
  }
  return words;
}

}  // namespace tandem::config
