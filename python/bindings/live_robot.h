// SPDX-License-Identifier: Apache-2.0
/** @file Connection to a running robot: the part of tandem.Client that does not depend on Python. */
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "config/config.h"
#include "control/parameters.h"
#include "services/client/motions.h"

namespace tandem::python {

/** Commands acquire the control lease and release it; one at a time. stop() and read access need neither. All calls
 * block without the GIL, and throw client::Failure with the reason. */
class LiveRobot {
 public:
  /// Joins the DDS domain; does not wait for other processes. @throw config::Error, std::invalid_argument
  explicit LiveRobot(const std::string& deployment);

  const config::Deployment& deployment() const { return deployment_; }
  const config::Robot& robot() const { return robot_; }

  /// Waits until sim (or hal), control and planning are discovered in both directions.
  void connect(double seconds);
  /// Latest samples. @throw client::Failure if control's have stopped
  client::Snapshot snapshot();
  std::uint64_t id() const { return client_->id(); }
  /// Tip pose, computed by control from the measured joints.
  dds::PoseStamped measuredTip(std::size_t arm);

  /// "enable", "disable", "pause", "resume" for all arms; `disable` clears faults.
  void stateCommand(const std::string& command);
  void setMethod(control::Method method);
  void setParameter(const std::string& name, const std::string& value);
  /// Returns when the arm has reached the joints, within safety::kPositionTolerance.
  void moveJp(std::size_t arm, const Eigen::VectorXd& joints);
  /// Moves all arms to the home configuration of the robot file.
  void home();
  /// Enables, follows a trajectory (YAML text), disables. @param progress  called on this thread during the run
  client::RunState run(const std::string& trajectory,
                       std::optional<control::Method> method,
                       bool keep_enabled,
                       const std::function<void(const client::RunState&)>& progress);
  /// Stops all arms and waits until the drives report it; needs no connection and interrupts no command.
  void stop(const std::string& reason);

  /// True: ends blocking calls; motions are paused, and their command fails.
  void interrupt(bool wanted) { interrupted_ = wanted; }

 private:
  /// One command at a time, with the lease if it needs it.
  class Command {
   public:
    Command(LiveRobot& live, bool lease);
    ~Command();
    Command(const Command&) = delete;
    Command& operator=(const Command&) = delete;

   private:
    LiveRobot& live_;
    std::unique_lock<std::mutex> alone_;
    bool lease_;
  };
  struct Pose {
    std::mutex mutex;
    std::optional<dds::PoseStamped> value;
  };

  bool waitFor(double seconds, const std::function<bool(const client::Snapshot&)>& condition);

  config::Deployment deployment_;
  config::Robot robot_;
  double timeout_;  ///< s without a sample from control
  std::atomic<bool> interrupted_{false}, uninterruptible_{false};
  std::atomic<std::int64_t> received_{0};  ///< time of the last sample from control, ns
  std::atomic<bool> connected_{false};
  std::mutex command_;
  std::vector<std::unique_ptr<Pose>> poses_;
  std::unique_ptr<client::Client> client_;
  std::optional<client::Motions> motions_;
  std::vector<dds::Reader> readers_;
};

}  // namespace tandem::python
