// SPDX-License-Identifier: Apache-2.0
#include "services/client/client.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "operation/permission.h"
#include "safety/operating_state.h"
#include "services/client/arguments.h"
#include "services/client/role.h"
#include "services/runtime/diagnostics.h"
#include "services/runtime/identity.h"

namespace tandem::client {
namespace {

/// Options of a client's participant: its session is the client id, so that services find the process of a client.
dds::BusOptions optionsOf(const config::Deployment& deployment, Client::Receives receives, std::uint64_t id) {
  dds::BusOptions options = clientOptions(deployment);
  options.identity.session = id;
  return receives == Client::Receives::kAnyRobot ? runtime::ofAnyRobot(options) : options;
}

constexpr double kAnswerTime = 10.0;  // s
constexpr double kStopTime = 5.0;     // s, for discovery of the receivers of a stop
constexpr const char* kDrives = "sim (or hal)";
constexpr const char* speakerOf(const dds::ActuationState&) { return kDrives; }
constexpr const char* speakerOf(const dds::ControlStatus&) { return "control"; }
constexpr const char* speakerOf(const dds::PlanningReference&) { return "planning"; }
template <class M>
constexpr const char* speakerOf(const M&) {
  return "";
}
constexpr int kRecorderDepth = 4096;  // samples: none is lost between two callbacks

}  // namespace

Client::Client(const config::Deployment& deployment, Callbacks callbacks, Receives receives)
    : id_(runtime::randomIdentity()),
      role_(localRole(deployment)),
      callbacks_(std::move(callbacks)),
      least_timeout_(deployment.clock == config::ClockMode::kLockStep ? deployment.budgets.lock_step : 0.0),
      bus_(optionsOf(deployment, receives, id_)) {
  if (commands()) {
    control_requests_ = bus_.writer(dds::kControlRequest);
    planning_requests_ = bus_.writer(dds::kPlanningRequest);
    sim_requests_ = bus_.writer(dds::kSimRequest);
    hal_requests_ = bus_.writer(dds::kHalRequest);
  }
  stops_ = bus_.writer(dds::kStop);
  const auto reply = [this](const dds::Reply& r) { onReply(r); };
  control_replies_ = bus_.reader(dds::kControlReply, reply);
  planning_replies_ = bus_.reader(dds::kPlanningReply, reply);
  sim_replies_ = bus_.reader(dds::kSimReply, reply);
  hal_replies_ = bus_.reader(dds::kHalReply, reply);
  const auto start = std::chrono::steady_clock::now();
  received_at_ = {{kDrives, start}, {"control", start}, {"planning", start}};
  listen();
  diagnostics_ = bus_.reader(dds::kDiagnostics, [this](const dds::DiagnosticArray& m) {
    const std::lock_guard lock(mutex_);
    for (const dds::DiagnosticStatus& status : m.status)
      snapshot_.diagnostics[status.name] = status;
  });
  if (callbacks_.sim_tips) {
    sim_tips_ = bus_.reader(
        dds::kSimTips,
        [this](const auto& m) {
          callbacks_.sim_tips(m);
          // An empty critical section: a thread between its check of the condition and its wait has started to wait
          // when it ends.
          { const std::lock_guard lock(mutex_); }
          changed_.notify_all();
        },
        dds::ReaderOptions{kRecorderDepth});
  }
  clocks_ = std::make_unique<Clocks>(bus_, id_);  // after all other ends: see Clocks::received()
  lease_keeper_ = std::thread([this, period = 0.2 * deployment.budgets.lease] {
    while (!ending_) {
      if (keep_lease_) {
        dds::ControlRequest keep;
        keep.client = id_;
        keep.kind = static_cast<std::uint8_t>(dds::ControlKind::kKeepLease);
        control_requests_.write(answering(keep));
      }
      // Not mutex_ and changed_: samples would wake this thread thousands of times a second, and delay it.
      std::unique_lock lock(keeper_mutex_);
      keeper_changed_.wait_for(lock, std::chrono::duration<double>(period), [this] { return ending_.load(); });
    }
  });
}

void Client::listen() {
  const auto received = [this](auto Snapshot::*slot, std::uint64_t Snapshot::*count, const auto& message,
                               const auto& tap) {
    {
      const std::lock_guard lock(mutex_);
      snapshot_.*slot = message;
      ++(snapshot_.*count);
      if (const char* who = speakerOf(message); *who != '\0')
        received_at_[who] = std::chrono::steady_clock::now();
    }
    if (tap)
      tap(message);
    changed_.notify_all();
  };
  // The callbacks are members, which outlive the readers.
  const auto read = [&](const auto& topic, auto slot, auto count, const auto& tap) {
    return bus_.reader(
        topic, [received, slot, count, &tap](const auto& m) { received(slot, count, m, tap); },
        dds::ReaderOptions{kRecorderDepth});
  };
  states_ = read(dds::kActuationState, &Snapshot::state, &Snapshot::states, callbacks_.state);
  references_ = read(dds::kPlanningReference, &Snapshot::reference, &Snapshot::references, callbacks_.reference);
  hals_ = read(dds::kHalStatus, &Snapshot::hal, &Snapshot::hals, callbacks_.hal);
  statuses_ = bus_.reader(
      dds::kControlStatus,
      [this, received](const auto& m) {
        control_session_ = m.session;
        control_sequence_ = m.sequence;
        received(&Snapshot::status, &Snapshot::statuses, m, callbacks_.status);
      },
      dds::ReaderOptions{kRecorderDepth});
  clearances_ = bus_.reader(dds::kControlClearance, [received](const auto& m) {
    received(&Snapshot::clearances, &Snapshot::clearance_count, m, std::function<void(const dds::Clearances&)>());
  });
  summaries_ = bus_.reader(dds::kPlanningSummary, [received](const auto& m) {
    received(&Snapshot::summary, &Snapshot::summaries, m, std::function<void(const dds::RunSummary&)>());
  });
}

void Client::rest() {
  for (dds::Reader* reader : {&states_, &statuses_, &references_, &hals_, &clearances_, &summaries_})
    *reader = {};
}

Client::~Client() {
  // After a failure: releases the lease, so that the next client need not wait until it expires.
  if (keep_lease_.exchange(false)) {
    dds::ControlRequest release;
    release.client = id_;
    release.kind = static_cast<std::uint8_t>(dds::ControlKind::kReleaseLease);
    control_requests_.write(release);
    // The sample can be lost if the participant is deleted at once: wait until control publishes the release.
    interrupted_ = {};
    silence_limit_ = 0.0;
    waitFor(0.5, [this](const Snapshot& s) { return s.status.lease_owner != id_; });
  }
  {
    const std::lock_guard lock(keeper_mutex_);
    ending_ = true;
  }
  keeper_changed_.notify_all();
  lease_keeper_.join();
}

Snapshot Client::snapshot() const {
  const std::lock_guard lock(mutex_);
  return snapshot_;
}

std::string Client::silent(double seconds) const {
  const std::lock_guard lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  std::string names;
  for (const auto& [who, at] : received_at_) {
    if (now - at > std::chrono::duration<double>(seconds))
      names += (names.empty() ? "; no recent message from " : ", ") + who;
  }
  return names;
}

bool Client::waitFor(double seconds, const std::function<bool(const Snapshot&)>& condition) const {
  return wait(seconds, condition, interrupted_);
}

bool Client::wait(double seconds,
                  const std::function<bool(const Snapshot&)>& condition,
                  const std::function<bool()>& interrupted) const {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  std::unique_lock lock(mutex_);
  auto received = std::chrono::steady_clock::now();
  std::uint64_t statuses = snapshot_.statuses;
  while (!condition(snapshot_)) {
    const auto now = std::chrono::steady_clock::now();
    if (snapshot_.statuses != statuses)
      received = now;
    statuses = snapshot_.statuses;
    if (silence_limit_ > 0.0 && now - received > std::chrono::duration<double>(silence_limit_)) {
      throw Failure(kFailure, "no message from control for " + std::to_string(std::lround(silence_limit_)) +
                                  " s; check that `tandem up` is running");
    }
    if (now >= deadline || (interrupted && interrupted()))
      return false;
    changed_.wait_until(lock, std::min<std::chrono::steady_clock::time_point>(
                                  now + std::chrono::milliseconds(50),
                                  std::chrono::time_point_cast<std::chrono::steady_clock::duration>(deadline)));
  }
  return true;
}

void Client::throwIfInterrupted(const std::string& done) const {
  if (interrupted_ && interrupted_())
    throw Failure(kFailure, "interrupted; " + done);
}

void Client::connect(double seconds) {
  std::string missing;
  const auto ready = [&](const Snapshot& s) {
    missing.clear();
    const auto add = [&](const char* process) { missing += (missing.empty() ? " " : ", ") + std::string(process); };
    if (s.states == 0 || !findsDrives())
      add("sim (or hal)");
    // Receiving each service is not enough: each must also have received from the one before it.
    if (s.statuses == 0 || !clocks_->found("control") || s.status.answers_state == 0)
      add("control");
    if (s.reference.answers_state == 0 || !clocks_->found("planning") || s.reference.answers_control == 0)
      add("planning");
    return missing.empty();
  };
  // Processes of another robot or deployment run, but ignore this client.
  constexpr double kAnnouncement = 1.0;  // s
  waitFor(std::min(seconds, kAnnouncement), [&](const Snapshot& s) { return ready(s); });
  const std::vector<std::string> others = missing.empty() ? std::vector<std::string>{} : runtime::mismatches(bus_);
  if (!others.empty())
    throw Failure(kFailure,
                  others.front() + "; no request was sent. Use the same files for both, or another domain or prefix");
  if (!waitFor(seconds, ready)) {
    throwIfInterrupted("nothing was requested");
    throw Failure(kFailure, "not running or not connected:" + missing + " (domain " +
                                std::to_string(bus_.options().domain) + ", prefix " + bus_.options().prefix +
                                "); check that `tandem up` is running");
  }
}

void Client::onReply(const dds::Reply& reply) {
  if (reply.client != id_ || reply.request == 0)
    return;
  {
    const std::lock_guard lock(mutex_);
    replies_.push_back(reply);
  }
  changed_.notify_all();
}

template <class Request>
dds::Reply Client::call(const char* who, dds::Writer<Request>& writer, Request& request) {
  if (!commands())
    throw Failure(kFailure, std::string("role ") + dds::name(role_) +
                                " may read topics and stop the robot, but not send requests to " + who +
                                "; use --role operator (docs/security.md)");
  // A matched reader of the requests is not enough: it may be a recorder.
  if (!waitFor(timeout(kAnswerTime), [&](const Snapshot&) { return clocks_->found(who); })) {
    throwIfInterrupted("nothing was requested");
    throw Failure(kFailure,
                  std::string(who) + " was not found; check that `tandem up` is running, with a process `" + who + "`");
  }
  {
    const std::lock_guard lock(mutex_);
    request.client = id_;
    request.request = next_request_++;
  }
  writer.write(request);
  dds::Reply answer;
  // No interruption ends this wait: the request may take effect, and the reply gives the id of what has to be ended.
  const bool answered = wait(timeout(kAnswerTime),
                             [&](const Snapshot&) {
                               const auto found =
                                   std::find_if(replies_.begin(), replies_.end(),
                                                [&](const dds::Reply& r) { return r.request == request.request; });
                               if (found == replies_.end())
                                 return false;
                               answer = *found;
                               return true;
                             },
                             {});
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(replies_, [&](const dds::Reply& r) { return r.request <= request.request; });
  }
  if (!answered)
    throw Failure(kFailure, std::string(who) + " did not answer" + silent());
  if (answer.accepted == 0)
    throw Refusal(who, answer.reason);
  return answer;
}

