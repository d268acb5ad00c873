// SPDX-License-Identifier: Apache-2.0
#include "hal/canopen/eds.h"

#include <algorithm>
#include <fstream>
#include <map>

#include "hal/canopen/detail/eds_object.h"
#include "hal/canopen/detail/eds_pdo.h"

namespace tandem::hal::canopen {
namespace {

/// A file of kMostBytes can describe more with CompactSubObj; no device has so many.
constexpr std::size_t kMostObjects = 200'000;
constexpr std::uint16_t kFirstIndex = 0x1000;  // those below are data types

/// The sections of one index.
struct IndexSections {
  const IniSection* main = nullptr;
  const IniSection* names = nullptr;   ///< of the sub-indices of a CompactSubObj
  const IniSection* values = nullptr;  ///< of a DCF
  std::map<std::uint8_t, const IniSection*> subs;

  bool describesObjects() const { return main != nullptr || !subs.empty(); }
  const IniSection& first() const { return main != nullptr ? *main : *subs.begin()->second; }
};

/** Turns sections into objects. */
class EdsReader {
 public:
  EdsReader(const Ini& ini, Eds& eds) : ini_(ini), eds_(eds), objects_(eds.warnings) {}

  void read() {
    readDevice();
    for (const auto& [name, section] : ini_.sections())
      classify(name, section);
    for (const char* list : {"mandatoryobjects", "optionalobjects", "manufacturerobjects"})
      readList(list);
    for (const auto& [index, sections] : indices_) {
      if (!sections.describesObjects())
        continue;
      if (has_lists_ && listed_.count(index) == 0)
        warn(sections.first().line, "[" + sections.first().name + "] is in none of the lists of objects");
      readIndex(index, sections);
    }
    for (const std::uint16_t index : short_pdos_) {
      const auto found = indices_.find(index);
      if (found == indices_.end() || !found->second.describesObjects())
        addShortPdo(index, found == indices_.end() ? IndexSections{} : found->second, pdo_entries_, compact_line_);
    }
    if (!has_lists_)
      warn(1, "found no list of objects (MandatoryObjects, OptionalObjects, ManufacturerObjects)");
    if (eds_.objects.empty())
      throw IniError(eds_.file, 1, "found no object, expected an EDS or DCF file (CiA 306)");
    std::ranges::stable_sort(eds_.warnings, {}, &FileWarning::line);
  }

 private:
  void warn(std::size_t line, const std::string& text) { eds_.warnings.push_back({line, text}); }

  void readDevice() {
    const IniSection* device = ini_.find("deviceinfo");
    if (device == nullptr) {
      warn(1, "found no section [DeviceInfo], which names the vendor and the product");
    } else {
      const auto number = [&](const char* key) { return objects_.number<std::uint32_t>(*device, key); };
      eds_.vendor = number("vendornumber");
      eds_.product_code = number("productnumber");
      eds_.revision = number("revisionnumber");
      if (const IniValue* vendor = device->find("vendornumber"))
        eds_.vendor_line = vendor->line;
      if (const IniValue* vendor = device->find("vendorname")) {
        eds_.vendor_name = vendor->text;
        eds_.vendor_name_line = vendor->line;
      }
      if (const IniValue* product = device->find("productname")) {
        eds_.product = product->text;
        eds_.product_line = product->line;
      }
      readCompactPdos(*device);
    }
    // CiA 306 spells it with one m.
    for (const char* spelling : {"devicecomissioning", "devicecommissioning"}) {
      if (const IniSection* commissioning = ini_.find(spelling))
        readCommissioning(*commissioning);
    }
  }

  void readCompactPdos(const IniSection& device) {
    const auto number = [&](const char* key) { return objects_.number<std::uint32_t>(device, key).value_or(0); };
    compact_pdo_ = number("compactpdo");
    if (compact_pdo_ == 0)
      return;
    // Bits of the smallest object that can be mapped: a PDO has 64.
    if (const std::uint32_t granularity = number("granularity"); granularity >= 1 && granularity <= 64)
      pdo_entries_ = static_cast<int>(64 / granularity);
    const std::uint32_t most = 0x200;
    for (std::uint32_t k = 0; k < std::min(number("nrofrxpdo"), most); ++k)
      short_pdos_.insert({static_cast<std::uint16_t>(0x1400 + k), static_cast<std::uint16_t>(0x1600 + k)});
    for (std::uint32_t k = 0; k < std::min(number("nroftxpdo"), most); ++k)
      short_pdos_.insert({static_cast<std::uint16_t>(0x1800 + k), static_cast<std::uint16_t>(0x1A00 + k)});
    compact_line_ = device.find("compactpdo")->line;
  }

