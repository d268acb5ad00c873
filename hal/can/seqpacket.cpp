// SPDX-License-Identifier: Apache-2.0
#include "hal/can/detail/seqpacket.h"

#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>

#include "hal/can/clock.h"
#include "hal/can/detail/kernel_frame.h"

namespace tandem::hal::can {
namespace {

constexpr std::int64_t kRetry = 100'000'000;
constexpr int kQueue = 1 << 20;  // bytes queued for one participant

std::system_error failure(const std::string& what) { return {errno, std::generic_category(), what}; }

bool addressOf(const std::string& path, sockaddr_un& address) noexcept {
  address = {};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path)
    return false;
  std::memcpy(address.sun_path, path.c_str(), path.size());
  return true;
}

int openSocket() noexcept { return socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0); }

/// Sets the queue size of a socket and enables time stamps.
void prepare(int fd) noexcept {
  const int on = 1;
  setsockopt(fd, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
  if (setsockopt(fd, SOL_SOCKET, SO_SNDBUFFORCE, &kQueue, sizeof kQueue) != 0)
    setsockopt(fd, SOL_SOCKET, SO_SNDBUF, &kQueue, sizeof kQueue);
}

/// @return a connected socket, -1 with errno set.
int connectTo(const std::string& path) noexcept {
  sockaddr_un address;
  if (!addressOf(path, address)) {
    errno = ENAMETOOLONG;
    return -1;
  }
  const int fd = openSocket();
  if (fd >= 0 && connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    const int error = errno;
    close(fd);
    errno = error;
    return -1;
  }
  return fd;
}

void watch(int poll, int fd) noexcept {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.fd = fd;
  epoll_ctl(poll, EPOLL_CTL_ADD, fd, &event);
}

bool wouldBlock(int error) noexcept { return error == EAGAIN || error == EWOULDBLOCK || error == ENOBUFS; }

enum class Read : std::uint8_t { kFrame, kInvalid, kNothing, kEnd };

/** Time of a call of receive(), on both clocks. */
struct ClockReading {
  std::int64_t now = monotonicNow();
  std::int64_t offset = realtimeOffset();
};

std::int64_t timeOf(msghdr& header, const ClockReading& clock) noexcept {
  for (cmsghdr* part = CMSG_FIRSTHDR(&header); part != nullptr; part = CMSG_NXTHDR(&header, part)) {
    if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SO_TIMESTAMPNS)
      continue;
    timespec stamp;
    std::memcpy(&stamp, CMSG_DATA(part), sizeof stamp);
    return toMonotonic(stamp.tv_sec * std::int64_t{1'000'000'000} + stamp.tv_nsec, clock.now, clock.offset);
  }
  return clock.now;
}

Read readFrame(int fd, const ClockReading& clock, canfd_frame& packet, std::size_t& length, CanFrame& frame) noexcept {
  // One byte more than a frame, to detect longer packets.
  std::array<char, sizeof(canfd_frame) + 1> bytes;
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(timespec))> control;
  iovec part{bytes.data(), bytes.size()};
  msghdr header{};
  header.msg_iov = &part;
  header.msg_iovlen = 1;
  header.msg_control = control.data();
  header.msg_controllen = control.size();
  const ssize_t count = recvmsg(fd, &header, MSG_DONTWAIT);
  if (count < 0)
    return wouldBlock(errno) || errno == EINTR ? Read::kNothing : Read::kEnd;
  if (count == 0)
    return Read::kEnd;
  length = static_cast<std::size_t>(count);
  std::memcpy(&packet, bytes.data(), std::min(length, sizeof packet));
  if (!decodeFrame(packet, length, frame))
    return Read::kInvalid;
  frame.time = timeOf(header, clock);
  return Read::kFrame;
}

}  // namespace

SeqpacketBus::SeqpacketBus(const std::string& path, const BusOptions& options)
    : Bus("unix:" + path, options), path_(path), poll_(epoll_create1(EPOLL_CLOEXEC)) {
  fd_frames_ = options.fd;
  if (poll_ < 0)
    throw failure("epoll");
  if (!connect()) {
    const std::system_error error = failure(name());
    close(poll_);
    throw error;
  }
}

SeqpacketBus::~SeqpacketBus() {
  disconnect();
  close(poll_);
}

bool SeqpacketBus::connect() noexcept {
  fd_ = connectTo(path_);
  if (fd_ < 0)
    return false;
  prepare(fd_);
  watch(poll_, fd_);
  noteState(BusState::kActive);
  return true;
}

void SeqpacketBus::disconnect() noexcept {
  if (fd_ >= 0)
    close(fd_);
  fd_ = -1;
  noteState(BusState::kDown);
}

