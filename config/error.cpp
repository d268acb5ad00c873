// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "config/config.h"
#include "config/key_table.h"

namespace tandem::config {
namespace {

/// "FILE:LINE:COLUMN: KEY: "; line 0: of no line.
std::string place(const std::string& file, int line, int column, const std::string& key) {
  const std::string where =
      file + (line > 0 ? ":" + std::to_string(line) + ":" + std::to_string(column) : std::string()) + ": ";
  return key.empty() ? where : where + key + ": ";
}

std::vector<Error> inOrder(std::vector<Error> errors) {
  std::ranges::stable_sort(errors, {}, [](const Error& error) { return std::pair(error.line(), error.column()); });
  return errors;
}

std::string linesOf(const std::vector<Error>& errors) {
  std::vector<std::string> lines;
  for (const Error& error : errors)
    lines.emplace_back(error.what());
  return join(lines, "\n");
}

}  // namespace

Error::Error(std::vector<Error> errors) : Error(inOrder(std::move(errors)), nullptr) {}

Error::Error(const std::vector<Error>& sorted, std::nullptr_t)
    : std::runtime_error(linesOf(sorted)),
      file_(sorted.front().file_),
      line_(sorted.front().line_),
      column_(sorted.front().column_),
      key_(sorted.front().key_),
      all_(std::make_shared<const std::vector<Error>>(sorted)) {}

std::vector<Error> Error::all() const { return all_ ? *all_ : std::vector<Error>{*this}; }

Error::Error(std::string file, int line, int column, std::string key, const std::string& message)
    : std::runtime_error(place(file, line, column, key) + message),
      file_(std::move(file)),
      line_(line),
      column_(column),
      key_(std::move(key)) {}

}  // namespace tandem::config