dds::ControlRequest Client::answering(dds::ControlRequest request) const {
  request.control_session = control_session_;
  request.answers_control = control_sequence_;
  return request;
}

dds::Reply Client::control(dds::ControlRequest request) {
  request = answering(std::move(request));
  return call("control", control_requests_, request);
}
dds::Reply Client::planning(dds::PlanningRequest request) { return call("planning", planning_requests_, request); }
dds::Reply Client::sim(dds::SimRequest request) { return call("sim", sim_requests_, request); }

dds::Reply Client::hal(dds::HalRequest request) { return call("hal", hal_requests_, request); }

void Client::publishStop(const std::string& reason) { stops_.write({id_, 1, reason}); }

void Client::stop(const std::string& reason) {
  const dds::Stop stop{id_, 1, reason + ", by " + runtime::describeThisProcess(bus_.options().name)};
  stops_.write(stop);  // to matched readers, and again after each discovery: a stop may be received twice
  int reported = 0;
  waitFor(kStopTime, [&](const Snapshot&) {
    const int found = (clocks_->found("control") ? 1 : 0) + (findsDrives() ? 1 : 0);
    if (found > reported)
      stops_.write(stop);
    reported = found;
    return found == 2;
  });
}

bool Client::findsDrives() { return clocks_->found("sim") || clocks_->found("hal"); }

