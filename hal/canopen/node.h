// SPDX-License-Identifier: Apache-2.0
/** @file Remote node as the master tracks it: boot sequence, heartbeat, emergencies, PDOs. */
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "hal/canopen/cob.h"
#include "hal/canopen/emcy.h"
#include "hal/canopen/node_guard.h"
#include "hal/canopen/pdo.h"
#include "hal/canopen/sdo_client.h"
#include "hal/canopen/setup.h"

namespace tandem::hal::canopen {

/** Setup of one node. Times in ns. */
struct NodeSetup {
  std::uint8_t id = 1;
  std::string name;              ///< readable name: "arm_a translation 1"
  std::vector<SetupStep> steps;  ///< before the PDOs
  std::vector<PdoConfig> rpdos;  ///< written and read back after the steps
  std::vector<PdoConfig> tpdos;
  std::vector<SetupStep> last_steps;             ///< after the PDOs
  std::int64_t heartbeat_timeout = 100'000'000;  ///< silence of an operational node, 0: not watched
  std::int64_t guard_period = 0;                 ///< of node guarding, instead of the node's heartbeat; 0: none
  std::int64_t boot_timeout = 2'000'000'000;     ///< from the reset to the boot-up message
  std::int64_t start_timeout = 1'000'000'000;    ///< from NMT start to a heartbeat with state operational
  std::int64_t sdo_timeout = 100'000'000;
  NmtCommand reset = NmtCommand::kResetCommunication;  ///< first command of boot(); or kResetNode
  int sdo_retries = 2;  ///< of a transfer without answer; each transfer may be executed twice
  /// Sets of protections (SetupStep): a node fails at the step with which it loses all of a set.
  std::vector<std::uint32_t> minimum;
};

/** Phase of a node during its boot. */
enum class NodePhase : std::uint8_t {
  kIdle = 0,     ///< no request yet
  kResetting,    ///< waits for the boot-up message
  kConfiguring,  ///< setup steps
  kConfigured,   ///< pre-operational, waits for start()
  kStarting,     ///< waits for a heartbeat with state operational
  kOperational,
  kFailed,  ///< see failure()
};
std::string_view name(NodePhase phase);

/** Reason of a node's failure. */
struct NodeFailure {
  enum class Reason : std::uint8_t {
    kNone = 0,
    kNoBootUp,
    kAborted,          ///< an SDO transfer: `step`, `abort`
    kMismatch,         ///< a check or a read-back: `step`, `value`
    kNotStarted,       ///< no heartbeat with state operational
    kHeartbeatLost,    ///< while operational; or no answer to node guarding
    kRebooted,         ///< a boot-up message without a request
    kLeftOperational,  ///< a heartbeat with another state
  };
  Reason reason = Reason::kNone;
  int step = -1;  ///< index in Node::steps()
  SdoAbort abort = SdoAbort::kNone;
  std::uint64_t value = 0;  ///< value read; kLeftOperational: the NmtState
};

/** A received PDO. */
struct Tpdo {
  PdoLayout layout;
  std::uint32_t id = 0;
  std::uint64_t word = 0;   ///< last word received
  std::int64_t time = 0;    ///< time of its reception, ns
  std::uint64_t count = 0;  ///< number received so far
  std::uint64_t bad_length = 0;

  std::uint64_t get(int slot) const noexcept { return layout.get(word, slot); }
  std::int64_t getSigned(int slot) const noexcept { return layout.getSigned(word, slot); }
};

/** A PDO to send with each requested Network::transmit(). */
struct Rpdo {
  PdoLayout layout;
  std::uint32_t id = 0;
  std::uint64_t word = 0;
  bool enabled = true;  ///< false: not sent
  std::uint64_t count = 0;

  void set(int slot, std::int64_t value) noexcept { word = layout.with(word, slot, static_cast<std::uint64_t>(value)); }
};

/** Place of an object in the PDOs of a node. */
struct PdoSlot {
  int pdo = -1;  ///< index in Node::tpdos() or rpdos(); -1: in none
  int slot = 0;

  bool mapped() const noexcept { return pdo >= 0; }
};

/** One node. Network controls it; other code reads it, and uses its SDO client while no configuration runs. */
class Node {
 public:
  /// @throw std::invalid_argument for an id out of range or a PDO without COB-ID or entries.
  explicit Node(const NodeSetup& setup);

