// SPDX-License-Identifier: Apache-2.0
#include "config/detail/yaml_reader.h"

#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "config/detail/syntax_hint.h"
#include "config/detail/yaml_scalar.h"
#include "config/file_tables.h"

namespace tandem::config {
namespace {

constexpr std::size_t kLargestText = 4u << 20;
constexpr const char* kKindKey = "tandem";

/// Stores the start of each document.
class DocumentStarts : public YAML::EventHandler {
 public:
  void OnDocumentStart(const YAML::Mark& mark) override { marks.push_back(mark); }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t, const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}

  std::vector<YAML::Mark> marks;
};

Error errorAtMark(const std::string& origin,
                  const YAML::Mark& mark,
                  const std::string& key,
                  const std::string& message) {
  return Error(origin, std::max(mark.line, 0) + 1, std::max(mark.column, 0) + 1, key, message);
}

/// Refuses content after the first document. YAML::LoadAll would detect it, too, but does not terminate if a document
/// starts with a stray token such as a comma.
void checkSingle(const std::string& origin, const std::string& text) {
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  DocumentStarts starts;
  parser.HandleNextDocument(starts);
  if (parser.HandleNextDocument(starts)) {
    throw errorAtMark(origin, starts.marks.back(), "",
                      "found text after the end of the YAML document, expected one document");
  }
}

/// Parses the only document of a text. A function, because an assignment to a YAML::Node also rebinds other nodes.
YAML::Node parseOne(const std::string& origin, const std::string& text) {
  if (text.size() > kLargestText) {
    throw Error(origin, 1, 1, "", "found " + std::to_string(text.size()) + " bytes, expected at most 4 MiB");
  }
  try {
    checkSingle(origin, text);
    const YAML::Node root = YAML::Load(text);
    if (root.IsNull())
      throw Error(origin, 1, 1, "", "found an empty file, expected `tandem: KIND/1` and more");
    return root;
  } catch (const YAML::Exception& error) {
    throw errorAtMark(origin, error.mark, "", "YAML syntax: " + error.msg + syntaxHint(text, error.mark.line));
  }
}

std::string plainBool(bool value) { return value ? "true" : "false"; }

std::string plainNode(const YAML::Node& node, const Field& field, const Unit* unit) {
  if (node.IsSequence()) {
    std::vector<std::string> elements;
    for (const YAML::Node& element : node)
      elements.push_back(plainNode(element, field, unit));
    const bool equal = std::adjacent_find(elements.begin(), elements.end(), std::not_equal_to<>()) == elements.end();
    return field.or_scalar && equal && !elements.empty() ? elements.front() : "[" + join(elements) + "]";
  }
  if (!node.IsScalar())
    return "";
  if (field.type == Type::kBool)
    return plainBool(readBool(node).value());
  if (field.type == Type::kText || field.type == Type::kMapping)
    return node.Scalar();
  return formatNumber(field.type == Type::kInteger && !config::isWord(node, field)
                          ? static_cast<double>(readInteger(node, field).value())
                          : readNumber(node, field, unit).value());
}

std::string expectedKinds() {
  std::vector<std::string> heads;
  for (const std::string& kind : kinds())
    heads.push_back(kind + "/1");
  return join(heads, " or ");
}

}  // namespace

Document::Document(std::string origin, const std::string& text)
    : origin_(std::move(origin)), root_(parseOne(origin_, text)) {}

std::string Document::kind() const { return kindAmong(expectedKinds()); }

std::string Document::kindAmong(const std::string& expected) const {
  const auto refuse = [&](YAML::Mark mark, const std::string& found) {
    throw errorAtMark(origin_, mark, kKindKey,
                      "found " + found + ", expected " + expected + " as the value of the first key `tandem`");
  };
  if (!root_.IsMap())
    refuse(root_.Mark(),
           describeNode(root_) +
               (root_.IsScalar() && root_.Scalar().starts_with("tandem:") ? " without a blank after the colon" : ""));
  if (root_.begin() == root_.end())
    refuse(root_.Mark(), "no key");
  const YAML::Node key = root_.begin()->first;
  const YAML::Node value = root_.begin()->second;
  if (!key.IsScalar() || key.Scalar() != kKindKey)
    refuse(key.Mark(), describeNode(key) + " as the first key");
  for (const std::string& kind : kinds()) {
    if (value.IsScalar() && value.Scalar() == kind + "/1")
      return kind;
  }
  refuse(value.IsNull() ? key.Mark() : value.Mark(), describeNode(value));
  return "";
}

