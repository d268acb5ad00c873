// SPDX-License-Identifier: Apache-2.0
#include "recording/matrices.h"

#include <algorithm>

namespace tandem::recording {
namespace {

template <class T>
Matrix<T> fill(const Column& column, const std::vector<T>& values, const T& missing) {
  Matrix<T> matrix{column.ends.size(), std::max<std::size_t>(1, column.width), {}};
  matrix.values.reserve(matrix.rows * matrix.columns);
  for (std::size_t row = 0; row < matrix.rows; ++row) {
    for (std::size_t i = 0; i < matrix.columns; ++i)
      matrix.values.push_back(i < column.size(row) ? values[column.begin(row) + i] : missing);
  }
  return matrix;
}

NamedMatrix toMatrix(const Column& column) {
  NamedMatrix named{plainName(column.name), column.name, {}};
  switch (column.type) {
    case Column::Type::kReal:
      named.matrix = fill(column, column.reals, std::numeric_limits<double>::quiet_NaN());
      break;
    case Column::Type::kInteger:
      named.matrix = fill(column, column.integers, std::int64_t{0});
      break;
    case Column::Type::kUnsigned:
      named.matrix = fill(column, column.unsigneds, std::uint64_t{0});
      break;
    case Column::Type::kText:
      named.matrix = fill(column, column.texts, std::string());
      break;
  }
  return named;
}

template <class T>
NamedMatrix vectorOf(const std::string& name, std::vector<T> values) {
  const std::size_t rows = values.size();
  return {name, name, Matrix<T>{rows, 1, std::move(values)}};
}

NamedMatrix timeOf(const std::vector<std::uint64_t>& times, std::uint64_t start) {
  std::vector<double> seconds;
  for (std::uint64_t time : times)
    seconds.push_back(1e-9 * static_cast<double>(static_cast<std::int64_t>(time - start)));
  return vectorOf("time_s", std::move(seconds));
}

}  // namespace

std::vector<NamedMatrices> matricesOf(const ExportSet& set) {
  std::vector<NamedMatrices> all;
  for (const Table& table : set.tables) {
    NamedMatrices& group = all.emplace_back(NamedMatrices{plainName(table.topic), table.topic, {}});
    group.members = {
        timeOf(table.log_times, set.start), vectorOf("log_time_ns", table.log_times),
        vectorOf("publish_time_ns", table.publish_times),
        vectorOf("sequence_of_writer", std::vector<std::uint64_t>(table.sequences.begin(), table.sequences.end()))};
    for (const Column& column : table.columns)
      group.members.push_back(toMatrix(column));
  }
  if (set.aligned) {
    NamedMatrices& group = all.emplace_back(NamedMatrices{"aligned", "aligned", {}});
    group.members = {timeOf(set.aligned->times, set.start), vectorOf("log_time_ns", set.aligned->times)};
    for (std::size_t i = 0; i < set.aligned->names.size(); ++i) {
      group.members.push_back(vectorOf(set.aligned->names[i], set.aligned->values[i]));
      group.members.back().name = plainName(set.aligned->names[i]);
    }
  }
  return all;
}

}  // namespace tandem::recording
