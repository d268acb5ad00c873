// SPDX-License-Identifier: Apache-2.0
/** @file Search paths of files, and generated schemas and documentation. */
#include <nlohmann/json.hpp>

#include <cstdlib>
#include <set>

#include "config/file_tables.h"
#include "config/suggestion.h"
#include "support.h"

namespace tandem::config::test {
namespace {

/// Sets TANDEM_CONFIG_PATH and restores it.
class SearchPath {
 public:
  explicit SearchPath(const std::string& value) {
    if (const char* old = std::getenv("TANDEM_CONFIG_PATH"))
      old_ = old;
    ::setenv("TANDEM_CONFIG_PATH", value.c_str(), 1);
  }
  ~SearchPath() { old_.empty() ? ::unsetenv("TANDEM_CONFIG_PATH") : ::setenv("TANDEM_CONFIG_PATH", old_.c_str(), 1); }

 private:
  std::string old_;
};

TEST(FindFile, ABareNameIsAPresetOfTheSourceTree) {
  EXPECT_EQ(findFile("ark2024", "robot"), presets() / "robots/ark2024.yaml");
  EXPECT_EQ(findFile("ark2024.yaml", "robot"), presets() / "robots/ark2024.yaml");
  EXPECT_EQ(findFile("circle", "trajectory"), presets() / "trajectories/circle.yaml");
  EXPECT_EQ(findFile("laptop", ""), presets() / "deployments/laptop.yaml");
}

TEST(FindFile, APathIsAPath) {
  const std::filesystem::path path = presets() / "robots/ark2024.yaml";
  EXPECT_EQ(findFile(path.string(), "trajectory"), path);
}

TEST(FindFile, TheSearchPathComesFirst) {
  const Folder folder;
  const auto mine = folder.write("robots/ark2024.yaml", "mine");
  const auto flat = folder.write("flat.yaml", "flat");
  const SearchPath path("/nowhere::" + folder.path().string());
  EXPECT_EQ(findFile("ark2024", "robot"), mine);
  EXPECT_EQ(findFile("flat", "experiment"), flat);
  EXPECT_EQ(findFile("table3", "experiment"), presets() / "experiments/table3.yaml");
}

TEST(FindFile, AProgramInAPrefixFindsTheSharedFiles) {
  const Folder prefix;
  const auto installed = prefix.write("share/tandem/robots/ours.yaml", "tandem: robot/1\n");
  std::filesystem::create_directories(prefix.path() / "bin");
  const auto program = prefix.path() / "bin/find_preset";
  std::filesystem::copy_file(TANDEM_FIND_PRESET, program);
  const auto found = prefix.path() / "found";
  const auto run = [&](const std::string& name) {
    return std::system(
        ("env -u TANDEM_CONFIG_PATH '" + program.string() + "' " + name + " robot >'" + found.string() + "'").c_str());
  };
  EXPECT_EQ(run("ours"), 0);
  EXPECT_EQ(readAll(found), installed.string());
  EXPECT_NE(run("ark2024"), 0);
  EXPECT_NE(readAll(found).find("expected a path or one of: ours"), std::string::npos) << readAll(found);
}

TEST(FindFile, TheErrorListsThePresets) {
  try {
    findFile("arc2024", "robot");
    ADD_FAILURE() << "found";
  } catch (const Error& error) {
    EXPECT_EQ(error.line(), 0);
    EXPECT_EQ(error.key(), "robot");
    EXPECT_NE(std::string(error.what()).find("expected a path or one of: ark2024, ark2024-as-printed"),
              std::string::npos)
        << error.what();
  }
  EXPECT_THROW(findFile("", "robot"), Error);
  EXPECT_THROW(findFile("/", "robot"), Error);
}

TEST(Reference, SchemasAreThoseOfTheKeyTables) {
  for (const std::string& kind : kinds()) {
    const auto file = std::filesystem::path(TANDEM_SOURCE) / "config/presets/schemas" / (kind + ".schema.json");
    EXPECT_EQ(readAll(file), schema(kind)) << "run `ninja -C build/release config-reference`";
  }
}

TEST(Reference, DocumentedKeysAreThoseOfTheKeyTables) {
  const std::filesystem::path source = TANDEM_SOURCE;
  for (const std::string& kind : kinds()) {
    const std::string page = readAll(source / "docs/configuration" / (kind + ".md"));
    const std::string section = "<!-- keys: " + kind + " -->\n\n" + keyTables(kind) + "\n<!-- end of keys -->";
    EXPECT_NE(page.find(section), std::string::npos) << kind << ": run `ninja -C build/release config-reference`";
    const std::string marker = "<!-- example: ";
    const std::size_t from = page.find(marker) + marker.size();
    const std::string preset =
        readAll(source / "config/presets" / (page.substr(from, page.find(' ', from) - from) + ".yaml"));
    const std::string example =
        "```yaml\n" + preset.substr(preset.find("tandem: " + kind)) + "```\n\n<!-- end of example -->";
    EXPECT_NE(page.find(example), std::string::npos) << kind << ": run `ninja -C build/release config-reference`";
  }
}

/// Compares a schema's objects with the key tables, both ways, by walking the parsed JSON.
void compare(const nlohmann::json& root, const nlohmann::json& object, const Mapping& table) {
  SCOPED_TRACE(table.name);
  EXPECT_EQ(object.at("additionalProperties"), false);
  std::set<std::string> described;
  for (const auto& [key, value] : object.at("properties").items())
    described.insert(key);
  std::set<std::string> known;
  std::set<std::string> required;
  for (const Field& field : table.fields) {
    const auto keys = field.keys();
    for (const auto& [key, unit] : keys)
      known.insert(key);
    if (field.is_required && keys.size() == 1)
      required.insert(keys[0].first);
    if (field.mapping)
      compare(root, root.at("$defs").at(field.mapping->name), *field.mapping);
  }
  EXPECT_EQ(described, known);
  EXPECT_EQ(object.value("required", std::set<std::string>{}), required);
}

TEST(Reference, SchemaFilesDescribeExactlyTheKnownKeys) {
  for (const std::string& kind : kinds()) {
    const auto file = std::filesystem::path(TANDEM_SOURCE) / "config/presets/schemas" / (kind + ".schema.json");
    const nlohmann::json root = nlohmann::json::parse(readAll(file));
    EXPECT_EQ(root.at("$schema"), "https://json-schema.org/draft/2020-12/schema");
    compare(root, root, tableOf(kind));
  }
}

TEST(Units, EverySuffixConvertsThereAndBack) {
  std::set<std::string_view> suffixes;
  for (const Unit& unit : units()) {
    EXPECT_TRUE(suffixes.insert(unit.suffix).second) << unit.suffix;
    for (const double value : {1.0, -0.88, 1.524, 1e-6, 12345.678}) {
      EXPECT_NEAR(unit.fromSi(unit.toSi(value)), value, 4e-16 * std::abs(value)) << unit.suffix;
    }
  }
  const auto convert = [](const std::string& suffix, double value) {
    for (const Unit& unit : units()) {
      if (unit.suffix == suffix)
        return unit.toSi(value);
    }
    ADD_FAILURE() << suffix;
    return 0.0;
  };
  EXPECT_EQ(convert("mm", 0.88), 0.88e-3);
  EXPECT_EQ(convert("deg", 180), 3.14159265358979323846);
  EXPECT_EQ(convert("deg_per_s", 90), 3.14159265358979323846 / 2);
  EXPECT_EQ(convert("per_mm", 0.01), 10.0);
  EXPECT_EQ(convert("GPa", 58), 58e9);
  EXPECT_EQ(convert("ms", 50), 0.05);
  EXPECT_EQ(convert("mm_per_s2", 1), 1e-3);
}

TEST(KeyCheck, EditDistance) {
  EXPECT_EQ(editDistance("", ""), 0);
  EXPECT_EQ(editDistance("abc", ""), 3);
  EXPECT_EQ(editDistance("poison", "poisson"), 1);
  EXPECT_EQ(editDistance("nmae", "name"), 1);
  EXPECT_EQ(editDistance("kitten", "sitting"), 3);
}

}  // namespace
}  // namespace tandem::config::test
