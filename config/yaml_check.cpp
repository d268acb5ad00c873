// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <utility>

#include "config/detail/key_check.h"
#include "config/detail/syntax_hint.h"
#include "config/detail/yaml_reader.h"
#include "config/detail/yaml_scalar.h"

namespace tandem::config {
namespace {

/// "straight_length, curved_length, curvature or sections".
std::string describe(const Mapping& table) {
  std::vector<std::string> groups;
  for (const auto& names : table.alternatives)
    groups.push_back(join(names));
  return "either " + join(groups, " or ");
}

/// "; write 0.88" for a number with a decimal comma.
std::string commaHint(const YAML::Node& node, const Field& field) {
  if (field.type != Type::kNumber || !node.IsScalar())
    return "";
  const std::string& text = node.Scalar();
  const std::size_t comma = text.find(',');
  if (comma == std::string::npos || !isCutOff(text.substr(comma + 1)))
    return "";
  return "; write " + text.substr(0, comma) + "." + text.substr(comma + 1);
}

/// "; its keys: file, absolute" for a mapping with few keys.
std::string keysHint(const Field& field) {
  constexpr std::size_t kMostKeys = 12;
  return field.type == Type::kMapping && field.mapping->fields.size() <= kMostKeys
             ? "; its keys: " + knownKeys(*field.mapping)
             : "";
}

}  // namespace

Map Map::checked(Document& document, const Mapping& table, std::string path, const YAML::Node& node) {
  Map map(document, table, std::move(path), node.Mark());
  if (!node.IsMap()) {
    throw map.error(node.Mark(), map.path_,
                    "found " + describeNode(node) + ", expected a mapping (" + table.name + ")");
  }
  for (const auto& item : node)
    map.collect([&] { map.addEntry(item.first, item.second); });
  map.collect([&] { map.checkPresence(); });
  for (const Entry& entry : map.entries_)
    map.collect([&] { map.checkEntry(entry); });
  return map;
}

void Map::addEntry(const YAML::Node& key, const YAML::Node& value) {
  if (!key.IsScalar())
    throw error(key.Mark(), path_, "found " + describeNode(key) + ", expected a key");
  const std::string& written = key.Scalar();
  if (value.IsNull() && isCutOff(written) && !entries_.empty() && entries_.back().value.IsScalar()) {
    const std::string& before = entries_.back().value.Scalar();
    throw error(key.Mark(), pathOf(entries_.back().key),
                "found the decimal comma of " + before + "," + written + ", expected a decimal point: " + before + "." +
                    written);
  }
  for (const Field& field : table_->fields) {
    for (const auto& [known, unit] : field.keys()) {
      if (known != written)
        continue;
      const auto earlier =
          std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) { return e.field == &field; });
      if (earlier != entries_.end()) {
        throw error(key.Mark(), pathOf(written),
                    earlier->key == written ? "the key appears twice; expected it once"
                                            : "found together with " + earlier->key + "; expected one of the two");
      }
      // The mark of an empty value is that of the next token.
      entries_.push_back({&field, unit, known, value, value.IsNull() ? key.Mark() : value.Mark()});
      document_->present_.insert(&field);
      return;
    }
  }
  unknown_.push_back(written);
  throw error(key.Mark(), pathOf(written), explainUnknownKey(written, *table_));
}

void Map::checkPresence() const {
  if (table_->exactly_one && entries_.size() != 1) {
    std::vector<std::string> names;
    for (const Field& field : table_->fields)
      names.push_back(field.name);
    throw error(entries_.size() > 1 ? entries_[1].mark : mark_, path_,
                "found " + std::to_string(entries_.size()) + " keys, expected exactly one of " + join(names));
  }
  for (const Field& field : table_->fields) {
    const bool present =
        std::any_of(entries_.begin(), entries_.end(), [&](const Entry& e) { return e.field == &field; });
    const bool misspelled =
        std::any_of(unknown_.begin(), unknown_.end(), [&](const std::string& key) { return isMeant(field, key); });
    if (field.is_required && !present && !misspelled) {
      collect([&] {
        throw error(mark_, pathOf(field.key()),
                    "the key is missing, expected " + field.keysForPeople() + ": " +
                        expectation(field, field.keys().front().second));
      });
    }
  }
  checkAlternatives();
}

