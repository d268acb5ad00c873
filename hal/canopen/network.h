// SPDX-License-Identifier: Apache-2.0
/** @file CANopen master of one bus: NMT, SYNC, heartbeats, emergencies, PDOs of all nodes. */
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "hal/can/bus.h"
#include "hal/canopen/master_watch.h"
#include "hal/canopen/node.h"
#include "hal/event_ring.h"

namespace tandem::hal::canopen {

struct NetworkOptions {
  std::uint8_t own_id = 127;                   ///< node id of our heartbeat
  std::int64_t heartbeat_period = 25'000'000;  ///< ns
  std::uint8_t sync_overflow = 0;              ///< object 1019: 0 no counter, else 2..240
  std::int64_t master_silence = 500'000'000;   ///< time-out for another master that was received, ns
  int request_interval = 1;                    ///< SYNCs per SDO request while Transmission::few_requests
};

/** Event of a network, in order of occurrence. */
struct NetworkEvent {
  enum class Kind : std::uint8_t {
    kPhase,     ///< a node entered `phase`; kFailed: see its failure()
    kEmcy,      ///< `emcy`
    kBusState,  ///< `bus_state`
    kMaster,    ///< another master sends `master`: the first such frame, or the first after a silence
  };
  Kind kind = Kind::kPhase;
  int node = -1;  ///< index in Network; -1: the bus
  NodePhase phase = NodePhase::kIdle;
  Emcy emcy;
  can::BusState bus_state = can::BusState::kActive;
  MasterFrame master = MasterFrame::kSync;
  std::int64_t time = 0;  ///< ns
};

/** Number of received frames by kind. Their sum is `received`. */
struct NetworkCounters {
  std::uint64_t received = 0;
  std::uint64_t tpdos = 0;       ///< of our nodes, with the right length, while the node may send them
  std::uint64_t early_pdos = 0;  ///< ... before it was started or after it failed
  std::uint64_t heartbeats = 0;
  std::uint64_t emcies = 0;
  std::uint64_t sdos = 0;
  std::uint64_t errors = 0;     ///< error frames
  std::uint64_t malformed = 0;  ///< wrong length, or a state that does not exist
  std::uint64_t masters = 0;    ///< of another master: NMT, SYNC, our own heartbeat, SDO requests, our RPDOs
  std::uint64_t foreign = 0;    ///< everything else: unknown nodes, 29 bits, remote, CAN FD, TIME, LSS

  std::uint64_t total() const noexcept {
    return tpdos + early_pdos + heartbeats + emcies + sdos + errors + malformed + masters + foreign;
  }
};

/** Selection of the periodic frames to send. */
struct Transmission {
  bool rpdos = false;  ///< of all nodes that are operational
  bool sync = false;   ///< after them
  /// The bus carries the traffic of a moving robot: besides urgent SDO requests at most one of all nodes, and that only
  /// once per NetworkOptions::request_interval SYNCs. Otherwise the request of each node.
  bool few_requests = false;
};

/** Master of one bus. No thread and no clock of its own: call receive() and transmit() with the time, at least once per
 * bus period. Nothing after the last addNode() allocates, locks, or throws. */
class Network {
 public:
  /// The bus must outlive the network. @throw std::invalid_argument for an id or an overflow out of range.
  Network(can::Bus& bus, const NetworkOptions& options = {});

  /// @return index of the node. @throw std::invalid_argument: id or COB-ID of a PDO in use, invalid setup.
  int addNode(const NodeSetup& setup);
  int nodeCount() const noexcept { return static_cast<int>(nodes_.size()); }
  Node& node(int index) noexcept { return *nodes_[index]; }
  const Node& node(int index) const noexcept { return *nodes_[index]; }

