// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "config/config.h"

namespace tandem::config {
namespace {

std::string place(const std::string& file, int line, int column, const std::string& key) {
  const std::string where = file + ":" + std::to_string(line) + ":" + std::to_string(column) + ": ";
  return key.empty() ? where : where + key + ": ";
}

}  // namespace

Error::Error(std::string file, int line, int column, std::string key, const std::string& message)
    : std::runtime_error(place(file, line, column, key) + message),
      file_(std::move(file)),
      line_(line),
      column_(column),
      key_(std::move(key)) {}

}  // namespace tandem::config
