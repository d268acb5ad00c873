// SPDX-License-Identifier: Apache-2.0
#include "recording/conversion.h"

#include <algorithm>
#include <array>
#include <map>

#include "recording/cdr.h"
#include "recording/records.h"
#include "recording/table.h"

namespace tandem::recording {
namespace {

constexpr std::size_t kLongest = 64u << 20;  // bytes of a converted message

struct Value;
using Values = std::map<std::string, Value>;

/** Values of one member, in one of the three lists; one entry per element. */
struct Value {
  std::vector<std::uint64_t> numbers;  ///< bit patterns
  std::vector<std::string> texts;
  std::vector<Values> messages;
};

std::uint64_t readBits(Cdr& cdr, Kind kind) {
  switch (sizeOf(kind)) {
    case 2:
      return cdr.number<std::uint16_t>();
    case 4:
      return cdr.number<std::uint32_t>();
    case 8:
      return cdr.number<std::uint64_t>();
    default:
      return cdr.number<std::uint8_t>();
  }
}

Values read(const Definition& definition, const std::string& type, Cdr& cdr) {
  Values values;
  for (const Field& field : definition.types.at(type)) {
    Value& value = values[field.name];
    const std::size_t count = field.count == Field::Count::kSequence
                                  ? cdr.count(field.kind == Kind::kString ? 4 : sizeOf(field.kind))
                                  : field.length;
    for (std::size_t i = 0; cdr.good() && i < count; ++i) {
      if (field.kind == Kind::kMessage)
        value.messages.push_back(read(definition, field.type, cdr));
      else if (field.kind == Kind::kString)
        value.texts.push_back(cdr.text());
      else
        value.numbers.push_back(readBits(cdr, field.kind));
    }
  }
  return values;
}

template <class T>
T at(const std::vector<T>& values, std::size_t i) {
  return i < values.size() ? values[i] : T{};
}

void write(const Definition& definition, const std::string& type, const Values& values, CdrSink& sink) {
  static const Value none;
  for (const Field& field : definition.types.at(type)) {
    const auto found = values.find(field.name);
    const Value& value = found == values.end() ? none : found->second;
    std::size_t count = field.length;
    if (field.count == Field::Count::kSequence) {
      count = value.numbers.size() + value.texts.size() + value.messages.size();
      sink.number(count, 4);
    }
    for (std::size_t i = 0; i < count && sink.size() <= kLongest; ++i) {
      if (field.kind == Kind::kMessage)
        write(definition, field.type, at(value.messages, i), sink);
      else if (field.kind == Kind::kString)
        sink.text(at(value.texts, i));
      else
        sink.number(at(value.numbers, i), sizeOf(field.kind));
    }
  }
}

const Field* find(const std::vector<Field>& fields, const std::string& name) {
  const auto found = std::find_if(fields.begin(), fields.end(), [&](const Field& field) { return field.name == name; });
  return found == fields.end() ? nullptr : &*found;
}

/// "uint8[8]"
std::string typeName(const Field& field) {
  static const std::map<Kind, std::string> names{
      {Kind::kBool, "bool"},     {Kind::kInt8, "int8"},       {Kind::kUint8, "uint8"},     {Kind::kInt16, "int16"},
      {Kind::kUint16, "uint16"}, {Kind::kInt32, "int32"},     {Kind::kUint32, "uint32"},   {Kind::kInt64, "int64"},
      {Kind::kUint64, "uint64"}, {Kind::kFloat32, "float32"}, {Kind::kFloat64, "float64"}, {Kind::kString, "string"}};
  const std::string element = field.kind == Kind::kMessage ? field.type : names.at(field.kind);
  return field.count == Field::Count::kOne     ? element
         : field.count == Field::Count::kFixed ? element + "[" + std::to_string(field.length) + "]"
                                               : element + "[]";
}

/// Members of messages that have been renamed: former and present name.
constexpr std::array<std::pair<const char*, const char*>, 4> kRenamed{
    {{"placements", "joint_resets"}, {"lease_holder", "lease_owner"}, {"words", "reason"}, {"words", "description"}}};

/// Name of a member of `from` in `to`: another one only if it has been renamed.
std::string nameIn(const std::vector<Field>& to, const std::vector<Field>& from, const std::string& name) {
  for (const auto& [former, present] : kRenamed) {
    for (const auto& [before, after] : {std::pair{former, present}, std::pair{present, former}}) {
      if (name == before && find(to, after) && !find(to, before) && !find(from, after))
        return after;
    }
  }
  return name;
}

/// `from` with the names that `to` has for renamed members.
Definition withNamesOf(Definition from, const Definition& to) {
  for (auto& [type, fields] : from.types) {
    const auto present = to.types.find(type);
    if (present == to.types.end())
      continue;
    for (Field& field : fields)
      field.name = nameIn(present->second, fields, field.name);
  }
  return from;
}

}  // namespace

Conversion::Conversion(Definition from, Definition to) : from_(withNamesOf(std::move(from), to)), to_(std::move(to)) {
  compare(from_.root, to_.root, "");
}

void Conversion::compare(const std::string& from, const std::string& to, const std::string& path) {
  const std::vector<Field>&before = from_.types.at(from), &after = to_.types.at(to);
  for (const Field& field : before) {
    if (!find(after, field.name))
      dropped_.push_back(path + field.name);
  }
  for (std::size_t i = 0; i < after.size(); ++i) {
    const Field& field = after[i];
    const Field* old = find(before, field.name);
    if (!old) {
      added_.push_back(path + field.name);
      continue;
    }
    reordered_ = reordered_ || i >= before.size() || before[i].name != field.name;
    if (old->kind != field.kind || old->count != field.count) {
      mismatched_.push_back(path + field.name + ": " + typeName(*old) + " before, " + typeName(field) + " after");
      continue;
    }
    if (old->length != field.length)
      (old->length < field.length ? added_ : dropped_)
          .push_back(path + field.name + "[" + std::to_string(std::min(old->length, field.length)) + ".." +
                     std::to_string(std::max(old->length, field.length) - 1) + "]");
    if (field.kind == Kind::kMessage)
      compare(old->type, field.type, path + field.name + ".");
  }
}

std::optional<std::string> Conversion::operator()(std::string_view bytes) const {
  if (!mismatched_.empty() || !fits(from_, bytes))
    return std::nullopt;
  Cdr cdr(bytes);
  CdrSink sink;
  write(to_, to_.root, read(from_, from_.root, cdr), sink);
  return sink.size() > kLongest ? std::nullopt : std::optional(sink.take());
}

}  // namespace tandem::recording