std::size_t SeqpacketBus::send(std::span<const CanFrame> frames) noexcept {
  std::size_t taken = 0;
  bool full = false;
  while (taken < frames.size() && fd_ >= 0 && state() != BusState::kOff) {
    const CanFrame& frame = frames[taken];
    if (!lengthIsValid(frame) || (frame.fd && !fd_frames_))
      break;
    canfd_frame packet{};
    const std::size_t length = encodeFrame(frame, packet);
    if (::send(fd_, &packet, length, MSG_DONTWAIT | MSG_NOSIGNAL) < 0) {
      full = wouldBlock(errno);
      if (!full)
        disconnect();
      break;
    }
    ++taken;
  }
  const std::size_t left = frames.size() - taken;
  noteSend(frames.first(taken), full ? left : 0, full ? 0 : left);
  return taken;
}

std::size_t SeqpacketBus::receive(std::span<CanFrame> frames) noexcept {
  const ClockReading clock;
  if (fd_ < 0) {
    if (clock.now < next_attempt_)
      return 0;
    next_attempt_ = clock.now + kRetry;
    if (!connect())
      return 0;
  }
  std::size_t filled = 0;
  while (filled < frames.size()) {
    canfd_frame packet;
    std::size_t length = 0;
    const Read read = readFrame(fd_, clock, packet, length, frames[filled]);
    if (read == Read::kNothing)
      break;
    if (read == Read::kEnd) {
      ++counters_.rx_failed;
      disconnect();
      break;
    }
    if (read == Read::kInvalid) {
      ++counters_.rx_invalid;
    } else if (accepts(frames[filled]) && (fd_frames_ || !frames[filled].fd)) {
      if (frames[filled].error)
        noteError(frames[filled]);
      ++filled;
    }
  }
  noteReceived(frames.first(filled));
  return filled;
}

SeqpacketHub::SeqpacketHub(const std::string& path, const BusOptions& options)
    : Bus("unix-hub:" + path, options), path_(path) {
  fd_frames_ = options.fd;
  sockaddr_un address;
  if (!addressOf(path, address))
    throw std::system_error(ENAMETOOLONG, std::generic_category(), name());
  const int other = connectTo(path);
  if (other >= 0) {
    close(other);
    throw std::system_error(EADDRINUSE, std::generic_category(), name());
  }
  if (errno == ECONNREFUSED)  // a socket file without a process
    unlink(path.c_str());
  poll_ = epoll_create1(EPOLL_CLOEXEC);
  listener_ = openSocket();
  if (poll_ < 0 || listener_ < 0 || bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      listen(listener_, 8) != 0) {
    const std::system_error error = failure(name());
    close(listener_);
    close(poll_);
    throw error;
  }
  watch(poll_, listener_);
}

SeqpacketHub::~SeqpacketHub() {
  while (peer_count_ > 0)
    drop(peer_count_ - 1);
  close(listener_);
  close(poll_);
  unlink(path_.c_str());
}

void SeqpacketHub::accept() noexcept {
  while (peer_count_ < kMaxPeers) {
    const int fd = accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (fd < 0)
      return;
    prepare(fd);
    watch(poll_, fd);
    peers_[peer_count_++] = fd;
  }
}

void SeqpacketHub::drop(std::size_t peer) noexcept {
  close(peers_[peer]);
  peers_[peer] = peers_[--peer_count_];
}

void SeqpacketHub::forward(const void* packet, std::size_t length, int from) noexcept {
  for (std::size_t k = 0; k < peer_count_; ++k) {
    if (peers_[k] == from)
      continue;
    // The loss of a peer is detected when it is read.
    if (::send(peers_[k], packet, length, MSG_DONTWAIT | MSG_NOSIGNAL) < 0 && wouldBlock(errno))
      ++undelivered_;
  }
}

std::size_t SeqpacketHub::send(std::span<const CanFrame> frames) noexcept {
  accept();
  std::size_t taken = 0;
  for (; taken < frames.size(); ++taken) {
    if (!lengthIsValid(frames[taken]) || (frames[taken].fd && !fd_frames_))
      break;
    canfd_frame packet{};
    const std::size_t length = encodeFrame(frames[taken], packet);
    forward(&packet, length, -1);
  }
  noteSend(frames.first(taken), 0, frames.size() - taken);
  return taken;
}

std::size_t SeqpacketHub::receive(std::span<CanFrame> frames) noexcept {
  accept();
  const ClockReading clock;
  std::size_t filled = 0;
  std::size_t idle = 0;
  // Round robin, so that one participant that floods does not block the others.
  for (std::size_t peer = 0; filled < frames.size() && idle < peer_count_; ++peer) {
    if (peer >= peer_count_)
      peer = 0;
    canfd_frame packet;
    std::size_t length = 0;
    const Read read = readFrame(peers_[peer], clock, packet, length, frames[filled]);
    idle = read == Read::kNothing ? idle + 1 : 0;
    if (read == Read::kEnd) {
      drop(peer);
    } else if (read == Read::kInvalid) {
      ++counters_.rx_invalid;
    } else if (read == Read::kFrame) {
      forward(&packet, length, peers_[peer]);
      if (accepts(frames[filled]) && (fd_frames_ || !frames[filled].fd))
        ++filled;
    }
  }
  for (std::size_t k = 0; k < filled; ++k) {
    if (frames[k].error)
      noteError(frames[k]);
  }
  noteReceived(frames.first(filled));
  return filled;
}

}  // namespace tandem::hal::can
