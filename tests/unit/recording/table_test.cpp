// SPDX-License-Identifier: Apache-2.0
#include "recording/table.h"

#include <gtest/gtest.h>

#include <cmath>

#include "recording/export.h"
#include "recording/gaps.h"

namespace tandem::recording {
namespace {

Schema schema(const std::string& text) { return {1, "p/msg/A", "ros2msg", text}; }

TEST(Definition, UnderstandsWhatRos2Writes) {
  const Definition d = parseDefinition("p/msg/A",
                                       "# a comment\nint32 LIMIT=5\nint32 OTHER = 6\n\nfloat64[3] position  # m\n"
                                       "string<=10 name\nuint8[<=4] few\nB[] more\nq/C one\nbool on true\n"
                                       "================\nMSG: p/B\nint8 x\n================\nMSG: q/C\nB b\n"
                                       "================\nMSG: q/B\nuint64 y\n");
  const auto& a = d.types.at("p/A");
  ASSERT_EQ(a.size(), 6u);
  EXPECT_EQ(a[0].length, 3u);
  EXPECT_EQ(a[1].kind, Kind::kString);
  EXPECT_EQ(a[2].count, Field::Count::kSequence);
  EXPECT_EQ(a[3].type, "p/B");
  EXPECT_EQ(a[5].name, "on");
  EXPECT_EQ(d.types.at("q/C")[0].type, "q/B");
}

TEST(Definition, WhatIsMissingIsNamed) {
  try {
    parseDefinition("p/msg/A", "Nothing x\n");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()), "definition of p/msg/A: member x of p/A is a p/Nothing, which is not defined");
  }
  EXPECT_THROW(Table("/a", {1, "p/msg/A", "jsonschema", "{}"}), Error);
}

TEST(Definition, WhatIsAmbiguousOrHasNoBoundedSizeIsRefused) {
  std::string doubled = "T1 a\nT1 b\n";
  for (int level = 1; level < 30; ++level) {
    const std::string next = "T" + std::to_string(level + 1);
    doubled += "===\nMSG: p/T" + std::to_string(level) + "\n" + next + " a\n" + next + " b\n";
  }
  doubled += "===\nMSG: p/T30\nuint8 x\n";
  const std::pair<std::string, const char*> cases[] = {
      {"int8[99999999999999999999999] a\n", "line 'int8[99999999999999999999999] a': found an array of"},
      {"int8[0] a\n", "found an array of 0 elements, expected 1 to 1000000"},
      {"int8 a\nstring a\n", "line 'string a': member a of p/A is there twice"},
      {"A a\nA b\n", "type p/A contains itself"},
      {"B[1000] a\n===\nMSG: p/B\nint8[1001] x\n", "type p/A has more than 1000000 values"},
      {"B[1000000] a\n===\nMSG: p/B\n", "member a is an array of p/B, which has no members"},
      {doubled, "20 levels"}};
  for (const auto& [text, reason] : cases) {
    try {
      parseDefinition("p/msg/A", text);
      FAIL() << reason;
    } catch (const Error& error) {
      EXPECT_TRUE(std::string_view(error.what()).starts_with("definition of p/msg/A: ")) << error.what();
      EXPECT_NE(std::string(error.what()).find(reason), std::string::npos) << error.what();
    }
  }
}

std::string bytes(std::initializer_list<int> values) { return {values.begin(), values.end()}; }

TEST(Table, CellsOfSequencesAndByteOrder) {
  Table table("a", schema("uint8 k\nuint16[] list\nstring s"));
  // Encapsulation (little-endian); k, padding, count, elements, padding, length of the text with its zero.
  const std::string little = bytes({0, 1, 0, 0, 7, 0, 0, 0, 1, 0, 0, 0, 2, 1, 0, 0, 3, 0, 0, 0, 'h', 'i', 0});
  const std::string big = bytes({0, 0, 0, 0, 8, 0, 0, 0, 0, 0, 0, 2, 0, 1, 0, 2, 0, 0, 0, 1, 0});
  EXPECT_TRUE(table.add({1, 1, 10, 9, little}));
  EXPECT_TRUE(table.add({1, 2, 20, 19, big}));
  for (std::size_t cut = 0; cut < little.size(); ++cut)
    EXPECT_FALSE(table.add({1, 3, 30, 0, std::string_view(little).substr(0, cut)})) << cut;
  EXPECT_FALSE(table.add({1, 3, 30, 0, bytes({0, 1, 0, 0, 7, 0, 0, 0, -1, -1, -1, -1})})) << "four billion elements";
  EXPECT_FALSE(table.add({1, 3, 30, 0, little + std::string(8, '\0')})) << "another type";
  ASSERT_EQ(table.rows(), 2u);
  ASSERT_EQ(table.columns.size(), 3u);
  EXPECT_EQ(table.columns[0].reals, (std::vector<double>{7, 8}));
  EXPECT_EQ(table.columns[1].reals, (std::vector<double>{258, 1, 2}));
  EXPECT_EQ(table.columns[1].ends, (std::vector<std::size_t>{1, 3}));
  EXPECT_EQ(table.columns[1].width, 2u);
  EXPECT_EQ(table.columns[2].texts, (std::vector<std::string>{"hi", ""}));
}

TEST(Table, AlignedRowsHoldTheLastSample) {
  Table table("a", schema("uint8[2] x"));
  for (int i = 1; i <= 3; ++i)
    table.add({1, 0, static_cast<std::uint64_t>(100 * i), 0, bytes({0, 1, 0, 0, i, 10 * i})});
  const AlignedTable aligned = align({table}, {50, 100, 199, 200, 1000});
  EXPECT_EQ(aligned.names, (std::vector<std::string>{"a.x[0]", "a.x[1]"}));
  EXPECT_TRUE(std::isnan(aligned.values[0][0]));
  EXPECT_EQ(std::vector<double>(aligned.values[1].begin() + 1, aligned.values[1].end()),
            (std::vector<double>{10, 10, 20, 30}));
}

TEST(Gaps, AreCountedPerWriterAndOverTheWrap) {
  GapCounter<int> gaps;
  for (std::uint32_t number : {0xfffffffeu, 0xffffffffu, 0u, 3u, 1u, 4u})
    gaps.see(1, number);
  for (std::uint32_t number : {70u, 71u, 73u})
    gaps.see(2, number);
  EXPECT_EQ(gaps.lost(1), 2u);
  EXPECT_EQ(gaps.lost(2), 1u);
  EXPECT_EQ(gaps.lost(3), 0u);
  EXPECT_EQ(gaps.lost(), 3u);
}

TEST(PlainName, IsOneEverywhere) {
  EXPECT_EQ(plainName("arm_a/measured_js"), "arm_a_measured_js");
  EXPECT_EQ(plainName("tasks[0].position"), "tasks_0_position");
  EXPECT_EQ(plainName("/a"), "a");
}

}  // namespace
}  // namespace tandem::recording
