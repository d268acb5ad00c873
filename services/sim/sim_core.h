// SPDX-License-Identifier: Apache-2.0
/** @file The simulated robot behind the topics of hal; no DDS, no threads. */
#pragma once

#include "safety/command_monitor.h"
#include "services/setup/process.h"
#include "sim/simulated_drives.h"

namespace tandem::service {

/** Wire in, simulated drives, wire out. After construction nothing but request() allocates. */
class SimCore {
 public:
  explicit SimCore(const Setup& setup);

  /// Takes a command. Lock-step: takes one step if the command asks for it and answers the present state.
  /// @return lock-step: whether there is a new state to publish.
  bool onCommand(const dds::ActuationCommand& command, std::int64_t now) noexcept;
  void onStop() noexcept { drives_.stop(); }
  dds::Reply onRequest(const dds::SimRequest& request);

  /// Real time: goes on by one sim period, to `now`.
  void step(std::int64_t now) noexcept;
  /** Real time: goes on by periods that have passed unnoticed, up to `now`: drives do not wait for a process that comes
   * late. More than a second's worth is left out; both are counted. */
  void catchUp(std::uint64_t periods, std::int64_t now) noexcept;

  /// The state to publish now, with a new sequence. `now`: real time, ns.
  void state(std::int64_t now, dds::ActuationState& state) noexcept;
  void status(dds::HalStatus& status) const noexcept;
  int armCount() const noexcept { return drives_.armCount(); }
  /// What led an arm into FAULT; empty in the other states.
  const safety::FaultRecord& faultRecord(int arm) const noexcept { return drives_.faultRecord(arm); }

 private:
  void advance() noexcept;  ///< lock-step: one control period

  const Setup& setup_;
  bool lock_step_;
  sim::SimulatedDrives drives_;
  safety::StateStamps stamps_;
  std::int64_t simulated_time_ = 0;  ///< ns, lock-step
  std::uint64_t sequence_ = 0;
  std::uint64_t caught_up_ = 0, left_out_ = 0;  ///< periods
  sim::Command command_;
};

}  // namespace tandem::service
