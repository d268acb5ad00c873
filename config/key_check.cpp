// SPDX-License-Identifier: Apache-2.0
#include "config/detail/key_check.h"

#include <algorithm>

namespace tandem::config {
namespace {

/// Field whose name the key starts with, as in `outer_diameter_cm`; the longest such name.
const Field* quantityOf(const std::string& key, const Mapping& table) {
  const Field* found = nullptr;
  for (const Field& field : table.fields) {
    if (field.quantity != Quantity::kNone && key.starts_with(field.name + "_") &&
        (!found || field.name.size() > found->name.size())) {
      found = &field;
    }
  }
  return found;
}

std::string knownKeys(const Mapping& table) {
  std::vector<std::string> keys;
  for (const Field& field : table.fields)
    keys.push_back(field.key());
  return join(keys);
}

}  // namespace

int editDistance(const std::string& a, const std::string& b) {
  const std::size_t width = b.size() + 1;
  std::vector<int> cost((a.size() + 1) * width);
  const auto at = [&cost, width](std::size_t i, std::size_t j) -> int& { return cost[i * width + j]; };
  for (std::size_t i = 0; i <= a.size(); ++i)
    at(i, 0) = static_cast<int>(i);
  for (std::size_t j = 0; j <= b.size(); ++j)
    at(0, j) = static_cast<int>(j);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const int replaced = at(i - 1, j - 1) + (a[i - 1] == b[j - 1] ? 0 : 1);
      at(i, j) = std::min({replaced, at(i - 1, j) + 1, at(i, j - 1) + 1});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        at(i, j) = std::min(at(i, j), at(i - 2, j - 2) + 1);
      }
    }
  }
  return at(a.size(), b.size());
}

std::string explainUnknownKey(const std::string& key, const Mapping& table) {
  for (const Field& field : table.fields) {
    if (field.quantity != Quantity::kNone && field.name == key) {
      return "a key without its unit; expected " + field.keysForPeople();
    }
  }
  if (const Field* field = quantityOf(key, table)) {
    const std::string suffix = key.substr(field->name.size() + 1);
    return "'" + suffix + "' is not a unit of " + std::string(name(field->quantity)) + " here; expected " +
           field->keysForPeople();
  }
  std::string nearest;
  // Two edits, or a third of a long key: a suggestion with more of them misleads. Very long keys take too much time.
  int best = key.size() > 80 ? -1 : std::max(2, static_cast<int>(key.size()) / 3) + 1;
  for (const Field& field : table.fields) {
    for (const auto& [known, unit] : field.keys()) {
      const int distance = best > 0 ? editDistance(key, known) : best;
      if (distance < best) {
        best = distance;
        nearest = known;
      }
    }
  }
  if (!nearest.empty())
    return "unknown key; did you mean " + nearest + "?";
  return "unknown key; expected one of " + knownKeys(table);
}

}  // namespace tandem::config