  /// A PDO parameter without sub-indices in the file; those that it has, and the values of a DCF, replace CiA 301's.
  void addShortPdo(std::uint16_t index, const IndexSections& sections, int entries, std::size_t line) {
    for (EdsObject& object : pdoParameter(index, compact_pdo_, entries, line)) {
      const std::string sub = std::to_string(object.address.sub);
      if (const IniValue* value = sections.values == nullptr ? nullptr : sections.values->find(sub))
        objects_.readValue(*value, object);
      if (sections.subs.count(object.address.sub) == 0)
        add(std::move(object));
    }
  }

  void readCommissioning(const IniSection& section) {
    const auto node = objects_.number<std::uint32_t>(section, "nodeid");
    if (node && *node >= 1 && *node <= 127) {
      eds_.node = static_cast<int>(*node);
    } else if (node) {
      warn(section.find("nodeid")->line, "NodeID: found " + std::to_string(*node) + ", expected 1 to 127");
    }
  }

  void classify(const std::string& name, const IniSection& section) {
    const std::string text = name.starts_with("0x") ? name.substr(2) : name;
    const auto index = hexNumber(text.substr(0, 4));
    if (text.size() < 4 || !index || *index < kFirstIndex)
      return;
    const std::string rest = trimmed(text.substr(4));
    const auto sub = rest.starts_with("sub") ? hexNumber(trimmed(rest.substr(3))) : std::nullopt;
    if (!rest.empty() && rest != "name" && rest != "value" && !sub)
      return;
    IndexSections& sections = indices_[static_cast<std::uint16_t>(*index)];
    if (sub && *sub > 0xFF) {
      warn(section.line, "[" + section.name + "]: expected a sub-index up to FF, the section is left out");
    } else if (sub) {
      if (!sections.subs.try_emplace(static_cast<std::uint8_t>(*sub), &section).second)
        warn(section.line, "[" + section.name + "]: there is another section of this sub-index: one is left out");
    } else {
      const IniSection*& place = rest.empty() ? sections.main : rest == "name" ? sections.names : sections.values;
      if (place != nullptr)
        warn(section.line, "[" + section.name + "]: there is another section of this object: one is left out");
      place = &section;
    }
    if (text.size() != name.size())
      warn(section.line, "[" + section.name + "]: expected the index without 0x");
  }

  void readList(const std::string& name) {
    const IniSection* list = ini_.find(name);
    if (list == nullptr)
      return;
    has_lists_ = true;
    std::size_t found = 0;
    for (const auto& [key, value] : list->values) {
      if (key == "supportedobjects")
        continue;
      ++found;
      readListed(*list, value);
    }
    const auto count = objects_.number<std::uint32_t>(*list, "supportedobjects");
    if (count != found)
      warn(list->line, "[" + list->name + "]: SupportedObjects: found " +
                           (count ? std::to_string(*count) : "no number") + ", expected " + std::to_string(found) +
                           ", the number of entries in this section");
  }

  void readListed(const IniSection& list, const IniValue& value) {
    if (value.text.empty())
      return warn(value.line, "[" + list.name + "]: found an entry without an index");
    const auto index = objects_.number<std::uint32_t>(value, "[" + list.name + "]");
    if (!index)
      return;
    if (*index < kFirstIndex || *index > 0xFFFF) {
      warn(value.line, "[" + list.name + "]: found index " + value.text + ", expected 0x1000 to 0xFFFF");
    } else if (const auto number = static_cast<std::uint16_t>(*index); !listed_.insert(number).second) {
      warn(value.line, "object " + value.text + " is listed twice");
    } else if (const auto sections = indices_.find(number);
               short_pdos_.count(number) == 0 && (sections == indices_.end() || !sections->second.describesObjects())) {
      warn(value.line, "object " + value.text + " is listed and has no section: it is left out");
    }
  }

  void readIndex(std::uint16_t index, const IndexSections& sections) {
    const IniSection& first = sections.first();
    if (sections.main == nullptr)
      warn(first.line, "[" + first.name + "] has no section of its index");
    const bool has_type = sections.main != nullptr && sections.main->find("objecttype") != nullptr;
    const auto type = has_type ? objects_.number<std::uint32_t>(*sections.main, "objecttype") : std::nullopt;
    const bool known = !type || *type == kDomainObject || *type == kVar || *type == kArray || *type == kRecord;
    if (!known)
      warn(sections.main->line, "[" + first.name + "]: ObjectType: found " + std::to_string(*type) +
                                    ", expected 0x2 (DOMAIN), 0x7 (VAR), 0x8 (ARRAY) or 0x9 (RECORD)");
    const auto compact =
        sections.main == nullptr ? std::nullopt : objects_.number<std::uint32_t>(*sections.main, "compactsubobj");
    for (const auto& [sub, section] : sections.subs)
      add(objects_.read(*section, {index, sub}));
    const bool has_subs = !sections.subs.empty() && sections.subs.rbegin()->first > 0;
    const bool typed = sections.main != nullptr && sections.main->find("datatype") != nullptr;
    if (isPdoParameter(index) && !has_subs && !typed && (compact.value_or(0) > 0 || compact_pdo_ != 0)) {
      const auto entries = static_cast<int>(std::min<std::uint32_t>(compact.value_or(0), 64));
      addShortPdo(index, sections, entries > 0 ? entries : pdo_entries_, first.line);
    } else if (compact.value_or(0) > 0) {
      readCompact(index, sections, *compact);
    } else if (!sections.subs.empty()) {
      checkSubs(sections, type);
    } else if (type == kArray || type == kRecord) {
      warn(first.line, "[" + first.name + "] has no sub-index");
      if (sections.main->find("datatype") != nullptr)
        add(objects_.read(*sections.main, {index, 0}));
    } else {
      add(objects_.read(*sections.main, {index, 0}));
    }
  }

