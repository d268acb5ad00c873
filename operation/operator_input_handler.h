// SPDX-License-Identifier: Apache-2.0
/** @file Operator input handler: validates teleop/input and runs the teleoperation pipeline. For the periodic thread;
 * nothing here allocates, locks or throws after construction. */
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "operation/control_setup.h"
#include "operation/permission.h"
#include "planning/teleoperation/pipeline.h"
#include "safety/command_monitor.h"

namespace tandem::operation {

/// The reason for an operator, whose switch has to be released before the robot moves again.
std::string describeOperatorStop(Reason reason);

/** What the periodic thread hands over to the thread that publishes teleop/status. */
struct OperatorSnapshot {
  struct Stage {
    std::array<double, 3> input{}, output{};
    planning::teleoperation::Limiter limiter{};
    int index = 0;
  };
  planning::teleoperation::State state{};
  Reason reason{}, refusal{};
  std::uint64_t client = 0, answers_input = 0, accepted = 0, refused = 0, late = 0, refused_client = 0;
  std::uint8_t device = 0, operator_present = 0, clutch = 0, mode = 0, arm = 0, other_arm = 0, frame = 0;
  double scale = 0.0, input_age = 0.0, latency = 0.0, input_rate = 0.0, lag = 0.0;
  bool engaged = false;
  std::array<Stage, planning::teleoperation::kStages> stages{};
  std::array<double, 3> wanted{}, target{}, position{};
  std::array<double, 3 * safety::kMaxArms> tip_target{};
};

/** One operator at a time: the holder of the control lease. */
class OperatorInputHandler {
 public:
  explicit OperatorInputHandler(const ControlSetup& setup);

  /// What control knows when it looks at an input.
  struct Context {
    std::int64_t now = 0;                           ///< ns
    std::uint64_t lease_holder = 0;                 ///< 0: nobody
    const safety::StateStamps* statuses = nullptr;  ///< when each control/status was sent
  };
  void take(const msg::TeleopInput& input, const Context& context) noexcept;

  /// Whether an operator holds the dead-man switch of a fresh stream and is not stopped: wants to move.
  /// Judges freshness and the lease; call once a cycle before step().
  bool isActive(const Context& context) noexcept;
  /// The arms that would move.
  int arm() const noexcept { return sample_.arm; }
  int otherArm() const noexcept { return sample_.other_arm; }

  /// One cycle of following. Call where isActive() and nothing stands against it.
  void step(const planning::teleoperation::TipPlaces& tips) noexcept { pipeline_.step(sample_, tips); }
  /// Nothing moves in this cycle; the operator has to release the dead-man switch before anything does.
  void stop(Reason reason) noexcept;

  /// The robot follows.
  bool engaged() const noexcept { return pipeline_.engaged(); }
  void tasks(double relative_gain, double tip_gain, planning::Reference& reference) const noexcept {
    pipeline_.tasks(relative_gain, tip_gain, reference);
  }
  void fill(const Context& context, OperatorSnapshot& snapshot) const noexcept;

 private:
  Reason judge(const msg::TeleopInput& input) const noexcept;
  void accept(const msg::TeleopInput& input, const Context& context) noexcept;
  bool fresh(const Context& context) const noexcept;

  std::uint64_t session_;
  bool lock_step_;
  int arm_count_;
  double budget_;  ///< s
  planning::teleoperation::Pipeline pipeline_;
  planning::teleoperation::Sample sample_;
  msg::TeleopInput last_;  ///< the last accepted one
  bool seen_ = false;      ///< there is one of the present client
  bool locked_ = true;     ///< the switch has to be seen released first
  Reason reason_{};        ///< for which it is locked
  std::int64_t last_taken_ = 0;
  std::int64_t last_refusal_ = 0;  ///< ns
  double rate_ = 0.0, latency_ = 0.0;
  Reason refusal_{};
  std::uint64_t refused_client_ = 0, accepted_ = 0, refused_ = 0, late_ = 0;
};

}  // namespace tandem::operation