/// The first key that is present selects its group.
void Map::checkAlternatives() const {
  const auto group = [this](const Field& field) {
    return std::find_if(table_->alternatives.begin(), table_->alternatives.end(), [&](const auto& names) {
      return std::find(names.begin(), names.end(), field.name) != names.end();
    });
  };
  const Entry* first = nullptr;
  for (const Entry& entry : entries_) {
    if (group(*entry.field) == table_->alternatives.end())
      continue;
    if (!first)
      first = &entry;
    if (group(*entry.field) != group(*first->field))
      throw error(entry.mark, pathOf(entry.key),
                  "found together with " + first->key + ", expected " + describe(*table_));
  }
  if (!first) {
    if (!table_->alternatives.empty())
      throw error(mark_, path_, "found neither, expected " + describe(*table_));
    return;
  }
  for (const std::string& name : *group(*first->field)) {
    const Field& field = table_->field(name);
    if (std::none_of(entries_.begin(), entries_.end(), [&](const Entry& e) { return e.field == &field; })) {
      throw error(mark_, pathOf(field.key()),
                  "the key is missing although " + first->key + " is present, expected " + field.keysForPeople() +
                      ": " + expectation(field, field.keys().front().second));
    }
  }
}

void Map::checkEntry(const Entry& entry) const {
  const Field& field = *entry.field;
  const std::string path = pathOf(entry.key);
  if (!field.is_list || (field.or_scalar && entry.value.IsScalar()))
    return checkElement(entry, entry.value, path);
  const auto size = static_cast<int>(entry.value.size());
  if (!entry.value.IsSequence() || size < field.min_size || size > field.max_size) {
    unexpected(entry, entry.value, path, false);
  }
  std::size_t index = 0;
  std::set<std::string> seen;
  for (const YAML::Node& node : entry.value) {
    const std::string element = indexed(path, index++);
    collect([&] { checkElement(entry, node, element); });
    if (field.is_unique && !seen.insert(node.Scalar()).second) {
      throw error(node.Mark(), element, "found '" + node.Scalar() + "' a second time, expected it once");
    }
  }
}

void Map::checkElement(const Entry& entry, const YAML::Node& node, const std::string& path) const {
  const Field& field = *entry.field;
  if (field.type == Type::kMapping) {
    if (node.IsMap()) {
      checked(*document_, *field.mapping, path, node);
    } else if (!config::isWord(node, field)) {
      unexpected(entry, node, path, true);
    }
    return;
  }
  if (field.row_size == 0)
    return checkScalar(entry, node, path);
  if (!node.IsSequence() || static_cast<int>(node.size()) != field.row_size)
    unexpected(entry, node, path, true);
  std::size_t index = 0;
  for (const YAML::Node& value : node)
    checkScalar(entry, value, indexed(path, index++));
}

void Map::checkScalar(const Entry& entry, const YAML::Node& node, const std::string& path) const {
  const Field& field = *entry.field;
  const bool good = (field.type == Type::kBool && readBool(node)) ||
                    (field.type == Type::kInteger && readInteger(node, field)) ||
                    (field.type == Type::kNumber && readNumber(node, field, entry.unit)) ||
                    (field.type == Type::kText && readText(node, field));
  if (!good)
    unexpected(entry, node, path, true);
  if (!field.usual || field.type != Type::kNumber)
    return;
  const double size = std::abs(readNumber(node, field, entry.unit).value());
  if (size != 0.0 && std::isfinite(size) && (size < field.usual->minimum || size > field.usual->maximum)) {
    const std::string message =
        "found " + node.Scalar() + ", " + usualForPeople(field, entry.unit) + "; check the unit";
    document_->warnings_.emplace_back(error(node.Mark(), path, message).what());
  }
}

void Map::unexpected(const Entry& entry, const YAML::Node& node, const std::string& path, bool element) const {
  throw error(node.IsNull() ? entry.mark : node.Mark(), path,
              "found " + describeNode(node) + ", expected " + expectation(*entry.field, entry.unit, element) +
                  commaHint(node, *entry.field) + keysHint(*entry.field));
}

}  // namespace tandem::config
