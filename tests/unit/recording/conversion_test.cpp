// SPDX-License-Identifier: Apache-2.0
#include "recording/conversion.h"

#include <gtest/gtest.h>

#include "recording/table.h"

namespace tandem::recording {
namespace {

Conversion conversion(const std::string& from, const std::string& to) {
  return {parseDefinition("p/msg/A", from), parseDefinition("p/msg/A", to)};
}

using Words = std::vector<std::string>;

std::string encoded(std::initializer_list<int> values) { return {values.begin(), values.end()}; }

constexpr const char* kBefore =
    "uint8 k  # a comment\nB[] list\nuint8[2] grows\nuint8[3] shrinks\nstring s\nuint8 gone\nfloat64 x\n"
    "================\nMSG: p/B\nuint16 y\n";
constexpr const char* kAfter =
    "uint8 NONE=0\nfloat64 x\nuint8 k\nstring more\nB[] list\nuint8[4] grows\nuint8[1] shrinks\nstring s\n"
    "================\nMSG: p/B\nuint8 new\nuint16 y\n";

TEST(Conversion, MemberByMemberByName) {
  const Conversion convert = conversion(kBefore, kAfter);
  EXPECT_FALSE(convert.same());
  EXPECT_EQ(convert.added(), (Words{"more", "list.new", "grows[2..3]"}));
  EXPECT_EQ(convert.dropped(), (Words{"gone", "shrinks[1..2]"}));
  EXPECT_TRUE(convert.mismatched().empty());
  // k, padding, two of the list, arrays, padding, "hi", gone, padding, x.
  const std::string old = encoded({0, 1, 0, 0, 7, 0, 0,   0,   2, 0,  0, 0, 1, 2, 3, 4, 11, 12, 21, 22, 23,   0,
                                   0, 0, 3, 0, 0, 0, 'h', 'i', 0, 99, 0, 0, 0, 0, 0, 0, 0,  0,  0,  0,  0xf0, 0x3f});
  const std::optional<std::string> now = convert(old);
  ASSERT_TRUE(now);
  Table table("a", {1, "p/msg/A", "ros2msg", kAfter});
  ASSERT_TRUE(table.add({1, 1, 0, 0, *now}));
  std::map<std::string, std::vector<double>> reals;
  std::map<std::string, Words> texts;
  for (const Column& column : table.columns)
    column.type == Column::Type::kText ? void(texts[column.name] = column.texts)
                                       : void(reals[column.name] = column.reals);
  EXPECT_EQ(reals, (std::map<std::string, std::vector<double>>{{"x", {1.0}},
                                                               {"k", {7}},
                                                               {"list[0].new", {0}},
                                                               {"list[0].y", {0x201}},
                                                               {"list[1].new", {0}},
                                                               {"list[1].y", {0x403}},
                                                               {"grows", {11, 12, 0, 0}},
                                                               {"shrinks", {21}}}));
  EXPECT_EQ(texts, (std::map<std::string, Words>{{"more", {""}}, {"s", {"hi"}}}));
  for (std::size_t cut = 0; cut < old.size(); ++cut)
    EXPECT_FALSE(convert(old.substr(0, cut))) << cut;
}

TEST(Conversion, ConstantsAndCommentsAreNoMembers) {
  EXPECT_TRUE(conversion("uint8 k", "# of\nuint8 OFF=0\nuint8 ON = 1\nuint8 k  # more words").same());
  EXPECT_FALSE(conversion("uint8 a\nuint8 b", "uint8 b\nuint8 a").same()) << "the order counts on the wire";
}

/// Recordings of before a member was renamed keep its values, in both directions.
TEST(Conversion, RenamedMembersAreTheSame) {
  const char* former = "uint32 placements\nstring words\nuint8 k";
  const char* present = "uint32 joint_resets\nstring reason\nuint8 k";
  for (const auto& [from, to] : {std::pair{former, present}, std::pair{present, former}}) {
    const Conversion convert = conversion(from, to);
    EXPECT_TRUE(convert.same()) << from;
    EXPECT_TRUE(convert.added().empty() && convert.dropped().empty()) << from;
  }
  EXPECT_EQ(conversion("string words", "string words\nstring reason").added(), Words{"reason"});
}

TEST(Conversion, AnotherTypeIsNotConverted) {
  const Conversion convert = conversion("uint8[2] a\nstring b\nuint8 c", "uint8[] a\nuint32 b\nuint8 c");
  EXPECT_EQ(convert.mismatched(), (Words{"a: uint8[2] before, uint8[] after", "b: string before, uint32 after"}));
  EXPECT_FALSE(convert(encoded({0, 1, 0, 0, 1, 2, 0, 0, 1, 0, 0, 0, 0, 5})));
}

}  // namespace
}  // namespace tandem::recording