Map Document::check(const Mapping& table) {
  const bool has_kind = !table.fields.empty() && table.fields[0].name == kKindKey;
  const std::string expected = table.fields[0].words.empty() ? "" : table.fields[0].words[0];
  if (const std::string found = has_kind ? kindAmong(expected) + "/1" : expected; found != expected) {
    const YAML::Mark mark = root_.begin()->second.Mark();
    throw Error(origin_, mark.line + 1, mark.column + 1, kKindKey, "found " + found + ", expected " + expected);
  }
  Map map = Map::checked(*this, table, "", root_);
  map.refuseErrors();
  return map;
}

void Document::finish() const {
  for (const Field* field : present_) {
    // A text with a single permitted word contains no information.
    if (!read_.contains(field) && !(field->type == Type::kText && field->words.size() == 1))
      throw std::logic_error("the loader ignores the key '" + field->name + "'");
  }
}

bool Map::has(const std::string& name) const { return find(name) != nullptr; }

bool Map::flag(const std::string& name) const {
  if (const Entry* found = find(name))
    return readBool(found->value).value();
  return table_->field(name).default_number.value_or(0.0) != 0.0;
}

int Map::integer(const std::string& name) const {
  if (const Entry* found = find(name))
    return static_cast<int>(readInteger(found->value, *found->field).value());
  return static_cast<int>(table_->field(name).default_number.value());
}

double Map::number(const std::string& name) const {
  if (const Entry* found = find(name))
    return readNumber(found->value, *found->field, found->unit).value();
  return table_->field(name).default_number.value_or(std::numeric_limits<double>::quiet_NaN());
}

std::string Map::text(const std::string& name) const {
  if (const Entry* found = find(name))
    return found->value.Scalar();
  return table_->field(name).default_text.value();
}

std::filesystem::path Map::path(const std::string& name) const {
  return (std::filesystem::absolute(document_->origin_).parent_path() / text(name)).lexically_normal();
}

std::uint32_t Map::unsigned32(const std::string& name) const {
  if (!has(name))
    return 0;
  const std::string written = text(name);
  const unsigned long long value = std::stoull(written, nullptr, written.starts_with("0x") ? 16 : 10);
  if (value > std::numeric_limits<std::uint32_t>::max())
    fail(name, "found " + written + ", expected less than 2^32");
  return static_cast<std::uint32_t>(value);
}

std::vector<std::string> Map::texts(const std::string& name) const {
  std::vector<std::string> values;
  if (const Entry* found = find(name)) {
    for (const YAML::Node& node : found->value)
      values.push_back(node.Scalar());
  }
  return values;
}

Eigen::Vector3d Map::vector3(const std::string& name) const {
  const std::vector<double> values = numbers(name, 3);
  return {values[0], values[1], values[2]};
}

std::vector<double> Map::numbers(const std::string& name, int count) const {
  const auto size = static_cast<std::size_t>(count);
  const Entry* found = find(name);
  if (!found || found->value.IsScalar())
    return std::vector<double>(size, number(name));
  if (found->value.size() != size) {
    fail(name, "found " + describeNode(found->value) + ", expected a list of " + std::to_string(count));
  }
  std::vector<double> values;
  for (const YAML::Node& node : found->value)
    values.push_back(readNumber(node, *found->field, found->unit).value());
  return values;
}

std::vector<Eigen::Vector3d> Map::points(const std::string& name) const {
  std::vector<Eigen::Vector3d> rows;
  const Entry* found = find(name);
  if (!found)
    return rows;
  for (const YAML::Node& row : found->value) {
    Eigen::Vector3d point;
    int axis = 0;
    for (const YAML::Node& node : row)
      point[axis++] = readNumber(node, *found->field, found->unit).value();
    rows.push_back(point);
  }
  return rows;
}

Map Map::map(const std::string& name) const {
  const Mapping& keys = *table_->field(name).mapping;
  const Entry* found = find(name);
  if (found && found->value.IsMap())
    return checked(*document_, keys, pathOf(found->key), found->value);
  return Map(*document_, keys, pathOf(name), found ? found->mark : mark_);
}

std::vector<Map> Map::maps(const std::string& name) const {
  std::vector<Map> all;
  const Entry* found = find(name);
  if (!found)
    return all;
  for (const YAML::Node& node : found->value) {
    all.push_back(checked(*document_, *found->field->mapping, indexed(pathOf(found->key), all.size()), node));
  }
  return all;
}

std::string Map::plain(const std::string& name) const {
  const Field& field = table_->field(name);
  const Entry* found = find(name);
  if (!found && field.default_number)
    return field.type == Type::kBool ? plainBool(*field.default_number != 0.0) : formatNumber(*field.default_number);
  if (!found)
    return field.default_text.value_or("");
  return plainNode(found->value, field, found->unit);
}

