// SPDX-License-Identifier: Apache-2.0
/** @file Data sheets as vendors write them: what is odd becomes a warning with its line, and reading goes on. */
#include "hal/canopen/eds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <random>
#include <sstream>
#include <tuple>

namespace tandem::hal::canopen {
namespace {

const std::string kHead =
    "[DeviceInfo]\nProductName=X\n\n[MandatoryObjects]\nSupportedObjects=1\n1=0x1000\n\n"            // lines 1 to 7
    "[OptionalObjects]\nSupportedObjects=1\n1=0x6040\n\n"                                            // 8 to 11
    "[1000]\nParameterName=Type\nDataType=7\nAccessType=ro\nDefaultValue=0x20192\n\n";               // 12 to 17
const std::string kObject = "[6040]\nParameterName=C\nDataType=6\nAccessType=rw\nDefaultValue=0\n";  // 18 to 22

Eds parse(const std::string& text) {
  std::istringstream in(text);
  return parseEds(in, "x.eds");
}

/// A sheet with object 6040 of this type, with these further lines from line 21 on.
Eds parseObject(const std::string& type, const std::string& lines) {
  return parse(kHead + "[6040]\nParameterName=C\nDataType=" + type + "\n" + lines);
}

const EdsObject& object(const Eds& eds, ObjectAddress address = {0x6040, 0}) {
  const EdsObject* found = eds.find(address);
  if (found == nullptr)
    throw std::runtime_error("no object " + describe(address));
  return *found;
}

std::string all(const Eds& eds) {
  std::string text;
  for (const FileWarning& warning : eds.warnings)
    text += describe(eds, warning) + "\n";
  return text;
}

TEST(Eds, ReadsObjects) {
  const Eds eds =
      parseObject("0x0003", "AccessType=rww\nDefaultValue=0xFFFE\nLowLimit=-5\nHighLimit=7\nPDOMapping=1\n");
  EXPECT_EQ(all(eds), "");
  ASSERT_EQ(eds.objects.size(), 2u);
  EXPECT_EQ(eds.objects[0].value, 0x20192);
  const EdsObject& word = eds.objects[1];
  EXPECT_EQ(word.name, "C");
  EXPECT_EQ(word.type, DataType::kInteger16);
  EXPECT_EQ(word.access, Access::kReadWrite);
  EXPECT_EQ(word.value, -2) << "two's complement";
  EXPECT_TRUE(word.has_value);
  EXPECT_EQ(word.low, -5);
  EXPECT_EQ(word.high, 7);
  EXPECT_TRUE(word.mappable);
}

TEST(Eds, ReadsTheDevice) {
  const Eds eds = parse("[DeviceInfo]\nVendorName=V\nVendorNumber=0xFB\nProductNumber=0X6055FFFF\nRevisionNumber=23\n" +
                        kHead.substr(kHead.find("ProductName")) + kObject);
  EXPECT_EQ(all(eds), "");
  EXPECT_EQ(eds.vendor_name, "V");
  EXPECT_EQ(eds.vendor, 0xFBu);
  EXPECT_EQ(eds.product_code, 0x6055FFFFu);
  EXPECT_EQ(eds.revision, 23u);
}

struct Odd {
  std::string text;
  std::size_t line;
  std::string warning;
};

void expectWarnings(const std::vector<Odd>& cases) {
  for (const Odd& odd : cases) {
    SCOPED_TRACE(odd.text);
    const Eds eds = parse(odd.text);
    const bool found = std::ranges::any_of(eds.warnings, [&](const FileWarning& warning) {
      return warning.line == odd.line && warning.text.find(odd.warning) != std::string::npos;
    });
    EXPECT_TRUE(found) << "expected line " << odd.line << ": " << odd.warning << "\nfound:\n" << all(eds);
    EXPECT_NE(eds.find({0x1000, 0}), nullptr) << "reading goes on";
  }
}

TEST(Eds, WarnsOfAnOddFileAndGoesOn) {
  expectWarnings({
      {kHead + kObject + "nonsense\n", 23, "KEY=VALUE, found 'nonsense'"},
      {kHead + kObject + "DataType=5\n", 23, "'DataType' is in this section already, in line 20"},
      {kHead + kObject + "[6040]\nDataType=5\n", 23, "already defined in line 18"},
      {kHead + "[6040\nParameterName=C\nDataType=6\nAccessType=rw\n", 18, "expected ']'"},
      {kHead + kObject + "[Comments] x\n", 23, "found 'x' after the name"},
      {"a=1\n" + kHead + kObject, 1, "before the first [section]"},
      {"\xEF\xBB\xBF" + kHead + kObject, 1, "byte order mark"},
      {kHead + kObject + "\x1A", 23, "control Z"},
      {kHead + std::string("\0", 1) + kObject, 18, "NUL"},
      {kHead + "[6040]\nParameterName=\xB0/s\nDataType=6\nAccessType=rw\n", 19, "Latin-1"},
      {kHead.substr(kHead.find("[Mandatory")) + kObject, 1, "no section [DeviceInfo]"},
      {kHead, 10, "listed and has no section"},
      {kHead + kObject + "[6041]\nParameterName=S\nDataType=6\nAccessType=ro\n", 23, "none of the lists"},
      {kHead + kObject + "[ManufacturerObjects]\nSupportedObjects=2\n1=0x6040\n", 23,
       "SupportedObjects: found 2, expected 1"},
      {kHead + kObject + "[ManufacturerObjects]\nSupportedObjects=1\n1=0x6040\n", 25, "listed twice"},
      {kHead + kObject + "[ManufacturerObjects]\nSupportedObjects=1\n1=0x10\n", 25, "expected 0x1000 to 0xFFFF"},
      {kHead + kObject + "[ManufacturerObjects]\nSupportedObjects=1\n1=x\n", 25, "expected a number"},
      {kHead + "[6040]\nParameterName=C\nObjectType=8\nSubNumber=2\n[6040sub0]\nParameterName=n\nDataType=5\n"
               "AccessType=ro\n",
       18, "SubNumber: found 2, expected 1"},
      {kHead + "[6040sub0]\nParameterName=n\nDataType=5\nAccessType=ro\n", 18, "no section of its index"},
      {kHead + "[6040]\nParameterName=C\nObjectType=9\nSubNumber=0\n", 18, "no sub-index"},
      {kHead + "[6040]\nParameterName=C\nObjectType=4\nDataType=6\nAccessType=rw\n", 18, "expected 0x2 (DOMAIN), 0x7"},
      {kHead + "[0x6040]\nParameterName=C\nDataType=6\nAccessType=rw\n", 18, "without 0x"},
  });
}

TEST(Eds, WarnsOfAnOddObjectAndGoesOn) {
  const std::string begin = kHead + "[6040]\nParameterName=C\nDataType=6\n";
  expectWarnings({
      {kHead + "[6040]\nDataType=6\nAccessType=rw\n", 18, "expected ParameterName"},
      {kHead + "[6040]\nParameterName=C\nAccessType=rw\n", 18, "expected DataType: read as DOMAIN"},
      {kHead + "[6040]\nParameterName=C\nDataType=0x42\nAccessType=rw\n", 20, "data type 0x42 is unknown"},
      {begin, 18, "expected AccessType"},
      {begin + "AccessType=x\n", 21, "found 'x', expected AccessType ro, wo, rw"},
      {begin + "AccessType=rw\nDefaultValue=0x1G\n", 22, "found '0x1G', expected a number"},
      {begin + "AccessType=rw\nDefaultValue=65536\n", 22, "does not fit UNSIGNED16"},
      {begin + "AccessType=rw\nDefaultValue=0x5 ; rpm\n", 22, "'; rpm' counts as a comment"},
      {begin + "AccessType=rw ; both\n", 21, "'; both' counts as a comment"},
      {begin + "AccessType=rw\nDefaultValue=010\n", 22, "read as octal (CiA 306): 8, not 10"},
      {begin + "AccessType=rw\nDefaultValue=09\n", 22, "read as decimal"},
      {begin + "AccessType=rw\nDefaultValue=9\nLowLimit=1\nHighLimit=8\n", 18,
       "found the value 9 outside its limits, 1 to 8"},
      {begin + "AccessType=rw\nLowLimit=3\n", 18, "a simulated device starts with 3"},
      {begin + "AccessType=rw\nLowLimit=8\nHighLimit=1\n", 18, "LowLimit is above HighLimit"},
      {begin + "AccessType=rw\nHighLimit=0x1FFFF\n", 22, "which no UNSIGNED16 reaches"},
      {begin + "AccessType=rw\nDefaultValue=$NODEID+0xFFFF\n", 22, "does not fit UNSIGNED16"},
      {begin + "AccessType=rw\nDefaultValue=NODEID+1\n", 22, "without '$'"},
      {kHead + "[6040]\nParameterName=C\nDataType=8\nAccessType=rw\nDefaultValue=x\n", 22, "expected a REAL32"},
  });
}

TEST(Eds, WhatIsNoDataSheetIsAnError) {
  for (const auto& [text, reason] : {std::pair<std::string, const char*>{"", "no [section]"},
                                     {"%PDF-1.4\nx", "no [section]"},
                                     {"[DeviceInfo]\nProductName=X\n", "no object"},
                                     {"\xFF\xFE[", "UTF-16"},
                                     {std::string(Ini::kMostBytes + 1, ' '), "8 MiB"}}) {
    try {
      parse(text);
      ADD_FAILURE() << reason;
    } catch (const IniError& error) {
      EXPECT_EQ(std::string(error.what()).find("x.eds:1: "), 0u) << error.what();
      EXPECT_NE(std::string(error.what()).find(reason), std::string::npos) << error.what();
    }
  }
  EXPECT_THROW(loadEds("/nowhere.eds"), std::runtime_error);
}

TEST(Eds, OddTextDoesNotChangeWhatIsRead) {
  const Eds eds = parse(
      "\xEF\xBB\xBF[DEVICEINFO] \r\nproductname = X\xB0 \r\n[mandatoryobjects]\r\nsupportedobjects=0x1\r\n1=0X6065\r\n"
      "[6065]\r\nPARAMETERNAME=Window\r\nObjectType=0X7\r\ndatatype=0X0007 ; u32\r\nACCESSTYPE=RW\r\n"
      "DefaultValue=0XaB \t\r\nPDOMapping=0x1\r\n\x1A");
  EXPECT_EQ(eds.product, "X\xC2\xB0");
  EXPECT_EQ(object(eds, {0x6065, 0}).value, 0xAB);
  EXPECT_EQ(object(eds, {0x6065, 0}).access, Access::kReadWrite);
  EXPECT_TRUE(object(eds, {0x6065, 0}).mappable);
  EXPECT_EQ(eds.warnings.size(), 4u) << all(eds);
}

TEST(Eds, HasTheTypesOfCia301) {
  const std::pair<const char*, int> types[] = {{"1", 1},    {"2", 1},    {"3", 2},    {"4", 4},    {"5", 1},
                                               {"6", 2},    {"7", 4},    {"8", 4},    {"9", 0},    {"0xA", 0},
                                               {"0xB", 0},  {"0xC", 6},  {"0xD", 6},  {"0xF", 0},  {"0x10", 3},
                                               {"0x11", 8}, {"0x12", 5}, {"0x13", 6}, {"0x14", 7}, {"0x15", 8},
                                               {"0x16", 3}, {"0x18", 5}, {"0x19", 6}, {"0x1A", 7}, {"0x1B", 8}};
  for (const auto& [type, size] : types) {
    const Eds eds = parseObject(type, "AccessType=rw\n");
    EXPECT_EQ(all(eds), "") << type;
    EXPECT_EQ(sizeOf(object(eds).type), size) << type;
    EXPECT_FALSE(object(eds).has_value);
  }
  EXPECT_EQ(object(parseObject("8", "AccessType=rw\nDefaultValue=1.5\n")).value, std::bit_cast<std::int32_t>(1.5f));
  EXPECT_EQ(object(parseObject("0x11", "AccessType=rw\nDefaultValue=-2e3\n")).value, std::bit_cast<std::int64_t>(-2e3));
  EXPECT_EQ(object(parseObject("0x10", "AccessType=rw\nDefaultValue=0xFFFFFF\n")).value, -1);
  EXPECT_EQ(object(parseObject("0x1B", "AccessType=rw\nDefaultValue=0xFFFFFFFFFFFFFFFF\n")).value, -1) << "bits";
}

TEST(Eds, AddsTheNodeIdInEitherOrderAndCase) {
  for (const char* text : {"$NODEID+0x200", "0x200+$NODEID", "$nodeid + 0X200", "512 + $NodeId", "0x200 +$NODEID"}) {
    const EdsObject word = object(parseObject("7", "AccessType=rw\nDefaultValue=" + std::string(text) + "\n"));
    EXPECT_EQ(word.valueAt(5), 0x205) << text;
  }
  EXPECT_EQ(object(parseObject("7", "AccessType=rw\nDefaultValue=$NODEID\n")).valueAt(7), 7);
}

/// [DeviceInfo] alone states the PDOs (CiA 306-1, CompactPDO), for random numbers and sub-indices of them.
TEST(Eds, ExpandsCompactPdo) {
  std::mt19937 random(20261127);
  for (int k = 0; k < 200; ++k) {
    const unsigned mask = 1 + random() % 63, receive = random() % 10, transmit = random() % 10;
    const unsigned granularity = 1u << random() % 7;
    SCOPED_TRACE("run " + std::to_string(k) + ", mask " + std::to_string(mask));
    const std::string text = "[DeviceInfo]\nProductName=X\nCompactPDO=" + std::to_string(mask) +
                             "\nNrOfRXPDO=" + std::to_string(receive) + "\nNrOfTXPDO=" + std::to_string(transmit) +
                             "\nGranularity=" + std::to_string(granularity) + "\n" +
                             kHead.substr(kHead.find("[Mandatory"));
    const Eds eds = parse(text + kObject);
    EXPECT_EQ(all(eds), "");
    for (unsigned pdo = 0; pdo < 12; ++pdo) {
      for (const auto& [base, id, count] :
           {std::tuple{0x1400u, 0x200u, receive}, std::tuple{0x1800u, 0x180u, transmit}}) {
        const auto index = static_cast<std::uint16_t>(base + pdo), mapping = static_cast<std::uint16_t>(index + 0x200);
        ASSERT_EQ(eds.hasIndex(index), pdo < count);
        ASSERT_EQ(eds.hasIndex(mapping), pdo < count);
        if (pdo >= count)
          continue;
        for (std::uint8_t sub = 1; sub <= 7; ++sub)
          EXPECT_EQ(eds.find({index, sub}) != nullptr, (mask >> (sub - 1) & 1) != 0) << int{sub};
        EXPECT_EQ(object(eds, {index, 0}).value, static_cast<std::int64_t>(std::bit_width(mask)));
        if ((mask & 1) != 0) {
          EXPECT_EQ(object(eds, {index, 1}).valueAt(5), pdo < 4 ? id + 0x100 * pdo + 5 : 0x80000000u);
        }
        if ((mask & 16) != 0) {
          EXPECT_EQ(object(eds, {index, 5}).type, DataType::kUnsigned16);
        }
        EXPECT_EQ(object(eds, {mapping, 0}).high, 64 / granularity);
        EXPECT_EQ(object(eds, {mapping, static_cast<std::uint8_t>(64 / granularity)}).type, DataType::kUnsigned32);
        EXPECT_EQ(eds.find({mapping, static_cast<std::uint8_t>(64 / granularity + 1)}), nullptr);
      }
    }
  }
}

/// Sections of a PDO, in part or in short, go before CompactPDO.
TEST(Eds, KeepsThePdoParametersOfSections) {
  const std::string text = "[DeviceInfo]\nProductName=X\nCompactPDO=0x13\nNrOfRXPDO=2\nNrOfTXPDO=1\n" +
                           kHead.substr(kHead.find("[Mandatory"));
  const Eds eds = parse(text + kObject +
                        "[1400]\nParameterName=R\nObjectType=9\nSubNumber=2\n"
                        "[1400sub0]\nParameterName=N\nDataType=5\nAccessType=ro\nDefaultValue=1\n"
                        "[1400sub1]\nParameterName=Id\nDataType=7\nAccessType=rw\nDefaultValue=0x321\n"
                        "[1401]\nParameterName=R\nObjectType=9\nSubNumber=1\n"
                        "[1401Value]\nNrOfEntries=1\n2=1\n"
                        "[1600]\nParameterName=M\nObjectType=9\nSubNumber=3\nCompactSubObj=2\n");
  EXPECT_EQ(object(eds, {0x1400, 1}).value, 0x321);
  EXPECT_EQ(eds.find({0x1400, 2}), nullptr) << "its sections are complete";
  EXPECT_EQ(object(eds, {0x1401, 2}).value, 1) << "value of a DCF";
  EXPECT_EQ(object(eds, {0x1401, 1}).valueAt(3), 0x303);
  EXPECT_EQ(object(eds, {0x1600, 2}).type, DataType::kUnsigned32) << "without DataType: that of CiA 301";
  EXPECT_EQ(eds.find({0x1600, 3}), nullptr);
  EXPECT_TRUE(eds.hasIndex(0x1A00));
  EXPECT_EQ(all(eds).find("DOMAIN"), std::string::npos) << all(eds);
}

TEST(Eds, ExpandsCompactSubObj) {
  const Eds eds = parseObject("7",
                              "AccessType=rw\nObjectType=8\nDefaultValue=9\nCompactSubObj=3\nPDOMapping=1\n"
                              "[6040Name]\nNrOfEntries=1\n2=Second\n"
                              "[6040Value]\nNrOfEntries=1\n3=77\n"
                              "[6040sub1]\nParameterName=Own\nDataType=5\nAccessType=ro\nDefaultValue=1\n");
  EXPECT_EQ(all(eds), "");
  ASSERT_EQ(eds.objects.size(), 5u);
  EXPECT_EQ(object(eds).value, 3);
  EXPECT_EQ(object(eds).type, DataType::kUnsigned8);
  EXPECT_EQ(object(eds, {0x6040, 1}).name, "Own");
  EXPECT_EQ(object(eds, {0x6040, 2}).name, "Second");
  EXPECT_EQ(object(eds, {0x6040, 2}).value, 9);
  EXPECT_EQ(object(eds, {0x6040, 2}).access, Access::kReadWrite);
  EXPECT_EQ(object(eds, {0x6040, 3}).name, "C 3");
  EXPECT_EQ(object(eds, {0x6040, 3}).value, 77);
}

TEST(Eds, ReadsTheValuesOfADcf) {
  const Eds eds = parse(kHead + kObject +
                        "ParameterValue=$NODEID+0x10\nUploadFile=a.bin\nDenotation=mine\nParamRefd=0\n"
                        "[DeviceComissioning]\nNodeID=0x05\nBaudrate=1000\n");
  EXPECT_EQ(all(eds), "");
  EXPECT_EQ(eds.node, 5);
  EXPECT_EQ(object(eds).valueAt(5), 0x15);
}

/// Numbers of each type, in each spelling.
TEST(Eds, ReadsBackNumbers) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937_64 random(seed);
  for (int k = 0; k < 300; ++k) {
    const auto type = std::array{DataType::kInteger8,   DataType::kInteger16,  DataType::kInteger24,
                                 DataType::kInteger32,  DataType::kInteger56,  DataType::kUnsigned8,
                                 DataType::kUnsigned24, DataType::kUnsigned32, DataType::kUnsigned48}[random() % 9];
    const int bits = 8 * sizeOf(type);
    const std::uint64_t raw = random() & ((std::uint64_t{1} << bits) - 1);
    const bool negative = isSigned(type) && (raw >> (bits - 1)) != 0;
    const auto value = static_cast<std::int64_t>(raw) - (negative ? std::int64_t{1} << bits : 0);
    char hex[32];
    std::snprintf(hex, sizeof hex, random() % 2 == 0 ? "0x%llX" : "0X%llx", static_cast<unsigned long long>(raw));
    const std::string text = random() % 2 == 0 ? hex : std::to_string(value);
    const Eds eds = parseObject(std::to_string(static_cast<int>(type)), "AccessType=rw\nDefaultValue=" + text + "\n");
    ASSERT_EQ(object(eds).value, value) << text << " as " << name(type);
    ASSERT_EQ(all(eds), "") << text;
  }
}

/// A vendor's file with bytes changed, removed and doubled: objects are sorted, limits in order, warnings have lines.
TEST(Eds, SurvivesDamage) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  const std::string sheet = kHead + kObject +
                            "[6065]\nParameterName=W\nObjectType=8\nCompactSubObj=4\nDataType=4\n"
                            "AccessType=rw\nLowLimit=-4\nHighLimit=0x7\nDefaultValue=$NODEID+1\n";
  for (int k = 0; k < 2000; ++k) {
    std::string text = sheet;
    for (unsigned n = random() % 8; n-- > 0;) {
      const std::size_t at = random() % text.size();
      switch (random() % 3) {
        case 0:
          text[at] = static_cast<char>(random());
          break;
        case 1:
          text.erase(at, random() % 20);
          break;
        default:
          text.insert(at, text.substr(random() % text.size(), random() % 40));
      }
      if (text.empty())
        text = "[";
    }
    try {
      const Eds eds = parse(text);
      const auto lines =
          static_cast<std::size_t>(1 + std::ranges::count_if(text, [](char c) { return c == '\n' || c == '\r'; }));
      for (std::size_t i = 0; i < eds.objects.size(); ++i) {
        ASSERT_TRUE(i == 0 || eds.objects[i - 1].address < eds.objects[i].address) << text;
        ASSERT_TRUE(!eds.objects[i].low || !eds.objects[i].high || *eds.objects[i].low <= *eds.objects[i].high) << text;
      }
      for (const FileWarning& warning : eds.warnings)
        ASSERT_TRUE(warning.line >= 1 && warning.line <= lines) << describe(eds, warning) << "\n" << text;
    } catch (const IniError& error) {
      ASSERT_EQ(std::string(error.what()).find("x.eds:"), 0u);
    }
  }
}

}  // namespace
}  // namespace tandem::hal::canopen
