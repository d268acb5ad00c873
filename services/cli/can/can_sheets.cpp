// SPDX-License-Identifier: Apache-2.0
/** @file tandem can compare and dump: all objects of a node, beside its data sheet. */
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <iostream>
#include <nlohmann/json.hpp>

#include "hal/canopen/bytes.h"
#include "services/cli/can/sheet.h"

namespace tandem::cli {
namespace {

using hal::canopen::Eds;
using hal::canopen::EdsObject;
using hal::canopen::ObjectAddress;
using hal::canopen::SdoAbort;
using Json = nlohmann::ordered_json;
using Bytes = std::vector<std::uint8_t>;

/** How far a run over many objects is: a line that changes on a terminal, otherwise a line per tenth. */
class ReadProgress {
 public:
  explicit ReadProgress(std::size_t total) : total_(std::max<std::size_t>(total, 1)) {}
  ~ReadProgress() {
    if (terminal_)
      std::cerr << "\r\033[K";
  }
  ReadProgress(const ReadProgress&) = delete;
  ReadProgress& operator=(const ReadProgress&) = delete;

  void at(std::size_t done, const ObjectAddress& object, std::size_t found) {
    const std::size_t percent = 100 * done / total_;
    if (percent / step_ == shown_)
      return;
    shown_ = percent / step_;
    std::cerr << (terminal_ ? "\r" : "") << percent << " %, object " << describe(object) << ", " << found << " read"
              << (terminal_ ? "  " : "\n") << std::flush;
  }

 private:
  const bool terminal_ = isatty(STDERR_FILENO) != 0;
  const std::size_t step_ = terminal_ ? 1 : 10;
  std::size_t total_, shown_ = 0;
};

/** Differences between a data sheet and a node. */
class Comparison {
 public:
  Comparison(const CanOptions& options, const Eds& sheet, CanTool& tool, int node)
      : options_(options), sheet_(sheet), tool_(tool), node_(node) {}

  int run() {
    compareIdentity();
    {
      ReadProgress progress(sheet_.objects.size());
      for (std::size_t k = 0; k < sheet_.objects.size(); ++k) {
        compare(sheet_.objects[k]);
        progress.at(k, sheet_.objects[k].address, k + 1 - missing_);
      }
    }
    if (options_.json) {
      std::cout << Json{{"node", node_},
                        {"sheet", sheet_.file},
                        {"objects", sheet_.objects.size()},
                        {"warnings", sheet_.warnings.size()},
                        {"differences", differences_},
                        {"values", values_}}
                       .dump(2)
                << '\n';
    } else {
      print("difference", differences_);
      print("value", values_);
      std::cout << sheet_.objects.size() << " objects, " << differences_.size() << " differences, " << values_.size()
                << " values that are not the default\n";
    }
    return differences_.empty() ? kOk : kFailure;
  }

 private:
  static void print(const char* kind, const Json& entries) {
    for (const Json& entry : entries)
      std::cout << kind << ": " << entry["object"].get<std::string>() << " " << entry["name"].get<std::string>() << ": "
                << entry["text"].get<std::string>() << '\n';
  }
  void add(Json& to, const EdsObject& object, const char* kind, const std::string& text) const {
    to.push_back({{"object", describe(object.address)}, {"name", object.name}, {"kind", kind}, {"text", text}});
  }

  void compareIdentity() {
    const auto check = [&](std::uint8_t sub, const char* what, std::optional<std::uint32_t> number) {
      EdsObject object;
      object.address = {0x1018, sub};
      object.name = what;
      Bytes data;
      if (!number || *number == 0 || tool_.tryRead(node_, object.address, data) != SdoAbort::kNone)
        return;
      const auto found = static_cast<std::uint32_t>(hal::canopen::fromBytes(data));
      if (found != *number)
        add(differences_, object, "identity",
            "the node has " + std::to_string(found) + ", [DeviceInfo] has " + std::to_string(*number) +
                ": the sheet may be of another device");
    };
    check(1, "vendor", sheet_.vendor);
    check(2, "product code", sheet_.product_code);
    check(3, "revision", sheet_.revision);
  }

