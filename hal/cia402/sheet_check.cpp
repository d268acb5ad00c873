// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/sheet_check.h"

#include <algorithm>
#include <map>

#include "hal/canopen/bytes.h"
#include "hal/canopen/node.h"
#include "hal/cia402/detail/node_setups.h"

namespace tandem::hal {
namespace {

using canopen::EdsObject;
using canopen::ObjectAddress;
using canopen::SetupStep;
using Verdict = SheetFinding::Verdict;

std::string hex(std::uint64_t value) {
  char text[24];
  std::snprintf(text, sizeof text, "0x%llX", static_cast<unsigned long long>(value));
  return text;
}

/// The bits of a PDO mapping parameter that name the mapped object.
bool mapsObject(const SetupStep& step) {
  const bool mapping = (step.object.index & 0xFE00) == 0x1600 || (step.object.index & 0xFE00) == 0x1A00;
  return mapping && step.object.sub > 0 && step.value != 0;
}

std::string sizeReason(const EdsObject& object, int wanted) {
  return std::string(name(object.type)) + ", expected " + std::to_string(wanted) + (wanted == 1 ? " byte" : " bytes");
}

/** Judges steps one after the other; knows what the steps before have written. */
class Judge {
 public:
  Judge(const canopen::Eds& sheet, int node) : sheet_(sheet), node_(node) {}

  SheetFinding judge(const SetupStep& step) {
    SheetFinding finding{step, Verdict::kFits, {}};
    const EdsObject* object = sheet_.find(step.object);
    if (object == nullptr) {
      finding.verdict = step.optional || step.protections != 0 ? withoutIt(step) : Verdict::kRefused;
      finding.reason = "absent";
    } else if (step.writes()) {
      judgeWrite(*object, finding);
    } else {
      judgeRead(*object, finding);
    }
    if (finding.verdict == Verdict::kLost)
      lost_ |= step.protections;
    return finding;
  }

  ProtectionMask lost() const { return lost_; }

 private:
  void judgeWrite(const EdsObject& object, SheetFinding& finding) {
    const SetupStep& step = finding.step;
    const auto value =
        isSigned(object.type) ? canopen::signExtend(step.value, 8 * step.size) : static_cast<std::int64_t>(step.value);
    if (!writable(object.access)) {
      keepsItsValue(object, "read-only", finding);
    } else if (sizeOf(object.type) != step.size) {
      refuse(finding, sizeReason(object, step.size));
    } else if ((object.low && value < *object.low) || (object.high && value > *object.high)) {
      keepsItsValue(object,
                    "range " + (object.low ? std::to_string(*object.low) : "any") + " to " +
                        (object.high ? std::to_string(*object.high) : "any") + ", the HAL writes " +
                        std::to_string(value),
                    finding);
    } else if (const std::string methods = otherMethods(object, value); !methods.empty()) {
      refuse(finding, methods);
    } else if (step.kind == SetupStep::Kind::kWriteVerify && !readable(object.access)) {
      refuse(finding, "write-only: cannot be read back");
    } else if (const std::string reason = mappingProblem(step); !reason.empty()) {
      refuse(finding, reason);
    } else {
      written_[step.object] = step.value;
    }
  }

  /// The drive refuses the value: it is as good if it has this value already.
  void keepsItsValue(const EdsObject& object, const std::string& reason, SheetFinding& finding) const {
    if (finding.step.protections == 0 && !finding.step.dispensable)
      return refuse(finding, reason);
    const bool same = readable(object.access) && sizeOf(object.type) == finding.step.size && object.has_value &&
                      finding.step.passes(bits(object));
    finding.verdict = same ? Verdict::kFits : withoutIt(finding.step);
    finding.reason = reason + (same ? ", with this value" : "");
  }

  void judgeRead(const EdsObject& object, SheetFinding& finding) const {
    const SetupStep& step = finding.step;
    const auto before = written_.find(step.object);
    const bool known = before != written_.end() || object.has_value;
    const std::uint64_t all = before != written_.end() ? before->second : bits(object);
    bool fits = true;
    const std::uint64_t value = canopen::withoutExtension(all, 8 * sizeOf(object.type), 8 * step.size, fits);
    // What a drive shows while it runs is not in its data sheet.
    const bool judged = step.kind == SetupStep::Kind::kCheck;
    if (!readable(object.access)) {
      refuse(finding, "write-only");
    } else if (judged && !known) {
      finding.verdict = Verdict::kUnknown;
      finding.reason = "no value in the data sheet";
    } else if (judged && !(fits && step.passes(value))) {
      refuse(finding, "found " + hex(value) + ", expected " + hex(step.value) +
                          ((~step.mask & ones(step.size)) == 0 ? "" : " in the bits " + hex(step.mask)));
    }
    if (finding.verdict == Verdict::kRefused && (step.protections & lost_) != 0)
      finding.verdict = Verdict::kLost;
    if (finding.verdict == Verdict::kRefused && step.kind == SetupStep::Kind::kRead && step.optional)
      finding.verdict = Verdict::kSkipped;
  }

