// SPDX-License-Identifier: Apache-2.0
#include <dlfcn.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>

#include "config/detail/loaders.h"
#include "config/file_tables.h"
#include "config/robot_files.h"
#include "config/suggestion.h"

namespace tandem::config {
namespace {

namespace fs = std::filesystem;

constexpr int kLevels = 4;  // largest depth of a build tree's executables below its cache

void addListed(std::vector<fs::path>& folders, const char* list) {
  const std::string text = list ? list : "";
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(':', begin), text.size());
    if (end > begin)
      folders.emplace_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
}

/// Source tree of a CMake build tree; empty for any other folder.
fs::path sourceOf(const fs::path& build) {
  std::ifstream cache(build / "CMakeCache.txt");
  const std::string key = "CMAKE_HOME_DIRECTORY:INTERNAL=";
  for (std::string line; std::getline(cache, line);) {
    if (line.starts_with(key))
      return line.substr(key.size());
  }
  return {};
}

/// Adds the folders beside an installed program or module, and the source tree of a build tree.
void addBeside(std::vector<fs::path>& folders, const fs::path& binary) {
  fs::path folder = binary.parent_path();
  // An installed package uses the administrator's files first.
  if (folder == "/usr/bin")
    folders.emplace_back("/etc/tandem");
  folders.push_back(folder / "../share/tandem");
  // build/bin, build/tests, build/preset/bin: the cache is a few levels above.
  for (int level = 0; level < kLevels && folder.has_relative_path(); ++level, folder = folder.parent_path()) {
    const fs::path source = sourceOf(folder);
    if (!source.empty())
      folders.push_back(source / "config/presets");
  }
}

std::vector<fs::path> searchFolders() {
  std::vector<fs::path> folders;
  addListed(folders, std::getenv("TANDEM_CONFIG_PATH"));
  std::error_code ignored;
  const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
  if (!program.empty())
    addBeside(folders, program);
  // The code may be in a module that another program has loaded.
  Dl_info here{};
  if (dladdr(reinterpret_cast<void*>(&searchFolders), &here) != 0 && here.dli_fname) {
    const fs::path module = fs::weakly_canonical(here.dli_fname, ignored);
    if (!module.empty() && module != program)
      addBeside(folders, module);
  }
  return folders;
}

/// "robots", "trajectories", "hardware", "cooperative".
std::string folderOf(const std::string& kind) {
  for (const RobotFile& type : robotFiles()) {
    if (type.kind == kind)
      return type.presets;
  }
  if (kind == "hardware")
    return kind;
  return kind.ends_with('y') ? kind.substr(0, kind.size() - 1) + "ies" : kind + "s";
}

std::vector<std::string> foldersOf(const std::string& kind) {
  std::vector<std::string> all;
  for (std::size_t begin = 0; begin < kind.size();) {
    const std::size_t end = std::min(kind.find('|', begin), kind.size());
    all.push_back(folderOf(kind.substr(begin, end - begin)));
    begin = end + 1;
  }
  if (!all.empty())
    return all;
  for (const std::string& known : kinds())
    all.push_back(folderOf(known));
  return all;
}

std::map<std::string, fs::path> presetFiles(const std::string& kind) {
  std::map<std::string, fs::path> files;
  for (const fs::path& folder : searchFolders()) {
    for (const std::string& sub : foldersOf(kind)) {
      std::error_code error;
      for (fs::directory_iterator entry(folder / sub, error), end; !error && entry != end; entry.increment(error)) {
        if (entry->path().extension() == ".yaml")
          files.emplace(entry->path().stem().string(), entry->path().lexically_normal());
      }
    }
  }
  return files;
}

std::vector<std::string> presetNames(const std::string& kind) {
  std::vector<std::string> names;
  for (const auto& [name, file] : presetFiles(kind))
    names.push_back(name);
  return names;
}

std::string listed(const std::vector<std::string>& names) { return names.empty() ? "none found" : join(names); }

bool isFile(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

}  // namespace

std::string readFile(const fs::path& file) {
  std::error_code ignored;
  if (!isFile(file))
    throw Error(file.string(), 0, 0, "",
                std::string(fs::is_directory(file, ignored) ? "found a folder" : "found no such file") +
                    ", expected a readable YAML file");
  std::ifstream stream(file, std::ios::binary);
  if (!stream)
    throw Error(file.string(), 0, 0, "", "found a file that cannot be opened, expected a readable YAML file");
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

fs::path findPreset(const std::string& name, const std::string& kind) {
  const std::string file = name.ends_with(".yaml") ? name : name + ".yaml";
  for (const fs::path& folder : searchFolders()) {
    if (name.empty())
      break;
    for (const std::string& sub : foldersOf(kind)) {
      if (isFile(folder / sub / file))
        return (folder / sub / file).lexically_normal();
    }
    if (isFile(folder / file))
      return (folder / file).lexically_normal();
  }
  const std::vector<std::string> known = presetNames(kind);
  const std::string nearest = nearestWord(name, known);
  std::string what = kind;
  for (std::size_t bar = 0; (bar = what.find('|', bar)) != std::string::npos;)
    what.replace(bar, 1, " or ");
  throw Error(name, 0, 0, what,
              "found neither a file nor a preset of this name" +
                  (nearest.empty() ? "" : " (did you mean " + nearest + "?)") +
                  ", expected a path or one of: " + listed(known));
}

fs::path findFile(const std::string& name_or_path, const std::string& kind) {
  return isFile(name_or_path) ? fs::path(name_or_path) : findPreset(name_or_path, kind);
}

std::vector<fs::path> presets(const std::string& kind) {
  std::vector<fs::path> files;
  for (const auto& [name, file] : presetFiles(kind))
    files.push_back(file);
  return files;
}

fs::path findShared(const std::string& installed, const std::vector<std::string>& in_trees) {
  std::error_code ignored;
  fs::path folder = fs::read_symlink("/proc/self/exe", ignored).parent_path();
  if (const fs::path beside = (folder / "../share/tandem" / installed).lexically_normal(); fs::exists(beside, ignored))
    return beside;
  for (int level = 0; level < kLevels && folder.has_relative_path(); ++level, folder = folder.parent_path()) {
    const fs::path source = sourceOf(folder);
    for (const std::string& name : source.empty() ? std::vector<std::string>{} : in_trees) {
      for (const fs::path& tree : {folder, source}) {
        if (fs::exists(tree / name, ignored))
          return tree / name;
      }
    }
  }
  return {};
}

fs::path robotPath(const Map& map, const fs::path& file) { return companionPath(map, "robot", file); }

fs::path methodLibrary(const Map& map, const fs::path& file, bool needed, const std::string& key) {
  if (map.has("method_library"))
    return fs::absolute(file.parent_path() / map.text("method_library")).lexically_normal();
  if (needed)
    map.fail(key, "found foreign without a method_library, expected the library of that method (docs/own-method.md)");
  return {};
}

fs::path companionPath(const Map& map, const std::string& key, const fs::path& file, const std::string& presets_of) {
  const std::string name = map.text(key), kind = presets_of.empty() ? key : presets_of;
  const fs::path beside = (file.parent_path() / name).lexically_normal();
  if (isFile(beside))
    return beside;
  if (name.find('/') == std::string::npos) {
    try {
      return findPreset(name, kind);
    } catch (const Error&) {
      // Reported below, at the key.
    }
  }
  map.fail(key, "found '" + name + "', expected a file relative to this one's folder or one of the presets: " +
                    listed(presetNames(kind)));
}

}  // namespace tandem::config
