// SPDX-License-Identifier: Apache-2.0
/** @file Generator of the JSON Schemas and of the key tables in docs/configuration.md. Usage: config_reference
 * SOURCE_FOLDER. */
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <string>

#include "config/file_tables.h"

namespace {

namespace fs = std::filesystem;

void write(const fs::path& file, const std::string& text) {
  std::ofstream stream(file, std::ios::binary);
  stream << text;
  if (!stream.flush())
    throw std::runtime_error("cannot write " + file.string());
}

std::string read(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

void replaceSection(std::string& page, const std::string& kind) {
  const std::string begin = "<!-- keys: " + kind + " -->\n";
  const std::string end = "<!-- end of keys -->";
  const std::size_t from = page.find(begin);
  const std::size_t to = page.find(end, from);
  if (from == std::string::npos || to == std::string::npos)
    throw std::runtime_error("docs/configuration.md: found no section of keys for " + kind +
                             ", expected a heading, then the line `<!-- keys: " + kind + " -->`, then the line `" +
                             end + "`; add these lines and run this again");
  std::string tables = "\n";
  tables.append(tandem::config::keyTables(kind)).append("\n");
  page.replace(from + begin.size(), to - from - begin.size(), tables);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: config_reference SOURCE_FOLDER\n";
    return 2;
  }
  try {
    const fs::path source = argv[1];
    const fs::path page = source / "docs/configuration.md";
    std::string text = read(page);
    for (const std::string& kind : tandem::config::kinds()) {
      write(source / "config/presets/schemas" / (kind + ".schema.json"), tandem::config::schema(kind));
      replaceSection(text, kind);
    }
    write(page, text);
  } catch (const std::exception& error) {
    std::cerr << "config_reference: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
