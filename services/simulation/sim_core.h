// SPDX-License-Identifier: Apache-2.0
/** @file Core of tandem-sim: passes actuation/command to the simulated robot, and its state to actuation/state; no DDS,
 * no threads. */
#pragma once

#include <optional>

#include "services/runtime/drive_core.h"
#include "services/simulation/mechanism_tips.h"
#include "sim/plant_tips.h"
#include "sim/simulated_drives.h"
#include "sim/tip_tracker.h"

namespace tandem::simulation {

/** Passes commands to the simulated drives and their state to DDS messages. After construction only onRequest()
 * allocates. */
class SimCore : public runtime::DriveCore<sim::SimulatedDrives> {
 public:
  explicit SimCore(const runtime::Setup& setup);

  /// Takes a command. Lock-step: advances by one step if the command requests it and answers the present state.
  /// @param arrivals  commands received so far, this one included; 0: not counted
  /// @return lock-step: whether there is a new state to publish.
  bool onCommand(const dds::ActuationCommand& command, std::int64_t now, std::uint64_t arrivals = 0) noexcept;
  /// Report on topic emergency_stop; real time.
  void onEmergencyStop(bool pressed, std::int64_t now) noexcept { reports_.take(pressed, now); }
  dds::Reply onRequest(const dds::SimRequest& request);

  /// Real time: advances by one sim period, to `now`.
  void step(std::int64_t now) noexcept;
  /** Real time: advances by missed periods up to `now`, because real drives do not wait for a late process. Periods
   * beyond one second are skipped; caught-up and skipped ones are counted. */
  void catchUp(std::uint64_t periods, std::int64_t now) noexcept;

  /// The state to publish now, with a new sequence. `now`: real time, ns.
  void state(std::int64_t now, dds::ActuationState& state) noexcept;
  void status(dds::HalStatus& status) const noexcept;

  /// Whether the deployment has a simulated tip tracker.
  bool tracking() const noexcept { return tracker_.has_value(); }
  /// The latest measurement of the tracker; in lock-step the one of the last published state. @return whether it is
  /// newer than that of the last call.
  bool measuredTips(dds::TipPoses& tips) noexcept;
  /// True tip poses of the plant; without robots::Capability::kTips see plantJoints().
  void trueTips(dds::TipPoses& tips) const noexcept;
  /// Input of MechanismTips.
  void plantJoints(MechanismSnapshot& snapshot) const noexcept;

 private:
  void advance() noexcept;  ///< lock-step: one control period
  void moveTips(std::int64_t now) noexcept;
  void placeTips(std::int64_t now) noexcept;
  void fillHead(dds::TipPoses& tips) const noexcept;

  safety::EmergencyReports reports_;
  bool injected_stop_ = false;          ///< emergency stop injected by a request
  std::optional<sim::PlantTips> tips_;  ///< empty without robots::Capability::kTips
  std::optional<sim::TipTracker> tracker_;
  std::uint64_t reported_ = 0;                  ///< sequence of the measurement of the last call
  std::int64_t simulated_time_ = 0;             ///< ns, lock-step
  std::uint64_t caught_up_ = 0, left_out_ = 0;  ///< periods
};

}  // namespace tandem::simulation
