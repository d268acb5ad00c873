// SPDX-License-Identifier: Apache-2.0
/** @file Process supervisor: starts the processes of a deployment, detects their exits, and ends them. */
#pragma once

#include <sys/types.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "config/config.h"

namespace tandem::cli {

/** Unexpected exit of a process. */
struct ProcessExit {
  std::string name;
  pid_t pid = 0;
  int status = 0;         ///< status of waitpid()
  bool essential = true;  ///< the deployment cannot continue without it

  /// "control (pid 4711) was killed by signal 9 (Killed)".
  std::string describe() const;
};

/** Processes of one deployment on one host. The kernel ends them when this process ends, for whatever reason. */
class Supervisor {
 public:
  /// Starts the processes of `host` (all if the deployment has no hosts), after the discovery server if this machine
  /// has its address. @throw Failure if an executable is missing.
  /// @param log_level  of the services; empty: their default
  Supervisor(const config::Deployment& deployment, const std::string& host, const std::string& log_level);
  /// Ends all processes that still run.
  ~Supervisor();
  Supervisor(const Supervisor&) = delete;
  Supervisor& operator=(const Supervisor&) = delete;

  /// The first process that exited since the last call, if any. Does not wait.
  std::optional<ProcessExit> poll();

  static constexpr double kLeave = 3.0;  ///< s, for processes to end
  /// SIGTERM to the services, then to the processes that they depend on; SIGKILL after `timeout`, s, each.
  void stopAll(double timeout = kLeave);

  struct Child {
    std::string name;
    pid_t pid = 0;
    bool is_service = true;
    bool essential = true;
  };
  const std::vector<Child>& children() const { return children_; }

 private:
  void start(const config::Deployment& deployment, const config::Process& process, const std::string& log_level);
  void stop(bool services, double timeout);

  std::vector<Child> children_;
};

/** Runs `body` while the processes of a deployment run on this host; starts them before and ends them after it.
 * @param body  receives a function that returns true if a process has exited or Ctrl-C was pressed
 * @throw Failure with that reason, if it made `body` fail. */
void withProcesses(const config::Deployment& deployment,
                   const std::string& log_level,
                   const std::function<void(const std::function<bool()>& interrupted)>& body);

}  // namespace tandem::cli
