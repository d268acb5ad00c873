// SPDX-License-Identifier: Apache-2.0
/** @file DDS bus: one participant with typed writers and readers.
 *
 * All traffic uses the chosen interface: no multicast, no shared memory, unicast discovery among the peers.
 * A match is not sufficient (a matched peer may still refuse the data), so services check one another by sequence and
 * age.
 * Not for periodic threads: writers take a lock and may make a system call; use services/runtime/outbox.h there.
 */
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "services/dds/credentials.h"
#include "services/dds/endpoints.h"
#include "services/dds/messages.h"
#include "services/dds/topics.h"

namespace tandem::dds {

/** Address of the discovery server. */
struct DiscoveryServer {
  std::string address;  ///< IPv4
  int port = 11811;     ///< UDP
  bool serve = false;   ///< this participant is the server
};

/** Options of a participant. All processes of a robot use the same values, except the name. */
struct BusOptions {
  std::string name = "tandem";                  ///< of this process, as discovery tools show it
  int domain = 0;                               ///< DDS domain, 0 to 232
  std::string prefix = "tandem";                ///< topic prefix, the robot's name
  std::string interface_address = "127.0.0.1";  ///< IPv4 address of the only interface used
  std::vector<std::string> peers{"127.0.0.1"};  ///< IPv4 addresses of hosts for discovery; this host is always included
  bool deterministic = false;  ///< lock-step: periodic topics and commands reliable, without time limits
  /// s; longest permitted silence of a writer of commands (deadline, liveliness).
  double command_age = 0.3;
  /// DDS Security: all traffic is encrypted, and only certified processes take part. Empty: off.
  std::optional<Credentials> credentials;
  /// Discovery through a server instead of peers. Empty: none.
  std::optional<DiscoveryServer> discovery;
  /// Robot and deployment of this process: published on topic `identity`, and its fingerprint in every message that has
  /// one. With fingerprint 0 no identity is published, messages are sent unchanged, and messages of all senders are
  /// accepted.
  Identity identity;
};

/** Options of a reader that differ from its topic's profile. */
struct ReaderOptions {
  /// History depth; 0: as in the profile. Otherwise, as for recorders and tools, without deadline and liveliness, so
  /// that it matches every writer.
  int depth = 0;
  /// Names of participants whose samples are accepted; empty: of all.
  std::vector<std::string> senders{};
};

/** Counters of a writer since its creation. */
struct WriterStatistics {
  int matched = 0;                 ///< readers matched now
  std::uint64_t written = 0;       ///< samples accepted
  std::uint64_t refused = 0;       ///< write() returned false
  std::uint64_t incompatible = 0;  ///< readers refused because of their quality of service
};

/** Counters of a reader since its creation. */
struct ReaderStatistics {
  int matched = 0;                    ///< writers matched now
  std::uint64_t received = 0;         ///< samples passed to the callback
  std::uint64_t malformed = 0;        ///< samples dropped: not decodable, or counts beyond capacity
  std::uint64_t incompatible = 0;     ///< writers refused because of their quality of service
  std::uint64_t deadline_missed = 0;  ///< command topics: no sample within the deadline
  std::uint64_t lost = 0;             ///< samples that DDS reports as lost
};

/** Samples of one topic that were dropped because they were malformed. */
struct Dropped {
  std::string topic;  ///< its name in DDS
  std::uint64_t count = 0;
  std::string why;  ///< of the last one
};

/** A received message of another robot or deployment; it is passed to no callback. */
struct Mismatch {
  std::string topic;  ///< its name in DDS
  std::uint64_t fingerprint = 0;
  std::uint64_t client = 0, request = 0;  ///< of a request, which needs a reply; otherwise 0
};

namespace detail {
class IdentityReader;
class Participant;

class WriterBase {
 public:
  virtual ~WriterBase() = default;
  virtual bool write(const void* message) = 0;
  virtual WriterStatistics statistics() const = 0;
  virtual std::string lastProblem() const = 0;
};

class ReaderBase {
 public:
  virtual ~ReaderBase() = default;
  virtual ReaderStatistics statistics() const = 0;
  virtual std::string lastProblem() const = 0;
};
}  // namespace detail

/** Writes one topic. Any thread may write; a default-constructed one refuses. */
template <class M>
class Writer {
 public:
  Writer() = default;
  explicit Writer(std::unique_ptr<detail::WriterBase> base) : base_(std::move(base)) {}

