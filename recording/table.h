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

/** One member over all messages. Cells hold one value, or as many as the array has; they may be empty where a message
 * lacks the member. */
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
  std::size_t width = 0;  ///< the most values that a cell has

  std::vector<std::size_t> ends;  ///< of each cell in the values
  std::vector<double> reals;
  std::vector<std::int64_t> integers;
  std::vector<std::uint64_t> unsigneds;
  std::vector<std::string> texts;

  std::size_t begin(std::size_t row) const { return row == 0 ? 0 : ends[row - 1]; }
  std::size_t size(std::size_t row) const { return ends[row] - begin(row); }
};

/** One topic. */
class Table {
 public:
  /// @param definition  of the type @throw Error where it is not understood.
  Table(std::string topic, const Schema& schema);

  /// Adds a row. @return false where the bytes do not fit the definition; nothing is added then.
  bool add(const Message& message);

  std::string topic;
  std::vector<std::uint64_t> log_times, publish_times;  ///< ns since the epoch
  std::vector<std::uint32_t> sequences;
  std::vector<Column> columns;
  std::size_t rows() const { return log_times.size(); }

 private:
  class Decoder;
  Column& column(const std::string& name, Column::Type type, bool is_array);

  Definition definition_;
  std::unordered_map<std::string, std::size_t> places_;
};

/// Whether bytes are a message of this definition, to the last one.
bool fits(const Definition& definition, std::string_view bytes);

/** All topics at the same times: what each said last at or before, as reals, one value a column; texts are left out,
 * and NaN stands where nothing was said yet. Columns are called TOPIC.MEMBER, or TOPIC.MEMBER[i]. */
struct AlignedTable {
  std::vector<std::uint64_t> times;  ///< ns since the epoch
  std::vector<std::string> names;
  std::vector<std::vector<double>> values;  ///< one vector a column
};
AlignedTable align(const std::vector<Table>& tables, std::vector<std::uint64_t> times);

}  // namespace tandem::recording
