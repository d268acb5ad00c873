// SPDX-License-Identifier: Apache-2.0
/** @file Texts, temporary files and expected refusals for the tests of config. */
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>

#include "config/config.h"
#include "config/file_tables.h"

namespace tandem::config::test {

inline std::filesystem::path presets() { return std::filesystem::path(TANDEM_SOURCE) / "config/presets"; }

inline std::string readAll(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

/** A temporary folder, removed in the destructor. */
class Folder {
 public:
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "tandem-config-XXXXXX").string();
    path_ = ::mkdtemp(name.data());
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((path_ / name).parent_path());
    std::ofstream(path_ / name, std::ios::binary) << text;
    return path_ / name;
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// The text with its first occurrence of `from` replaced; fails if there is none.
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << "no '" << from << "' in the text";
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

/// Hardware of the robot ark2024 on two buses, with a home_position of each carriage at its lower limit.
inline std::string withHomes(std::string text) {
  const std::string homes[] = {"-400", "-300", "-190"};
  for (const std::string bus : {"bus_a", "bus_b"}) {
    for (int tube = 1; tube <= 3; ++tube) {
      const std::string key = "tube: " + std::to_string(tube) + ", bus: " + bus + ", node: " + std::to_string(tube);
      text = replaced(text, key + ",", key + ", home_position_mm: " + homes[tube - 1] + ",");
    }
  }
  return text;
}

/** One refusal: a change of a valid text, and the expected place of the error. */
struct Refusal {
  std::string from;
  std::string to;
  std::string at;      ///< the error is at the first occurrence of this text in the changed file ...
  std::size_t offset;  ///< ... and this number of characters further
  std::string key;
  std::string message;  ///< part of what()
};

/// Keys of a deployment, instead of interface_address and peers.
inline constexpr const char* kHosts = R"(hosts:
  - {name: robot, address: 10.0.0.1}
  - {name: console, address: 10.0.0.2}
processes:
  - {name: sim, executable: tandem-sim, host: robot}
  - {name: planning, executable: tandem-planning, host: console}
)";

/// Line and column of a character, from 1.
inline std::pair<int, int> placeOf(const std::string& text, std::size_t position) {
  int line = 1;
  int column = 1;
  for (std::size_t i = 0; i < position; ++i, ++column) {
    if (text[i] == '\n') {
      ++line;
      column = 0;
    }
  }
  return {line, column};
}

/// Runs a loader on the changed text and compares the refusal's file, line, column, key and message.
inline void expectRefusal(const std::string& good,
                          const Refusal& refusal,
                          const std::function<void(const std::filesystem::path&)>& load) {
  SCOPED_TRACE("'" + refusal.from + "' -> '" + refusal.to + "'");
  const Folder folder;
  const std::string text = replaced(good, refusal.from, refusal.to);
  const std::filesystem::path file = folder.write("file.yaml", text);
  const std::size_t position = text.find(refusal.at);
  ASSERT_NE(position, std::string::npos) << "no '" << refusal.at << "' in the changed text";
  const auto [line, column] = placeOf(text, position + refusal.offset);
  try {
    load(file);
    ADD_FAILURE() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.file(), file.string());
    EXPECT_EQ(error.line(), line) << error.what();
    EXPECT_EQ(error.column(), column) << error.what();
    EXPECT_EQ(error.key(), refusal.key) << error.what();
    EXPECT_NE(std::string(error.what()).find(refusal.message), std::string::npos) << error.what();
    const std::string place = file.string() + ":" + std::to_string(line) + ":" + std::to_string(column) + ": ";
    EXPECT_TRUE(std::string(error.what()).starts_with(place)) << error.what();
  }
}

/// Checks that a text uses every key: it contains each field of the table in one of its units.
inline void expectEveryKey(const std::string& text, const Mapping& table) {
  for (const Field& field : table.fields) {
    bool found = false;
    for (const auto& [key, unit] : field.keys())
      found = found || text.find(key + ":") != std::string::npos;
    EXPECT_TRUE(found) << table.name << ": " << field.name;
    if (field.mapping)
      expectEveryKey(text, *field.mapping);
  }
}

/// A folder like that of the presets, so that relative paths work; `load` receives the file under experiments/.
inline void expectRefusalBesideRobot(const std::string& good,
                                     const Refusal& refusal,
                                     const std::function<void(const std::filesystem::path&)>& load) {
  const std::string absolute = (presets() / "robots/ark2024.yaml").string();
  expectRefusal(replaced(good, "../robots/ark2024.yaml", absolute), refusal, load);
}

}  // namespace tandem::config::test