  void checkSubs(const IndexSections& sections, std::optional<std::uint32_t> type) {
    if (sections.main == nullptr)
      return;
    if (type == kVar)
      warn(sections.main->line, "[" + sections.main->name + "]: ObjectType VAR, and there are sub-indices");
    const auto count = objects_.number<std::uint32_t>(*sections.main, "subnumber");
    if (count != sections.subs.size())
      warn(sections.main->line, "[" + sections.main->name + "]: SubNumber: found " +
                                    (count ? std::to_string(*count) : "no number") + ", expected " +
                                    std::to_string(sections.subs.size()) + ", the number of its sections subN");
  }

  /// Sub-index 0 with their number, and alike ones from 1 on, unless they have sections of their own.
  void readCompact(std::uint16_t index, const IndexSections& sections, std::uint32_t count) {
    const IniSection& main = *sections.main;
    if (count > 0xFE) {
      warn(main.line, "[" + main.name + "]: CompactSubObj: found " + std::to_string(count) + ", expected up to 254");
      count = 0xFE;
    }
    EdsObject object = objects_.read(main, {index, 0});
    const std::string name = object.name;
    for (std::uint32_t sub = 1; sub <= count; ++sub) {
      object.address.sub = static_cast<std::uint8_t>(sub);
      const IniValue* own = sections.names == nullptr ? nullptr : sections.names->find(std::to_string(sub));
      object.name = own == nullptr ? name + " " + std::to_string(sub) : own->text;
      EdsObject configured = object;
      if (const IniValue* value = sections.values == nullptr ? nullptr : sections.values->find(std::to_string(sub)))
        objects_.readValue(*value, configured);
      if (sections.subs.count(object.address.sub) == 0)
        add(std::move(configured));
    }
    if (sections.subs.count(0) == 0) {
      EdsObject number;
      number.address = {index, 0};
      number.name = "Number of entries";
      number.type = DataType::kUnsigned8;
      number.value = count;
      number.has_value = true;
      number.line = main.line;
      add(std::move(number));
    }
  }

  void add(EdsObject object) {
    if (eds_.objects.size() >= kMostObjects)
      throw IniError(eds_.file, object.line, "more than " + std::to_string(kMostObjects) + " objects");
    eds_.objects.push_back(std::move(object));
  }

  static constexpr std::uint32_t kDomainObject = 2, kVar = 7, kArray = 8, kRecord = 9;

  const Ini& ini_;
  Eds& eds_;
  EdsObjectReader objects_;
  std::map<std::uint16_t, IndexSections> indices_;
  std::set<std::uint16_t> listed_;
  bool has_lists_ = false;
  std::uint32_t compact_pdo_ = 0;  ///< sub-indices of PDOs that the file states in short, by CompactPDO
  std::size_t compact_line_ = 0;
  int pdo_entries_ = 8;                 ///< of their mapping
  std::set<std::uint16_t> short_pdos_;  ///< their indices
};

}  // namespace

const EdsObject* Eds::find(ObjectAddress address) const {
  const auto found = std::ranges::lower_bound(objects, address, {}, &EdsObject::address);
  return found != objects.end() && found->address == address ? &*found : nullptr;
}

bool Eds::hasIndex(std::uint16_t index) const {
  const auto found = std::ranges::lower_bound(objects, ObjectAddress{index, 0}, {}, &EdsObject::address);
  return found != objects.end() && found->address.index == index;
}

std::string describe(const Eds& eds, const FileWarning& warning) {
  return eds.file + ":" + std::to_string(warning.line) + ": " + warning.text;
}

Eds parseEds(std::istream& in, const std::string& file) {
  Eds eds;
  eds.file = file;
  const Ini ini(in, file, eds.warnings);
  EdsReader(ini, eds).read();
  std::ranges::sort(eds.objects, {}, &EdsObject::address);
  return eds;
}

Eds loadEds(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in)
    throw std::runtime_error(path + ": cannot be opened");
  return parseEds(in, path);
}

}  // namespace tandem::hal::canopen
