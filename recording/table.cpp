// SPDX-License-Identifier: Apache-2.0
#include "recording/table.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <optional>
#include <type_traits>

namespace tandem::recording {
namespace {

Column::Type columnType(Kind kind) {
  return kind == Kind::kInt64    ? Column::Type::kInteger
         : kind == Kind::kUint64 ? Column::Type::kUnsigned
         : kind == Kind::kString ? Column::Type::kText
                                 : Column::Type::kReal;
}

std::size_t sizeOf(Kind kind) {
  switch (kind) {
    case Kind::kInt16:
    case Kind::kUint16:
      return 2;
    case Kind::kInt32:
    case Kind::kUint32:
    case Kind::kFloat32:
      return 4;
    case Kind::kInt64:
    case Kind::kUint64:
    case Kind::kFloat64:
      return 8;
    default:
      return 1;
  }
}

/** Plain CDR, version 1, of either byte order. Reads beyond the end give nothing, and good() says so. */
class Cdr {
 public:
  explicit Cdr(std::string_view bytes) : bytes_(bytes) {
    good_ = bytes.size() >= 4 && bytes[0] == 0 && (bytes[1] == 0 || bytes[1] == 1);
    swap_ = good_ && bytes[1] == 0;
  }

  template <class T>
  T number() {
    std::array<char, sizeof(T)> raw{};
    at_ += (sizeof(T) - at_ % sizeof(T)) % sizeof(T);
    const std::string_view from = take(sizeof(T));
    std::copy(from.begin(), from.end(), raw.begin());
    if (swap_)
      std::reverse(raw.begin(), raw.end());
    T value;
    std::memcpy(&value, raw.data(), sizeof value);
    return value;
  }
  std::string text() {
    const auto size = number<std::uint32_t>();  // with the zero at the end
    const std::string_view text = take(size);
    return std::string(text.substr(0, text.empty() ? 0 : text.size() - 1));
  }
  /// Elements of a sequence; each takes at least so many bytes.
  std::size_t count(std::size_t smallest) {
    const auto size = number<std::uint32_t>();
    if (size > (bytes_.size() - std::min(bytes_.size(), 4 + at_)) / std::max<std::size_t>(1, smallest))
      good_ = false;
    return good_ ? size : 0;
  }
  bool good() const { return good_; }
  bool atEnd() const { return bytes_.size() - std::min(bytes_.size(), 4 + at_) < 4; }  // encoders may pad to 4

 private:
  std::string_view take(std::size_t size) {
    if (!good_ || 4 + at_ + size > bytes_.size()) {
      good_ = false;
      return {};
    }
    const std::string_view taken = bytes_.substr(4 + at_, size);
    at_ += size;
    return taken;
  }

