// SPDX-License-Identifier: Apache-2.0
/** @file Computation request handler: executes computations of clients, one at a time, in a low-priority thread. */
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

/** Executes requests one at a time, publishes progress and results.
 *
 * A separate thread computes, at a lower scheduling priority than all others of the process (nice 10). A second thread
 * of ordinary priority sends its messages, so that no preempted low-priority thread has a DDS lock. The handler and the
 * thread that publishes references never wait for each other.
 *
 * A computation ends early when its client cancels it, after kSilence without a keep-alive of its client, at its time
 * limit, or with the handler. While one runs, other requests are refused as busy. */
class ComputationRequestHandler {
 public:
  static constexpr double kSilence = 5.0;   ///< s, longest permitted silence of a client
  static constexpr double kProgress = 0.2;  ///< s, shortest period of progress messages
  static constexpr int kNice = 10;

  using Outgoing = std::variant<dds::Reply, dds::ComputationProgress, dds::ComputationResult, Plan>;

  /// Sends a Plan before the result of its feasibility check.
  /// @param send  called by the handler's sending thread, for one message at a time
  ComputationRequestHandler(const runtime::Setup& setup, std::function<void(const Outgoing&)> send);
  /// Cancels the running computation and sends its result.
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
    std::atomic<std::int64_t> received{0};  ///< last request or keep-alive of its client, ns
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
  dds::ActuationState state_;  ///< computing thread only
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::shared_ptr<Job> job_;  ///< waiting or running
  bool taken_ = false;        ///< job_ is running
  bool end_ = false;
  runtime::Mailbox<std::optional<Outgoing>> outgoing_;  ///< empty: ends the sending thread
  std::thread computer_, sender_;
};

}  // namespace tandem::planning_service
