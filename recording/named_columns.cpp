// SPDX-License-Identifier: Apache-2.0
#include "recording/named_columns.h"

#include <algorithm>
#include <array>
#include <optional>

namespace tandem::recording {
namespace {

constexpr std::size_t kArms = 8, kJoints = 8, kActions = 32;  ///< room for them in arrays: idl/tandem_msgs.idl

/** One element of an array. */
struct Element {
  std::size_t index;
  std::string name;
  bool turns = false;  ///< has the second of two units
};
using Elements = std::vector<Element>;

Elements numbered(const std::string& stem, std::size_t count) {
  Elements elements;
  for (std::size_t i = 0; i < count; ++i)
    elements.push_back({i, stem + "_" + std::to_string(i + 1)});
  return elements;
}

template <class Names>
Elements listed(const Names& names) {
  Elements elements;
  for (const auto& name : names)
    elements.push_back({elements.size(), name});
  return elements;
}

std::string ofArm(const ArrayNames::Arm& arm, const std::string& element) { return arm.name + "." + element; }

/// The part behind the last dot.
std::string leafOf(const std::string& name) { return name.substr(name.rfind('.') + 1); }

/** Names the columns of one table. */
class Namer {
 public:
  Namer(const ArrayNames& names, const Table& table) : names_(names) {
    for (const Column& column : table.columns) {
      if (!column.is_array && column.name.ends_with("_count"))
        counts_[column.name.substr(0, column.name.size() - 6)] =
            column.reals.empty() ? 0 : static_cast<std::size_t>(*std::ranges::max_element(column.reals));
    }
    for (const ArrayNames::Arm& arm : names.arms) {
      if (table.topic.starts_with(arm.name + "/") && table.topic.ends_with("_js"))
        own_arm_ = &arm;
    }
  }

  /// Name without unit; empty for a member of a message that the robot does not use.
  std::string memberName(const std::string& name) const {
    for (const auto& [stem, count] : counts_) {
      const std::string start = stem + "s[";
      if (!name.starts_with(start))
        continue;
      const std::size_t index = std::stoul(name.substr(start.size())), end = name.find(']');
      return index < count ? stem + "_" + std::to_string(index + 1) + name.substr(end + 1) : "";
    }
    return name;
  }

  /// Elements of an array; nothing for those that keep their index.
  std::optional<Elements> elementsOf(const Column& column) const {
    const std::string leaf = leafOf(column.name);
    if (column.length == 0)
      return own_arm_ == nullptr || column.type == Column::Type::kText ? std::nullopt : std::optional(ofOwnArm(column));
    for (const auto& [prefix, elements] : names_.prefixes) {
      if (leaf.starts_with(prefix) && elements.size() <= column.length)
        return listed(elements);
    }
    if (leaf.ends_with("joints") && column.length == kJoints)
      return numbered("joint", kJoints);
    for (const auto& [stem, count] : counts_) {
      if (column.name.starts_with(stem + "_"))
        return numbered(stem, std::min(count, column.length));
    }
    return byLength(column.length, leaf == "orientation");
  }

 private:
  Elements ofOwnArm(const Column& column) const {
    Elements elements;
    for (const ArrayNames::Joint& joint : own_arm_->joints) {
      if (elements.size() < column.width)
        elements.push_back({elements.size(), joint.name, joint.turns});
    }
    return elements;
  }

  std::optional<Elements> byLength(std::size_t length, bool orientation) const {
    static constexpr std::array kAxes{"x", "y", "z"};
    static constexpr std::array kQuaternion{"x", "y", "z", "w"};
    switch (length) {
      case 3:
        return listed(kAxes);
      case 4:
        return orientation ? std::optional(listed(kQuaternion)) : std::nullopt;
      case kArms:
        return ofArms();
      case kArms * 3:
        return eachArm(listed(kAxes), 3);
      case kArms * 4:
        return eachArm(listed(kQuaternion), 4);
      case kArms* kJoints:
        return ofJoints();
      case kArms* kActions:
        return eachArm(listed(names_.actions), kActions);
      default:
        return std::nullopt;
    }
  }

  Elements ofArms() const {
    Elements elements;
    for (const ArrayNames::Arm& arm : names_.arms)
      elements.push_back({elements.size(), arm.name});
    return elements;
  }

  Elements eachArm(const Elements& inner, std::size_t room) const {
    Elements elements;
    for (std::size_t arm = 0; arm < names_.arms.size(); ++arm) {
      for (const Element& element : inner)
        elements.push_back({room * arm + element.index, ofArm(names_.arms[arm], element.name)});
    }
    return elements;
  }

