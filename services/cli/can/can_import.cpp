// SPDX-License-Identifier: Apache-2.0
/** @file tandem can import: what a data sheet promises of a drive as an axis, and the axis for the hardware file. */
#include <algorithm>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <set>

#include "config/axis_block.h"
#include "config/config.h"
#include "hal/canopen/bytes.h"
#include "services/cli/can/import_axis.h"
#include "services/cli/can/sheet.h"

namespace tandem::cli {
namespace {

using hal::SheetCheck;
using hal::SheetFinding;
using hal::canopen::Eds;
using hal::canopen::EdsObject;
using hal::canopen::SetupStep;
using Json = nlohmann::ordered_json;
using SheetVerdict = SheetFinding::Verdict;

/// The HAL boots the drive if the hardware file accepts the protections that it lacks.
constexpr int kNeedsAcceptance = 3;

struct ImportOptions {
  std::string file, hardware = "ark2024-two-buses", axis, mode, out;
  int node = 0;
  bool json = false, force = false;
};

/// What is to be imported: the sheet, and the axis that the drive shall become.
struct Import {
  Eds sheet;
  std::filesystem::path hardware_file;
  hal::HardwareConfig hardware;
  std::size_t axis = 0;
  hal::AxisConfig drive;
  std::string mode;
  std::vector<std::string> notes;
  std::vector<std::string> fill_in;  ///< keys of units that nobody states
};

const std::pair<const char*, hal::DriveMode> kModes[] = {{"csp", hal::DriveMode::kCyclicPosition},
                                                         {"csv", hal::DriveMode::kCyclicVelocity},
                                                         {"pv", hal::DriveMode::kProfileVelocity}};

/// Number of [DeviceInfo], or of object 1018, which the HAL compares with the node.
std::uint32_t identityNumber(Import& job, std::uint8_t sub, const char* what, std::optional<std::uint32_t> number) {
  const EdsObject* object = job.sheet.find({0x1018, sub});
  if (object == nullptr)
    return 0;
  const auto value = static_cast<std::uint32_t>(object->value);
  if (object->has_value && number && value != *number)
    job.notes.push_back(std::string(what) + ": [DeviceInfo] has " + std::to_string(*number) + ", object " +
                        describe(object->address) + " has " + std::to_string(value) +
                        ", which counts; compare with tandem can scan");
  return object->has_value ? value : number.value_or(0);
}

std::size_t findAxis(const hal::HardwareConfig& hardware, const std::string& name) {
  if (name.empty())
    return 0;
  const auto found = std::ranges::find(hardware.axes, name, &hal::AxisConfig::name);
  if (found != hardware.axes.end())
    return static_cast<std::size_t>(found - hardware.axes.begin());
  std::string names;
  for (const hal::AxisConfig& axis : hardware.axes)
    names += (names.empty() ? "'" : ", '") + axis.name + "'";
  throw Failure(kUsage, "--axis: found '" + name + "', expected one of " + names);
}

/// The mode on request, or that of the axis if the sheet supports it, or the first one that it supports.
void chooseMode(Import& job, const std::string& wanted) {
  const EdsObject* supported = job.sheet.find({0x6502, 0});
  const auto offered = [&](hal::DriveMode mode) {
    return supported == nullptr || !supported->has_value ||
           hal::supports(static_cast<std::uint32_t>(supported->value), mode);
  };
  const hal::DriveMode present = job.drive.mode;
  for (const auto& [text, mode] : kModes) {
    const bool fits = offered(present) ? mode == present : offered(mode);
    if (wanted.empty() ? fits : wanted == text) {
      job.mode = text;
      job.drive.mode = mode;
      return;
    }
  }
  job.mode = kModes[0].first;
  job.drive.mode = kModes[0].second;
}

Import prepareImport(const ImportOptions& options) {
  Import job;
  job.sheet = loadSheet(options.file);
  job.hardware_file = config::findFile(options.hardware, "hardware");
  job.hardware = config::loadHardware(job.hardware_file, safety::Budgets{}.drive_heartbeat, false);
  job.axis = findAxis(job.hardware, options.axis);
  job.drive = job.hardware.axes[job.axis];
  job.drive.node = options.node != 0 ? options.node : job.sheet.node.value_or(job.drive.node);
  chooseMode(job, options.mode);
  const Eds& sheet = job.sheet;
  const config::AxisOrigin origin = config::originOf(job.hardware_file, job.hardware, job.axis);
  job.fill_in = takeFromSheet(sheet, origin, job.drive, job.notes);
  if (origin.profile)
    judgeMaker(*origin.profile, job.sheet);
  const hal::canopen::ObjectAddress temperature{job.drive.temperature_index, job.drive.temperature_sub};
  if (temperature.index != 0 && sheet.find(temperature) == nullptr) {
    job.notes.push_back("the temperature object " + describe(temperature) + " of the axis is absent: it is left out");
    job.drive.temperature_index = 0;
  }
  job.drive.identity = {identityNumber(job, 1, "vendor", sheet.vendor),
                        identityNumber(job, 2, "product", sheet.product_code),
                        identityNumber(job, 3, "revision", sheet.revision), 0};
  return job;
}

/// "UNSIGNED16 rw 0..100".
std::string describeObject(const EdsObject* object) {
  if (object == nullptr)
    return "-";
  std::string text = std::string(name(object->type)) + " " + std::string(name(object->access));
  if (object->low || object->high)
    text += " " + (object->low ? std::to_string(*object->low) : "") + ".." +
            (object->high ? std::to_string(*object->high) : "");
  return text;
}

/// "= 0x20192" of a check, "20480" of what the HAL writes.
std::string describeValue(const SetupStep& step) {
  switch (step.kind) {
    case SetupStep::Kind::kRead:
      return "read";
    case SetupStep::Kind::kCheck:
    case SetupStep::Kind::kAwait:
      return "= " + hexadecimal(step.value);
    default:
      return step.object.index < 0x2000 ? hexadecimal(step.value)
                                        : std::to_string(hal::canopen::signExtend(step.value, 8 * step.size));
  }
}

/// Read-backs that add nothing to the row of their write are left out.
std::vector<const SheetFinding*> rowsOf(const SheetCheck& check) {
  std::vector<const SheetFinding*> rows;
  std::set<std::pair<hal::canopen::ObjectAddress, SheetVerdict>> shown;
  for (const SheetFinding& finding : check.findings) {
    const bool again =
        finding.step.kind == SetupStep::Kind::kCheck && shown.count({finding.step.object, finding.verdict}) != 0;
    shown.insert({finding.step.object, finding.verdict});
    if (!again)
      rows.push_back(&finding);
  }
  return rows;
}

std::string modesOf(const Eds& sheet) {
  const EdsObject* object = sheet.find({0x6502, 0});
  if (object == nullptr || !object->has_value)
    return object == nullptr ? "object 6502 is absent" : "object 6502 has no default";
  constexpr const char* kNames[] = {"profile position",
                                    "velocity",
                                    "profile velocity",
                                    "profile torque",
                                    "",
                                    "homing",
                                    "interpolated position",
                                    "cyclic synchronous position",
                                    "cyclic synchronous velocity",
                                    "cyclic synchronous torque"};
  std::string text;
  for (std::size_t k = 0; k < std::size(kNames); ++k) {
    if ((static_cast<std::uint64_t>(object->value) >> k & 1) != 0 && kNames[k][0] != '\0')
      text += (text.empty() ? "" : ", ") + std::string(kNames[k]);
  }
  return (text.empty() ? "none" : text) + " (6502 = " + hexadecimal(static_cast<std::uint64_t>(object->value)) + ")";
}

/// "mapped objects fit", or what cannot be mapped.
std::string mappingOf(const SheetCheck& check) {
  std::string text;
  for (const SheetFinding* row : rowsOf(check)) {
    const std::uint16_t kind = row->step.object.index & 0xFE00;
    if ((kind == 0x1600 || kind == 0x1A00) && row->verdict == SheetVerdict::kRefused)
      text += (text.empty() ? "" : "; ") + describe(row->step.object) + " " + row->reason;
  }
  return text.empty() ? "the PDOs of the HAL fit" : text;
}

std::vector<std::string> reasonsOf(const SheetCheck& check) {
  std::vector<std::string> reasons;
  for (const SheetFinding* row : rowsOf(check)) {
    if (row->verdict == SheetVerdict::kRefused)
      reasons.push_back(describe(row->step.object) + " " + row->step.what + ": " + row->reason);
  }
  for (const hal::ProtectionMask set : check.missing)
    reasons.push_back("without " + hal::describeProtections(set) +
                      " the drive may continue to move when the HAL ends: the hardware file must accept that");
  return reasons;
}

/// The axis, with the protections to be accepted as comments.
std::string blockOf(const Import& job, const SheetCheck& check) {
  std::string text = "# From " + job.sheet.file + ": " + job.sheet.vendor_name + ", " + job.sheet.product +
                     ".\n# Everything but node, vendor, product, revision, mode, units, pdo_objects and watch is of " +
                     job.drive.name + " in " + job.hardware.name + ": check it, and add the serial number.\n";
  for (const std::string& key : job.fill_in)
    text += "# Replace " + std::string(config::kFillIn) + " of " + key + ": the unit is in the drive's manual.\n";
  text += config::axisBlock(job.hardware_file, job.hardware, job.axis, job.drive, job.mode, job.fill_in);
  const std::string indent = "        # ";
  if (check.lost != 0)
    text += indent + "The drive lacks " + hal::describeProtections(check.lost) + ".\n";
  if (check.missing.empty())
    return text;
  text += indent + "tandem-hal refuses it without these lines. Write the reasons, and remove the '#':\n" + indent +
          "accept:\n";
  for (const hal::ProtectionMask set : check.missing) {
    bool first = true;
    for (int k = 0; k < hal::kProtectionCount; ++k) {
      const auto protection = static_cast<hal::Protection>(k);
      if ((set & hal::bit(protection)) == 0)
        continue;
      text +=
          indent + (first ? "  " : "  # or ") + "- {protection: " + std::string(name(protection)) + ", reason: \"\"}\n";
      first = false;
    }
  }
  return text;
}

Json importJson(const Import& job, const SheetCheck& check, int code) {
  Json json{{"file", job.sheet.file},
            {"vendor_name", job.sheet.vendor_name},
            {"product_name", job.sheet.product},
            {"vendor", job.drive.identity.vendor},
            {"product", job.drive.identity.product},
            {"revision", job.drive.identity.revision},
            {"objects", job.sheet.objects.size()},
            {"warnings", Json::array()},
            {"axis", job.drive.name},
            {"node", job.drive.node},
            {"mode", job.mode},
            {"modes", modesOf(job.sheet)},
            {"pdo_mapping", mappingOf(check)},
            {"setup", Json::array()},
            {"lost", Json::array()},
            {"notes", job.notes},
            {"fill_in", job.fill_in},
            {"reasons", reasonsOf(check)},
            {"boots", check.boots()}};
  for (const auto& warning : job.sheet.warnings)
    json["warnings"].push_back({{"line", warning.line}, {"text", warning.text}});
  for (const SheetFinding* row : rowsOf(check))
    json["setup"].push_back({{"object", describe(row->step.object)},
                             {"what", row->step.what},
                             {"need", needOf(row->step)},
                             {"value", describeValue(row->step)},
                             {"sheet", describeObject(job.sheet.find(row->step.object))},
                             {"verdict", name(row->verdict)},
                             {"reason", row->reason}});
  for (int k = 0; k < hal::kProtectionCount; ++k) {
    if ((check.lost & hal::bit(static_cast<hal::Protection>(k))) != 0)
      json["lost"].push_back(name(static_cast<hal::Protection>(k)));
  }
  if (code != kFailure)
    json["yaml"] = blockOf(job, check);
  return json;
}

void printReport(const Import& job, const SheetCheck& check) {
  const Eds& sheet = job.sheet;
  std::printf("%s: %s, %s; vendor 0x%08X, product 0x%08X, revision 0x%08X; %zu objects, %zu warnings\n",
              sheet.file.c_str(), sheet.vendor_name.c_str(), sheet.product.c_str(), job.drive.identity.vendor,
              job.drive.identity.product, job.drive.identity.revision, sheet.objects.size(), sheet.warnings.size());
  for (const auto& warning : sheet.warnings)
    std::printf("warning: %s\n", describe(sheet, warning).c_str());
  for (const std::string& note : job.notes)
    std::printf("note: %s\n", note.c_str());
  std::printf("\nsetup of %s as node %d, mode %s:\n%-8s %-43s %-20s %-14s %-34s %s\n", job.drive.name.c_str(),
              job.drive.node, job.mode.c_str(), "object", "what", "need", "value", "data sheet", "");
  for (const SheetFinding* row : rowsOf(check))
    std::printf("%-8s %-43s %-20s %-14s %-34s %s%s\n", describe(row->step.object).c_str(), row->step.what.c_str(),
                needOf(row->step).c_str(), describeValue(row->step).c_str(),
                describeObject(sheet.find(row->step.object)).c_str(), std::string(name(row->verdict)).c_str(),
                row->reason.empty() ? "" : (": " + row->reason).c_str());
  std::printf("\nmodes: %s\nPDO mapping: %s\nlost protections: %s\n", modesOf(sheet).c_str(), mappingOf(check).c_str(),
              hal::describeProtections(check.lost).c_str());
}

int runImport(const ImportOptions& options) {
  if (!options.out.empty() && !options.force && std::filesystem::exists(options.out))
    throw Failure(kUsage, "--out: '" + options.out + "' exists: name another file, or use --force to replace it");
  Import job = prepareImport(options);
  const SheetCheck check = hal::checkSheet(job.sheet, job.hardware, job.drive, safety::Budgets{}.drive_heartbeat);
  judgeCounts(job.drive, check, job.notes);
  judgeProfile(job.drive, check.lost, job.notes);
  const int code = check.boots() ? kOk : check.accessible() ? kNeedsAcceptance : kFailure;
  if (options.json) {
    std::cout << importJson(job, check, code).dump(2) << '\n';
  } else {
    printReport(job, check);
    constexpr const char* kVerdicts[] = {"tandem-hal boots this drive", "tandem-hal does not boot this drive:", "",
                                         "tandem-hal boots this drive if the hardware file accepts what it lacks:"};
    std::printf("%s\n", kVerdicts[code]);
    for (const std::string& reason : reasonsOf(check))
      std::printf("  %s\n", reason.c_str());
  }
  if (code == kFailure)
    return code;
  if (!options.out.empty()) {
    std::ofstream file(options.out);
    if (!(file << blockOf(job, check)).flush())
      client::failToWrite(kUsage, options.out);
  } else if (!options.json) {
    std::printf("\n%s", blockOf(job, check).c_str());
  }
  return code;
}

}  // namespace

void registerCanImport(CLI::App& can, int& exit_code) {
  auto options = std::make_shared<ImportOptions>();
  CLI::App* command = can.add_subcommand(
      "import",
      "read a drive's data sheet (EDS or DCF): objects that the HAL needs, lost protections, axis for a hardware file");
  command->add_option("file", options->file, "EDS or DCF file")->required();
  command->add_option("--node", options->node, "node id of the drive (default: that of the DCF, else of --axis)")
      ->check(CLI::Range(1, 127));
  command
      ->add_option("--hardware", options->hardware,
                   "hardware file or preset with units, limits and windows of the axis: they decide what is written")
      ->capture_default_str();
  command->add_option("--axis", options->axis, "axis of that file, e.g. 'arm_a rotation 1' (default: the first)");
  command
      ->add_option(
          "--mode", options->mode,
          "csp, csv or pv (default: that of --axis if the data sheet supports it, else the first that it supports)")
      ->check(CLI::IsMember({"csp", "csv", "pv"}));
  command->add_option("-o,--out", options->out, "new file for the axis (default: standard output)");
  command->add_flag("--force", options->force, "replace the file of --out if it exists");
  command->add_flag("--json", options->json, "JSON instead of text");
  command->footer(
      "Needs no bus. Exit code 0: tandem-hal boots a drive that conforms to this data sheet; 3: only if the hardware\n"
      "file accepts the protections that it lacks (`accept`); 1: it does not boot the drive, with each reason;\n"
      "2: the file cannot be read, or --out exists. A sheet of another maker or product than the profile's is a "
      "warning,\n"
      "with its line. Units that neither the sheet nor a profile states are FILL_IN in the axis.");
  command->callback([options, &exit_code] { guarded(exit_code, [&] { return runImport(*options); }); });
}

}  // namespace tandem::cli
