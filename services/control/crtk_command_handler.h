// SPDX-License-Identifier: Apache-2.0
/** @file CRTK command handler: validation of received commands, counters of accepted and refused ones. Runs on DDS
 * threads and the publisher thread, never on the periodic one. */
#pragma once

#include <array>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "operation/crtk_request.h"
#include "robots/robot_model.h"
#include "services/dds/bus.h"
#include "services/runtime/process.h"
#include "services/runtime/ros_time.h"

namespace tandem::control_service {

/** Age check of one command stream, whose writer does not use control's clock. */
class CrtkStream {
 public:
  /** @param by_arrival  age: delay relative to the fastest sample of the stream; the first sample of a stream, or after
   * a silence, is accepted if the wall clocks agree, and otherwise only starts the stream. false: age by the stamp,
   * which requires a wall clock that agrees with this host's
   * @param budget  largest age, s */
  CrtkStream(bool by_arrival, double budget) : by_arrival_(by_arrival), budget_(budget) {}

  /// Checks a sample. @param stamp  of its header, ns @param wall, arrival  now, ns since 1970 and on a steady clock
  /// @return reason of a refusal; empty: accepted
  std::string judge(std::int64_t stamp, std::int64_t wall, std::int64_t arrival);

 private:
  bool by_arrival_;
  double budget_;
  bool known_ = false;
  std::int64_t last_stamp_ = 0, last_arrival_ = 0;
  double quickest_ = 0.0;  ///< arrival minus stamp of the fastest sample, s; grows slowly to follow clock drift
};

/** Stamps of feedback in ROS time, and the sequences of control/status that they belong to: a state_command with the
 * stamp of the last received feedback answers that status, independent of clocks. Any thread. */
class FeedbackStamps {
 public:
  explicit FeedbackStamps(bool lock_step) : time_(lock_step) {}
  /// Stamp of feedback that is published now: when control first used the state, so that a state that stays the same
  /// grows old. Before the first state it is that of the status.
  std::int64_t next(const dds::ActuationState& state, const dds::ControlStatus& status);
  /// @return the sequence of the status; 0: no recent feedback has this stamp
  std::uint64_t statusOf(std::int64_t stamp) const;
  /// Sequence of the status of the last feedback.
  std::uint64_t last() const;

 private:
  struct Entry {
    std::int64_t stamp = 0;
    std::uint64_t status = 0;
  };
  mutable std::mutex mutex_;
  runtime::RosTime time_;
  std::uint64_t session_ = 0, sequence_ = 0;  ///< of the last state
  std::int64_t stamp_ = 0;                    ///< of it
  std::array<Entry, 256> entries_{};
  std::size_t next_ = 0;
};

/** Handler of all command topics of all arms and of the pair. */
class CrtkCommandHandler {
 public:
  using OnRequest = std::function<void(const operation::CrtkRequest&)>;
  CrtkCommandHandler(const runtime::Setup& setup, const robots::RobotModel& robot);

  /// Creates readers of all command topics of the robot.
  /// @param admitted  reader options with the admitted senders
  void listen(dds::Bus& bus,
              OnRequest on_request,
              const dds::ReaderOptions& admitted,
              std::vector<dds::Reader>& readers);

  /// Converts a message to a request. @return reason of a refusal; empty: accepted
  std::string parse(const dds::JointState& message, operation::CrtkRequest& request) const;
  std::string parse(const dds::PoseStamped& message, operation::CrtkRequest& request) const;
  std::string parse(const dds::TwistStamped& message, operation::CrtkRequest& request) const;
  std::string parse(const dds::Empty& message, operation::CrtkRequest& request) const;

  /// The status that a state_command answers: see FeedbackStamps. 0: none.
  std::uint64_t answered(std::int64_t stamp) const;
  /// Stamp of feedback that is published now: see FeedbackStamps.
  std::int64_t stampFeedback(const dds::ActuationState& state, const dds::ControlStatus& status) {
    return feedback_.next(state, status);
  }

  /// Counts the outcome of a request.
  void report(const operation::CrtkOutcome& outcome);
  void fill(const operation::CrtkSnapshot& snapshot, dds::CrtkStatus& status) const;

 private:
  struct Entry {
    CrtkStream stream;
    std::uint64_t accepted = 0, refused = 0;
    std::string refusal{};
  };
  template <class M>
  void take(const M& message, operation::CrtkRequest request, const OnRequest& on_request);
  void note(const operation::CrtkRequest& request, const std::string& refusal);
  std::string groupName(int group) const;
  std::vector<int> armsOf(int group) const;
  std::string badFrame(const std::string& frame) const;
  Entry& entry(int group, int verb);

  const runtime::Setup& setup_;
  const robots::RobotModel& robot_;
  std::string frame_;
  FeedbackStamps feedback_;
  mutable std::mutex mutex_;
  std::map<std::pair<int, int>, Entry> entries_;  ///< by group and verb
};

/// "arm_a_beta_1" ...: config::Arm::joint_names with the arm's name as prefix, as in measured_js.
std::vector<std::string> jointNames(const config::Arm& arm);

}  // namespace tandem::control_service
