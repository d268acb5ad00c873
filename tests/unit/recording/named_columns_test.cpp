// SPDX-License-Identifier: Apache-2.0
#include "recording/named_columns.h"

#include <gtest/gtest.h>

namespace tandem::recording {
namespace {

using Texts = std::vector<std::string>;

TEST(NamedColumns, UnitsInComments) {
  const std::pair<const char*, Texts> cases[] = {
      {" m, rad", {"m", "rad"}},
      {" m/s, rad/s over the next control period, from the last setpoint on", {"m/s", "rad/s"}},
      {" s for which an arm has had power; 0: somebody does", {"s"}},
      {" s: how far the tip lags behind", {"s"}},
      {" N, N m", {"N", "N m"}},
      {" when it was measured, ns", {"ns"}},
      {" of the drive, degrees Celsius; NaN where it is not known", {"degrees Celsius"}},
      {" m or rad of that joint; s without a joint", {}},
      {" sequence of that state", {}},
      {" [0, 8]", {}},
      {"", {}},
  };
  for (const auto& [comment, units] : cases)
    EXPECT_EQ(unitsIn(comment), units) << comment;
}

/// A message of zeros, in little-endian CDR; `values` at their offsets from the end of the encapsulation.
std::string zeros(std::size_t size, std::initializer_list<std::pair<std::size_t, char>> values) {
  std::string bytes = std::string("\0\1\0\0", 4) + std::string(size, '\0');
  for (const auto& [offset, value] : values)
    bytes[4 + offset] = value;
  return bytes;
}

Texts namesOf(const Table& table) {
  Texts names;
  for (const Column& column : table.columns)
    names.push_back(column.name);
  return names;
}

const ArrayNames kRobot{{{"left", {{"beta_1", false}, {"alpha_1", true}}}, {"right", {{"roll", true}}}},
                        {"enable", "disable"},
                        {{"guard_", {"finite", "fresh"}}}};

TEST(NamedColumns, ElementsOfArmsAndJoints) {
  Table table("actuation/state",
              {1, "p/msg/A", "ros2msg",
               "int8[64] position  # m, rad\nint8[8] faults\nint8[16] guard_count\nint8[256] reason\n"
               "int8[24] tip  # m\nint64 stamp_ns  # ns\nint8 wait  # s\nint8[4] orientation\n"});
  ASSERT_TRUE(table.add(
      {1, 1, 1, 1, zeros(384, {{0, 1}, {1, 2}, {8, 3}, {9, 4}, {65, 5}, {73, 6}, {88 + 33, 7}, {344 + 4, 8}})}));
  std::vector<Table> tables{table};
  nameColumns(kRobot, tables);
  EXPECT_EQ(namesOf(tables[0]), (Texts{"position.left.beta_1_m",
                                       "position.left.alpha_1_rad",
                                       "position.right.roll_rad",
                                       "faults.left",
                                       "faults.right",
                                       "guard_count.finite",
                                       "guard_count.fresh",
                                       "reason.left.enable",
                                       "reason.left.disable",
                                       "reason.right.enable",
                                       "reason.right.disable",
                                       "tip.left.x_m",
                                       "tip.left.y_m",
                                       "tip.left.z_m",
                                       "tip.right.x_m",
                                       "tip.right.y_m",
                                       "tip.right.z_m",
                                       "stamp_ns",
                                       "wait_s",
                                       "orientation.x",
                                       "orientation.y",
                                       "orientation.z",
                                       "orientation.w"}));
  std::vector<double> values;
  for (const Column& column : tables[0].columns)
    values.insert(values.end(), column.reals.begin(), column.reals.end());
  EXPECT_EQ(values, (std::vector<double>{1, 2, 3, 0, 5, 0, 6, 0, 0, 0, 7, 0, 0, 0, 0, 8, 0, 0, 0, 0, 0, 0}));
}

TEST(NamedColumns, WhatIsCountedAndListsOfVariableLength) {
  const Schema schema{
      1, "p/msg/A", "ros2msg",
      "int8 task_count\nT[4] tasks\nint8[4] task_error  # m\nint8[] list\nV speed  # m/s\n===\nMSG: p/T\n"
      "int8[3] place  # m\nint8 arm\n===\nMSG: p/V\nint8 x\n"};
  Table table("planning/reference", schema);
  const std::string none = zeros(29, {{28, 5}}), two = zeros(29, {{0, 2}, {28, 5}});
  ASSERT_TRUE(table.add({1, 1, 1, 1, none}));
  ASSERT_TRUE(table.add({1, 2, 2, 2, two}));
  std::vector<Table> tables{table};
  nameColumns(kRobot, tables);
  EXPECT_EQ(namesOf(tables[0]),
            (Texts{"task_count", "task_1.place.x_m", "task_1.place.y_m", "task_1.place.z_m", "task_1.arm",
                   "task_2.place.x_m", "task_2.place.y_m", "task_2.place.z_m", "task_2.arm", "task_error.task_1_m",
                   "task_error.task_2_m", "list", "speed.x_m_per_s"}));
}

TEST(NamedColumns, JointStatesOfOneArm) {
  const Schema schema{1, "p/msg/A", "ros2msg", "string[] name\nint8[] position  # m, rad\n"};
  std::vector<Table> tables{Table("left/measured_js", schema), Table("other/measured_js", schema)};
  const std::string bytes = zeros(4 + 4 + 2, {{4, 2}, {8, 11}, {9, 22}});
  for (Table& table : tables)
    ASSERT_TRUE(table.add({1, 1, 1, 1, bytes}));
  nameColumns(kRobot, tables);
  EXPECT_EQ(namesOf(tables[0]), (Texts{"name", "position.beta_1_m", "position.alpha_1_rad"}));
  EXPECT_EQ(tables[0].columns[2].reals, (std::vector<double>{22}));
  EXPECT_EQ(namesOf(tables[1]), (Texts{"name", "position"}));
}

}  // namespace
}  // namespace tandem::recording
