// SPDX-License-Identifier: Apache-2.0
/** @file Process supervisor: starts the processes of a deployment, detects deaths, ends them all. */
#pragma once

#include <sys/types.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "config/config.h"

namespace tandem::cli {

/** A process that ended although nobody asked it to. */
struct ProcessExit {
  std::string name;
  pid_t pid = 0;
  int status = 0;         ///< as waitpid() gives it
  bool essential = true;  ///< the deployment does not go on without it

  /// "control (pid 4711) was killed by signal 9 (Killed)".
  std::string describe() const;
};

/** The processes of one deployment on one host. They die with this process, however it ends. */
class Supervisor {
 public:
  /// Starts those of the host, and the discovery server before them if this machine has its address; all where the
  /// deployment has no hosts. @throw Failure where an executable is missing.
  /// @param log_level  for the services; empty: theirs.
  Supervisor(const config::Deployment& deployment, const std::string& host, const std::string& log_level);
  /// Ends all that still run.
  ~Supervisor();
  Supervisor(const Supervisor&) = delete;
  Supervisor& operator=(const Supervisor&) = delete;

  /// The first process that died since the last call, if any. Never waits.
  std::optional<ProcessExit> poll();

  static constexpr double kLeave = 3.0;  ///< s, that processes have to end
  /// SIGTERM to the services, then to what they stand on; SIGKILL to those that are still there after so many s each.
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

/** Runs `body` beside the processes of a deployment on this host, which are started for it and ended after it.
 * @param body  gets what says that a process has died or Ctrl-C was pressed
 * @throw Failure that names either, where that is why `body` failed. */
void withProcesses(const config::Deployment& deployment,
                   const std::string& log_level,
                   const std::function<void(const std::function<bool()>& interrupted)>& body);

}  // namespace tandem::cli