bool Map::isWord(const std::string& name) const {
  const Entry* found = find(name);
  return found ? config::isWord(found->value, *found->field) : table_->field(name).default_text.has_value();
}

void Map::fail(const std::string& name, const std::string& message, int element) const {
  throw errorAt(name, message, element);
}

void Map::addErrors(const Error& error) const {
  if (error.file() != document_->origin_)
    throw Error(error);
  std::vector<Error>& known = document_->errors_;
  for (const Error& one : error.all()) {
    if (std::ranges::none_of(known, [&](const Error& other) { return std::strcmp(other.what(), one.what()) == 0; }))
      known.push_back(one);
  }
}

void Map::refuseErrors() const {
  if (!document_->errors_.empty())
    throw Error(document_->errors_);
}

void Map::expectDistinct(const std::string& list, const std::string& name) const {
  std::set<std::string> seen;
  for (const Map& entry : maps(list)) {
    if (!seen.insert(entry.text(name)).second)
      entry.fail(name, "found '" + entry.text(name) + "' a second time, expected another " + name);
  }
}

std::size_t Map::indexAmong(const std::string& name,
                            const std::vector<std::string>& all,
                            const std::string& expected) const {
  const auto found = std::find(all.begin(), all.end(), text(name));
  if (found == all.end())
    fail(name, "found '" + text(name) + "', expected " + expected);
  return static_cast<std::size_t>(found - all.begin());
}

void Map::expectBelow(const std::string& lower, const std::string& upper) const {
  if (!(number(lower) < number(upper)))
    fail(lower, "found " + inUnit(lower, number(lower)) + ", expected less than " + keyOf(upper) + ", " +
                    inUnit(lower, number(upper)));
}

void Map::complete(const std::string& name, const Map& by) const {
  const Map own = map(name);
  YAML::Node into = find(name)->value;
  for (const Entry& entry : by.entries_) {
    const auto same = std::ranges::find(own.entries_, entry.field->name, [](const Entry& e) { return e.field->name; });
    if (same == own.entries_.end()) {
      into[entry.key] = YAML::Clone(entry.value);
    } else if (entry.field->is_list) {
      YAML::Node both = YAML::Clone(entry.value);
      for (const YAML::Node& element : same->value)
        both.push_back(element);
      into[entry.key] = both;
    }
  }
}

void Map::warn(const std::string& name, const std::string& message) const {
  document_->warnings_.push_back(errorAt(name, message, -1).what());
}

std::string Map::keyOf(const std::string& name) const {
  const Entry* found = find(name);
  return found ? found->key : table_->field(name).key();
}

std::string Map::inUnit(const std::string& name, double si) const {
  const Entry* found = find(name);
  const Unit* unit = found ? found->unit : table_->field(name).keys().front().second;
  if (!unit)
    return formatNumber(si);
  return formatNumber(unit->fromSi(si)) + " " + unit->forPeople();
}

Map::Map(Document& document, const Mapping& table, std::string path, YAML::Mark mark)
    : document_(&document), table_(&table), path_(std::move(path)), mark_(mark) {}

void Map::fill(const std::type_info& owner, void* into) const {
  bool bound = false;
  for (const Field& field : table_->fields) {
    if (!field.owner || *field.owner != owner)
      continue;
    field.store(*this, field, into);
    bound = true;
  }
  if (!bound)
    throw std::logic_error("internal error: the key table '" + table_->name +
                           "' fills no member of the struct that is read");
}

const Map::Entry* Map::find(const std::string& name) const {
  const Field& field = table_->field(name);
  document_->read_.insert(&field);
  for (const Entry& entry : entries_) {
    if (entry.field == &field)
      return &entry;
  }
  return nullptr;
}

std::string Map::pathOf(const std::string& key) const { return path_.empty() ? key : path_ + "." + key; }

Error Map::error(YAML::Mark mark, const std::string& path, const std::string& message) const {
  const YAML::Mark& place = mark.is_null() ? mark_ : mark;
  return Error(document_->origin_, std::max(place.line, 0) + 1, std::max(place.column, 0) + 1, path, message);
}

Error Map::errorAt(const std::string& name, const std::string& message, int element) const {
  const Entry* found = find(name);
  if (!found)
    return error(mark_, pathOf(table_->field(name).key()), message);
  std::string path = pathOf(found->key);
  YAML::Mark mark = found->mark;
  if (element >= 0 && found->value.IsSequence() && static_cast<std::size_t>(element) < found->value.size()) {
    const YAML::Node& list = found->value;
    mark = list[element].Mark();
    path = indexed(path, static_cast<std::size_t>(element));
  }
  return error(mark, path, message);
}

}  // namespace tandem::config
