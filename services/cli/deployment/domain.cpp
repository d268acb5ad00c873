// SPDX-License-Identifier: Apache-2.0
#include "services/cli/deployment/domain.h"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <thread>

#include "services/cli/subcommand.h"
#include "services/client/role.h"
#include "services/dds/ports.h"
#include "services/runtime/identity.h"
#include "services/runtime/process.h"

namespace tandem::cli {
namespace {

/// Whether the ports of the first participants of a domain are unused.
bool isFree(int domain) {
  for (int participant = 0; participant < 4; ++participant) {
    const int probe = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(dds::discoveryPort(domain, participant)));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const bool mine = bind(probe, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
    close(probe);
    if (!mine)
      return false;
  }
  return true;
}

int freeDomain() {
  constexpr int kFirst = 1, kCount = 100;  // higher domains share ports with outgoing connections
  for (int k = 0; k < kCount; ++k) {
    const int domain = kFirst + (getpid() + k) % kCount;
    if (isFree(domain))
      return domain;
  }
  throw Failure(kFailure, "no DDS domain is free: the UDP ports of all domains from 1 to 100 are in use");
}

/// "since 2026-11-23 10:44:03".
std::string startText(std::int64_t wall) {
  const auto seconds = static_cast<time_t>(wall / 1'000'000'000);
  tm parts{};
  localtime_r(&seconds, &parts);
  char text[40];
  std::strftime(text, sizeof text, "since %F %T", &parts);
  return text;
}

/// Process, on any host, that runs a service of `host` already; empty if there is none.
/// @param listen  how long to wait for a report, s
std::string occupant(const config::Deployment& deployment, const std::string& host, double listen) {
  constexpr double kLook = 0.02;  // s
  const dds::Bus bus(client::clientOptions(deployment));
  const auto start = std::chrono::steady_clock::now();
  while (since(start) < listen) {
    for (const dds::Identity& other : bus.others()) {
      const bool ours = std::ranges::any_of(deployment.processes, [&](const config::Process& process) {
        // A program of one's own in a role has the name of the role alone (docs/own-hardware.md).
        const bool same = "tandem-" + other.process == std::filesystem::path(process.executable).filename() ||
                          other.process == process.name;
        return process.host == host && process.is_service && same;
      });
      if (ours && other.moves != 0)
        return runtime::describe(other) + ", deployment " + other.deployment + ", " + startText(other.started);
    }
    std::this_thread::sleep_for(std::chrono::duration<double>(kLook));
  }
  return {};
}

/// Binds an abstract socket in this network namespace, the scope of domains. @return -1 if the name is in use
int claim(const config::Deployment& deployment) {
  const std::string name = "tandem-up-" + std::to_string(deployment.domain) + "-" + deployment.prefix;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::size_t length = std::min(name.size(), sizeof address.sun_path - 1);
  std::copy_n(name.data(), length, address.sun_path + 1);
  const int held = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + length);
  if (held >= 0 && ::bind(held, reinterpret_cast<const sockaddr*>(&address), size) == 0)
    return held;
  ::close(held);
  return -1;
}

}  // namespace

void useOwnDomain(config::Deployment& deployment) {
  const bool named = std::getenv("TANDEM_DOMAIN") != nullptr || std::getenv("TANDEM_PREFIX") != nullptr;
  if (named || !deployment.hosts.empty() || !deployment.security.empty())
    return;
  deployment.domain = freeDomain();
  deployment.prefix = "run_" + std::to_string(::getpid());
  ::setenv("TANDEM_DOMAIN", std::to_string(deployment.domain).c_str(), 1);
  ::setenv("TANDEM_PREFIX", deployment.prefix.c_str(), 1);
}

DomainLock::DomainLock(const config::Deployment& deployment, const std::string& host) : socket_(claim(deployment)) {
  // A running process is found after 0.1 s, on a loaded PC after some seconds.
  constexpr double kListen = 0.5, kListenToKnown = 10.0;  // s
  const std::string there = occupant(deployment, host, socket_ >= 0 ? kListen : kListenToKnown);
  if (socket_ >= 0 && there.empty())
    return;
  if (socket_ >= 0)
    ::close(socket_);
  throw Failure(kFailure, "domain " + std::to_string(deployment.domain) + ", prefix " + deployment.prefix +
                              (there.empty() ? ": another `tandem up` is starting here" : ": in use by " + there) +
                              "; stop it, or choose another --domain or --prefix");
}

DomainLock::~DomainLock() { ::close(socket_); }

}  // namespace tandem::cli
