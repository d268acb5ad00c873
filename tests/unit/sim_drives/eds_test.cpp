// SPDX-License-Identifier: Apache-2.0
/** @file Data sheets of the simulated devices, and object dictionaries that are made of them. */
#include "sim/drives/eds.h"

#include <gtest/gtest.h>

#include "sim/drives/object_dictionary.h"

namespace tandem::sim::drives {
namespace {

TEST(BuiltInEds, IsTheShippedOneAndHasNothingOdd) {
  for (const auto& [built_in, file] :
       {std::pair{driveEds(), "/tandem-drive.eds"}, std::pair{encoderEds(), "/tandem-encoder.eds"}}) {
    const Eds read = hal::canopen::loadEds(std::string(EDS_FOLDER) + file);
    for (const auto& warning : read.warnings)
      ADD_FAILURE() << describe(read, warning);
    ASSERT_EQ(built_in.objects.size(), read.objects.size());
    for (std::size_t k = 0; k < read.objects.size(); ++k) {
      EXPECT_EQ(built_in.objects[k].address, read.objects[k].address);
      EXPECT_EQ(built_in.objects[k].value, read.objects[k].value);
    }
  }
}

TEST(ObjectDictionary, ChecksWhatIsWritten) {
  ObjectDictionary dictionary(driveEds(), driveEds(), 5);
  const auto write = [&](ObjectAddress object, std::vector<std::uint8_t> bytes) {
    return dictionary.checkWrite(object, bytes);
  };
  EXPECT_EQ(write({0x2FFF, 0}, {0}), SdoAbort::kNoObject);
  EXPECT_EQ(write({0x1018, 9}, {0, 0, 0, 0}), SdoAbort::kNoSubIndex);
  EXPECT_EQ(write({0x1018, 4}, {0, 0, 0, 0}), SdoAbort::kReadOnly);
  EXPECT_EQ(write({0x1008, 0}, {65}), SdoAbort::kReadOnly) << "a constant string";
  EXPECT_EQ(write({0x605A, 0}, {1}), SdoAbort::kTooShort);
  EXPECT_EQ(write({0x605A, 0}, {1, 0, 0, 0}), SdoAbort::kTooLong);
  EXPECT_EQ(write({0x605A, 0}, {9, 0}), SdoAbort::kValueTooHigh);
  EXPECT_EQ(write({0x605A, 0}, {0xFF, 0xFF}), SdoAbort::kValueTooLow) << "-1";
  EXPECT_EQ(write({0x605A, 0}, {2, 0}), SdoAbort::kNone);
  EXPECT_EQ(dictionary.require(0x1400, 1).value, 0x205) << "$NODEID";
  EXPECT_THROW(dictionary.require(0x1008), std::invalid_argument) << "a string is no number";
  dictionary.require(0x605A).value = 6;
  dictionary.require(0x1017).value = 100;
  dictionary.reset(0x1000, 0x1FFF);
  EXPECT_EQ(dictionary.require(0x605A).value, 6);
  EXPECT_EQ(dictionary.require(0x1017).value, 0);
}

/// A vendor's file without defaults: what the simulation needs starts with its own value, inside the vendor's limits.
TEST(ObjectDictionary, StartsWithBuiltInValuesWhereAFileHasNone) {
  Eds eds = driveEds();
  const auto entry = [&](std::uint16_t index, std::uint8_t sub) -> EdsObject& {
    return *std::ranges::find(eds.objects, ObjectAddress{index, sub}, &EdsObject::address);
  };
  for (const std::uint16_t index : {0x6502, 0x6085}) {
    entry(index, 0).has_value = false;
    entry(index, 0).value = 0;
  }
  entry(0x6085, 0).high = driveEds().find({0x6085, 0})->value - 1;
  std::erase_if(eds.objects, [](const EdsObject& object) { return object.address == ObjectAddress{0x6007, 0}; });
  ObjectDictionary dictionary(eds, driveEds(), 5);
  EXPECT_EQ(dictionary.require(0x6502).value, driveEds().find({0x6502, 0})->value);
  EXPECT_EQ(dictionary.require(0x6085).value, 0) << "the built-in value is outside the limits";
  EXPECT_EQ(dictionary.checkRead({0x6007, 0}), SdoAbort::kNoObject);
  EXPECT_NO_THROW(dictionary.require(0x6007)) << "hidden";
}

}  // namespace
}  // namespace tandem::sim::drives