  std::string_view bytes_;
  std::size_t at_ = 0;  // behind the encapsulation
  bool good_, swap_;
};

/// Calls f(value) with a number as the type that it is kept as.
template <class F>
void readNumber(Cdr& cdr, Kind kind, F&& f) {
  switch (kind) {
    case Kind::kBool:
    case Kind::kUint8:
      return f(static_cast<double>(cdr.number<std::uint8_t>()));
    case Kind::kInt8:
      return f(static_cast<double>(cdr.number<std::int8_t>()));
    case Kind::kInt16:
      return f(static_cast<double>(cdr.number<std::int16_t>()));
    case Kind::kUint16:
      return f(static_cast<double>(cdr.number<std::uint16_t>()));
    case Kind::kInt32:
      return f(static_cast<double>(cdr.number<std::int32_t>()));
    case Kind::kUint32:
      return f(static_cast<double>(cdr.number<std::uint32_t>()));
    case Kind::kFloat32:
      return f(static_cast<double>(cdr.number<float>()));
    case Kind::kFloat64:
      return f(cdr.number<double>());
    case Kind::kInt64:
      return f(cdr.number<std::int64_t>());
    case Kind::kUint64:
      return f(cdr.number<std::uint64_t>());
    case Kind::kString:
      return f(cdr.text());
    case Kind::kMessage:
      break;
  }
}

void append(Column& column, double value) { column.reals.push_back(value); }
void append(Column& column, std::int64_t value) { column.integers.push_back(value); }
void append(Column& column, std::uint64_t value) { column.unsigneds.push_back(value); }
void append(Column& column, std::string value) { column.texts.push_back(std::move(value)); }

std::size_t valuesOf(const Column& column) {
  return column.reals.size() + column.integers.size() + column.unsigneds.size() + column.texts.size();
}

constexpr int kDeepest = 20;  // types within types

/// Walks over a message: visit(path, field, count) reads the values of one member, whose number is known.
template <class Visit>
void walk(const Definition& definition,
          const std::string& type,
          const std::string& path,
          Cdr& cdr,
          Visit& visit,
          int depth = 0) {
  for (const Field& field : definition.types.at(type)) {
    const std::string name = path.empty() ? field.name : path + "." + field.name;
    const std::size_t smallest = field.kind == Kind::kString ? 4 : sizeOf(field.kind);
    const std::size_t count = field.count == Field::Count::kOne     ? 1
                              : field.count == Field::Count::kFixed ? field.length
                                                                    : cdr.count(smallest);
    if (field.kind != Kind::kMessage) {
      visit(name, field, count);
      continue;
    }
    for (std::size_t i = 0; cdr.good() && depth < kDeepest && i < count; ++i)
      walk(definition, field.type, field.count == Field::Count::kOne ? name : name + "[" + std::to_string(i) + "]", cdr,
           visit, depth + 1);
  }
}

}  // namespace

bool fits(const Definition& definition, std::string_view bytes) {
  Cdr cdr(bytes);
  const auto skip = [&](const std::string&, const Field& field, std::size_t count) {
    for (std::size_t i = 0; cdr.good() && i < count; ++i)
      readNumber(cdr, field.kind, [](auto&&) {});
  };
  walk(definition, definition.root, "", cdr, skip);
  return cdr.good() && cdr.atEnd();
}

Table::Table(std::string topic_name, const Schema& schema) : topic(std::move(topic_name)) {
  if (schema.encoding != "ros2msg")
    throw Error("topic " + topic + ": found schema encoding '" + schema.encoding + "', expected ros2msg");
  definition_ = parseDefinition(schema.name, schema.data);
}

Column& Table::column(const std::string& name, Column::Type type, bool is_array) {
  const auto [place, is_new] = places_.try_emplace(name, columns.size());
  if (is_new) {
    Column column;
    column.name = name;
    column.type = type;
    column.is_array = is_array;
    column.ends.assign(rows(), 0);
    columns.push_back(std::move(column));
  }
  return columns[place->second];
}

bool Table::add(const Message& message) {
  if (!fits(definition_, message.data))
    return false;
  Cdr cdr(message.data);
  const auto take = [&](const std::string& name, const Field& field, std::size_t count) {
    Column& into = column(name, columnType(field.kind), field.count != Field::Count::kOne);
    for (std::size_t i = 0; i < count; ++i)
      readNumber(cdr, field.kind, [&](auto&& value) { append(into, std::forward<decltype(value)>(value)); });
    into.width = std::max(into.width, count);
  };
  walk(definition_, definition_.root, "", cdr, take);
  log_times.push_back(message.log_time);
  publish_times.push_back(message.publish_time);
  sequences.push_back(message.sequence);
  for (Column& each : columns)
    each.ends.push_back(valuesOf(each));  // a cell that got nothing is empty
  return true;
}

namespace {

double valueOf(const Column& column, std::size_t row, std::size_t i) {
  if (i >= column.size(row))
    return std::numeric_limits<double>::quiet_NaN();
  const std::size_t at = column.begin(row) + i;
  return column.type == Column::Type::kReal      ? column.reals[at]
         : column.type == Column::Type::kInteger ? static_cast<double>(column.integers[at])
                                                 : static_cast<double>(column.unsigneds[at]);
}

}  // namespace

AlignedTable align(const std::vector<Table>& tables, std::vector<std::uint64_t> times) {
  AlignedTable aligned;
  aligned.times = std::move(times);
  for (const Table& table : tables) {
    std::vector<std::optional<std::size_t>> rows;  // of the table, at each time
    for (std::uint64_t time : aligned.times) {
      const auto after = std::upper_bound(table.log_times.begin(), table.log_times.end(), time);
      rows.push_back(after == table.log_times.begin()
                         ? std::nullopt
                         : std::optional<std::size_t>(static_cast<std::size_t>(after - table.log_times.begin() - 1)));
    }
    for (const Column& column : table.columns) {
      if (column.type == Column::Type::kText)
        continue;
      for (std::size_t i = 0; i < column.width; ++i) {
        aligned.names.push_back(table.topic + "." + column.name +
                                (column.is_array ? "[" + std::to_string(i) + "]" : ""));
        std::vector<double>& values = aligned.values.emplace_back();
        for (const auto& row : rows)
          values.push_back(row ? valueOf(column, *row, i) : std::numeric_limits<double>::quiet_NaN());
      }
    }
  }
  return aligned;
}

}  // namespace tandem::recording
