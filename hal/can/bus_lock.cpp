// SPDX-License-Identifier: Apache-2.0
#include "hal/can/bus_lock.h"

#include <net/if.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <utility>

namespace tandem::hal::can {
namespace {

/// A refused process connects once to read the id of the lock owner; no process accepts, so the backlog limits the
/// number of such queries.
constexpr int kBacklog = 4096;

std::system_error lockFailure(const std::string& what) { return {errno, std::generic_category(), what}; }

/// Identity of the bus, the same for all its names.
std::string identityOf(const std::string& address) {
  const std::size_t colon = address.find(':');
  const std::string kind = address.substr(0, colon);
  const std::string rest = colon == std::string::npos ? "" : address.substr(colon + 1);
  if (kind == "can") {
    const unsigned index = if_nametoindex(rest.c_str());
    if (index == 0)
      throw lockFailure(address);
    return "can/" + std::to_string(index);
  }
  // The folder, not the file: each start of the hub makes a new file.
  const std::filesystem::path path = rest;
  const std::string folder = path.has_parent_path() ? path.parent_path().string() : ".";
  struct stat place {};
  if (stat(folder.c_str(), &place) != 0)
    throw lockFailure(address);
  constexpr std::size_t kLongest = 48;  // of 107 for all
  std::string file = path.filename().string();
  file.erase(0, file.size() - std::min(file.size(), kLongest));
  return "unix/" + std::to_string(place.st_dev) + "." + std::to_string(place.st_ino) + "/" + file;
}

socklen_t fill(sockaddr_un& address, const std::string& identity) {
  const std::string name = "tandem-bus/" + identity;
  address.sun_family = AF_UNIX;
  const std::size_t length = std::min(name.size(), sizeof address.sun_path - 1);
  std::memcpy(address.sun_path + 1, name.data(), length);  // behind a zero: abstract
  return static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + length);
}

/// Process id of the listener at the address, 0 if not known.
int holderOf(const sockaddr_un& address, socklen_t length) {
  const int fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0)
    return 0;
  ucred who{};
  socklen_t size = sizeof who;
  const bool known = connect(fd, reinterpret_cast<const sockaddr*>(&address), length) == 0 &&
                     getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &who, &size) == 0;
  close(fd);
  return known ? who.pid : 0;
}

std::string describeHolder(int process) {
  if (process <= 0)
    return "another process of this host";
  std::ifstream file("/proc/" + std::to_string(process) + "/comm");
  std::string command;
  std::getline(file, command);
  return "process " + std::to_string(process) + (command.empty() ? "" : " (" + command + ")");
}

}  // namespace

BusLock::BusLock(const std::string& address) {
  sockaddr_un place{};
  const socklen_t length = fill(place, identityOf(address));
  fd_ = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd_ < 0)
    throw lockFailure("lock of " + address);
  if (bind(fd_, reinterpret_cast<const sockaddr*>(&place), length) == 0 && listen(fd_, kBacklog) == 0)
    return;
  const std::system_error error = lockFailure("lock of " + address);
  close(fd_);
  if (error.code().value() != EADDRINUSE)
    throw error;
  const int holder = holderOf(place, length);
  throw BusTaken(describeHolder(holder) + " commands it", holder);
}

BusLock::~BusLock() {
  if (fd_ >= 0)
    close(fd_);
}

BusLock::BusLock(BusLock&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}

}  // namespace tandem::hal::can
