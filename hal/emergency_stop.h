// SPDX-License-Identifier: Apache-2.0
/** @file Emergency stop or STO state, read back from drives. */
#pragma once

#include <cstdint>
#include <vector>

#include "hal/axis_driver.h"
#include "hal/feedback.h"
#include "hal/hardware.h"
#include "safety/emergency_stop.h"

namespace tandem::hal {

/** Inputs that report the emergency stop. One pressed input is sufficient. A silent input is ignored while another one
 * is received; the loss of the last input stops the arms, too, because the emergency stop cannot be read any more.
 * While a drive boots, its input keeps the last received value. Nothing after construction allocates, locks or throws;
 * times are ns on the caller's clock. */
class EmergencyStopWatch {
 public:
  /// @param budget longest time without an input of a drive that is up, s. @param reports s, of EmergencyReports.
  EmergencyStopWatch(double budget, double reports) : budget_(budget), reports_(reports) {}

  /// @param driver outlives this.
  void add(const EmergencyInput& input, const AxisDriver& driver);

  /// Report of another process that reads the emergency stop.
  void report(bool pressed, std::int64_t now) noexcept { reports_.take(pressed, now); }

  /// Once per period, after the drivers. @return index of the axis whose input became pressed; -1: none.
  int update(std::int64_t now) noexcept;

  safety::EmergencyStop state() const noexcept { return state_; }
  /// Inputs were readable, and none of them is any more.
  bool lost() const noexcept { return lost_; }
  /// The reports on the topic are silent.
  bool silent() const noexcept { return silent_; }
  /// There is nothing to read, or a value has been read.
  bool known() const noexcept {
    return (sources_.empty() && !reports_.asked()) || state_ != safety::EmergencyStop::kNotRead;
  }

 private:
  struct Source {
    EmergencyInput input;
    const AxisDriver* driver = nullptr;
    FeedbackStream stream{};
    bool read = false;     ///< at least one value was received
    bool pressed = false;  ///< as last read
    bool lost = false;     ///< expected, but not received
  };
  void listen(Source& source, std::int64_t now) const noexcept;

  double budget_;
  safety::EmergencyReports reports_;
  std::vector<Source> sources_;
  safety::EmergencyStop state_ = safety::EmergencyStop::kNotRead;
  bool lost_ = false;
  bool silent_ = false;
};

}  // namespace tandem::hal
