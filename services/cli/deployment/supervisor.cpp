// SPDX-License-Identifier: Apache-2.0
#include "services/cli/deployment/supervisor.h"

#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <thread>

#include "services/cli/deployment/domain.h"
#include "services/cli/subcommand.h"
#include "services/dds/host_addresses.h"
#include "services/runtime/process.h"
#include "services/runtime/stop_signal.h"

namespace tandem::cli {

std::string ProcessExit::describe() const {
  const std::string who = name + " (pid " + std::to_string(pid) + ") ";
  if (WIFSIGNALED(status)) {
    return who + "was killed by signal " + std::to_string(WTERMSIG(status)) + " (" + strsignal(WTERMSIG(status)) + ")";
  }
  return who + "ended with exit code " + std::to_string(WEXITSTATUS(status));
}

Supervisor::Supervisor(const config::Deployment& deployment, const std::string& host, const std::string& log_level) {
  if (deployment.discovery && dds::hostAddresses().contains(deployment.discovery->address))
    start(deployment, {"discovery", "tandem-discovery", {}, true, host}, log_level);
  for (const config::Process& process : deployment.processes) {
    if (process.host == host)
      start(deployment, process, log_level);
  }
}

Supervisor::~Supervisor() { stopAll(); }

void Supervisor::start(const config::Deployment& deployment,
                       const config::Process& process,
                       const std::string& log_level) {
  const auto beside = std::filesystem::read_symlink("/proc/self/exe").parent_path() / process.executable;
  if (access(beside.c_str(), X_OK) != 0) {
    throw Failure(kUsage, deployment.file.string() + ": processes: " + process.name +
                              ": executable: found no program " + beside.string() +
                              ", expected one in the folder of tandem, or an absolute path");
  }
  std::vector<std::string> words{beside.string()};
  if (process.is_service)
    words.insert(words.end(), {"--deployment", deployment.file.string()});
  if (process.is_service && !log_level.empty())
    words.insert(words.end(), {"--log", log_level});
  words.insert(words.end(), process.arguments.begin(), process.arguments.end());
  std::vector<char*> arguments;
  for (std::string& word : words)
    arguments.push_back(word.data());
  arguments.push_back(nullptr);

  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid < 0)
    throw Failure(kFailure, std::string("cannot start a process: ") + std::strerror(errno));
  if (pid == 0) {
    // Only async-signal-safe calls from here on. The child has its own process group, so that Ctrl-C reaches only the
    // parent, which ends its children in order.
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent)
      _exit(127);
    setpgid(0, 0);
    execv(arguments[0], arguments.data());
    _exit(127);
  }
  children_.push_back({process.name, pid, process.is_service, process.essential});
}

std::optional<ProcessExit> Supervisor::poll() {
  for (auto child = children_.begin(); child != children_.end(); ++child) {
    int status = 0;
    if (waitpid(child->pid, &status, WNOHANG) != child->pid)
      continue;
    ProcessExit exited{child->name, child->pid, status, child->essential};
    children_.erase(child);
    return exited;
  }
  return std::nullopt;
}

void Supervisor::stop(bool services, double timeout) {
  const auto concerned = [services](const Child& child) { return child.is_service == services; };
  for (const Child& child : children_) {
    if (concerned(child))
      kill(child.pid, SIGTERM);
  }
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(timeout);
  while (std::any_of(children_.begin(), children_.end(), concerned) && std::chrono::steady_clock::now() < deadline) {
    while (poll()) {
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

void Supervisor::stopAll(double timeout) {
  stop(true, timeout);
  stop(false, timeout);  // simulated drives end after the HAL, which brings the arms to a standstill
  for (const Child& child : children_) {
    kill(child.pid, SIGKILL);
    waitpid(child.pid, nullptr, 0);
  }
  children_.clear();
}

void withProcesses(const config::Deployment& deployment,
                   const std::string& log_level,
                   const std::function<void(const std::function<bool()>&)>& body) {
  runtime::StopSignal stop;
  const std::string host = runtime::hostName(deployment);
  const DomainLock domain_lock(deployment, host);
  Supervisor supervisor(deployment, host, log_level);
  std::optional<ProcessExit> exited;
  try {
    body([&] { return stop.requested() || exited || (exited = supervisor.poll()).has_value(); });
  } catch (const Failure&) {
    if (exited)
      throw Failure(kFailure, exited->describe());
    if (stop.requested())
      throw Failure(kFailure, "interrupted");
    throw;
  }
}

}  // namespace tandem::cli
