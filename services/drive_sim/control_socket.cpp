// SPDX-License-Identifier: Apache-2.0
#include "services/drive_sim/control_socket.h"

#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>

namespace tandem::drive_sim {
namespace {

constexpr std::size_t kLongest = 1 << 16;

std::system_error failure(const std::string& what) { return {errno, std::generic_category(), what}; }

sockaddr_un addressOf(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path)
    throw std::system_error(ENAMETOOLONG, std::generic_category(), path);
  std::memcpy(address.sun_path, path.c_str(), path.size());
  return address;
}

void watch(int poll, int fd) {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.fd = fd;
  epoll_ctl(poll, EPOLL_CTL_ADD, fd, &event);
}

}  // namespace

ControlSocket::ControlSocket(const std::string& path) : path_(path) {
  const sockaddr_un address = addressOf(path);
  poll_ = epoll_create1(EPOLL_CLOEXEC);
  listener_ = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  unlink(path.c_str());  // of an earlier run
  if (poll_ < 0 || listener_ < 0 || bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      listen(listener_, 8) != 0) {
    const std::system_error error = failure("control socket " + path);
    close(listener_);
    close(poll_);
    throw error;
  }
  watch(poll_, listener_);
}

ControlSocket::~ControlSocket() {
  for (const int client : clients_)
    close(client);
  close(listener_);
  close(poll_);
  unlink(path_.c_str());
}

void ControlSocket::poll(const std::function<std::string(const std::string&)>& answer) {
  for (int fd = 0; (fd = accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC)) >= 0;) {
    watch(poll_, fd);
    clients_.push_back(fd);
  }
  std::string line(kLongest, '\0');
  for (std::size_t k = clients_.size(); k-- > 0;) {
    const ssize_t count = recv(clients_[k], line.data(), line.size(), MSG_DONTWAIT);
    if (count > 0) {
      const std::string reply = answer(line.substr(0, static_cast<std::size_t>(count)));
      send(clients_[k], reply.data(), reply.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
    } else if (count == 0 || (errno != EAGAIN && errno != EINTR)) {
      close(clients_[k]);
      clients_.erase(clients_.begin() + static_cast<std::ptrdiff_t>(k));
    }
  }
}

std::string askControl(const std::string& path, const std::string& line, double seconds) {
  const sockaddr_un address = addressOf(path);
  const int fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  timeval timeout{};
  timeout.tv_sec = static_cast<time_t>(seconds);
  timeout.tv_usec = static_cast<suseconds_t>(1e6 * (seconds - static_cast<double>(timeout.tv_sec)));
  setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
  std::string reply(kLongest, '\0');
  ssize_t count = -1;
  if (connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
      send(fd, line.data(), line.size(), MSG_NOSIGNAL) >= 0) {
    count = recv(fd, reply.data(), reply.size(), 0);
  }
  const std::system_error error = failure("control socket " + path);
  close(fd);
  if (count < 0)
    throw error;
  reply.resize(static_cast<std::size_t>(count));
  return reply;
}

}  // namespace tandem::drive_sim
