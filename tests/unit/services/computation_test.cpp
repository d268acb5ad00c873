// SPDX-License-Identifier: Apache-2.0
#include "services/computation/computation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <span>

#include "services/computation/reports.h"
#include "services/dds/validate.h"
#include "tests/unit/services/computation_fixture.h"

namespace tandem::test {
namespace {

using computation::Computation;
using computation::ComputationProblem;
using dds::ComputationKind;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

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
    ComputationFixture fixture;
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
                 {[](auto& t) { t.orientation[3] = 0.0, t.has_orientation = 1; }, "targets[0].orientation"},
                 {[](auto& t) { t.orientation[3] = kNan, t.has_orientation = 1; }, "targets[0].orientation"},
                 {[](auto& t) { t.has_direction = t.has_orientation = 1, t.direction[0] = t.orientation[3] = 1.0; },
                  "targets[0].orientation: found a direction, too"},
                 {[](auto& t) { t.direction[0] = kNan, t.has_direction = 1; }, "targets[0].direction"}};
  for (const auto& c : targets) {
    ComputationFixture fixture;
    inverse(fixture.request);
    dds::ReplyCode code = dds::ReplyCode::kOk;
    EXPECT_EQ(fixture.refusal(code), "");
    c.change(fixture.request.targets[0]);
    EXPECT_NE(fixture.refusal(code).find(c.word), std::string::npos) << fixture.refusal(code);
  }
  ComputationFixture fixture;
  inverse(fixture.request);
  dds::ReplyCode code = dds::ReplyCode::kOk;
  fixture.request.targets.resize(2);
  EXPECT_NE(fixture.refusal(code).find("targets[1].arm"), std::string::npos);
  fixture.request.targets.clear();
  EXPECT_NE(fixture.refusal(code).find("targets: found 0"), std::string::npos);
}

TEST(Computation, AFeasibleCheckKeepsTheJointsOfEveryPoint) {
  ComputationFixture fixture;
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
  ComputationFixture fixture;
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

TEST(Computation, RehearsesWithTheParametersOfTheRequest) {
  ComputationFixture fixture;
  fixture.request.rehearse = "nspqp";
  const auto iterations = [&] {
    const auto result = Computation(fixture.request, fixture.robot(), fixture.home).run({});
    EXPECT_EQ(result.rehearsed, 1);
    return result.without_posture.iterations;
  };
  const unsigned before = iterations();
  fixture.request.parameters = {{"tip_gain", "3"}, {"bounds", "coupled"}};
  EXPECT_EQ(iterations(), before) << "these are the values without a request";
  fixture.request.parameters = {{"tip_gain", "0.5"}};
  EXPECT_GT(iterations(), 2 * before);
  dds::ReplyCode code{};
  fixture.request.parameters = {{"tip_gain", "0.5"}, {"tip_gian", "1"}};
  EXPECT_THAT(fixture.refusal(code),
              testing::StartsWith("parameters[1]: found parameter 'tip_gian', expected one of: "));
  EXPECT_EQ(code, dds::ReplyCode::kMalformed);
  fixture.request.parameters = {{"tip_gain", "nan"}};
  EXPECT_EQ(fixture.refusal(code), "parameters[0]: tip_gain: found 'nan', expected a finite number above zero");
}

TEST(Computation, AStartOutsideItsLimitsIsAnAnswerAndNoRefusal) {
  ComputationFixture fixture;
  fixture.request.joints = computation::listOf(fixture.home);
  fixture.request.joints[0] = fixture.state(0.01).position[0];
  const auto result = Computation(fixture.request, fixture.robot(), {}).run({});
  EXPECT_EQ(static_cast<dds::Outcome>(result.outcome), dds::Outcome::kNot);
  EXPECT_NE(result.reason.find("outside its limits"), std::string::npos) << result.reason;
}

}  // namespace
}  // namespace tandem::test
