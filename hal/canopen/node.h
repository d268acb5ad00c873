// SPDX-License-Identifier: Apache-2.0
/** @file Remote node as the master tracks it: boot sequence, heartbeat, emergencies, PDOs. */
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "hal/canopen/cob.h"
#include "hal/canopen/emcy.h"
#include "hal/canopen/pdo.h"
#include "hal/canopen/sdo_client.h"
#include "hal/canopen/setup.h"

namespace tandem::hal::canopen {

/** How one node is brought up. Times in ns. */
struct NodeSetup {
  std::uint8_t id = 1;
  std::string name;              ///< for people: "arm_a translation 1"
  std::vector<SetupStep> steps;  ///< before the PDOs
  std::vector<PdoConfig> rpdos;  ///< written and read back after the steps
  std::vector<PdoConfig> tpdos;
  std::vector<SetupStep> last_steps;             ///< after the PDOs
  std::int64_t heartbeat_timeout = 100'000'000;  ///< silence of an operational node, 0: not watched
  std::int64_t boot_timeout = 2'000'000'000;     ///< from the reset to the boot-up message
  std::int64_t start_timeout = 1'000'000'000;    ///< from NMT start to a heartbeat that says operational
  std::int64_t sdo_timeout = 100'000'000;
  NmtCommand reset = NmtCommand::kResetCommunication;  ///< what boot() begins with; or kResetNode
  int sdo_retries = 2;  ///< of a transfer whose answer got lost; all transfers may be done twice
};

/** Where a node stands on the way up. */
enum class NodePhase : std::uint8_t {
  kIdle = 0,     ///< nothing was asked of it
  kResetting,    ///< waits for the boot-up message
  kConfiguring,  ///< setup steps
  kConfigured,   ///< pre-operational, waits for start()
  kStarting,     ///< waits for "operational"
  kOperational,
  kFailed,  ///< see failure()
};
std::string_view name(NodePhase phase);

/** Why a node failed. */
struct NodeFailure {
  enum class Reason : std::uint8_t {
    kNone = 0,
    kNoBootUp,
    kAborted,          ///< an SDO transfer: `step`, `abort`
    kMismatch,         ///< a check or a read-back: `step`, `value`
    kNotStarted,       ///< never said "operational"
    kHeartbeatLost,    ///< while operational
    kRebooted,         ///< a boot-up message that nobody asked for
    kLeftOperational,  ///< its heartbeat says another state
  };
  Reason reason = Reason::kNone;
  int step = -1;  ///< index in Node::steps()
  SdoAbort abort = SdoAbort::kNone;
  std::uint64_t value = 0;  ///< what was read
};

/** A received PDO. */
struct Tpdo {
  PdoLayout layout;
  std::uint32_t id = 0;
  std::uint64_t word = 0;   ///< the last one received
  std::int64_t time = 0;    ///< its reception, ns
  std::uint64_t count = 0;  ///< received so far
  std::uint64_t bad_length = 0;

  std::uint64_t get(int slot) const noexcept { return layout.get(word, slot); }
  std::int64_t getSigned(int slot) const noexcept { return layout.getSigned(word, slot); }
};

/** A PDO to send, every time Network::transmit() is commanded to. */
struct Rpdo {
  PdoLayout layout;
  std::uint32_t id = 0;
  std::uint64_t word = 0;
  bool enabled = true;  ///< false: left out
  std::uint64_t count = 0;

  void set(int slot, std::int64_t value) noexcept { word = layout.with(word, slot, static_cast<std::uint64_t>(value)); }
};

/** One node. Network drives it; others read it, and use its SDO client while nothing is being configured. */
class Node {
 public:
  /// @throw std::invalid_argument for an id out of range or a PDO without COB-ID or entries.
  explicit Node(const NodeSetup& setup);

  int id() const noexcept { return setup_.id; }
  const NodeSetup& setup() const noexcept { return setup_; }
  NodePhase phase() const noexcept { return phase_; }
  const NodeFailure& failure() const noexcept { return failure_; }
  /// A sentence for people: "node 3 (arm_a rotation 1): quick stop option 605A:00: 06090030: value out of range".
  std::string describeFailure() const;
  /// All steps in order, those for the PDOs included.
  const std::vector<SetupStep>& steps() const noexcept { return steps_; }
  /// How many steps are done.
  int stepsDone() const noexcept { return step_; }
  /// What the last kRead, kCheck or read-back of this object gave, nullptr: none.
  const std::uint64_t* readValue(ObjectAddress object) const noexcept;

  const Emcy& lastEmcy() const noexcept { return emcy_; }
  std::uint64_t emcyCount() const noexcept { return emcy_count_; }

  std::vector<Tpdo>& tpdos() noexcept { return tpdos_; }
  const std::vector<Tpdo>& tpdos() const noexcept { return tpdos_; }
  std::vector<Rpdo>& rpdos() noexcept { return rpdos_; }
  const std::vector<Rpdo>& rpdos() const noexcept { return rpdos_; }
  SdoClient& sdo() noexcept { return sdo_; }
  /// Nothing is being configured and no transfer runs: sdo() is the caller's.
  bool sdoFree() const noexcept { return phase_ != NodePhase::kConfiguring && !sdo_.busy(); }

  // Driven by Network. All noexcept, without allocation.
  void boot(std::int64_t now) noexcept;   ///< asks for a reset
  void start(std::int64_t now) noexcept;  ///< configured: asks for NMT start
  void release() noexcept;                ///< back to kIdle; nothing is watched any more
  void poll(std::int64_t now) noexcept;   ///< time-outs, next setup step
  void onHeartbeat(NmtState state, std::int64_t now) noexcept;
  void onEmcy(const Emcy& emcy) noexcept;
  /// The NMT command that this node needs now, taken out when the bus took it.
  bool nmtRequest(NmtCommand& command) const noexcept;
  void nmtSent(std::int64_t now) noexcept;

 private:
  void enter(NodePhase phase, std::int64_t now) noexcept;
  void fail(NodeFailure::Reason reason, std::uint64_t value = 0, SdoAbort abort = SdoAbort::kNone) noexcept;
  void configure(std::int64_t now) noexcept;
  void beginTransfer(std::int64_t now) noexcept;
  void endTransfer(std::int64_t now) noexcept;
  void nextStep() noexcept;
  void restartConfiguration() noexcept;
  void judge(std::int64_t now) noexcept;

  NodeSetup setup_;
  std::vector<SetupStep> steps_;
  std::vector<std::uint64_t> values_;  ///< what was read, per step
  std::vector<bool> has_value_;
  std::vector<Tpdo> tpdos_;
  std::vector<Rpdo> rpdos_;
  SdoClient sdo_;
  NodePhase phase_ = NodePhase::kIdle;
  NodeFailure failure_;
  int step_ = 0;
  int restarts_ = 0;  ///< boot-ups while it was configured, of this boot
  bool transferring_ = false;
  bool reading_back_ = false;
  bool nmt_pending_ = false;
  std::int64_t deadline_ = 0;       ///< of the phase
  std::int64_t step_deadline_ = 0;  ///< of kAwait
  NmtState nmt_ = NmtState::kUnknown;
  std::int64_t heartbeat_time_ = 0;
  Emcy emcy_;
  std::uint64_t emcy_count_ = 0;
};

}  // namespace tandem::hal::canopen
