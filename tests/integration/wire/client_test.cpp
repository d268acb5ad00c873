// SPDX-License-Identifier: Apache-2.0
// A client: interruptions between a request and its answer, and before anything was requested; its control lease.
#include "services/client/client.h"

#include <gtest/gtest.h>

#include <atomic>

#include "config/config.h"
#include "planning/follower.h"
#include "services/client/arguments.h"
#include "services/client/run_summary.h"
#include "support.h"

namespace tandem::client {
namespace {

config::Deployment testDeployment() {
  config::Deployment deployment;
  deployment.domain = dds::testOptions().domain;
  deployment.prefix = dds::testOptions().prefix;
  return deployment;
}

// Simulated control for a client. Its answer follows statuses that wake the client, so that a client that checks for
// interruptions while it waits detects one.
class SlowControl {
 public:
  static constexpr std::uint32_t kValue = 42;

  explicit SlowControl(dds::Watched<int>& received)
      : received_(received),
        bus_(dds::testOptions()),
        replies_(bus_.writer(dds::kControlReply)),
        clock_replies_(bus_.writer(dds::kClockReply)),
        statuses_(bus_.writer(dds::kControlStatus)),
        requests_(bus_.reader(dds::kControlRequest, [this](const dds::ControlRequest& r) { onRequest(r); })),
        clock_requests_(bus_.reader(dds::kClockRequest, [this](const dds::ClockRequest& r) { onClockRequest(r); })) {}

  bool requested() const { return requested_; }
  /// Messages that keep the lease.
  dds::Watched<int>& keeps() { return keeps_; }

 private:
  void onRequest(const dds::ControlRequest& request) {
    if (request.kind == static_cast<std::uint8_t>(dds::ControlKind::kKeepLease)) {
      keeps_.change([](int& n) { ++n; });
      return;
    }
    requested_ = true;
    dds::ControlStatus status;
    status.lease_owner = request.client;
    constexpr int kStatuses = 3;
    const int before = received_.get();
    EXPECT_TRUE(
        dds::repeatUntil([&] { return received_.get() >= before + kStatuses; }, [&] { statuses_.write(status); }));
    dds::Reply reply;
    reply.client = request.client;
    reply.request = request.request;
    reply.accepted = 1;
    reply.value = kValue;
    replies_.write(reply);
  }

  void onClockRequest(const dds::ClockRequest& request) {
    dds::ClockReply reply;
    reply.client = request.client;
    reply.request = request.request;
    reply.process = "control";
    clock_replies_.write(reply);
  }

