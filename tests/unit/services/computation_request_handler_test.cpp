// SPDX-License-Identifier: Apache-2.0
#include "services/planning/computation_request_handler.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <condition_variable>
#include <filesystem>

#include "services/computation/reports.h"
#include "services/runtime/periodic_loop.h"
#include "tests/unit/services/computation_fixture.h"

namespace tandem::test {
namespace {

using dds::ComputationKind;
using planning_service::ComputationRequestHandler;

/// A handler, and its replies.
class Listener {
 public:
  explicit Listener(const runtime::Setup& setup)
      : handler(std::make_unique<ComputationRequestHandler>(setup,
                                                            [this](const ComputationRequestHandler::Outgoing& message) {
                                                              {
                                                                const std::lock_guard lock(mutex_);
                                                                received_.push_back(message);
                                                              }
                                                              changed_.notify_all();
                                                            })) {}

  /// Waits for the first message of that type and request.
  template <class M>
  std::optional<M> await(std::uint64_t request, double seconds = 60.0) {
    std::optional<M> found;
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::chrono::duration<double>(seconds), [&] {
      for (const auto& message : received_) {
        const M* m = std::get_if<M>(&message);
        if (!found && m != nullptr && m->request == request)
          found = *m;
      }
      return found.has_value();
    });
    return found;
  }
  void send(dds::ComputationRequest request, std::uint64_t number, std::uint64_t client = 5) {
    request.client = client;
    request.request = number;
    handler->onRequest(request);
  }
  void send(ComputationKind kind, std::uint64_t number, std::uint64_t computation, std::uint64_t client = 5) {
    dds::ComputationRequest request;
    request.kind = static_cast<std::uint8_t>(kind);
    request.computation = computation;
    send(request, number, client);
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<ComputationRequestHandler::Outgoing> received_;

 public:
  std::unique_ptr<ComputationRequestHandler> handler;
};

dds::ComputationRequest endless(const ComputationFixture& fixture) {
  dds::ComputationRequest request = fixture.request;
  request.kind = static_cast<std::uint8_t>(ComputationKind::kChooseStart);
  request.tries = 10000;
  return request;
}

dds::ReplyCode codeOf(const std::optional<dds::Reply>& reply) {
  return reply ? static_cast<dds::ReplyCode>(reply->code) : dds::ReplyCode::kFailed;
}

TEST(ComputationRequestHandler, OneAtATimeWithProgressAndCancelledAtOnce) {
  ComputationFixture fixture;
  Listener listener(fixture.setup);
  listener.send(fixture.request, 1);
  EXPECT_EQ(codeOf(listener.await<dds::Reply>(1)), dds::ReplyCode::kWrongState) << "nobody knows the joints";
  listener.handler->onState(fixture.state());
  listener.send(endless(fixture), 2);
  EXPECT_EQ(codeOf(listener.await<dds::Reply>(2)), dds::ReplyCode::kOk);
  ASSERT_TRUE(listener.await<dds::ComputationProgress>(2));
  listener.send(fixture.request, 3, 6);
  EXPECT_EQ(codeOf(listener.await<dds::Reply>(3)), dds::ReplyCode::kBusy);
  listener.send(ComputationKind::kCancel, 4, 2, 6);
  EXPECT_EQ(codeOf(listener.await<dds::Reply>(4)), dds::ReplyCode::kUnknown) << "another client's";
  const std::int64_t begin = runtime::monotonicNow();
  listener.send(ComputationKind::kCancel, 5, 2);
  EXPECT_EQ(codeOf(listener.await<dds::Reply>(5)), dds::ReplyCode::kOk);
  const auto result = listener.await<dds::ComputationResult>(2);
  EXPECT_LT(1e-9 * static_cast<double>(runtime::monotonicNow() - begin), 10.0);
  ASSERT_TRUE(result);
  EXPECT_EQ(static_cast<dds::Outcome>(result->outcome), dds::Outcome::kCancelled);
  EXPECT_EQ(static_cast<dds::CancelledBy>(result->cancelled_by), dds::CancelledBy::kClient);
  listener.send(fixture.request, 6, 6);  // free again
  EXPECT_EQ(codeOf(listener.await<dds::Reply>(6)), dds::ReplyCode::kOk);
  const auto good = listener.await<dds::ComputationResult>(6);
  ASSERT_TRUE(good);
  EXPECT_EQ(static_cast<dds::Outcome>(good->outcome), dds::Outcome::kGood) << good->reason;
  EXPECT_EQ(good->start, computation::listOf(fixture.home));
}

TEST(ComputationRequestHandler, TimeLimitSilentClientAndShutdownCancel) {
  ComputationFixture fixture;
  Listener listener(fixture.setup);
  listener.handler->onState(fixture.state());
  dds::ComputationRequest request = endless(fixture);
  request.time_limit = 0.2;
  listener.send(request, 1);
  const auto late = listener.await<dds::ComputationResult>(1);
  ASSERT_TRUE(late);
  EXPECT_EQ(static_cast<dds::CancelledBy>(late->cancelled_by), dds::CancelledBy::kTimeLimit);
  listener.send(endless(fixture), 2);
  const auto silent = listener.await<dds::ComputationResult>(2);
  ASSERT_TRUE(silent);
  EXPECT_EQ(static_cast<dds::CancelledBy>(silent->cancelled_by), dds::CancelledBy::kSilence);
  EXPECT_GE(silent->elapsed, ComputationRequestHandler::kSilence);
  listener.send(endless(fixture), 3);
  ASSERT_TRUE(listener.await<dds::ComputationProgress>(3));
  listener.handler.reset();
  const auto ended = listener.await<dds::ComputationResult>(3, 0.0);
  ASSERT_TRUE(ended);
  EXPECT_EQ(static_cast<dds::CancelledBy>(ended->cancelled_by), dds::CancelledBy::kEnd);
}

TEST(ComputationRequestHandler, ComputesBelowTheOthersInPriority) {
  ComputationFixture fixture;
  Listener listener(fixture.setup);
  listener.handler->onState(fixture.state());
  listener.send(fixture.request, 1);
  ASSERT_TRUE(listener.await<dds::Reply>(1));
  int low = 0;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    const int id = std::stoi(task.path().filename());
    low += sched_getscheduler(id) == SCHED_BATCH &&
           getpriority(PRIO_PROCESS, static_cast<id_t>(id)) >= ComputationRequestHandler::kNice;
  }
  EXPECT_EQ(low, 1);
  ASSERT_TRUE(listener.await<dds::ComputationResult>(1));
}

TEST(ComputationRequestHandler, NoiseOfEncodersIsNoStartOutsideTheLimits) {
  ComputationFixture fixture;
  Listener listener(fixture.setup);
  listener.handler->onState(fixture.state(1e-5));
  listener.send(fixture.request, 1);
  const auto result = listener.await<dds::ComputationResult>(1);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->report.start, "");
  listener.handler->onState(fixture.state(0.01));
  listener.send(fixture.request, 2);
  const auto outside = listener.await<dds::ComputationResult>(2);
  ASSERT_TRUE(outside);
  EXPECT_NE(outside->report.start, "");
}

}  // namespace
}  // namespace tandem::test
