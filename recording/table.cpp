// SPDX-License-Identifier: Apache-2.0
#include "recording/table.h"

#include <algorithm>
#include <limits>
#include <optional>

#include "recording/cdr.h"

namespace tandem::recording {
namespace {

Column::Type columnType(Kind kind) {
  return kind == Kind::kInt64    ? Column::Type::kInteger
         : kind == Kind::kUint64 ? Column::Type::kUnsigned
         : kind == Kind::kString ? Column::Type::kText
                                 : Column::Type::kReal;
}

/// Calls f(value) with the value in the type of its column.
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

/// Traverses a message: visit(path, field, comment, count) reads the `count` values of one member. The comment is the
/// member's, or that of the message it belongs to. `comment`: of the message at `path`
template <class Visit>
void walk(const Definition& definition,
          const std::string& type,
          const std::string& path,
          const std::string& comment,
          Cdr& cdr,
          Visit& visit) {
  for (const Field& field : definition.types.at(type)) {
    const std::string name = path.empty() ? field.name : path + "." + field.name;
    const std::size_t smallest = field.kind == Kind::kString ? 4 : sizeOf(field.kind);
    const std::size_t count = field.count == Field::Count::kOne     ? 1
                              : field.count == Field::Count::kFixed ? field.length
                                                                    : cdr.count(smallest);
    const std::string& own_comment = field.comment.empty() ? comment : field.comment;
    if (field.kind != Kind::kMessage) {
      visit(name, field, own_comment, count);
      continue;
    }
    for (std::size_t i = 0; cdr.good() && i < count; ++i)
      walk(definition, field.type, field.count == Field::Count::kOne ? name : name + "[" + std::to_string(i) + "]",
           own_comment, cdr, visit);
  }
}

}  // namespace

bool fits(const Definition& definition, std::string_view bytes) {
  Cdr cdr(bytes);
  const auto skip = [&](const std::string&, const Field& field, const std::string&, std::size_t count) {
    for (std::size_t i = 0; cdr.good() && i < count; ++i)
      readNumber(cdr, field.kind, [](auto&&) {});
  };
  walk(definition, definition.root, "", "", cdr, skip);
  return cdr.good() && cdr.atEnd();
}

Table::Table(std::string topic_name, const Schema& schema) : topic(std::move(topic_name)) {
  if (schema.encoding != "ros2msg")
    throw Error("topic " + topic + ": found schema encoding '" + schema.encoding + "', expected ros2msg");
  definition_ = parseDefinition(schema.name, schema.data);
}

Column& Table::column(const std::string& name, const Field& field, const std::string& comment) {
  const auto [place, is_new] = places_.try_emplace(name, columns.size());
  if (is_new) {
    Column column;
    column.name = name;
    column.type = columnType(field.kind);
    column.is_array = field.count != Field::Count::kOne;
    column.length = field.count == Field::Count::kFixed ? field.length : 0;
    column.comment = comment;
    column.ends.assign(rows(), 0);
    columns.push_back(std::move(column));
  }
  return columns[place->second];
}

bool Table::add(const Message& message) {
  if (!fits(definition_, message.data))
    return false;
  Cdr cdr(message.data);
  const auto take = [&](const std::string& name, const Field& field, const std::string& comment, std::size_t count) {
    Column& into = column(name, field, comment);
    for (std::size_t i = 0; i < count; ++i)
      readNumber(cdr, field.kind, [&](auto&& value) { append(into, std::forward<decltype(value)>(value)); });
    into.width = std::max(into.width, count);
  };
  walk(definition_, definition_.root, "", "", cdr, take);
  log_times.push_back(message.log_time);
  publish_times.push_back(message.publish_time);
  sequences.push_back(message.sequence);
  for (Column& each : columns)
    each.ends.push_back(valuesOf(each));  // a cell without values is empty
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
    std::vector<std::optional<std::size_t>> rows;  // row of the table at each time
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
