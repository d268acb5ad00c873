// SPDX-License-Identifier: Apache-2.0
#include "services/computation/computation.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <condition_variable>
#include <filesystem>
#include <limits>
#include <span>

#include "services/computation/reports.h"
#include "services/dds/validate.h"
#include "services/planning/computation_request_handler.h"
#include "services/runtime/periodic_loop.h"
#include "tests/unit/services/system.h"

namespace tandem::test {
namespace {

using computation::Computation;
using computation::ComputationProblem;
using dds::ComputationKind;
using planning_service::ComputationRequestHandler;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::string lineOf(double z, int points = 5, int arm = 0) {
  planning::TrajectorySpec spec;
  spec.arm = arm;
  spec.name = "line";
  spec.shape = planning::Line{{0.0, 0.0, z}};
  spec.point_count = points;
  return config::formatTrajectory(spec);
}

/// A robot, and an accepted request.
struct Fixture {
  explicit Fixture(const std::string& deployment = "laptop")
      : setup(makeSetup(deployment)), model(setup.robot, setup.deployment.model) {
    std::vector<Eigen::VectorXd> stack;
    for (const config::Arm& arm : setup.robot.arms)
      stack.push_back(arm.home);
    home = model.stack(stack);
    request.client = 5;
    request.request = 9;
    request.kind = static_cast<std::uint8_t>(ComputationKind::kCheck);
    request.trajectory = lineOf(0.01);
  }
  computation::ComputationRobot robot() const { return {setup.robot, model, setup.deployment.model == "rigid"}; }
  dds::ActuationState state(double outside = 0.0) const {
    dds::ActuationState state;
    state.session = state.sequence = 1;
    state.arm_count = 2;
    for (int k = 0; k < 2; ++k) {
      state.joint_count[static_cast<std::size_t>(k)] = static_cast<std::uint8_t>(model.size(k));
      state.valid[static_cast<std::size_t>(k)] = 1;
      for (int j = 0; j < model.size(k); ++j)
        state.position[dds::jointIndex(k, j)] = home[model.offset(k) + j];
    }
    for (const safety::LinearRow& row : model.limits()[0]->rows) {
      // Carriages nearer to each other than possible.
      if (outside > 0.0 && row.kind == safety::RowKind::kCarriageSpacing && row.inner_joint == 0)
        state.position[0] += (row.b + outside - safety::rowValue(row, home.head(model.size(0)))) / row.a[0];
    }
    return state;
  }
  /// Reason of the refusal; empty if accepted.
  std::string refusal(dds::ReplyCode& code) const {
    try {
      Computation computation(request, robot(), home);
      return "";
    } catch (const computation::Refusal& why) {
      code = why.code();
      return why.what();
    }
  }