void Client::acquireLease() {
  dds::ControlRequest request;
  request.kind = static_cast<std::uint8_t>(dds::ControlKind::kAcquireLease);
  control(request);
  keep_lease_ = true;
  // Planning reads the lease owner from control/status.
  waitFor(timeout(kAnswerTime), [this](const Snapshot& s) { return s.status.lease_owner == id_; });
}

void Client::releaseLease() {
  keep_lease_ = false;
  dds::ControlRequest request;
  request.kind = static_cast<std::uint8_t>(dds::ControlKind::kReleaseLease);
  control(request);
}

namespace {

/// ": in FAULT: clearance. What to do."; empty without a fault.
std::string describeFaults(const dds::ControlStatus& status) {
  for (std::size_t k = 0; k < status.arm_count; ++k) {
    if (const safety::FaultMask faults = status.faults[k]; faults != 0)
      return ": in FAULT: " + safety::describeFaults(faults) + ". " +
             std::string(safety::remedy(static_cast<safety::Fault>(faults & -faults)));
  }
  return {};
}

}  // namespace

void Client::stateCommand(const std::string& command) {
  dds::ControlRequest request;
  request.kind = static_cast<std::uint8_t>(dds::ControlKind::kStateCommand);
  request.value = command;
  control(request);
  const auto wanted = command == "enable" || command == "resume" ? safety::OperatingState::kEnabled
                      : command == "pause"                       ? safety::OperatingState::kPaused
                                                                 : safety::OperatingState::kDisabled;
  const bool reached = waitFor(timeout(kAnswerTime), [&](const Snapshot& s) {
    for (std::size_t k = 0; k < s.status.arm_count; ++k) {
      if (s.status.operating_state[k] != static_cast<std::uint8_t>(wanted))
        return false;
    }
    return s.status.arm_count > 0;
  });
  if (!reached)
    throwIfInterrupted("'" + command + "' was accepted; it may take effect later");
  const Snapshot now = snapshot();
  bool homed = true;
  for (std::size_t k = 0; k < now.hal.arm_count && now.hal.bus_count > 0; ++k)
    homed = homed && now.hal.homed[k] != 0;
  if (!reached && !homed)
    throw Failure(kFailure, "'" + command + "' was accepted, but " +
                                std::string(idl::name(operation::Reason::kJointsUnknown)) +
                                "; `tandem can monitor` shows nodes that do not start");
  if (!reached)
    throw Failure(kFailure, "'" + command + "' was accepted, but not all arms are " + std::string(name(wanted)) +
                                describeFaults(now.status) + "; see `tandem status`");
}

void Client::setMethod(control::Method method) {
  dds::ControlRequest request;
  request.kind = static_cast<std::uint8_t>(dds::ControlKind::kSetMethod);
  request.text = std::string(control::name(method));
  control(request);
}

std::string Client::nameOfPauser(const Snapshot& snapshot) const {
  const std::uint64_t client = snapshot.status.paused_by;
  if (const auto known = bus_.identityOf(client))
    return runtime::describe(*known);
  const auto control = snapshot.diagnostics.find(runtime::kControl);
  if (control == snapshot.diagnostics.end())
    return {};
  const auto& values = control->second.values;
  const auto name = std::ranges::find(values, runtime::kPausedByKey + std::to_string(client), &dds::KeyValue::key);
  return name == values.end() ? std::string() : name->value;
}

}  // namespace tandem::client