  int id() const noexcept { return setup_.id; }
  const NodeSetup& setup() const noexcept { return setup_; }
  NodePhase phase() const noexcept { return phase_; }
  const NodeFailure& failure() const noexcept { return failure_; }
  /// Text for a person: "node 3 (arm_a rotation 1): quick stop option 605A:00: 06090030: value out of range".
  std::string describeFailure() const;
  /// "quick stop option 605A:00: sent 9: 06090030: value out of range". Reads only what is fixed after construction.
  std::string describe(const NodeFailure& failure) const;
  /// All steps in order, including those for the PDOs.
  const std::vector<SetupStep>& steps() const noexcept { return steps_; }
  /// Number of completed steps.
  int stepsDone() const noexcept { return step_; }
  /// Protections (SetupStep) that this node did not offer in its last configuration.
  std::uint32_t lostProtections() const noexcept { return lost_; }
  /// The caller has found that the node lacks these, too.
  void addLost(std::uint32_t protections) noexcept { lost_ |= protections; }
  /// The caller cannot use a node that states this by an object of a step: kFailed, kMismatch.
  void refuse(ObjectAddress object, std::uint64_t stated) noexcept;
  /// Result of the last kRead, kCheck or read-back of this object; nullptr: none.
  const std::uint64_t* readValue(ObjectAddress object) const noexcept;

  const Emcy& lastEmcy() const noexcept { return emcy_; }
  std::uint64_t emcyCount() const noexcept { return emcy_count_; }

  std::vector<Tpdo>& tpdos() noexcept { return tpdos_; }
  const std::vector<Tpdo>& tpdos() const noexcept { return tpdos_; }
  std::vector<Rpdo>& rpdos() noexcept { return rpdos_; }
  const std::vector<Rpdo>& rpdos() const noexcept { return rpdos_; }
  /// Place of an object that the node sends, or receives.
  PdoSlot tpdoSlot(ObjectAddress object) const noexcept;
  PdoSlot rpdoSlot(ObjectAddress object) const noexcept;
  /// Last value received of an object that is mapped.
  std::uint64_t get(PdoSlot at) const noexcept { return tpdos_[static_cast<std::size_t>(at.pdo)].get(at.slot); }
  std::int64_t getSigned(PdoSlot at) const noexcept {
    return tpdos_[static_cast<std::size_t>(at.pdo)].getSigned(at.slot);
  }
  /// Value to send of an object that is mapped.
  void set(PdoSlot at, std::int64_t value) noexcept { rpdos_[static_cast<std::size_t>(at.pdo)].set(at.slot, value); }
  SdoClient& sdo() noexcept { return sdo_; }
  /// No configuration and no transfer runs: the caller may use sdo().
  bool sdoFree() const noexcept { return phase_ != NodePhase::kConfiguring && !sdo_.busy(); }

  // Called by Network. All noexcept, without allocation.
  void boot(std::int64_t now) noexcept;   ///< requests a reset
  void start(std::int64_t now) noexcept;  ///< when configured: requests NMT start
  void release() noexcept;                ///< back to kIdle; heartbeats are not watched any more
  void poll(std::int64_t now) noexcept;   ///< time-outs, next setup step
  /// A byte of the node's state, of a heartbeat or a guarding answer. @return false: there is no such state
  bool onState(std::uint8_t byte, std::int64_t now) noexcept;
  /// The node needs a guarding request now; guardSent() once the bus has accepted it.
  bool guardDue(std::int64_t now) const noexcept;
  void guardSent(std::int64_t now) noexcept { guard_.sent(now); }
  void onEmcy(const Emcy& emcy) noexcept;
  /// The NMT command that this node needs now; removed once the bus has accepted it.
  bool nmtRequest(NmtCommand& command) const noexcept;
  void nmtSent(std::int64_t now) noexcept;

 private:
  void onHeartbeat(NmtState state, std::int64_t now) noexcept;
  void enter(NodePhase phase, std::int64_t now) noexcept;
  void fail(NodeFailure::Reason reason, std::uint64_t value = 0, SdoAbort abort = SdoAbort::kNone) noexcept;
  void configure(std::int64_t now) noexcept;
  void beginTransfer(std::int64_t now) noexcept;
  void endTransfer(std::int64_t now) noexcept;
  void nextStep() noexcept;
  void onAbort(SdoAbort abort, std::int64_t now) noexcept;
  void lose(SdoAbort abort) noexcept;
  void restartConfiguration() noexcept;
  void judge(std::int64_t now) noexcept;

  NodeSetup setup_;
  std::vector<SetupStep> steps_;
  std::vector<std::uint64_t> values_;  ///< values read, per step
  std::vector<bool> has_value_;
  std::vector<Tpdo> tpdos_;
  std::vector<Rpdo> rpdos_;
  SdoClient sdo_;
  NodePhase phase_ = NodePhase::kIdle;
  NodeFailure failure_;
  int step_ = 0;
  int restarts_ = 0;  ///< unexpected boot-ups during configuration, in this boot
  bool transferring_ = false;
  bool reading_back_ = false;
  SdoAbort refused_ = SdoAbort::kNone;  ///< why the node did not accept the value that is being read back
  std::uint32_t lost_ = 0;
  bool nmt_pending_ = false;
  std::int64_t deadline_ = 0;       ///< of the phase
  std::int64_t step_deadline_ = 0;  ///< of kAwait
  NmtState nmt_ = NmtState::kUnknown;
  NodeGuard guard_;
  std::int64_t heartbeat_time_ = 0;
  Emcy emcy_;
  std::uint64_t emcy_count_ = 0;
};

}  // namespace tandem::hal::canopen
