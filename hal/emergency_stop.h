// SPDX-License-Identifier: Apache-2.0
/** @file Emergency stop or STO state, read back from the PDOs of drives. */
#pragma once

#include <cstdint>
#include <vector>

#include "hal/canopen/network.h"
#include "hal/feedback.h"
#include "hal/hardware.h"
#include "safety/emergency_stop.h"

namespace tandem::hal {

/** All inputs that tell of the emergency stop. One that says "pressed" is enough. One that falls silent is not missed
 * while another one is received; when the last one is lost, nobody would learn of the emergency stop, and that stops
 * the arms, too. While a node boots its input stands as it was last received. Nothing after construction allocates,
 * locks or throws; times are ns on the caller's clock. */
class EmergencyStopWatch {
 public:
  /// @param budget s for which an operational node may owe an input. @param reports s, of EmergencyReports.
  EmergencyStopWatch(double budget, double reports) : budget_(budget), reports_(reports) {}

  /// @param network outlives this. @param node index of the drive in it.
  void add(const EmergencyInput& input, const canopen::Network& network, int node);

  /// What somebody else says who reads it.
  void report(bool pressed, std::int64_t now) noexcept { reports_.take(pressed, now); }

  /// After Network::receive(), once per period. @return index of the axis whose input began to say "pressed"; -1: none.
  int update(std::int64_t now) noexcept;

  safety::EmergencyStop state() const noexcept { return state_; }
  /// Inputs could be read, and none of them can any more.
  bool lost() const noexcept { return lost_; }
  /// Whoever reports on the topic has fallen silent.
  bool silent() const noexcept { return silent_; }
  /// Nothing is to be read, or something has been.
  bool known() const noexcept {
    return (sources_.empty() && !reports_.asked()) || state_ != safety::EmergencyStop::kNotRead;
  }

 private:
  struct Source {
    EmergencyInput input;
    const canopen::Network* network = nullptr;
    int node = 0;
    FeedbackStream stream{};
    bool read = false;     ///< ever
    bool pressed = false;  ///< as last read
    bool lost = false;     ///< it should be received, and is not
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
