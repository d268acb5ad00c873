// SPDX-License-Identifier: Apache-2.0
/** @file Findings of `tandem commission`: measurements of axes, and the files with them. */
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "hal/drives/axis_sweep.h"
#include "hal/hardware.h"

namespace tandem::cli {

/** One axis to be checked. */
struct Candidate {
  std::uint8_t arm = 0;
  int joint = 0;
  const hal::AxisConfig* axis = nullptr;
  std::string name;  ///< "arm_a beta_1"
  bool translation() const { return axis->translation; }
  double scale() const { return translation() ? 1e3 : 180.0 / std::numbers::pi; }
  const char* unit() const { return translation() ? "mm" : "deg"; }
};

/// Entry of one axis in commissioning.json. @param wanted  commanded travel, m or rad
nlohmann::ordered_json describeAxis(const Candidate& candidate,
                                    const hal::SweepResult& found,
                                    double wanted,
                                    bool right_way);

/** The folder with what was found: commissioning.json, a CSV file for each axis, report.md, the corrected hardware
 * file.
 */
class Findings {
 public:
  /// Goes on with the folder if its results are of the same files. @param fingerprint  of robot and hardware
  /// @param again  forget earlier results
  Findings(const std::filesystem::path& folder, const std::string& fingerprint, bool again);

  /// The axis was checked, and has no problem.
  bool passed(const std::string& axis) const;
  /// Keeps the result of an axis, also if this program ends now.
  void add(const Candidate& candidate,
           const nlohmann::ordered_json& found,
           const std::vector<hal::SweepSample>& samples);
  /// Writes report.md, and the hardware file with the directions that were found wrong turned round.
  void finish(const std::filesystem::path& hardware_file,
              const hal::HardwareConfig& hardware,
              const std::vector<Candidate>& candidates) const;

  /// All results, as Markdown.
  std::string report() const;
  const nlohmann::ordered_json& json() const { return json_; }

 private:
  std::filesystem::path folder_;
  nlohmann::ordered_json json_;
};

}  // namespace tandem::cli
