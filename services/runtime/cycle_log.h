// SPDX-License-Identifier: Apache-2.0
/** @file Cycle log: one line per cycle of a periodic thread, with the messages that it took and what it decided, on the
 * clock of its process. Ages can be computed from it again, independently of the code that watches them (docs/csv.md).
 */
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "services/dds/messages.h"
#include "services/runtime/outbox.h"
#include "services/runtime/periodic_loop.h"
#include "services/runtime/process.h"

namespace tandem::runtime {

/** One cycle of sim or hal. */
struct DriveCycle {
  Tick tick;
  bool taken = false;             ///< a command was taken in this cycle
  bool stop = false;              ///< a message on topic stop was taken
  dds::ActuationCommand command;  ///< the last one taken
  dds::ActuationState state;      ///< published in this cycle
};

/** One cycle of control. */
struct ControlCycle {
  Tick tick;
  bool state_taken = false, reference_taken = false, input_taken = false;
  dds::ActuationState state;         ///< the last one taken
  dds::PlanningReference reference;  ///< likewise
  std::uint64_t lease_client = 0;    ///< the lease owner, if it acquired or kept the lease in this cycle; else 0
  std::uint64_t lease_answers = 0;   ///< sequence of the control/status that this request answers
  dds::TeleopInput input;            ///< of the lease owner, the last one taken
  dds::ControlStatus status;         ///< published in this cycle
  dds::ActuationCommand command;     ///< likewise
};

/** A CSV file that a thread of its own writes: FOLDER/NAME-SESSION.csv. After an error (a full disk) it logs the error
 * once and writes nothing more. */
class CycleFile {
 public:
  /// Does nothing if the deployment has no `cycle_log`. @throw std::system_error if the file cannot be created.
  CycleFile(const Setup& setup, const std::string& header);
  ~CycleFile();
  CycleFile(const CycleFile&) = delete;
  CycleFile& operator=(const CycleFile&) = delete;

  bool open() const noexcept { return descriptor_ >= 0; }
  void write(const std::string& line);

 private:
  std::string name_;
  int descriptor_ = -1;
};

/// Header and lines of both logs; a line ends with a line feed. @param lost  cycles that are missing in the file so far
std::string cycleHeader(const config::Robot& robot, const DriveCycle&);
std::string cycleHeader(const config::Robot& robot, const ControlCycle&);
std::string cycleLine(const config::Robot& robot, const DriveCycle& cycle, std::uint64_t lost);
std::string cycleLine(const config::Robot& robot, const ControlCycle& cycle, std::uint64_t lost);

/** The log of a periodic thread; without `cycle_log` in the deployment it does nothing. Create it before
 * enterRealtime(). */
template <class Cycle>
class CycleLog {
 public:
  /// @throw as CycleFile
  explicit CycleLog(const Setup& setup) : file_(setup, cycleHeader(setup.robot, Cycle{})) {
    if (!file_.open())
      return;
    outbox_ = std::make_unique<Outbox>();
    queue_ = &outbox_->queue<Cycle>(kCapacity, [this, &setup](const Cycle& cycle) {
      file_.write(cycleLine(setup.robot, cycle, queue_->dropped()));
    });
    outbox_->start();
  }

  /// Whether cycles are written; a cycle need not be filled otherwise.
  bool on() const noexcept { return queue_ != nullptr; }
  /// Periodic thread: neither locks nor allocates. Only if on().
  void post(const Cycle& cycle) noexcept { queue_->post(cycle); }

 private:
  static constexpr std::size_t kCapacity = 4096;  // 4 s at 1 kHz

  CycleFile file_;
  std::unique_ptr<Outbox> outbox_;
  typename Outbox::Queue<Cycle>* queue_ = nullptr;
};

}  // namespace tandem::runtime
