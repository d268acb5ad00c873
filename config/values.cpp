// SPDX-License-Identifier: Apache-2.0
#include "config/values.h"

#include <array>
#include <cinttypes>
#include <cstdio>
#include <map>
#include <set>
#include <sstream>

#include "config/detail/drive_profile.h"
#include "config/detail/loaders.h"
#include "config/file_tables.h"

namespace tandem::config {
namespace {

bool hasRequired(const Mapping& keys) {
  for (const Field& field : keys.fields) {
    if (field.is_required)
      return true;
  }
  return false;
}

/** Collects the values of one file. */
class Listing {
 public:
  void add(const Map& map, const std::string& under) {
    for (const Field& field : map.table().fields) {
      if (field.moves)
        addField(map, field, under + field.name);
    }
  }
  std::string take() { return std::move(text_); }

 private:
  void addField(const Map& map, const Field& field, const std::string& key) {
    if (field.type != Type::kMapping || map.isWord(field.name))
      return line(key, map.plain(field.name));
    if (field.is_list) {
      const std::vector<Map> entries = map.maps(field.name);
      for (std::size_t i = 0; i < entries.size(); ++i)
        add(entries[i], indexed(key, i) + ".");
    } else if (map.has(field.name) || (!field.is_optional && !hasRequired(*field.mapping))) {
      line(key, "given");
      add(map.map(field.name), key + ".");
    }
  }

  void line(const std::string& key, const std::string& value) {
    if (!value.empty())
      text_ += key + ": " + value + '\n';
  }

  std::string text_;
};

std::string valuesOfFile(const std::filesystem::path& file, const std::string& under) {
  Document document(file.string(), readFile(file));
  const std::string kind = document.kind();
  FactsOfProfiles facts;
  return valuesOf(kind == "hardware" ? checkHardware(document, file, facts) : document.check(tableOf(kind)), under);
}

std::map<std::string, std::string> byKey(const std::string& values) {
  std::map<std::string, std::string> all;
  std::istringstream lines(values);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t colon = line.find(": ");
    if (colon != std::string::npos)
      all[line.substr(0, colon)] = line.substr(colon + 2);
  }
  return all;
}

}  // namespace

std::string valuesOf(const Map& map, const std::string& under) {
  Listing listing;
  listing.add(map, under);
  return listing.take();
}

std::string valuesOfFiles(const Deployment& deployment) {
  std::string values = valuesOfFile(deployment.robot, "robot.");
  if (!deployment.hardware.empty())
    values += valuesOfFile(deployment.hardware, "hardware.");
  return values;
}

std::uint64_t fingerprintOf(const std::string& values, std::uint64_t wire_version) noexcept {
  constexpr std::uint64_t kOffset = 14695981039346656037ULL, kPrime = 1099511628211ULL;
  std::uint64_t hash = kOffset;
  const auto add = [&](unsigned char byte) {
    hash ^= byte;
    hash *= kPrime;
  };
  for (const char byte : values)
    add(static_cast<unsigned char>(byte));
  for (int i = 0; i < 8; ++i)
    add(static_cast<unsigned char>(wire_version >> (8 * i)));
  return hash == 0 ? 1 : hash;
}

std::string fingerprintText(std::uint64_t fingerprint) {
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016" PRIx64, fingerprint);
  return text.data();
}

std::string differences(const std::string& here, const std::string& there, std::size_t most) {
  const auto ours = byKey(here), theirs = byKey(there);
  std::set<std::string> keys;
  for (const auto* side : {&ours, &theirs}) {
    for (const auto& [key, value] : *side)
      keys.insert(key);
  }
  const auto value_in = [](const std::map<std::string, std::string>& side, const std::string& key) {
    const auto found = side.find(key);
    return found == side.end() ? std::string("none") : found->second;
  };
  std::string text;
  std::size_t count = 0;
  for (const std::string& key : keys) {
    const std::string a = value_in(ours, key), b = value_in(theirs, key);
    if (a == b)
      continue;
    if (++count <= most)
      text += (text.empty() ? "" : "; ") + key + ": " + a + " here, " + b + " there";
  }
  if (count > most)
    text += "; and " + std::to_string(count - most) + " more";
  return text;
}

}  // namespace tandem::config
