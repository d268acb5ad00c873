// SPDX-License-Identifier: Apache-2.0
#include "sim/drives/eds.h"

#include <gtest/gtest.h>

#include <sstream>

#include "sim/drives/object_dictionary.h"

namespace tandem::sim::drives {
namespace {

const std::string kHead =
    "[DeviceInfo]\nProductName=X\n\n[MandatoryObjects]\nSupportedObjects=1\n1=0x1000\n\n"  // lines 1 to 7
    "[OptionalObjects]\nSupportedObjects=1\n1=0x6040\n\n"                                  // 8 to 11
    "[1000]\nParameterName=Type\nDataType=7\nAccessType=ro\nDefaultValue=0x20192\n\n";     // 12 to 17

Eds parse(const std::string& text) {
  std::istringstream in(text);
  return parseEds(in, "x.eds");
}

TEST(Eds, ReadsObjects) {
  const Eds eds = parse(kHead +
                        "[6040]\nParameterName=Controlword\nDataType=0x0003\nAccessType=rww\nDefaultValue=0xFFFE\n"
                        "LowLimit=-5\nHighLimit=7\nPDOMapping=1\n");
  ASSERT_EQ(eds.objects.size(), 2u);
  EXPECT_EQ(eds.objects[0].value, 0x20192);
  const EdsObject& word = eds.objects[1];
  EXPECT_EQ(word.name, "Controlword");
  EXPECT_EQ(word.type, DataType::kInteger16);
  EXPECT_EQ(word.access, Access::kReadWrite);
  EXPECT_EQ(word.value, -2) << "two's complement";
  EXPECT_EQ(word.low, -5);
  EXPECT_EQ(word.high, 7);
  EXPECT_TRUE(word.mappable);
}

TEST(Eds, NamesFileLineAndReason) {
  struct Case {
    std::string text;
    const char* where;
    const char* reason;
  };
  const std::string object = "[6040]\nParameterName=C\nDataType=6\nAccessType=rw\nDefaultValue=0\n";  // 18 to 22
  const Case cases[] = {
      {"a=1\n", ":1:", "section"},
      {"[DeviceInfo\n", ":1:", "']'"},
      {kHead + object + "nonsense\n", ":23:", "KEY=VALUE"},
      {kHead + object + "DataType=6\n", ":23:", "already"},
      {kHead + object + "[6040]\n", ":23:", "already defined in line 18"},
      {kHead, ":10:", "[6040]"},
      {kHead + "[6040]\nParameterName=C\nDataType=6\nAccessType=rw\nDefaultValue=0x1G\n", ":22:", "a number"},
      {kHead + "[6040]\nParameterName=C\nDataType=6\nAccessType=rw\nDefaultValue=65536\n", ":22:", "does not fit"},
      {kHead + object + "LowLimit=-0xFFFFFFFFFFFFFFF6\n", ":23:", "a number of 64 bits, found '-0xFFFFFFFFFFFFFFF6'"},
      {kHead + object + "HighLimit=18446744073709551615\n", ":23:", "a number of 64 bits"},
      {kHead + object + "LowLimit=-9223372036854775808\n", ":23:", "-9223372036854775808 does not fit"},
      {kHead + "[6040]\nParameterName=C\nDataType=0x15\nAccessType=rw\nDefaultValue=$NODEID+0x7FFFFFFFFFFFFFFF\n",
       ":22:", "expected at most 9223372036854775680"},
      {kHead + "[6040]\nParameterName=C\nDataType=5\nAccessType=rw\nDefaultValue=$NODEID+129\n", ":22:", "at most 128"},
      {kHead + "[6040]\nParameterName=C\nDataType=0x42\nAccessType=rw\n", ":20:", "data type"},
      {kHead + "[6040]\nParameterName=C\nDataType=6\nAccessType=x\n", ":21:", "ro, wo, rw"},
      {kHead + "[6040]\nParameterName=C\nDataType=6\n", ":18:", "AccessType"},
      {kHead + object + "LowLimit=3\n", ":18:", "DefaultValue: found 0, expected LowLimit 3"},
      {kHead + object + "[6041]\nParameterName=S\n", ":23:", "none of the lists"},
      {kHead + "[6040]\nParameterName=C\nObjectType=8\nSubNumber=2\n[6040sub0]\nParameterName=n\nDataType=5\n"
               "AccessType=ro\n",
       ":21:", "SubNumber: found 2, expected 1"},
      {"[DeviceInfo]\n[MandatoryObjects]\nSupportedObjects=2\n1=0x1000\n", ":2:", "found 2, expected 1"},
      {"[DeviceInfo]\n[MandatoryObjects]\nSupportedObjects=1\n1=0x10\n", ":4:", "an index"},
      {"[MandatoryObjects]\nSupportedObjects=0\n", ":1:", "[DeviceInfo]"},
  };
  for (const Case& one : cases) {
    SCOPED_TRACE(one.text);
    try {
      parse(one.text);
      ADD_FAILURE() << "accepted";
    } catch (const EdsError& error) {
      const std::string what = error.what();
      EXPECT_EQ(what.find(std::string("x.eds") + one.where), 0u) << what;
      EXPECT_NE(what.find(one.reason), std::string::npos) << what;
    }
  }
}

TEST(Eds, TheShippedOnesAreCompiledIn) {
  for (const auto& [built_in, file] :
       {std::pair{driveEds(), "/tandem-drive.eds"}, std::pair{encoderEds(), "/tandem-encoder.eds"}}) {
    const Eds read = loadEds(std::string(EDS_FOLDER) + file);
    ASSERT_EQ(built_in.objects.size(), read.objects.size());
    for (std::size_t k = 0; k < read.objects.size(); ++k) {
      EXPECT_EQ(built_in.objects[k].address, read.objects[k].address);
      EXPECT_EQ(built_in.objects[k].value, read.objects[k].value);
    }
  }
  EXPECT_THROW(loadEds("/nowhere.eds"), std::runtime_error);
}

TEST(ObjectDictionary, ChecksWhatIsWritten) {
  ObjectDictionary dictionary(driveEds(), 5);
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

}  // namespace
}  // namespace tandem::sim::drives