  Elements ofJoints() const {
    Elements elements;
    for (std::size_t arm = 0; arm < names_.arms.size(); ++arm) {
      const std::vector<ArrayNames::Joint>& joints = names_.arms[arm].joints;
      for (std::size_t joint = 0; joint < joints.size(); ++joint)
        elements.push_back({kJoints * arm + joint, ofArm(names_.arms[arm], joints[joint].name), joints[joint].turns});
    }
    return elements;
  }

  const ArrayNames& names_;
  std::map<std::string, std::size_t> counts_;  ///< "task": largest task_count
  const ArrayNames::Arm* own_arm_ = nullptr;   ///< of a topic with one arm's joints
};

/// "_m_per_s"; empty where one value may have several units, or where the name ends with its unit ("sec" of a time).
std::string suffix(const std::string& name, const std::vector<std::string>& units, bool is_joint, bool turns) {
  if (units.empty() || units.size() > (is_joint ? 2u : 1u))
    return "";
  std::string text = "_";
  for (char letter : units.size() == 2 && turns ? units[1] : units[0]) {
    if (letter == '/')
      text += "_per_";
    else if (letter != '^')
      text += letter == ' ' ? '_' : letter;
  }
  return leafOf(name) == "sec" || name.ends_with(text) ? "" : text;
}

template <class T>
void takeElement(const Column& from,
                 const std::vector<T>& values,
                 std::size_t index,
                 std::vector<T>& into,
                 Column& to) {
  for (std::size_t row = 0; row < from.ends.size(); ++row) {
    if (index < from.size(row))
      into.push_back(values[from.begin(row) + index]);
    to.ends.push_back(into.size());
  }
}

Column elementColumn(const Column& from, std::size_t index) {
  Column to;
  to.type = from.type;
  to.width = 1;
  switch (from.type) {
    case Column::Type::kReal:
      takeElement(from, from.reals, index, to.reals, to);
      break;
    case Column::Type::kInteger:
      takeElement(from, from.integers, index, to.integers, to);
      break;
    case Column::Type::kUnsigned:
      takeElement(from, from.unsigneds, index, to.unsigneds, to);
      break;
    case Column::Type::kText:
      takeElement(from, from.texts, index, to.texts, to);
      break;
  }
  return to;
}

/// The named columns of one column.
std::vector<Column> named(const Namer& namer, Column column) {
  const std::string name = namer.memberName(column.name);
  if (name.empty())
    return {};
  const std::vector<std::string> units =
      column.type == Column::Type::kText ? std::vector<std::string>() : unitsIn(column.comment);
  if (!column.is_array) {
    column.name = name + suffix(name, units, false, false);
    return {column};
  }
  const std::optional<Elements> elements = namer.elementsOf(column);
  if (!elements) {
    column.name = name;
    return {column};
  }
  std::vector<Column> columns;
  const bool is_joint = std::ranges::any_of(*elements, &Element::turns);
  for (const Element& element : *elements) {
    columns.push_back(elementColumn(column, element.index));
    columns.back().name = name + "." + element.name + suffix(name + "." + element.name, units, is_joint, element.turns);
  }
  return columns;
}

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(' ');
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(' ') + 1 - first);
}

}  // namespace

std::vector<std::string> unitsIn(const std::string& comment) {
  // Longer ones first: each begins a piece of the comment, or is one.
  static constexpr std::array kUnits{"degrees Celsius",
                                     "rad/s^2",
                                     "m/s^2",
                                     "rad/s",
                                     "m/rad",
                                     "m/s",
                                     "N m",
                                     "rad",
                                     "1/s",
                                     "ns",
                                     "Hz",
                                     "m",
                                     "s",
                                     "N",
                                     "J"};
  std::vector<std::string> units;
  if (comment.find(" or ") != std::string::npos)
    return units;
  for (std::size_t begin = 0; begin <= comment.size();) {
    const std::size_t end = std::min(comment.find_first_of(",;:", begin), comment.size());
    const std::string piece = trimmed(comment.substr(begin, end - begin)) + " ";
    const auto* unit =
        std::ranges::find_if(kUnits, [&](const char* each) { return piece.starts_with(std::string(each) + " "); });
    if (unit != kUnits.end() && std::ranges::find(units, *unit) == units.end())
      units.emplace_back(*unit);
    begin = end + 1;
  }
  return units;
}

void nameColumns(const ArrayNames& names, std::vector<Table>& tables) {
  for (Table& table : tables) {
    const Namer namer(names, table);
    std::vector<Column> columns;
    for (Column& column : table.columns)
      std::ranges::move(named(namer, std::move(column)), std::back_inserter(columns));
    table.columns = std::move(columns);
  }
}

}  // namespace tandem::recording