  runtime::Setup setup;
  robots::RobotModel model;
  safety::RobotVector home;
  dds::ComputationRequest request;
};

TEST(Computation, RefusalsNameTheKeyWhatWasFoundAndWhatWasExpected) {
  using Change = void (*)(dds::ComputationRequest&);
  const auto inverse = [](dds::ComputationRequest& r) {
    r.kind = static_cast<std::uint8_t>(ComputationKind::kInverseKinematics);
    r.targets.resize(1);
    r.targets[0].position = {0.02, 0.01, 0.3};
  };
  const struct {
    Change change;
    dds::ReplyCode code;
    std::vector<std::string> words;
  } cases[] = {
      {[](auto& r) { r.kind = 77; }, dds::ReplyCode::kUnknown, {"kind", "77", "1 to 7"}},
      {[](auto& r) { r.trajectory = ""; }, dds::ReplyCode::kMalformed, {"trajectory"}},
      {[](auto& r) { r.trajectory = "tandem: [trajectory/1"; }, dds::ReplyCode::kMalformed, {"trajectory:"}},
      {[](auto& r) { r.trajectory = lineOf(0.01) + "color: red\n"; }, dds::ReplyCode::kMalformed, {"color"}},
      {[](auto& r) { r.trajectory = lineOf(kNan); }, dds::ReplyCode::kMalformed, {"displacement_m", "nan", "expected"}},
      {[](auto& r) { r.trajectory = lineOf(0.01, 5, 6); },
       dds::ReplyCode::kMalformed,
       {"trajectory: found arm g, expected a or b", "arm_a, arm_b"}},
      {[](auto& r) { r.trajectory = lineOf(0.01, ComputationProblem::kMostPoints + 1); },
       dds::ReplyCode::kMalformed,
       {"points", "2001", "at most 2000"}},
      {[](auto& r) { r.trajectory.assign(ComputationProblem::kLongestTrajectory + 1, 'x'); },
       dds::ReplyCode::kMalformed,
       {"trajectory", "1048577 bytes", "at most 1048576"}},
      {[](auto& r) { r.trajectory = "tandem: trajectory/1\nname: x\nshape:\n  csv: {file: /etc/passwd}\n"; },
       dds::ReplyCode::kMalformed,
       {"file", "sent as text"}},
      {[](auto& r) { r.joints.assign(3, 0.0); }, dds::ReplyCode::kMalformed, {"joints", "3", "12"}},
      {[](auto& r) { r.joints.assign(12, kNan); }, dds::ReplyCode::kMalformed, {"joints[0]", "nan", "finite"}},
      {[](auto& r) { r.stability = 2.0; }, dds::ReplyCode::kMalformed, {"stability", "2", "0 to 1"}},
      {[](auto& r) { r.clearance = -1.0; }, dds::ReplyCode::kMalformed, {"clearance", "-1"}},
      {[](auto& r) { r.port_radius = kNan; }, dds::ReplyCode::kMalformed, {"port_radius", "nan"}},
      {[](auto& r) { r.accept = kNan; }, dds::ReplyCode::kMalformed, {"accept"}},
      {[](auto& r) { r.starts = 1000000; }, dds::ReplyCode::kMalformed, {"starts", "1000000", "1000"}},
      {[](auto& r) { r.tries = 1000000; }, dds::ReplyCode::kMalformed, {"tries"}},
      {[](auto& r) { r.smoothing = -kNan; }, dds::ReplyCode::kMalformed, {"smoothing"}},
      {[](auto& r) { r.rotation_velocity = INFINITY; }, dds::ReplyCode::kMalformed, {"rotation_velocity", "inf"}},
      {[](auto& r) { r.rehearse = "magic"; }, dds::ReplyCode::kMalformed, {"rehearse", "'magic'", "nspqp"}},
      {[](auto& r) { r.time_limit = 1e9; }, dds::ReplyCode::kMalformed, {"time_limit", "3600"}},
  };
  for (const auto& c : cases) {
    Fixture fixture;
    c.change(fixture.request);
    dds::ReplyCode code = dds::ReplyCode::kOk;
    const std::string why = fixture.refusal(code);
    EXPECT_EQ(code, c.code) << why;
    for (const std::string& word : c.words)
      EXPECT_NE(why.find(word), std::string::npos) << why << " lacks " << word;
  }
  const struct {
    void (*change)(dds::TipTarget&);
    std::string word;
  } targets[] = {{[](auto& t) { t.arm = 2; }, "targets[0].arm: found 2, expected 0 to 1"},
                 {[](auto& t) { t.position[1] = kNan; }, "targets[0].position"},
                 {[](auto& t) { t.has_direction = 1; }, "targets[0].direction"},
                 {[](auto& t) { t.direction[0] = kNan, t.has_direction = 1; }, "targets[0].direction"}};
  for (const auto& c : targets) {
    Fixture fixture;
    inverse(fixture.request);
    dds::ReplyCode code = dds::ReplyCode::kOk;
    EXPECT_EQ(fixture.refusal(code), "");
    c.change(fixture.request.targets[0]);
    EXPECT_NE(fixture.refusal(code).find(c.word), std::string::npos) << fixture.refusal(code);
  }
  Fixture fixture;
  inverse(fixture.request);
  dds::ReplyCode code = dds::ReplyCode::kOk;
  fixture.request.targets.resize(2);
  EXPECT_NE(fixture.refusal(code).find("targets[1].arm"), std::string::npos);
  fixture.request.targets.clear();
  EXPECT_NE(fixture.refusal(code).find("targets: found 0"), std::string::npos);
}

TEST(Computation, AFeasibleCheckKeepsTheJointsOfEveryPoint) {
  Fixture fixture;
  const Computation computation(fixture.request, fixture.robot(), fixture.home);
  int last = 0;
  double fraction = 0.0;
  computation::ComputationHooks hooks;
  hooks.progress = [&](double f, const std::string& at, int done, int all) {
    EXPECT_EQ(at, "point");
    EXPECT_EQ(all, 5);
    EXPECT_EQ(done, ++last);
    fraction = f;
  };
  const dds::ComputationResult result = computation.run(hooks);
  EXPECT_EQ(fraction, 1.0);
  EXPECT_EQ(result.client, 5u);
  EXPECT_EQ(result.request, 9u);
  EXPECT_EQ(static_cast<dds::Outcome>(result.outcome), dds::Outcome::kGood) << result.reason;
  EXPECT_EQ(result.start, computation::listOf(fixture.home));
  ASSERT_EQ(result.report.points.size(), 5u);
  for (const dds::PointReport& point : result.report.points) {
    ASSERT_EQ(point.joints.size(), 12u);
    for (int k = 0; k < 2; ++k) {
      kinematics::Tip tip;
      const Eigen::VectorXd q = Eigen::VectorXd::Map(point.joints.data() + fixture.model.offset(k), 6);
      ASSERT_EQ(fixture.model.models()[static_cast<std::size_t>(k)]->tip(q, tip), kinematics::ModelStatus::kOk);
      Eigen::Vector3d wanted = Eigen::Vector3d::Map(point.wanted.data());
      if (k == 1)
        wanted -= Eigen::Vector3d::Map(point.wanted_relative.data());
      EXPECT_LT((tip.pose.translation() - wanted).norm(), 1e-5);
    }
  }
  EXPECT_EQ(dds::malformed(result), nullptr);
}

TEST(Computation, RehearsalReportsTheResultOfTheMethod) {
  Fixture fixture;
  fixture.request.rehearse = "nspqp";
  std::vector<std::string> seen;
  double last = 0.0;
  computation::ComputationHooks hooks;
  hooks.progress = [&](double fraction, const std::string& at, int, int) {
    EXPECT_GE(fraction, last);
    last = fraction;
    if (seen.empty() || seen.back() != at)
      seen.push_back(at);
  };
  const auto result = Computation(fixture.request, fixture.robot(), fixture.home).run(hooks);
  EXPECT_EQ(static_cast<dds::Outcome>(result.outcome), dds::Outcome::kGood) << result.reason;
  EXPECT_EQ(seen, (std::vector<std::string>{"point", "rehearsal", "rehearsal without posture"}));
  EXPECT_EQ(result.rehearsed, 1);
  for (const dds::RehearsalReport* run : {&result.with_posture, &result.without_posture}) {
    EXPECT_EQ(static_cast<planning::RehearsalEnd>(run->end), planning::RehearsalEnd::kCompleted) << run->reason;
    EXPECT_EQ(run->converged, 5u);
    ASSERT_EQ(run->joints.size(), 12 * run->joints_points.size());
    EXPECT_TRUE(std::ranges::equal(std::span(run->joints).first(12), result.start));
    EXPECT_LE(run->least_clearance, std::min(result.report.points.front().clearance, 1.0))
        << "one arm, or not measured";
    EXPECT_EQ(run->joints_points.front(), 0u);
    EXPECT_EQ(run->joints_points.back(), 5u);
    EXPECT_TRUE(std::ranges::is_sorted(run->joints_points));
    EXPECT_EQ(run->joints_points.size(), (run->iterations + run->stride - 1) / run->stride + 1);
  }
  EXPECT_EQ(dds::malformed(result), nullptr);
}

TEST(Computation, AStartOutsideItsLimitsIsAnAnswerAndNoRefusal) {
  Fixture fixture;
  fixture.request.joints = computation::listOf(fixture.home);
  fixture.request.joints[0] = fixture.state(0.01).position[0];
  const auto result = Computation(fixture.request, fixture.robot(), {}).run({});
  EXPECT_EQ(static_cast<dds::Outcome>(result.outcome), dds::Outcome::kNot);
  EXPECT_NE(result.reason.find("outside its limits"), std::string::npos) << result.reason;
}

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

dds::ComputationRequest endless(const Fixture& fixture) {
  dds::ComputationRequest request = fixture.request;
  request.kind = static_cast<std::uint8_t>(ComputationKind::kChooseStart);
  request.tries = 10000;
  return request;
}

dds::ReplyCode codeOf(const std::optional<dds::Reply>& reply) {
  return reply ? static_cast<dds::ReplyCode>(reply->code) : dds::ReplyCode::kFailed;
}

TEST(ComputationRequestHandler, OneAtATimeWithProgressAndCancelledAtOnce) {
  Fixture fixture;
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
  Fixture fixture;
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
  Fixture fixture;
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
  Fixture fixture;
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