  void compare(const EdsObject& object) {
    Bytes data;
    const SdoAbort abort = tool_.tryRead(node_, object.address, data);
    if (abort == SdoAbort::kNoObject || abort == SdoAbort::kNoSubIndex) {
      ++missing_;
      add(differences_, object, "missing", "the node does not have it");
    } else if (abort != SdoAbort::kNone) {
      if (readable(object.access))
        add(differences_, object, "access",
            "the node refuses to read it (" + describe(abort) + "), the sheet says " +
                std::string(name(object.access)));
    } else if (!readable(object.access)) {
      add(differences_, object, "access", "the node permits to read it, the sheet says wo");
    } else if (const int size = sizeOf(object.type); size > 0 && data.size() != static_cast<std::size_t>(size)) {
      add(differences_, object, "size",
          "the node has " + std::to_string(data.size()) + " bytes, the sheet " + std::string(name(object.type)));
    } else {
      compareValue(object, data);
    }
  }

  void compareValue(const EdsObject& object, const Bytes& data) {
    if (!object.has_value || data.empty())
      return;
    if (sizeOf(object.type) == 0) {
      const std::string text(data.begin(), data.end());
      if (object.type == hal::canopen::DataType::kVisibleString && text != object.text)
        add(values_, object, "value", valueText(data, object.type) + ", default \"" + object.text + "\"");
      return;
    }
    Bytes by_default(data.size());
    hal::canopen::toBytes(static_cast<std::uint64_t>(object.valueAt(node_)), by_default);
    if (data == by_default)
      return;
    // What a product is, and no setting: not the serial number.
    constexpr std::uint16_t kIdentity = 0x1018;
    constexpr int kLastFixed = 3;
    const bool identity = object.address.index == kIdentity && object.address.sub >= 1 &&
                          object.address.sub <= kLastFixed && !writable(object.access) && object.value != 0;
    if (identity)
      add(differences_, object, "identity",
          "the node has " + valueText(data, object.type) + ", the sheet " + valueText(by_default, object.type) +
              ": it is of another device");
    else
      add(values_, object, "value", valueText(data, object.type) + ", default " + valueText(by_default, object.type));
  }

  const CanOptions& options_;
  const Eds& sheet_;
  CanTool& tool_;
  int node_;
  std::size_t missing_ = 0;
  Json differences_ = Json::array(), values_ = Json::array();
};

int compareSheet(const CanOptions& options) {
  const int node = parseNode(options.node);
  const Eds sheet = loadSheet(options.file);
  printWarnings(sheet, 5);
  CanTool tool(options);
  tool.refuseBesideMaster();
  return Comparison(options, sheet, tool, node).run();
}

/** Writes the objects that a node lets read. */
class Dump {
 public:
  Dump(const CanOptions& options, const Eds& sheet, CanTool& tool, int node)
      : options_(options), sheet_(sheet), tool_(tool), node_(node) {}

  /// The objects of the data sheet.
  void readSheet() {
    ReadProgress progress(sheet_.objects.size());
    for (std::size_t k = 0; k < sheet_.objects.size(); ++k) {
      read(sheet_.objects[k].address);
      progress.at(k, sheet_.objects[k].address, found_);
    }
  }

  /// Every index, and its sub-indices.
  void readRange(std::uint16_t first, std::uint16_t last) {
    ReadProgress progress(last - first + 1u);
    for (std::uint32_t index = first; index <= last; ++index) {
      const ObjectAddress object{static_cast<std::uint16_t>(index), 0};
      Bytes data;
      const SdoAbort abort = read(object, &data);
      // Sub-index 0 counts the others; of 1003 it counts errors.
      const bool may_have_subs = abort != SdoAbort::kNoObject && data.size() <= 1;
      const int count = data.size() == 1 ? data[0] : abort == SdoAbort::kNoSubIndex ? kMostSubs : 0;
      for (int sub = 1; may_have_subs && sub <= kMostSubs; ++sub) {
        if (read({object.index, static_cast<std::uint8_t>(sub)}) != SdoAbort::kNone && sub >= count)
          break;
      }
      progress.at(index - first, object, found_);
    }
  }