  /// Never throws, and never waits for a reader.
  /// @return false if the message exceeds its capacities or DDS refused it; lastProblem() has the reason.
  bool write(const M& message) { return base_ && base_->write(&message); }
  /// Readers matched now.
  int matched() const { return statistics().matched; }
  WriterStatistics statistics() const { return base_ ? base_->statistics() : WriterStatistics{}; }
  /// Description of the last error; empty: none.
  std::string lastProblem() const { return base_ ? base_->lastProblem() : std::string(); }

 private:
  std::unique_ptr<detail::WriterBase> base_;
};

/** Reads one topic until it is destroyed; the callback does not run after the destructor returns. Never destroy a
 * reader inside its own callback. */
class Reader {
 public:
  Reader() = default;
  explicit Reader(std::unique_ptr<detail::ReaderBase> base) : base_(std::move(base)) {}

  /// Writers matched now.
  int matched() const { return statistics().matched; }
  /// Samples passed to the callback so far.
  std::uint64_t received() const { return statistics().received; }
  ReaderStatistics statistics() const { return base_ ? base_->statistics() : ReaderStatistics{}; }
  /// Description of the last error; empty: none.
  std::string lastProblem() const { return base_ ? base_->lastProblem() : std::string(); }

 private:
  std::unique_ptr<detail::ReaderBase> base_;
};

/** One participant. Writers and readers may outlive the Bus, but none of them may outlive main(). */
class Bus {
 public:
  /// @throw std::invalid_argument for a wrong domain, prefix or address (the message names the value, and the addresses
  /// of this host), std::runtime_error if DDS refuses to start.
  explicit Bus(const BusOptions& options);
  ~Bus();
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;

  /// A writer of a topic; `arm` is given for topics per arm, and only for these.
  /// @throw std::invalid_argument for a missing or superfluous arm, std::runtime_error if DDS refuses.
  template <class M>
  Writer<M> writer(const Topic<M>& topic, const std::string& arm = "");

  /// A reader of a topic of the whole robot. The callback runs on a DDS thread, one sample at a time, and must return
  /// soon.
  /// @throw as writer().
  template <class M>
  Reader reader(const Topic<M>& topic,
                std::function<void(const std::type_identity_t<M>&)> callback,
                const ReaderOptions& options = {}) {
    return reader(topic, std::string(), std::move(callback), options);
  }

  /// A reader of a topic of one arm.
  template <class M>
  Reader reader(const Topic<M>& topic,
                const std::string& arm,
                std::function<void(const std::type_identity_t<M>&)> callback,
                const ReaderOptions& options = {});

  const BusOptions& options() const;

  /// Samples dropped by its readers, also destroyed ones, since its creation. Any thread.
  std::vector<Dropped> dropped() const;

  /// Identities of all other present participants that have published one. Any thread.
  std::vector<Identity> others() const;
  /// Writers and readers of all other participants. Any thread.
  std::vector<Endpoint> endpoints() const;
  /// Identity of a session, also of recently ended ones.
  std::optional<Identity> identityOf(std::uint64_t session) const;
  /// Sets the handler of messages of another robot or deployment, called on DDS threads. An empty function removes it:
  /// no handler runs after the return.
  void onMismatch(std::function<void(const Mismatch&)> handler);

  /// For readers and writers in this folder.
  const std::shared_ptr<detail::Participant>& participant() const { return participant_; }

 private:
  std::shared_ptr<detail::Participant> participant_;
  std::unique_ptr<detail::IdentityReader> others_;
  Writer<Identity> identity_;
};

}  // namespace tandem::dds
