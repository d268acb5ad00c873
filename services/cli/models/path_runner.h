// SPDX-License-Identifier: Apache-2.0
/** @file Execution of a path over DDS in lock-step, with one row per period. */
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>

#include "robots/track.h"
#include "services/client/client.h"
#include "services/runtime/temporary_folder.h"

namespace tandem::cli {

/** Temporary deployment of one robot file: simulator, control and planning in lock-step, with a unique prefix, in a
 * domain without other participants on this machine. Its folder is removed with this object.
 */
class TemporaryDeployment {
 public:
  /// @throw Failure where the folder cannot be made; config::Error as config::loadDeployment() does.
  TemporaryDeployment(const std::filesystem::path& robot, double period, double gain, control::Method method);
  const config::Deployment& deployment() const { return deployment_; }

 private:
  runtime::TemporaryFolder folder_;
  config::Deployment deployment_;
};

/** Drives the running processes along a path. What is moved is taken to be where the equilibrium of a mechanism of its
 * own is at the joints that the topics tell. */
class PathRunner {
 public:
  /// Connects and takes the control lease. @param interrupted  ends waiting: a process died or the user asked.
  PathRunner(const config::Deployment& deployment, std::function<bool()> interrupted);
  ~PathRunner();

  /// @param mechanism  in equilibrium where the robot stands  @param path  with the mechanism's length
  /// @return as robots::track() does  @throw Failure where a service falls silent or a sample is missing.
  robots::TrackRecord run(robots::Mechanism& mechanism,
                          const planning::ObjectPath& path,
                          const robots::TrackOptions& options,
                          const std::function<void(double, double)>& progress);

 private:
  /// One period of the run: reference of planning, measured joints, solution of control.
  struct Period {
    dds::PlanningReference reference;
    dds::ActuationState state;
    dds::ControlStatus status;
  };
  std::uint32_t start(const planning::ObjectPath& path, std::string& refused);
  std::optional<Period> take(std::uint32_t id);
  Period next(std::uint32_t id, std::size_t periods);  ///< waits for it
  safety::RobotVector joints(const dds::ActuationState& state, int count) const;

  double period_;
  mutable std::mutex mutex_;
  std::deque<dds::PlanningReference> references_;         ///< in order of arrival
  std::map<std::uint64_t, dds::ActuationState> states_;   ///< by sequence
  std::map<std::uint64_t, dds::ControlStatus> statuses_;  ///< those with a solution, by the state that they answer
  std::unique_ptr<client::Client> client_;
};

}  // namespace tandem::cli
