// SPDX-License-Identifier: Apache-2.0
/** @file What a data sheet says about the setup of a drive: whether the HAL could boot such a drive as an axis. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hal/canopen/eds.h"
#include "hal/canopen/setup.h"
#include "hal/hardware.h"

namespace tandem::hal {

/** What the data sheet says about one SDO access of the HAL. */
struct SheetFinding {
  enum class Verdict : std::uint8_t {
    kFits,
    kUnknown,  ///< the object is there, but its value is not in the data sheet
    kSkipped,  ///< optional, and the object is absent
    kLost,     ///< costs the protections of the step
    kRefused,  ///< the node does not boot
  };
  canopen::SetupStep step;
  Verdict verdict = Verdict::kFits;
  std::string reason;  ///< "absent", "read-only", "range 0 to 0"; empty: nothing to say
};
/// "fits", "lost" ...
std::string_view name(SheetFinding::Verdict verdict);

struct SheetCheck {
  std::vector<SheetFinding> findings;  ///< in the order of the setup, then the software limits
  /// Counts per revolution of the motor that the default values state, where the hardware file has others.
  std::optional<double> counts;
  bool refuses_counts = false;  ///< the HAL refuses a drive that states these
  ProtectionMask lost = 0;
  std::vector<ProtectionMask> missing;  ///< sets of protections of which the axis needs one (leastProtections())

  /// No access is refused; `missing` may still have sets.
  bool accessible() const;
  /// The HAL boots a drive that is as its data sheet says, apart from counts (refuses_counts), which may be set in it.
  bool boots() const { return accessible() && missing.empty(); }
};

/// All setup steps of this axis: what the HAL checks and writes at boot, those of the PDOs included.
std::vector<canopen::SetupStep> setupSteps(const HardwareConfig& hardware,
                                           const AxisConfig& axis,
                                           double heartbeat_budget);

/** Judges the setup steps of this axis (driveSetup()) as canopen::Node would, by a data sheet instead of a node.
 * @param heartbeat_budget time-out of the drive for the HAL's heartbeat, s */
SheetCheck checkSheet(const canopen::Eds& sheet,
                      const HardwareConfig& hardware,
                      const AxisConfig& axis,
                      double heartbeat_budget);

}  // namespace tandem::hal
