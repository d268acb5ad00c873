// SPDX-License-Identifier: Apache-2.0
/** @file Wide table of the messages of one topic: one row per message, one column per member. */
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "recording/definition.h"
#include "recording/records.h"

namespace tandem::recording {

/** One member of all messages. A cell contains one value, or all values of an array; it is empty if a message lacks the
 * member. */
struct Column {
  enum class Type {
    kReal,      ///< floating point, and integers of up to 32 bits
    kInteger,   ///< int64
    kUnsigned,  ///< uint64
    kText,
  };

  std::string name;  ///< "position", "tasks[0].kind"
  Type type = Type::kReal;
  bool is_array = false;
  std::size_t length = 0;  ///< of an array of fixed length
  std::size_t width = 0;   ///< largest number of values in a cell
  std::string comment;     ///< of the member, or of the message that it belongs to

  std::vector<std::size_t> ends;  ///< end index of each cell in the values
  std::vector<double> reals;
  std::vector<std::int64_t> integers;
  std::vector<std::uint64_t> unsigneds;
  std::vector<std::string> texts;

  std::size_t begin(std::size_t row) const { return row == 0 ? 0 : ends[row - 1]; }
  std::size_t size(std::size_t row) const { return ends[row] - begin(row); }
};

/** Table of one topic. */
class Table {
 public:
  /// @throw Error if the schema cannot be parsed.
  Table(std::string topic, const Schema& schema);

  /// Adds a row. @return false, without a new row, if the bytes do not fit the definition.
  bool add(const Message& message);

  std::string topic;
  std::vector<std::uint64_t> log_times, publish_times;  ///< ns since the epoch
  std::vector<std::uint32_t> sequences;
  std::vector<Column> columns;
  std::size_t rows() const { return log_times.size(); }

 private:
  Column& column(const std::string& name, const Field& field, const std::string& comment);

  Definition definition_;
  std::unordered_map<std::string, std::size_t> places_;
};

/// Whether bytes are exactly one message of this definition.
bool fits(const Definition& definition, std::string_view bytes);

/** All topics at common times: the last value of each at or before that time, as reals, one value per column; without
 * texts, and NaN before the first message. Column names are TOPIC.MEMBER, or TOPIC.MEMBER[i]. */
struct AlignedTable {
  std::vector<std::uint64_t> times;  ///< ns since the epoch
  std::vector<std::string> names;
  std::vector<std::vector<double>> values;  ///< one vector per column
};
AlignedTable align(const std::vector<Table>& tables, std::vector<std::uint64_t> times);

}  // namespace tandem::recording
