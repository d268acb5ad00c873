// SPDX-License-Identifier: Apache-2.0
/** @file Strict YAML reader: checks a complete document against its key table, then converts values to SI. */
#pragma once

#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "config/config.h"
#include "config/key_table.h"

namespace tandem::config {

class Map;

/** One YAML text. Owns what its Maps refer to, so it outlives them and stays where it is. */
class Document {
 public:
  /// Parses; `origin` names the text in errors.
  /// @throw Error for a syntax error, an empty text, more than one document, or one beyond four megabytes.
  Document(std::string origin, const std::string& text);
  Document(const Document&) = delete;
  Document& operator=(const Document&) = delete;

  /// Kind by the first key: "robot" of `tandem: robot/1`.
  /// @throw Error where the first key is another one or the kind is unknown.
  std::string kind() const;

  /// Checks the whole text against a table: unknown, missing and repeated keys, units, types, ranges, sizes.
  /// @throw Error at the first offence.
  Map check(const Mapping& table);

  /// To be called when everything is read.
  /// @throw std::logic_error where the text has a key that the table knows and the loader never asked for.
  void finish() const;

  const std::string& origin() const { return origin_; }
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  friend class Map;
  std::string origin_;
  YAML::Node root_;
  std::vector<std::string> warnings_;
  std::set<const Field*> present_;
  std::set<const Field*> read_;
};

/** A checked mapping of a document, or one that is absent and stands for its defaults. Fields are asked for by the name
 * in the table, without unit; asking for a name that the table does not have is a std::logic_error. */
class Map {
 public:
  const Mapping& table() const { return *table_; }
  bool has(const std::string& name) const;

  bool flag(const std::string& name) const;
  int integer(const std::string& name) const;
  /// SI value, or the default of the table (NaN where it has none); infinity for `unlimited`.
  double number(const std::string& name) const;
  std::string text(const std::string& name) const;
  /// Relative to the folder of the file.
  std::filesystem::path path(const std::string& name) const;
  /// A text that is a decimal number or 0x...; 0 where it is absent. @throw Error from 2^32 on.
  std::uint32_t unsigned32(const std::string& name) const;
  std::vector<std::string> texts(const std::string& name) const;
  Eigen::Vector3d vector3(const std::string& name) const;
  /// So many SI values; one scalar, or the default, stands for all. @throw Error for a list of another size.
  std::vector<double> numbers(const std::string& name, int count) const;
  /// A list of [x, y, z].
  std::vector<Eigen::Vector3d> points(const std::string& name) const;
  /// A mapping; where it is absent, one of defaults.
  Map map(const std::string& name) const;
  std::vector<Map> maps(const std::string& name) const;
  /// A value, or its default, as text that says the same for the same value: SI, 12 digits, of a list of equal numbers
  /// where one may stand for all this one. Empty without a default, and for mappings that no word stands for.
  std::string plain(const std::string& name) const;
  /// True where a word stands in place of a mapping, or is its default.
  bool isWord(const std::string& name) const;

  /// Fills a struct from the keys that the table binds to its members; its other members stay as they are.
  /// @throw std::logic_error where the table binds none.
  template <class Struct>
  void read(Struct& into) const {
    fill(typeid(Struct), &into);
  }
  template <class Struct>
  Struct read() const {
    Struct made;
    read(made);
    return made;
  }

  /// @throw Error always, at the value of a key (or where it should be), or at an element of its list.
  [[noreturn]] void fail(const std::string& name, const std::string& message, int element = -1) const;
  /// @throw Error at the second mapping of a list that has the same text.
  void expectDistinct(const std::string& list, const std::string& name) const;
  /// The place of a text among others. @throw Error at a text that is not there. @param expected what to say then
  std::size_t indexAmong(const std::string& name,
                         const std::vector<std::string>& all,
                         const std::string& expected) const;
  /// @throw Error at the first number where it is not less than the second one.
  void expectBelow(const std::string& lower, const std::string& upper) const;
  /// Adds a warning at the value of a key.
  void warn(const std::string& name, const std::string& message) const;
  /// The key as it is written, or as it should be: "outer_diameter_mm".
  std::string keyOf(const std::string& name) const;
  /// An SI value in the unit of its key: "1.524 mm".
  std::string inUnit(const std::string& name, double si) const;

 private:
  friend class Document;
  struct Entry {
    const Field* field;
    const Unit* unit;
    std::string key;
    YAML::Node value;
    YAML::Mark mark;  ///< of the value; of the key where the value has none
  };

  Map(Document& document, const Mapping& table, std::string path, YAML::Mark mark);
  static Map checked(Document& document, const Mapping& table, std::string path, const YAML::Node& node);

  void fill(const std::type_info& owner, void* into) const;
  void addEntry(const YAML::Node& key, const YAML::Node& value);
  void checkPresence() const;
  void checkAlternatives() const;
  void checkEntry(const Entry& entry) const;
  void checkElement(const Entry& entry, const YAML::Node& node, const std::string& path) const;
  void checkScalar(const Entry& entry, const YAML::Node& node, const std::string& path) const;

  const Entry* find(const std::string& name) const;  ///< marks the field as read
  std::string pathOf(const std::string& key) const;
  Error error(YAML::Mark mark, const std::string& path, const std::string& message) const;
  Error errorAt(const std::string& name, const std::string& message, int element) const;
  [[noreturn]] void unexpected(const Entry& entry, const YAML::Node& node, const std::string& path, bool element) const;

  Document* document_;
  const Mapping* table_;
  std::string path_;  ///< "arms[0].tubes[1]", empty for the root
  YAML::Mark mark_;
  std::vector<Entry> entries_;
};

}  // namespace tandem::config
