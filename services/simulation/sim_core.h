// SPDX-License-Identifier: Apache-2.0
/** @file Core of tandem-sim: from actuation/command to the simulated robot and from it to actuation/state; no DDS, no
 * threads. */
#pragma once

#include <optional>

#include "services/runtime/drive_core.h"
#include "services/simulation/catheter_tips.h"
#include "sim/plant_tips.h"
#include "sim/simulated_drives.h"
#include "sim/tip_tracker.h"

namespace tandem::simulation {

/** Wire in, simulated drives, wire out. After construction nothing but request() allocates. */
class SimCore : public runtime::DriveCore<sim::SimulatedDrives> {
 public:
  explicit SimCore(const runtime::Setup& setup);

  /// Takes a command. Lock-step: takes one step if the command asks for it and answers the present state.
  /// @param arrivals  commands that have come so far, with this one; 0: nobody counts
  /// @return lock-step: whether there is a new state to publish.
  bool onCommand(const dds::ActuationCommand& command, std::int64_t now, std::uint64_t arrivals = 0) noexcept;
  /// What somebody says who reads the emergency stop; real time.
  void onEmergencyStop(bool pressed, std::int64_t now) noexcept { reports_.take(pressed, now); }
  dds::Reply onRequest(const dds::SimRequest& request);

  /// Real time: goes on by one sim period, to `now`.
  void step(std::int64_t now) noexcept;
  /** Real time: goes on by periods that have passed unnoticed, up to `now`: drives do not wait for a process that comes
   * late. More than a second's worth is left out; both are counted. */
  void catchUp(std::uint64_t periods, std::int64_t now) noexcept;

  /// The state to publish now, with a new sequence. `now`: real time, ns.
  void state(std::int64_t now, dds::ActuationState& state) noexcept;
  void status(dds::HalStatus& status) const noexcept;

  /// Whether there is a simulated tip tracker.
  bool tracking() const noexcept { return tracker_.has_value(); }
  /// What the tracker says; in lock-step that goes with the state published last. @return whether it is a measurement
  /// that has not been asked for yet.
  bool measuredTips(dds::TipPoses& tips) noexcept;
  /// Where the plant's tips really are; of catheters plantJoints() tells.
  void trueTips(dds::TipPoses& tips) const noexcept;
  /// Of catheters: what CatheterTips needs to find the tips.
  void plantJoints(CatheterSnapshot& snapshot) const noexcept;

 private:
  void advance() noexcept;  ///< lock-step: one control period
  void moveTips(std::int64_t now) noexcept;
  void placeTips(std::int64_t now) noexcept;
  void fillHead(dds::TipPoses& tips) const noexcept;

  safety::EmergencyReports reports_;
  bool injected_stop_ = false;          ///< the emergency stop, by a request
  std::optional<sim::PlantTips> tips_;  ///< none of catheters
  std::optional<sim::TipTracker> tracker_;
  std::uint64_t reported_ = 0;                  ///< the last measurement that has been asked for
  std::int64_t simulated_time_ = 0;             ///< ns, lock-step
  std::uint64_t caught_up_ = 0, left_out_ = 0;  ///< periods
};

}  // namespace tandem::simulation