  int finish() const {
    if (options_.json)
      std::cout << json_.dump(2) << '\n';
    std::cerr << found_ << " objects read\n";
    return found_ > 0 ? kOk : kFailure;
  }

 private:
  static constexpr int kMostSubs = 0xFE;

  SdoAbort read(ObjectAddress address, Bytes* value = nullptr) {
    Bytes data;
    const SdoAbort abort = tool_.tryRead(node_, address, data);
    if (abort == SdoAbort::kNone) {
      ++found_;
      show(address, data);
    }
    if (value != nullptr)
      *value = data;
    return abort;
  }

  void show(ObjectAddress address, const Bytes& data) {
    const EdsObject* object = sheet_.find(address);
    if (options_.json) {
      Json entry{{"object", describe(address)}};
      if (object != nullptr)
        entry.update({{"name", object->name}, {"type", name(object->type)}, {"access", name(object->access)}});
      entry.update(valueJson(data, typeIn(sheet_, address)));
      json_.push_back(entry);
    } else {
      const std::string about = object == nullptr ? ""
                                                  : " " + object->name + " [" + std::string(name(object->type)) + " " +
                                                        std::string(name(object->access)) + "]";
      std::cout << describe(address) << about << " = " << valueText(data, typeIn(sheet_, address)) << '\n';
    }
  }

  const CanOptions& options_;
  const Eds& sheet_;
  CanTool& tool_;
  int node_;
  std::size_t found_ = 0;
  Json json_ = Json::array();
};

int dump(const CanOptions& options) {
  const int node = parseNode(options.node);
  const std::uint16_t first = parseObject(options.first).index, last = parseObject(options.last).index;
  if (first > last)
    throw Failure(kUsage, "--first " + options.first + " is above --last " + options.last);
  const Eds sheet = options.eds.empty() ? Eds{} : loadSheet(options.eds);
  printWarnings(sheet, 5);
  CanTool tool(options);
  tool.refuseBesideMaster();
  Dump output(options, sheet, tool, node);
  if (options.eds.empty()) {
    output.readRange(first, last);
  } else {
    output.readSheet();
  }
  return output.finish();
}

}  // namespace

void registerCanSheets(CLI::App& can, const std::shared_ptr<CanOptions>& options, int& exit_code) {
  CLI::App* comparison =
      addCanCommand(can, options, exit_code, "compare",
                    "compare a data sheet (EDS or DCF) with a node: objects, sizes, values", compareSheet);
  comparison->add_option("file", options->file, "EDS or DCF file")->required();
  comparison->add_option("node", options->node, "1 to 127")->required();
  comparison->footer(
      "Reads every object of the data sheet and writes nothing: whether an object can be written is not tried.\n"
      "Exit code 0: no difference; 1: objects that are missing, or have another size or access. Values that are not\n"
      "the default are information.");
  CLI::App* all = addCanCommand(can, options, exit_code, "dump", "read all objects of a node, by SDO", dump);
  all->add_option("node", options->node, "1 to 127")->required();
  all->add_option("--eds", options->eds, "data sheet: read its objects, with their names (default: try every index)");
  all->add_option("--first", options->first, "first index without --eds, hexadecimal")->capture_default_str();
  all->add_option("--last", options->last, "last index without --eds, hexadecimal")->capture_default_str();
  all->footer(
      "Trying every index takes some minutes on a real bus. Reading changes nothing in most drives; a few clear\n"
      "an object, e.g. an error counter, when it is read.");
}

}  // namespace tandem::cli
