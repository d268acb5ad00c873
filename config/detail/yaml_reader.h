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

/** One YAML text. Owns the nodes that its Maps refer to: it must outlive them at the same address. */
class Document {
 public:
  /// Parses; `origin` names the text in errors.
  /// @throw Error for a syntax error, an empty text, more than one document, or one beyond four megabytes.
  Document(std::string origin, const std::string& text);
  Document(const Document&) = delete;
  Document& operator=(const Document&) = delete;

  /// Kind by the first key: "robot" for `tandem: robot/1`.
  /// @throw Error if the first key is another one or the kind is unknown.
  std::string kind() const;

  /// Checks the whole text against a table: unknown, missing and repeated keys, units, types, ranges, sizes.
  /// @throw Error with all violations.
  Map check(const Mapping& table);

  /// To be called after all keys are read.
  /// @throw std::logic_error if the text has a key of the table that the loader has not read.
  void finish() const;

  const std::string& origin() const { return origin_; }
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  friend class Map;
  /// As kind(). @param expected  of the error: what the reader takes
  std::string kindAmong(const std::string& expected) const;

  std::string origin_;
  YAML::Node root_;
  std::vector<std::string> warnings_;
  std::vector<Error> errors_;
  std::set<const Field*> present_;
  std::set<const Field*> read_;
};

/** Checked mapping of a document, or an absent one with the defaults of its table. Fields are read by their name in the
 * table, without unit; a name that the table does not have is a std::logic_error. */
class Map {
 public:
  const Mapping& table() const { return *table_; }
  bool has(const std::string& name) const;

  bool flag(const std::string& name) const;
  int integer(const std::string& name) const;
  /// SI value, or the default of the table (NaN: none); infinity for `unlimited`.
  double number(const std::string& name) const;
  std::string text(const std::string& name) const;
  /// Relative to the folder of the file.
  std::filesystem::path path(const std::string& name) const;
  /// A text that is a decimal number or 0x...; 0 if absent. @throw Error from 2^32 on.
  std::uint32_t unsigned32(const std::string& name) const;
  std::vector<std::string> texts(const std::string& name) const;
  Eigen::Vector3d vector3(const std::string& name) const;
  /// `count` SI values; one scalar, or the default, counts for all. @throw Error for a list of another size.
  std::vector<double> numbers(const std::string& name, int count) const;
  /// A list of [x, y, z].
  std::vector<Eigen::Vector3d> points(const std::string& name) const;
  /// A mapping; if absent, one with defaults.
  Map map(const std::string& name) const;
  std::vector<Map> maps(const std::string& name) const;
  /// Value, or default, as a text that is the same for equal values: SI, 12 digits; a list of equal numbers becomes one
  /// number if the key permits it. Empty without a default, and for mappings without a word.
  std::string plain(const std::string& name) const;
  /// True if a word replaces a mapping, or is its default.
  bool isWord(const std::string& name) const;

  /// Fills a struct from the keys that the table binds to its members; its other members do not change.
  /// @throw std::logic_error if the table binds none.
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

  /// Reads each mapping of a list, also after an error. @param read  of a Map @throw Error with the errors of all
  template <class Read>
  void each(const std::string& name, Read read) const {
    for (const Map& entry : maps(name))
      collect([&] { read(entry); });
    refuseErrors();
  }
  /// The same of a list whose mappings differ in a text. @throw Error with the errors of all
  template <class Read>
  void eachDistinct(const std::string& list, const std::string& name, Read read) const {
    together([&] { expectDistinct(list, name); }, [&] { each(list, read); });
  }
  /// Runs steps that do not need one another, all of them also after an error. @throw Error with the errors of all
  template <class... Steps>
  void together(Steps... steps) const {
    (collect(steps), ...);
    refuseErrors();
  }
  /// Throws an error at the value of a key (or its expected place), or at an element of its list. @throw Error always
  [[noreturn]] void fail(const std::string& name, const std::string& message, int element = -1) const;
  /// @throw Error at the second mapping of a list that has the same text.
  void expectDistinct(const std::string& list, const std::string& name) const;
  /// Index of a text in a list. @throw Error for a text that is not in it. @param expected text for the error
  std::size_t indexAmong(const std::string& name,
                         const std::vector<std::string>& all,
                         const std::string& expected) const;
  /// @throw Error at the first number if it is not less than the second one.
  void expectBelow(const std::string& lower, const std::string& upper) const;
  /// Adds to the mapping in a key what another mapping has and it has not; a list of both starts with that of the
  /// other. Maps read before do not change: the document has to be checked again.
  void complete(const std::string& name, const Map& by) const;
  /// Adds a warning at the value of a key.
  void warn(const std::string& name, const std::string& message) const;
  /// The key in its written, or else its preferred form: "outer_diameter_mm".
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
    YAML::Mark mark;  ///< of the value; of the key if it has no value
  };

  Map(Document& document, const Mapping& table, std::string path, YAML::Mark mark);
  static Map checked(Document& document, const Mapping& table, std::string path, const YAML::Node& node);

  void fill(const std::type_info& owner, void* into) const;
  /// Runs a check; its error becomes one of the document, so that the checks after it run too.
  template <class Check>
  void collect(Check check) const {
    try {
      check();
    } catch (const Error& error) {
      addErrors(error);
    }
  }
  void addErrors(const Error& error) const;  ///< those that are not known yet @throw Error if it is of another file
  void refuseErrors() const;                 ///< @throw Error with the document's errors, if it has any
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
  std::vector<std::string> unknown_;  ///< keys that the table does not have
  std::vector<Entry> entries_;
};

}  // namespace tandem::config