  /// The homing methods that the sheet lists (60E3), if it lists some and not this one.
  std::string otherMethods(const EdsObject& object, std::int64_t method) const {
    if (object.address != objects::kHomingMethod)
      return {};
    std::string methods;
    for (std::uint8_t sub = 1; const EdsObject* entry = sheet_.find({objects::kHomingMethods, sub}); ++sub) {
      if (!entry->has_value)
        continue;
      const std::int64_t listed = canopen::signExtend(bits(*entry), 8 * sizeOf(entry->type));
      if (listed == method)
        return {};
      methods += (methods.empty() ? "" : ", ") + std::to_string(listed);
    }
    return methods.empty() ? "" : "method " + std::to_string(method) + ", 60E3 lists " + methods;
  }

  std::string mappingProblem(const SetupStep& step) const {
    if (!mapsObject(step))
      return {};
    const canopen::PdoEntry entry = canopen::PdoEntry::fromRaw(static_cast<std::uint32_t>(step.value));
    const EdsObject* mapped = sheet_.find(entry.object);
    const std::string what = describe(entry.object) + " ";
    const bool receive = step.object.index < 0x1800;
    if (mapped == nullptr)
      return what + "is absent";
    if (!mapped->mappable)
      return what + "cannot be mapped into a PDO";
    if (receive ? !writable(mapped->access) : !readable(mapped->access))
      return what + "is " + (receive ? "read-only" : "write-only");
    if (8 * sizeOf(mapped->type) != entry.bits)
      return what + "is " + std::string(name(mapped->type)) + ", expected " + std::to_string(entry.bits) + " bits";
    return {};
  }

  static Verdict withoutIt(const SetupStep& step) { return step.protections != 0 ? Verdict::kLost : Verdict::kSkipped; }
  static void refuse(SheetFinding& finding, const std::string& reason) {
    finding.verdict = Verdict::kRefused;
    finding.reason = reason;
  }
  static std::uint64_t ones(int size) { return canopen::lowBits(~std::uint64_t{0}, size == 0 ? 64 : 8 * size); }
  std::uint64_t bits(const EdsObject& object) const {
    return static_cast<std::uint64_t>(object.valueAt(node_)) & ones(sizeOf(object.type));
  }

  const canopen::Eds& sheet_;
  int node_;
  std::map<ObjectAddress, std::uint64_t> written_;
  ProtectionMask lost_ = 0;
};

/// What the HAL writes to every drive after its setup, when it knows the position: here for one at the reference.
std::vector<SetupStep> limitSteps(const AxisConfig& axis) {
  const auto limits = AxisUnits(axis.gearing).softwareLimits(axis.lower, axis.upper);
  if (!limits)
    return {};
  std::vector<SetupStep> steps{canopen::write(objects::kLowerLimit, limits->least, 4, "lower software limit"),
                               canopen::write(objects::kUpperLimit, limits->most, 4, "upper software limit")};
  for (SetupStep& step : steps)
    step.protections = bit(Protection::kSoftwareLimits);
  return steps;
}

}  // namespace

std::string_view name(Verdict verdict) {
  constexpr std::string_view kNames[] = {"fits", "unknown", "left out", "lost", "refused"};
  return kNames[static_cast<std::size_t>(verdict)];
}

bool SheetCheck::accessible() const {
  return std::ranges::none_of(findings, [](const SheetFinding& f) { return f.verdict == Verdict::kRefused; });
}

std::vector<SetupStep> setupSteps(const HardwareConfig& hardware, const AxisConfig& axis, double heartbeat_budget) {
  return canopen::Node(driveSetup(hardware, axis, heartbeat_budget)).steps();
}

SheetCheck checkSheet(const canopen::Eds& sheet,
                      const HardwareConfig& hardware,
                      const AxisConfig& axis,
                      double heartbeat_budget) {
  const canopen::Node node(driveSetup(hardware, axis, heartbeat_budget));
  Judge judge(sheet, axis.node);
  SheetCheck check;
  for (const SetupStep& step : node.steps())
    check.findings.push_back(judge.judge(step));
  for (const SetupStep& step : limitSteps(axis))
    check.findings.push_back(judge.judge(step));
  check.counts = differingCounts(factorsFrom([&sheet](const ObjectAddress& object) -> std::int64_t {
                                   const EdsObject* found = sheet.find(object);
                                   return found != nullptr && found->has_value ? found->value : 0;
                                 }),
                                 axis.gearing);
  check.refuses_counts = axis.checks_counts && check.counts;
  check.lost = judge.lost();
  check.missing = missingProtections(check.lost, axis.accepted);
  return check;
}

}  // namespace tandem::hal