  dds::Watched<int>& received_;
  std::atomic<bool> requested_{false};
  dds::Watched<int> keeps_;
  dds::Bus bus_;
  dds::Writer<dds::Reply> replies_;
  dds::Writer<dds::ClockReply> clock_replies_;
  dds::Writer<dds::ControlStatus> statuses_;
  dds::Reader requests_, clock_requests_;
};

Client::Callbacks countingInto(dds::Watched<int>& received) {
  Client::Callbacks callbacks;
  callbacks.status = [&received](const dds::ControlStatus&) { received.change([](int& n) { ++n; }); };
  return callbacks;
}

TEST(Interruption, BetweenRequestAndAnswerTheAnswerIsAwaited) {
  dds::Watched<int> received;
  SlowControl control(received);
  Client client(testDeployment(), countingInto(received), Client::Receives::kAnyRobot);
  client.setInterrupt([&] { return control.requested(); });
  EXPECT_EQ(client.control({}).value, SlowControl::kValue);
}

TEST(Interruption, BeforeARequestIsReportedAsSuch) {
  Client client(testDeployment(), {}, Client::Receives::kAnyRobot);
  client.setInterrupt([] { return true; });
  const auto expect_interrupted = [](const auto& call) {
    try {
      call();
      FAIL() << "expected a failure";
    } catch (const Failure& failure) {
      EXPECT_STREQ(failure.what(), "interrupted; nothing was requested");
    }
  };
  expect_interrupted([&] { client.control({}); });
  expect_interrupted([&] { client.connect(20.0); });
}

/// Nobody sends periodic messages to a client that rests; afterwards they come again.
TEST(Rest, AClientThatRestsReceivesNoPeriodicMessages) {
  Client client(testDeployment(), {}, Client::Receives::kAnyRobot);
  dds::Bus bus(dds::testOptions());
  dds::Writer<dds::ControlStatus> statuses = bus.writer(dds::kControlStatus);
  const auto write = [&] { statuses.write(dds::ControlStatus{}); };
  EXPECT_TRUE(dds::repeatUntil([&] { return client.snapshot().statuses > 0; }, write));
  client.rest();
  EXPECT_TRUE(dds::repeatUntil([&] { return statuses.matched() == 0; }, write));
  const std::uint64_t received = client.snapshot().statuses;
  write();
  client.listen();
  EXPECT_TRUE(dds::repeatUntil([&] { return client.snapshot().statuses > received; }, write));
}

// However many samples come, the client keeps its lease: here a condition has the lock of the snapshot until it has.
TEST(Lease, IsKeptWhileTheSnapshotIsLocked) {
  dds::Watched<int> received;
  SlowControl control(received);
  config::Deployment deployment = testDeployment();
  deployment.budgets.lease = 0.1;
  Client client(deployment, countingInto(received), Client::Receives::kAnyRobot);
  client.acquireLease();
  const auto keeps_arrive = [&](const Snapshot&) {
    const int before = control.keeps().get();
    return control.keeps().waitUntil([before](int n) { return n >= before + 5; });
  };
  EXPECT_TRUE(client.waitFor(0.0, keeps_arrive));
}

// The pausing client may have left before its own identity arrived.
TEST(Pauser, IsNamedByControl) {
  constexpr std::uint64_t kPauser = 77;
  dds::Bus control(dds::testOptions());
  auto statuses = control.writer(dds::kControlStatus);
  auto diagnostics = control.writer(dds::kDiagnostics);
  dds::ControlStatus status;
  status.paused_by = kPauser;
  dds::DiagnosticArray array;
  array.status.resize(1);
  array.status[0].name = "tandem-control";
  array.status[0].values = {{"paused_by 76", "another"}, {"paused_by 77", "cli (pid 5 on vm)"}};
  const Client client(testDeployment(), {}, Client::Receives::kAnyRobot);
  EXPECT_TRUE(dds::repeatUntil([&] { return client.nameOfPauser(client.snapshot()) == "cli (pid 5 on vm)"; },
                               [&] {
                                 statuses.write(status);
                                 diagnostics.write(array);
                               }));
}

// The summary of a run may be received after the reference that shows its end: somebody who reports the run waits for
// it, and takes none of an earlier run.
TEST(Summary, IsDueFromTheEndOfItsRunUntilItIsReceived) {
  dds::Bus bus(dds::testOptions());
  auto references = bus.writer(dds::kPlanningReference);
  auto summaries = bus.writer(dds::kPlanningSummary);
  const Client client(testDeployment(), {}, Client::Receives::kAnyRobot);
  dds::PlanningReference reference;
  reference.trajectory_id = 2;
  dds::RunSummary summary;
  const auto expect_due = [&](planning::Phase phase, bool due) {
    reference.phase = static_cast<std::uint8_t>(phase);
    EXPECT_TRUE(dds::repeatUntil(
        [&] {
          const Snapshot s = client.snapshot();
          return s.reference.phase == reference.phase && summaryIsDue(s) == due;
        },
        [&] { references.write(reference); }));
  };
  expect_due(planning::Phase::kRunning, false);
  expect_due(planning::Phase::kFailed, true);
  expect_due(planning::Phase::kFinished, true);
  summary.trajectory_id = 1;
  EXPECT_TRUE(dds::repeatUntil([&] { return client.snapshot().summaries > 0; }, [&] { summaries.write(summary); }));
  expect_due(planning::Phase::kFailed, true);
  summary.trajectory_id = 2;
  EXPECT_TRUE(dds::repeatUntil([&] { return !summaryIsDue(client.snapshot()); }, [&] { summaries.write(summary); }));
}

}  // namespace
}  // namespace tandem::client
