// SPDX-License-Identifier: Apache-2.0
/** @file ROS 2 message definitions (`ros2msg`), as far as the layout of values requires. */
#pragma once

#include <map>
#include <string>
#include <vector>

namespace tandem::recording {

inline constexpr int kDeepest = 20;                    ///< levels of nested types
inline constexpr std::size_t kMostValues = 1'000'000;  ///< of a message, with one element in each sequence

enum class Kind {
  kBool,
  kInt8,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kInt64,
  kUint64,
  kFloat32,
  kFloat64,
  kString,
  kMessage
};

/** One member of a message. */
struct Field {
  enum class Count { kOne, kFixed, kSequence };
  std::string name;
  Kind kind = Kind::kFloat64;
  std::string type;  ///< kMessage: key in Definition::types
  Count count = Count::kOne;
  std::size_t length = 1;  ///< kFixed: number of elements
  std::string comment;     ///< behind the member, on its line
};

/** A type with all its member types. */
struct Definition {
  std::string root;
  std::map<std::string, std::vector<Field>> types;  ///< by "package/Type"
};

/// Parses the text of a schema. @param type "package/msg/Type"
/// @throw Error that names the type, and the invalid line or the undefined member type; also for types that contain
/// themselves, are nested deeper than kDeepest, or have more than kMostValues values.
Definition parseDefinition(const std::string& type, const std::string& text);

}  // namespace tandem::recording
