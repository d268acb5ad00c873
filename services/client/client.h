// SPDX-License-Identifier: Apache-2.0
/** @file Client of a running system: requests with replies, and the latest samples of its topics. */
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <thread>

#include "services/client/arguments.h"
#include "services/client/clocks.h"
#include "services/dds/bus.h"
#include "services/runtime/process.h"

namespace tandem::client {

/** A service has refused a request. */
class Refusal : public Failure {
 public:
  Refusal(const std::string& who, const std::string& reason)
      : Failure(kFailure, who + " refused: " + reason), reason_(reason) {}
  const std::string& reason() const { return reason_; }

 private:
  std::string reason_;
};

/** Latest sample of each topic. */
struct Snapshot {
  dds::ActuationState state;
  dds::ControlStatus status;
  dds::PlanningReference reference;
  dds::HalStatus hal;
  dds::RunSummary summary;  ///< of the last run
  dds::Clearances clearances;
  std::map<std::string, dds::DiagnosticStatus> diagnostics;  ///< by service name
  std::uint64_t states = 0, statuses = 0, references = 0, hals = 0, clearance_count = 0,
                summaries = 0;  ///< samples received
};

/** One participant of a client. While the client has the control lease, a separate thread renews it. */
class Client {
 public:
  /// Receive every sample in order, on DDS threads; empty functions are not called.
  struct Callbacks {
    std::function<void(const dds::ActuationState&)> state;
    std::function<void(const dds::ControlStatus&)> status;
    std::function<void(const dds::PlanningReference&)> reference;
    std::function<void(const dds::HalStatus&)> hal;
    std::function<void(const dds::TipPoses&)> sim_tips;  ///< received only with this callback
  };

  /// kOurRobot: only messages of processes with the same robot and deployment. kAnyRobot: of all, for clients that stop
  /// any robot.
  enum class Receives { kOurRobot, kAnyRobot };

  explicit Client(const config::Deployment& deployment,
                  Callbacks callbacks = {},
                  Receives receives = Receives::kOurRobot);
  ~Client();

  std::uint64_t id() const { return id_; }
  Clocks& clocks() { return *clocks_; }
  /// For further topics.
  dds::Bus& bus() { return bus_; }
  const dds::Bus& bus() const { return bus_; }
  /// Whether its role may command; a viewer sends nothing but stop.
  bool commands() const { return role_ == dds::Role::kConsoleOperator; }
  Snapshot snapshot() const;

  /// Waits until `condition` is true; evaluates it at every sample. @return false at the deadline (s) or after an
  /// interruption.
  bool waitFor(double seconds, const std::function<bool(const Snapshot&)>& condition) const;
  /// Called about every 50 ms during a wait: true ends the wait.
  void setInterrupt(std::function<bool()> interrupted) { interrupted_ = std::move(interrupted); }
  /// From now on every wait ends with a Failure if no message from control arrives for `seconds`.
  void setSilenceLimit(double seconds) { silence_limit_ = seconds; }

  /// Time-out for an action that takes at most `seconds`; in lock-step at least the lock-step budget.
  double timeout(double seconds) const { return std::max(seconds, least_timeout_); }
  /// Receives the periodic topics; a new client does. Needed to connect, to wait, and for requests.
  void listen();
  /// Stops receiving them until listen(), so that a client that waits for other events causes no traffic.
  void rest();

  /// Services without a message for so many seconds: "; no recent message from sim (or hal), planning"; else empty.
  std::string silent(double seconds = 2.0) const;

  /// Waits until sim (or hal), control and planning are received and receive this client. @throw Failure that names the
  /// missing services.
  void connect(double seconds);

  /// Requests; each waits up to 10 s for its reply, interrupted or not. @throw Refusal with the service's reason;
  /// Failure for a viewer, or without a reply.
  dds::Reply control(dds::ControlRequest request);
  dds::Reply planning(dds::PlanningRequest request);
  dds::Reply sim(dds::SimRequest request);
  dds::Reply hal(dds::HalRequest request);
  /// Stops all arms, also without a successful connect(): writes at once, and again when control and when the drives
  /// are found; waits up to 5 s for both.
  void stop(const std::string& reason);
  /// The same to matched readers only, without waiting.
  void publishStop(const std::string& reason);

  void acquireLease();
  void releaseLease();
  /// "enable", "disable", ... for all arms; waits until all arms are in the resulting state.
  void stateCommand(const std::string& command);
  void setMethod(control::Method method);

  /// "cli (pid 4711 on vm)" of the client that has paused the arms, also if it has ended: from its own identity, or
  /// from control's diagnostics. Empty: neither was received. Does not lock; for conditions of waitFor().
  std::string nameOfPauser(const Snapshot& snapshot) const;

 private:
  /// The request, with session and sequence of the last control/status received.
  dds::ControlRequest answering(dds::ControlRequest request) const;
  struct Pending;
  bool wait(double seconds,
            const std::function<bool(const Snapshot&)>& condition,
            const std::function<bool()>& interrupted) const;
  void throwIfInterrupted(const std::string& done) const;
  template <class Request>
  dds::Reply call(const char* who, dds::Writer<Request>& writer, Request& request);
  bool findsDrives();
  void onReply(const dds::Reply& reply);

  std::uint64_t id_;
  dds::Role role_;
  Callbacks callbacks_;
  std::function<bool()> interrupted_;
  double silence_limit_ = 0.0;  ///< s; 0: unlimited
  double least_timeout_;        ///< s
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  Snapshot snapshot_;
  std::map<std::string, std::chrono::steady_clock::time_point> received_at_;  ///< by service
  std::uint64_t next_request_ = 1;
  std::vector<dds::Reply> replies_;
  dds::Bus bus_;
  dds::Writer<dds::ControlRequest> control_requests_;
  dds::Writer<dds::PlanningRequest> planning_requests_;
  dds::Writer<dds::SimRequest> sim_requests_;
  dds::Writer<dds::HalRequest> hal_requests_;
  dds::Writer<dds::Stop> stops_;
  dds::Reader control_replies_, planning_replies_, sim_replies_, hal_replies_, states_, statuses_, references_, hals_,
      clearances_, summaries_, diagnostics_, sim_tips_;
  std::atomic<bool> keep_lease_{false}, ending_{false};
  std::atomic<std::uint64_t> control_session_{0}, control_sequence_{0};  ///< of the last control/status, without mutex_
  std::unique_ptr<Clocks> clocks_;
  std::mutex keeper_mutex_;
  std::condition_variable keeper_changed_;
  std::thread lease_keeper_;
};

}  // namespace tandem::client
