// SPDX-License-Identifier: Apache-2.0
/** @file Procedures of a client: runs, joint motions, homing, recovery and withdrawal; each sends requests and waits
 * for its end. */
#pragma once

#include <Eigen/Core>

#include "planning/follower.h"
#include "safety/recovery.h"
#include "services/client/client.h"

namespace tandem::client {

/** How far a run is, or how it ended. */
struct RunState {
  planning::Phase phase = planning::Phase::kRunning;
  std::uint32_t point = 0, points = 0, iterations = 0;  ///< iterations of all points so far
  std::vector<double> errors{};                         ///< m, one a task
  std::string why{};                                    ///< a failed run: as planning says, where it does
};

/** Motions of a robot whose lease the client holds. Each waits for its end, and throws Failure with the reason where
 * that is not what was asked for: arms that still move are paused then. */
class Motions {
 public:
  using Wait = std::function<bool(double seconds, const std::function<bool(const Snapshot&)>& condition)>;

  /// Client and files are kept by reference.
  /// @param uninterruptible  uninterruptible(true): from now on nothing interrupts the client, for what has to be said
  /// after an interruption
  /// @param wait  as Client::waitFor(); empty: that one
  Motions(Client& client,
          const config::Deployment& deployment,
          const config::Robot& robot,
          std::function<void(bool)> uninterruptible,
          Wait wait = {});

  /// Disables all arms. Takes the lease where that has to clear a fault, and gives it back.
  void disable();
  /// Until the arm is there, to safety::kAtRest. @param joints  m and rad
  void moveJp(std::size_t arm, const Eigen::VectorXd& joints);
  /// As the request says, until the arm has power. @throw Failure with what stands against it
  void recover(const dds::ControlRequest& request);
  /// Until nothing more can be retracted. @param progress  called from here, again and again
  void withdraw(std::uint8_t arm, const std::function<void(const Snapshot&)>& progress);
  /// All arms to the home of the robot file.
  void home();

  struct Run {
    std::string trajectory;  ///< YAML text of a trajectory, or of a path for catheters
    bool planned = false;    ///< with the joints that planning finds
    bool keep_enabled = false;
    std::function<void(const RunState&)> progress{};       ///< called from here at every new point
    std::function<void(const std::string& who)> paused{};  ///< called when somebody else has paused the arms
    std::function<bool()> goes_on{};                       ///< asked again and again while they are: true resumes
  };
  /// Enables, follows a trajectory, disables. @return how it ended, which may be before the last point
  RunState run(const Run& run);

  /// Gives the lease back, whatever interrupts. Who does not answer has forgotten it, or will: nobody keeps it alive.
  void releaseLease() noexcept;

 private:
  class Uninterruptible;
  void expectNoFault(const Snapshot& snapshot) const;
  /// Until it is over, through pauses by others. @return false where it was interrupted
  bool waitUntilFinished(const Run& run, const std::function<bool(const Snapshot&)>& over);
  std::string describePauser(std::uint64_t client) const;
  [[noreturn]] void abandon(const std::string& what, bool trajectory);

  Client& client_;
  const config::Deployment& deployment_;
  const config::Robot& robot_;
  std::function<void(bool)> uninterruptible_;
  Wait wait_;
};

/// Number of an arm by its name. @throw Failure
std::uint8_t armIndex(const config::Robot& robot, const std::string& arm);
/// Number of a joint by its name, or "b1" for beta_1. @throw Failure that names them all
int jointIndex(const config::Arm& arm, const std::string& name);

/// "beta_1, alpha_3"; empty for none.
std::string jointNamesOf(const config::Arm& arm, safety::JointMask joints);

/// Why the last run failed, in planning's words; empty where it does not say.
std::string failureOf(const Snapshot& snapshot);

/// Text for Motions::Run of a trajectory or path by file or preset; a shape from CSV is read here, so that planning
/// needs no file of ours. @throw config::Error
std::string runText(const std::string& name_or_path);

/// Connects, and takes the lease, as a run of one's own does. @param interrupted  asked while it waits
void takeCommand(Client& client, std::function<bool()> interrupted);
/// Disables all arms and gives the lease back, where there is still somebody to tell.
void endCommand(Client& client) noexcept;

/// Stops all arms and waits until the drives report it; needs no connection and no lease. @throw Failure
void stopAndWait(Client& client, const std::string& reason);

}  // namespace tandem::client