  /// Resets and configures a node, concurrently with all others.
  void boot(int index, std::int64_t now) noexcept;
  void bootAll(std::int64_t now) noexcept;
  /// Starts a configured node.
  void start(int index, std::int64_t now) noexcept;
  void startAll(std::int64_t now) noexcept;
  /// Sends one NMT command with the next transmit(). @param id 0: all nodes.
  void command(NmtCommand command, std::uint8_t id) noexcept;
  /// There is at least one node, and all nodes are in this phase.
  bool all(NodePhase phase) const noexcept;
  bool anyFailed() const noexcept;

  /// Our heartbeat and the requests of node guarding, initially off: the time-out of a node starts with the first one
  /// that it receives.
  void setHeartbeat(bool on, NmtState state = NmtState::kOperational) noexcept;

  /// Processes all received frames and advances the nodes. @return number of frames.
  std::size_t receive(std::int64_t now) noexcept;

  /** Sends all due frames in one batch: NMT, heartbeat, RPDOs, SYNC, SDO requests. RPDOs and SYNC that the bus does not
   * accept are dropped: the next ones supersede them. NMT, heartbeat and SDO requests are tried again.
   * @return number of accepted frames. */
  std::size_t transmit(std::int64_t now, const Transmission& what = {}) noexcept;

  /// Removes the oldest event. @return false: there is none.
  bool nextEvent(NetworkEvent& event) noexcept { return events_.pop(event); }

  const NetworkCounters& counters() const noexcept { return counters_; }
  /// Frames of other masters since the start.
  const MasterWatch& masters() const noexcept { return masters_; }
  can::Bus& bus() noexcept { return bus_; }
  const can::Bus& bus() const noexcept { return bus_; }
  std::uint64_t syncCount() const noexcept { return syncs_; }

 private:
  enum class Use : std::uint8_t { kForeign = 0, kTpdo, kMaster, kHeartbeat, kEmcy, kSdo };
  struct Route {
    Use use = Use::kForeign;
    std::uint8_t node = 0;
    std::uint8_t pdo = 0;
    MasterFrame master = MasterFrame::kSync;
  };
  struct Command {
    NmtCommand command = NmtCommand::kStart;
    std::uint8_t id = 0;
  };

  void claim(std::uint32_t id, Route route);
  void dispatch(const CanFrame& frame, std::int64_t now) noexcept;
  void onTpdo(const CanFrame& frame, const Route& route) noexcept;
  void onHeartbeat(const CanFrame& frame, Node& node, std::int64_t now) noexcept;
  void onEmcy(const CanFrame& frame, const Route& route) noexcept;
  void onMaster(MasterFrame frame, std::int64_t now) noexcept;
  void noticePhases(std::int64_t now) noexcept;
  void queue(const CanFrame& frame, std::int16_t origin) noexcept;
  void queueNmt() noexcept;
  void queueGuards(std::int64_t now) noexcept;
  void queueRpdos() noexcept;
  void queueRequests(bool few) noexcept;
  void finishSend(std::size_t taken, std::int64_t now) noexcept;

  can::Bus& bus_;
  NetworkOptions options_;
  std::vector<std::unique_ptr<Node>> nodes_;
  std::vector<NodePhase> phases_;  ///< as last reported
  std::array<Route, 0x800> routes_{};
  std::array<CanFrame, 64> incoming_{};
  std::vector<CanFrame> outgoing_;
  std::vector<std::int16_t> origin_;  ///< source of each outgoing frame
  std::size_t outgoing_count_ = 0;
  std::array<Command, 16> commands_{};
  std::size_t command_count_ = 0;
  EventRing<NetworkEvent, 256> events_;
  bool heartbeat_ = false;
  NmtState heartbeat_state_ = NmtState::kOperational;
  std::int64_t next_heartbeat_ = 0;
  std::uint8_t sync_counter_ = 0;
  std::uint64_t syncs_ = 0;
  std::size_t next_request_ = 0;         ///< node whose SDO request is due first
  std::uint64_t next_request_sync_ = 0;  ///< few requests: not before this SYNC
  can::BusState bus_state_ = can::BusState::kActive;
  NetworkCounters counters_;
  MasterWatch masters_;
};

}  // namespace tandem::hal::canopen
