// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "planning/joint_sampler.h"
#include "services/control/clearance_publisher.h"
#include "tests/unit/safety/random_arm.h"
#include "tests/unit/services/system.h"

namespace tandem::test {
namespace {

struct Meter {
  explicit Meter(const std::string& deployment = "laptop", bool port = true)
      : setup(makeSetup(deployment)), model(setup.robot, setup.deployment.model) {
    if (port)
      setup.deployment.port = kinematics::Port{Eigen::Isometry3d::Identity(), 0.012, 0.01};
  }
  dds::ActuationState state(const safety::RobotVector& q) const {
    dds::ActuationState state;
    state.session = 3;
    state.sequence = 17;
    state.stamp = 99;
    state.arm_count = static_cast<std::uint8_t>(model.armCount());
    for (int k = 0; k < model.armCount(); ++k) {
      state.joint_count[static_cast<std::size_t>(k)] = static_cast<std::uint8_t>(model.size(k));
      state.valid[static_cast<std::size_t>(k)] = 1;
      for (int j = 0; j < model.size(k); ++j)
        state.position[dds::jointIndex(k, j)] = q[model.offset(k) + j];
    }
    return state;
  }
  safety::RobotVector random(std::mt19937_64& engine) const {
    safety::RobotVector q(model.jointCount());
    for (int k = 0; k < model.armCount(); ++k)
      q.segment(model.offset(k), model.size(k)) =
          planning::JointSampler(*model.limits()[static_cast<std::size_t>(k)]).random(engine);
    return q;
  }
  runtime::Setup setup;
  robots::RobotModel model;
};

TEST(ClearanceMeter, SaysWhatTheLibraryAnswers) {
  const std::uint32_t seed = baseSeed();
  SCOPED_TRACE(trace(seed));
  std::mt19937_64 engine(seed);
  Meter meter;
  control_service::ClearanceMeter clearance(meter.setup, meter.model);
  for (int round = 1; round <= 50; ++round) {
    const safety::RobotVector q = meter.random(engine);
    const dds::Clearances said = clearance.measure(meter.state(q));
    EXPECT_EQ(said.answers_state, 17u);
    EXPECT_EQ(said.stamp, 99);
    EXPECT_EQ(said.session, meter.setup.session);
    EXPECT_EQ(said.sequence, static_cast<std::uint64_t>(round));
    kinematics::Body bodies[2];
    for (int k = 0; k < 2; ++k) {
      kinematics::Branch branch;
      ASSERT_EQ(kinematics::makeBody(*meter.model.models()[static_cast<std::size_t>(k)],
                                     q.segment(meter.model.offset(k), meter.model.size(k)), branch, true, bodies[k]),
                kinematics::ModelStatus::kOk);
    }
    ASSERT_EQ(said.bodies.size(), 3u);  // a to b, a to the port, b to the port
    for (const dds::BodyClearance& body : said.bodies) {
      const bool port = body.other_arm == dds::kPort;
      const kinematics::Clearance wanted = port ? kinematics::clearance(bodies[body.arm], *meter.setup.deployment.port)
                                                : kinematics::clearance(bodies[0], bodies[1]);
      EXPECT_EQ(body.distance, wanted.distance);
      EXPECT_EQ(Eigen::Vector3d(Eigen::Vector3d::Map(body.place.data())), wanted.place_a);
      EXPECT_EQ(body.s, wanted.s_a);
      for (int j = 0; j < 6; ++j)
        EXPECT_EQ(body.by_joints[static_cast<std::size_t>(j)], wanted.by_a[j]);
      for (int j = 0; j < 6 && !port; ++j)
        EXPECT_EQ(body.by_other_joints[static_cast<std::size_t>(j)], wanted.by_b[j]);
      if (!port) {
        EXPECT_EQ(Eigen::Vector3d(Eigen::Vector3d::Map(body.other_place.data())), wanted.place_b);
        EXPECT_EQ(body.other_s, wanted.s_b);
      }
    }
  }
}

TEST(ClearanceMeter, LeavesOutWhatIsNotMeasuredAndThePortThatThereIsNot) {
  std::mt19937_64 engine(baseSeed());
  Meter meter("laptop", false);
  control_service::ClearanceMeter clearance(meter.setup, meter.model);
  dds::ActuationState state = meter.state(meter.random(engine));
  EXPECT_EQ(clearance.measure(state).bodies.size(), 1u);
  state.valid[1] = 0;
  EXPECT_TRUE(clearance.measure(state).bodies.empty());
  state.valid[1] = 1;
  state.position[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(clearance.measure(state).bodies.empty());
  state = meter.state(meter.random(engine));
  state.arm_count = 1;
  EXPECT_TRUE(clearance.measure(state).bodies.empty());
}

}  // namespace
}  // namespace tandem::test
