// SPDX-License-Identifier: Apache-2.0
/** @file DDS bus: one participant with typed writers and readers.
 *
 * No traffic leaves the chosen interface: no multicast, no shared memory, unicast discovery among the peers.
 * A match proves nothing (a peer may match and yet refuse the data), so services judge one another by sequence and age.
 * Nothing here belongs on a periodic thread: writers take a lock and may make a system call; hand over through
 * services/runtime/outbox.h instead.
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
#include "services/dds/messages.h"
#include "services/dds/topics.h"

namespace tandem::dds {

/** Where the discovery server listens. */
struct DiscoveryServer {
  std::string address;  ///< IPv4
  int port = 11811;     ///< UDP
  bool serve = false;   ///< this participant is the server
};

/** How a process joins. All processes of a robot use the same values, name excepted. */
struct BusOptions {
  std::string name = "tandem";                  ///< of this process, as discovery tools show it
  int domain = 0;                               ///< DDS domain, 0 to 232
  std::string prefix = "tandem";                ///< topic prefix, the robot's name
  std::string interface_address = "127.0.0.1";  ///< IPv4 address of the only interface used
  std::vector<std::string> peers{"127.0.0.1"};  ///< IPv4 addresses of hosts to look for; this host is always looked at
  bool deterministic = false;  ///< lock-step: periodic topics and commands reliable, without time limits
  /// s; a writer of commands that is silent for longer counts as dead.
  double command_age = 0.3;
  /// DDS Security: everything is encrypted, and only who is certified takes part. Empty: off.
  std::optional<Credentials> credentials;
  /// Discovery through a server instead of peers. Empty: none.
  std::optional<DiscoveryServer> discovery;
  /// As what this process knows the robot: goes out on topic `identity`, and its fingerprint with every message that
  /// carries one. With fingerprint 0 nothing is published, messages go out as they are, and those of all are taken.
  Identity identity;
};

/** What a reader may ask for beyond its topic's profile. */
struct ReaderOptions {
  /// 0: the profile's own. Otherwise keeps so many samples, as recorders and tools do, and asks for no deadline and no
  /// liveliness, so that it matches whatever the writer offers.
  int depth = 0;
  /// Names of participants whose samples count; empty: those of all do.
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
  std::uint64_t received = 0;         ///< samples given to the callback
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

/** A message of somebody who knows another robot or deployment than this process: it is given to nobody. */
struct Mismatch {
  std::string topic;  ///< its name in DDS
  std::uint64_t fingerprint = 0;
  std::uint64_t client = 0, request = 0;  ///< of a request, which wants an answer; otherwise 0
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

  /// Writes; never throws, and never waits for a reader.
  /// @return false where the message exceeds its capacities or DDS refused it; lastProblem() says why.
  bool write(const M& message) { return base_ && base_->write(&message); }
  /// Readers matched now.
  int matched() const { return statistics().matched; }
  WriterStatistics statistics() const { return base_ ? base_->statistics() : WriterStatistics{}; }
  /// The last thing that went wrong, for people; empty if nothing did.
  std::string lastProblem() const { return base_ ? base_->lastProblem() : std::string(); }

 private:
  std::unique_ptr<detail::WriterBase> base_;
};

/** Reads one topic until it is destroyed; once the destructor returns, its callback runs no more. Never destroy a
 * reader inside its own callback. */
class Reader {
 public:
  Reader() = default;
  explicit Reader(std::unique_ptr<detail::ReaderBase> base) : base_(std::move(base)) {}

  /// Writers matched now.
  int matched() const { return statistics().matched; }
  /// Samples given to the callback so far.
  std::uint64_t received() const { return statistics().received; }
  ReaderStatistics statistics() const { return base_ ? base_->statistics() : ReaderStatistics{}; }
  /// The last thing that went wrong, for people; empty if nothing did.
  std::string lastProblem() const { return base_ ? base_->lastProblem() : std::string(); }

 private:
  std::unique_ptr<detail::ReaderBase> base_;
};

/** One participant. Writers and readers may outlive the Bus, but none of them may outlive main(). */
class Bus {
 public:
  /// @throw std::invalid_argument for a wrong domain, prefix or address (the message names the value, and the addresses
  /// that this host has), std::runtime_error where DDS refuses to start.
  explicit Bus(const BusOptions& options);
  ~Bus();
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;

  /// A writer of a topic; `arm` is given for topics per arm, and only for these.
  /// @throw std::invalid_argument for a missing or superfluous arm, std::runtime_error where DDS refuses.
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

  /// What its readers, the former ones included, have dropped since its creation. Any thread.
  std::vector<Dropped> dropped() const;

  /// Everybody else who is there and has published its identity. Any thread.
  std::vector<Identity> others() const;
  /// Who has this session, also of those who have left of late.
  std::optional<Identity> identityOf(std::uint64_t session) const;
  /// Whom to call, on DDS threads, for each message of somebody who knows another robot or deployment; nobody from the
  /// moment on in which this returns with an empty function.
  void onMismatch(std::function<void(const Mismatch&)> handler);

  /// For the ends in this folder.
  const std::shared_ptr<detail::Participant>& participant() const { return participant_; }

 private:
  std::shared_ptr<detail::Participant> participant_;
  std::unique_ptr<detail::IdentityReader> others_;
  Writer<Identity> identity_;
};

}  // namespace tandem::dds
