// SPDX-License-Identifier: Apache-2.0
/** @file Execution of a path over DDS in lock-step, with one row per period. */
#pragma once

#include <filesystem>
#include <functional>

#include "robots/track.h"
#include "services/cli/models/experiment_runner.h"
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

/** Runs a path. The common object is assumed to be where the equilibrium of `mechanism` at the measured joints is.
 * @param mechanism  in equilibrium where the robot stands  @param path  with the mechanism's length
 * @return as robots::track() does  @throw Failure where a service publishes nothing or a sample is missing. */
robots::TrackRecord runPath(ExperimentRunner& runner,
                            robots::Mechanism& mechanism,
                            const planning::ObjectPath& path,
                            const robots::TrackOptions& options,
                            const std::function<void(double, double)>& progress);

}  // namespace tandem::cli
