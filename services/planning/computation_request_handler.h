// SPDX-License-Identifier: Apache-2.0
/** @file Computation request handler: clients' computations, one at a time, in a low-priority thread. */
#pragma once

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <variant>

#include "services/computation/computation.h"
#include "services/planning/plan.h"
#include "services/runtime/latest_value.h"
#include "services/runtime/mailbox.h"
#include "services/runtime/process.h"

namespace tandem::planning_service {

/** Takes requests, computes one at a time, tells how far it is, answers.
 *
 * A thread of its own computes, at a lower scheduling priority than all others of the process (nice 10). What it has to
 * say is sent by another thread of ordinary priority, so that no lock of DDS is ever held by a thread that the machine
 * has no time for. Nothing here waits for the thread that publishes references, nor that one for anything here.
 *
 * A computation ends early when its client says so, when its client has said nothing for kSilence, at its time limit,
 * or with the handler. While one runs, other clients get the answer that planning is busy. */
class ComputationRequestHandler {
 public:
  static constexpr double kSilence = 5.0;   ///< s, of a client that is still there
  static constexpr double kProgress = 0.2;  ///< s, between two messages of progress; more where nobody gives us time
  static constexpr int kNice = 10;

  using Outgoing = std::variant<dds::Reply, dds::ComputationProgress, dds::ComputationResult, Plan>;

  /// A Plan goes out before the result of the check that found it feasible.
  /// @param send  called by the handler's sending thread, one message after another
  ComputationRequestHandler(const runtime::Setup& setup, std::function<void(const Outgoing&)> send);
  /// Cancels what runs and sends its result.
  ~ComputationRequestHandler();
  ComputationRequestHandler(const ComputationRequestHandler&) = delete;
  ComputationRequestHandler& operator=(const ComputationRequestHandler&) = delete;

  /// From one thread at a time.
  void onState(const dds::ActuationState& state) noexcept { states_.store(state); }
  /// From any thread; returns at once.
  void onRequest(const dds::ComputationRequest& request);

 private:
  struct Job {
    dds::ComputationRequest request;
    std::int64_t begin = 0;                 ///< ns
    std::atomic<std::int64_t> received{0};  ///< of its client, ns
    std::atomic<dds::CancelledBy> cancelled{dds::CancelledBy::kNobody};
  };

  void answer(const dds::ComputationRequest& request, dds::ReplyCode code, const std::string& reason);
  void compute();
  void send();
  dds::ComputationResult run(const computation::Computation& computation, Job& job);
  std::optional<safety::RobotVector> presentJoints();

  const runtime::Setup& setup_;
  robots::RobotModel robot_;
  std::function<void(const Outgoing&)> send_;
  runtime::LatestValue<dds::ActuationState> states_;
  dds::ActuationState state_;  ///< the computing thread's
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::shared_ptr<Job> job_;  ///< the one that waits or runs
  bool taken_ = false;        ///< it runs
  bool end_ = false;
  runtime::Mailbox<std::optional<Outgoing>> outgoing_;  ///< nothing: the end
  std::thread computer_, sender_;
};

}  // namespace tandem::planning_service
