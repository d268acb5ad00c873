// SPDX-License-Identifier: Apache-2.0
/** @file Closed loop on the thing that catheters move together. */
#pragma once

#include <memory>
#include <optional>

#include "operation/frame_control.h"
#include "services/control/settler.h"
#include "services/dds/messages.h"

namespace tandem::service {

/** In lock-step every step settles where it is, and in the middle of its period. In real time a thread beside the
 * periodic one settles where the joints are going to be in the middle of the next period (Settler); what it found is
 * taken to where they are to first order. */
class FrameLoop : public operation::FrameControl {
 public:
  /// @throw std::invalid_argument as robots::makeRestFollower() does.
  explicit FrameLoop(const Setup& setup);

  /// Real time, before enterRealtime(). Without it every cycle settles by itself: for tests.
  void start();
  void stop();

  void restart() noexcept override;
  dds::HoldReason step(std::int64_t now,
                       const safety::RobotVector& setpoint,
                       const safety::RobotVector& velocity,
                       const planning::Reference& tasks,
                       planning::ReferenceTracker& tracker,
                       planning::TrackResult& result) noexcept override;
  void ask(std::int64_t now,
           const safety::RobotVector& setpoint,
           const safety::RobotVector& velocity,
           const planning::ReferenceTracker& tracker) noexcept override;

 private:
  void stepAtOnce(const safety::RobotVector& q,
                  const planning::Reference& tasks,
                  planning::ReferenceTracker& tracker,
                  planning::TrackResult& result);

  const Setup& setup_;
  double period_;
  double oldest_;                                 ///< rest that may be used, s
  std::optional<robots::RestFollower> follower_;  ///< lock-step
  std::unique_ptr<Settler> settler_;              ///< real time
  std::uint32_t placement_ = 0;
  planning::Rest rest_;
  Settler::Wish wish_;
  Settler::Answer answer_;
};

}  // namespace tandem::service
