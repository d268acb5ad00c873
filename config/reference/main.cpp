// SPDX-License-Identifier: Apache-2.0
/** @file Generator of the JSON Schemas and of the key tables and examples in docs/configuration/, and of the
 * drives in docs/hardware.md. Usage:
 * config_reference SOURCE_FOLDER. */
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <regex>
#include <string>

#include "config/drive_profile.h"
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

/// Replaces what is between the line <!-- begin --> and <!-- end of what -->.
void replaceSection(const fs::path& file,
                    std::string& page,
                    const std::string& begin,
                    const std::string& what,
                    const std::string& text) {
  const std::string first = "<!-- " + begin, end = "<!-- end of " + what + " -->";
  const std::size_t from = page.find('\n', page.find(first));
  const std::size_t to = page.find(end, from);
  if (page.find(first) == std::string::npos || to == std::string::npos)
    throw std::runtime_error(file.string() + ": found no section, expected the lines `" + first + " -->` and `" + end +
                             "`; add these lines and run this again");
  page.replace(from + 1, to - from - 1, "\n" + text + "\n");
}

/// The preset that a page names in <!-- example: FOLDER/NAME -->, from its first key on.
std::string exampleOf(const fs::path& presets, const std::string& page) {
  static const std::regex marker("<!-- example: (\\S+) -->");
  std::smatch found;
  if (!std::regex_search(page, found, marker))
    throw std::runtime_error("found no line `<!-- example: FOLDER/NAME -->`");
  const std::string name = found[1], text = read(presets / (name + ".yaml"));
  return "The preset `" + fs::path(name).filename().string() + "`:\n\n```yaml\n" + text.substr(text.find("tandem: ")) +
         "```\n";
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: config_reference SOURCE_FOLDER\n";
    return 2;
  }
  try {
    const fs::path source = argv[1];
    const fs::path presets = source / "config/presets";
    for (const std::string& kind : tandem::config::kinds()) {
      write(presets / "schemas" / (kind + ".schema.json"), tandem::config::schema(kind));
      const fs::path page = source / "docs/configuration" / (kind + ".md");
      std::string text = read(page);
      replaceSection(page, text, "example: ", "example", exampleOf(presets, text));
      replaceSection(page, text, "keys: " + kind, "keys", tandem::config::keyTables(kind));
      write(page, text);
    }
    const fs::path page = source / "docs/hardware.md";
    std::string text = read(page);
    replaceSection(page, text, "drives: ", "drives", tandem::config::triedWith(presets / "drives"));
    write(page, text);
  } catch (const std::exception& error) {
    std::cerr << "config_reference: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
