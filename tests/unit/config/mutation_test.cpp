// SPDX-License-Identifier: Apache-2.0
/** @file Random mutations of valid files: each loads, or is refused at a place inside the file. */
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <random>
#include <variant>

#include "support.h"

namespace tandem::config::test {
namespace {

using Step = std::variant<std::string, std::size_t>;
using Path = std::vector<Step>;

struct Tree {
  std::vector<Path> numbers;  ///< leaves that are numbers
  std::vector<Path> keys;     ///< every key of every mapping
};

bool isNumber(const YAML::Node& node) {
  double value = 0.0;
  const std::string& text = node.Scalar();
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), value);
  return node.Tag() != "!" && status == std::errc{} && end == text.data() + text.size();
}

void walk(const YAML::Node& node, const Path& path, Tree& tree) {
  Path next = path;
  if (node.IsScalar() && isNumber(node))
    tree.numbers.push_back(path);
  if (node.IsSequence()) {
    for (std::size_t i = 0; i < node.size(); ++i) {
      next.emplace_back(i);
      walk(node[i], next, tree);
      next.pop_back();
    }
  }
  if (!node.IsMap())
    return;
  for (const auto& item : node) {
    next.emplace_back(item.first.Scalar());
    tree.keys.push_back(next);
    walk(item.second, next, tree);
    next.pop_back();
  }
}

YAML::Node child(const YAML::Node& node, const Step& step) {
  return std::holds_alternative<std::string>(step) ? node[std::get<std::string>(step)]
                                                   : node[std::get<std::size_t>(step)];
}

/// A fresh copy of the file with the value at a path replaced, or its key removed or renamed.
std::string changed(const std::string& text,
                    const Path& path,
                    const std::function<void(YAML::Node, const Step&)>& change) {
  const YAML::Node root = YAML::Load(text);
  std::vector<YAML::Node> nodes{root};
  for (std::size_t i = 0; i + 1 < path.size(); ++i)
    nodes.push_back(child(nodes.back(), path[i]));
  change(nodes.back(), path.back());
  YAML::Emitter out;
  out << root;
  return std::string(out.c_str()) + "\n";
}

std::string describe(const Path& path) {
  std::string text;
  for (const Step& step : path) {
    text += "/";
    text += std::holds_alternative<std::string>(step) ? std::get<std::string>(step)
                                                      : std::to_string(std::get<std::size_t>(step));
  }
  return text;
}

enum class Outcome { kLoads, kRefused };

/// Loads a text as the file in the folder; every refusal must name the file (or another one that it refers to) and a
/// place in it.
Outcome outcomeOf(const Folder& folder, const std::string& name, const std::string& text) {
  const std::filesystem::path file = folder.write(name, text);
  try {
    validate(file);
    return Outcome::kLoads;
  } catch (const Error& error) {
    EXPECT_EQ(error.file(), file.string());
    const auto [lines, columns] = placeOf(text, text.size());
    EXPECT_GE(error.line(), 1) << error.what();
    EXPECT_LE(error.line(), lines) << error.what();
    EXPECT_GE(error.column(), 1) << error.what();
  }
  return Outcome::kRefused;
}

/// A folder with the files that the preset refers to.
void copyRobot(const Folder& folder) {
  folder.write("robots/ark2024.yaml", readAll(presets() / "robots/ark2024.yaml"));
}

class Mutation : public testing::TestWithParam<const char*> {};

TEST_P(Mutation, EveryNumberRefusesWhatIsNoFiniteNumber) {
  const std::string good = readAll(presets() / GetParam());
  const Folder folder;
  copyRobot(folder);
  Tree tree;
  walk(YAML::Load(good), {}, tree);
  ASSERT_FALSE(tree.numbers.empty());
  for (const Path& path : tree.numbers) {
    SCOPED_TRACE(describe(path));
    const auto with = [&](const std::string& value) {
      return outcomeOf(folder, GetParam(), changed(good, path, [&](YAML::Node parent, const Step& step) {
                         if (std::holds_alternative<std::string>(step))
                           parent[std::get<std::string>(step)] = value;
                         else
                           parent[std::get<std::size_t>(step)] = value;
                       }));
    };
    for (const char* const bad : {"nan", ".inf", "text", "", "1e400"}) {
      EXPECT_EQ(with(bad), Outcome::kRefused) << bad;
    }
    for (const char* const perhaps : {"-1", "0", "1e300"})
      with(perhaps);
  }
}

TEST_P(Mutation, DeletedAndRenamedKeys) {
  const std::string good = readAll(presets() / GetParam());
  const Folder folder;
  copyRobot(folder);
  Tree tree;
  walk(YAML::Load(good), {}, tree);
  int refused = 0;
  for (const Path& path : tree.keys) {
    SCOPED_TRACE(describe(path));
    const std::string without =
        changed(good, path, [](YAML::Node parent, const Step& step) { parent.remove(std::get<std::string>(step)); });
    refused += outcomeOf(folder, GetParam(), without) == Outcome::kRefused;
    const std::string renamed = changed(good, path, [](YAML::Node parent, const Step& step) {
      const std::string& key = std::get<std::string>(step);
      parent[key + "q"] = YAML::Clone(parent[key]);
      parent.remove(key);
    });
    EXPECT_EQ(outcomeOf(folder, GetParam(), renamed), Outcome::kRefused);
  }
  EXPECT_GE(refused, 4);  // at least type, name, and the required keys of the type
}

TEST_P(Mutation, RandomBytes) {
  const std::string good = readAll(presets() / GetParam());
  const Folder folder;
  copyRobot(folder);
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  const std::string alphabet = ":-[]{}#&*!|>'\"%@`,? \n\t0123456789.eabn_\x01\xc3\xff";
  const auto below = [&random](std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random); };
  for (int trial = 0; trial < 300; ++trial) {
    std::string text = good;
    for (std::size_t change = 0; change <= below(4); ++change) {
      const std::size_t at = below(text.size());
      switch (below(3)) {
        case 0:
          text[at] = alphabet[below(alphabet.size())];
          break;
        case 1:
          text.insert(at, 1, alphabet[below(alphabet.size())]);
          break;
        default:
          text.erase(at, 1 + below(20));
          break;
      }
    }
    // A broken reference to the robot may name the robot's file; another test covers it.
    if (text.find("robot: ../robots/ark2024.yaml") == std::string::npos && good.find("robot: ") != std::string::npos)
      continue;
    outcomeOf(folder, GetParam(), text);
    if (HasFailure())
      FAIL() << "the text was:\n" << text;
  }
}

INSTANTIATE_TEST_SUITE_P(Presets,
                         Mutation,
                         testing::Values("robots/ark2024.yaml",
                                         "robots/timc2024.yaml",
                                         "experiments/table3.yaml",
                                         "deployments/laptop.yaml",
                                         "hardware/ark2024-two-buses.yaml",
                                         "trajectories/circle.yaml",
                                         "trajectories/lissajous.yaml",
                                         "paths/tip-eight.yaml"),
                         [](const auto& preset) {
                           std::string name = preset.param;
                           std::replace_if(
                               name.begin(), name.end(), [](char c) { return !std::isalnum(c); }, '_');
                           return name;
                         });

}  // namespace
}  // namespace tandem::config::test
