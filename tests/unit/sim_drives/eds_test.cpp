// SPDX-License-Identifier: Apache-2.0
/** @file Data sheets of the simulated devices, and object dictionaries that are made of them. */
#include "sim/drives/eds.h"

#include <gtest/gtest.h>

#include "sim/drives/drive.h"
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

/// A sheet of another product: 2001 and 2002 are a set-up of its own, far below any temperature.
Eds ofAnotherMaker() {
  Eds eds = driveEds();
  const auto entry = [&](std::uint16_t index, std::uint8_t sub = 0) -> EdsObject& {
    return *std::ranges::find(eds.objects, ObjectAddress{index, sub}, &EdsObject::address);
  };
  entry(0x1018, 1).value = 0x147;
  entry(0x2001).value = 7;
  entry(0x2002).value = -3;
  entry(0x2002).low.reset();
  return eds;
}

/// Powered on and past its boot.
DriveState stateAfterBoot(Drive& drive) {
  drive.powerOn(0);
  for (int ms = 1; ms <= 100; ++ms)
    drive.advance(std::int64_t{ms} * 1'000'000, 1e-3);
  drive.receive(hal::canopen::sdo::uploadRequest(hal::canopen::cob::kSdoRequest + drive.id(), {0x2001, 0}),
                100'000'000);  // refreshes the objects
  return drive.state();
}

TEST(ObjectDictionary, KeepsObjectsOfOtherManufacturersAsData) {
  const Eds eds = ofAnotherMaker();
  DriveSpec spec;
  Drive drive(spec, eds);
  EXPECT_EQ(stateAfterBoot(drive), DriveState::kSwitchOnDisabled) << name(drive.state());
  EXPECT_EQ(drive.dictionary().require(0x2001).value, 7);
  EXPECT_EQ(drive.dictionary().require(0x2002).value, -3);
  // The built-in object is none of theirs, not even a hidden one.
  Eds without = eds;
  std::erase_if(without.objects, [](const EdsObject& object) { return object.address.index == 0x2001; });
  EXPECT_EQ(ObjectDictionary(without, driveEds(), 5).find({0x2001, 0}), nullptr);
  Drive bare(spec, without);
  EXPECT_EQ(stateAfterBoot(bare), DriveState::kSwitchOnDisabled);
}

/// Without 608F the counts of a revolution are those of the hardware file; a sheet that has it, decides.
TEST(ObjectDictionary, TakesTheCountsOfARevolutionFromTheSheetThatHasThem) {
  Eds without = driveEds();
  std::erase_if(without.objects, [](const EdsObject& object) { return object.address.index == 0x608F; });
  DriveSpec spec;
  spec.counts_per_revolution = 16384.0;
  Drive other(spec, without);
  other.powerOn(0);
  EXPECT_EQ(other.dictionary().require(0x608F, 1).value, 16384);
  EXPECT_EQ(other.dictionary().checkRead({0x608F, 1}), SdoAbort::kNoObject);
  EXPECT_EQ(Drive(spec, driveEds()).dictionary().require(0x608F, 1).value, driveEds().find({0x608F, 1})->value);
  spec.counts_per_revolution = 0.0;
  EXPECT_EQ(Drive(spec, without).dictionary().require(0x608F, 1).value, driveEds().find({0x608F, 1})->value);
}

TEST(ObjectDictionary, ShowsTheTemperatureWhereAProfileNamesIt) {
  DriveSpec spec;
  spec.temperature = {0x2001, 0};
  spec.temperature_scale = 0.1;
  Drive drive(spec, ofAnotherMaker());
  EXPECT_EQ(stateAfterBoot(drive), DriveState::kSwitchOnDisabled);
  EXPECT_EQ(drive.dictionary().require(0x2001).value, std::llround(10.0 * drive.motor().temperature()));
  EXPECT_EQ(drive.dictionary().require(0x2002).value, -3);
}

}  // namespace
}  // namespace tandem::sim::drives
