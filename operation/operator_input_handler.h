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

/// Reason of a stop in words for the operator, who must release the switch before the robot moves again.
std::string describeOperatorStop(Reason reason);

/** Snapshot from the periodic thread for the thread that publishes teleop/status. */
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
  bool rotates = false;  ///< orientations are not ignored
  std::array<Stage, planning::teleoperation::kStages> stages{}, rotation_stages{};
  std::array<double, 3> wanted{}, target{}, position{};
  std::array<double, 3 * safety::kMaxArms> tip_target{};
};

/** One operator at a time: the owner of the control lease. */
class OperatorInputHandler {
 public:
  explicit OperatorInputHandler(const ControlSetup& setup);

  /// State of control when an input is processed.
  struct Context {
    std::int64_t now = 0;                           ///< ns
    std::uint64_t lease_owner = 0;                  ///< 0: none
    const safety::StateStamps* statuses = nullptr;  ///< send time of each control/status
  };
  void take(const msg::TeleopInput& input, const Context& context) noexcept;

  /// Whether the operator requests motion: pressed dead-man switch, fresh stream, not stopped. Checks freshness and the
  /// lease; call once a cycle before step().
  bool isActive(const Context& context) noexcept;
  /// The arms that the input moves.
  int arm() const noexcept { return sample_.arm; }
  int otherArm() const noexcept { return sample_.other_arm; }

  /// One cycle of following. Call if isActive() and nothing forbids it.
  void step(const planning::teleoperation::TipPlaces& tips) noexcept { pipeline_.step(sample_, tips); }
  /// No motion in this cycle; the operator must release the dead-man switch before the next motion.
  void stop(Reason reason) noexcept;

  /// The robot follows the input.
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
  bool seen_ = false;      ///< an input of the present client was accepted
  bool locked_ = true;     ///< the switch must be released first
  Reason reason_{};        ///< of the lock
  std::int64_t last_taken_ = 0;
  std::int64_t last_refusal_ = 0;  ///< ns
  double rate_ = 0.0, latency_ = 0.0;
  Reason refusal_{};
  std::uint64_t refused_client_ = 0, accepted_ = 0, refused_ = 0, late_ = 0;
};

}  // namespace tandem::operation
