// SPDX-License-Identifier: Apache-2.0
/** @file Procedures of a client: runs, joint motions, homing, recovery and withdrawal; each sends requests and waits
 * for the end. */
#pragma once

#include <Eigen/Core>

#include "planning/follower.h"
#include "safety/recovery.h"
#include "services/client/client.h"

namespace tandem::client {

/** Progress or result of a run. */
struct RunState {
  planning::Phase phase = planning::Phase::kRunning;
  std::uint32_t point = 0, points = 0, iterations = 0;  ///< iterations of all points so far
  std::vector<double> errors{};                         ///< m, one per task
  dds::RunSummary summary{};                            ///< at the end; its trajectory_id is 0 if it was not received
};

/** Motions of a robot whose lease the client has. Each waits for its end, and throws Failure with the reason if it does
 * not reach its goal; arms that still move are then paused. */
class Motions {
 public:
  using Wait = std::function<bool(double seconds, const std::function<bool(const Snapshot&)>& condition)>;

  /// Client and files are kept by reference.
  /// @param uninterruptible  uninterruptible(true): from now on nothing interrupts the client, for requests that follow
  /// an interruption
  /// @param wait  replaces Client::waitFor(); empty: Client::waitFor()
  Motions(Client& client,
          const config::Deployment& deployment,
          const config::Robot& robot,
          std::function<void(bool)> uninterruptible,
          Wait wait = {});

  /// Disables all arms. Acquires the lease if a fault has to be cleared, and releases it.
  void disable();
  /// Returns when the arm is at `joints` within safety::kPositionTolerance. @param joints  m and rad
  void moveJp(std::size_t arm, const Eigen::VectorXd& joints);
  /// Executes the request; returns when the arm has power. @throw Failure with the reason if it gets none
  void recover(const dds::ControlRequest& request);
  /// Returns when nothing more can be retracted. @param progress  called repeatedly by the calling thread
  void withdraw(std::uint8_t arm, const std::function<void(const Snapshot&)>& progress);
  /// Moves all arms to the home of the robot file.
  void home();

  struct Run {
    std::string trajectory;  ///< YAML text of a trajectory, or of a path of the common object
    bool planned = false;    ///< with the joints that planning computes
    bool keep_enabled = false;
    std::function<void(const RunState&)> progress{};       ///< called at every new point, by the calling thread
    std::function<void(const std::string& who)> paused{};  ///< called when another client has paused the arms
    std::function<bool()> goes_on{};                       ///< called repeatedly while they are paused: true resumes
  };
  /// Enables, follows a trajectory, disables. @return its end, possibly before the last point
  RunState run(const Run& run);

  /// Releases the lease, also after an interruption. If control does not reply, the lease expires without its
  /// heartbeat.
  void releaseLease() noexcept;

 private:
  class Uninterruptible;
  void expectNoFault(const Snapshot& snapshot) const;
  /// Waits for `over`, also through pauses by other clients. @return false after an interruption
  bool waitUntilFinished(const Run& run, const std::function<bool(const Snapshot&)>& over);
  std::string describePauser(std::uint64_t client) const;
  [[noreturn]] void abandon(const std::string& what, const std::function<void()>& end_run = {});

  Client& client_;
  const config::Deployment& deployment_;
  const config::Robot& robot_;
  std::function<void(bool)> uninterruptible_;
  Wait wait_;
};

/// Index of an arm by its name. @throw Failure
std::uint8_t armIndex(const config::Robot& robot, const std::string& arm);
/// Index of a joint by its name, or "b1" for beta_1. @throw Failure that lists all names
int jointIndex(const config::Arm& arm, const std::string& name);

/// "beta_1, alpha_3"; empty for none.
std::string jointNamesOf(const config::Arm& arm, safety::JointMask joints);

/// Trajectory or path text for Motions::Run, from a file or preset; a shape from CSV is read here, so that planning
/// needs no file of the client. @throw config::Error
std::string runText(const std::string& name_or_path);

/// Connects and acquires the lease, as a run does. @param interrupted  polled during waits
void takeCommand(Client& client, std::function<bool()> interrupted);
/// Disables all arms and releases the lease; ignores errors of a system that is stopping.
void endCommand(Client& client) noexcept;

/// Stops all arms and waits until the drives report it; needs no connection and no lease. @throw Failure
void stopAndWait(Client& client, const std::string& reason);

}  // namespace tandem::client
