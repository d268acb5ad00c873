// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <iterator>

#include "hal/canopen/eds.h"

namespace tandem::hal::canopen {
namespace {

struct TypeInfo {
  DataType type;
  std::string_view name;
  int bytes;
};

constexpr TypeInfo kTypes[] = {
    {DataType::kBoolean, "BOOLEAN", 1},
    {DataType::kInteger8, "INTEGER8", 1},
    {DataType::kInteger16, "INTEGER16", 2},
    {DataType::kInteger32, "INTEGER32", 4},
    {DataType::kUnsigned8, "UNSIGNED8", 1},
    {DataType::kUnsigned16, "UNSIGNED16", 2},
    {DataType::kUnsigned32, "UNSIGNED32", 4},
    {DataType::kReal32, "REAL32", 4},
    {DataType::kVisibleString, "VISIBLE_STRING", 0},
    {DataType::kOctetString, "OCTET_STRING", 0},
    {DataType::kUnicodeString, "UNICODE_STRING", 0},
    {DataType::kTimeOfDay, "TIME_OF_DAY", 6},
    {DataType::kTimeDifference, "TIME_DIFFERENCE", 6},
    {DataType::kDomain, "DOMAIN", 0},
    {DataType::kInteger24, "INTEGER24", 3},
    {DataType::kReal64, "REAL64", 8},
    {DataType::kInteger40, "INTEGER40", 5},
    {DataType::kInteger48, "INTEGER48", 6},
    {DataType::kInteger56, "INTEGER56", 7},
    {DataType::kInteger64, "INTEGER64", 8},
    {DataType::kUnsigned24, "UNSIGNED24", 3},
    {DataType::kUnsigned40, "UNSIGNED40", 5},
    {DataType::kUnsigned48, "UNSIGNED48", 6},
    {DataType::kUnsigned56, "UNSIGNED56", 7},
    {DataType::kUnsigned64, "UNSIGNED64", 8},
};

const TypeInfo* infoOf(DataType type) {
  const auto* found = std::ranges::find(kTypes, type, &TypeInfo::type);
  return found == std::end(kTypes) ? nullptr : found;
}

}  // namespace

std::string_view name(DataType type) {
  const TypeInfo* info = infoOf(type);
  return info == nullptr ? "" : info->name;
}

int sizeOf(DataType type) {
  const TypeInfo* info = infoOf(type);
  return info == nullptr ? 0 : info->bytes;
}

bool isSigned(DataType type) { return name(type).starts_with("INTEGER"); }

bool isReal(DataType type) { return type == DataType::kReal32 || type == DataType::kReal64; }

std::string_view name(Access access) {
  constexpr std::string_view kNames[] = {"ro", "wo", "rw", "const"};
  return kNames[static_cast<std::size_t>(access)];
}

}  // namespace tandem::hal::canopen
