// SPDX-License-Identifier: Apache-2.0
#include "hal/can/detail/socketcan.h"

#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <linux/net_tstamp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <system_error>

#include "hal/can/clock.h"
#include "hal/can/detail/kernel_frame.h"

namespace tandem::hal::can {
namespace {

constexpr std::size_t kBatch = 64;
// Space for three time stamps and the overflow counter.
constexpr std::size_t kControlLength = CMSG_SPACE(3 * sizeof(timespec)) + CMSG_SPACE(sizeof(std::uint32_t));

void set(int fd, int level, int option, const void* value, std::size_t length, const char* what) {
  if (setsockopt(fd, level, option, value, static_cast<socklen_t>(length)) != 0)
    throw std::system_error(errno, std::generic_category(), what);
}

std::vector<can_filter> kernelFilters(const std::vector<Filter>& filters) {
  std::vector<can_filter> result;
  for (const Filter& filter : filters) {
    // Without the two flags in the mask, 29-bit and remote frames with the same low bits pass too.
    const std::uint32_t flag = filter.extended ? CAN_EFF_FLAG : 0u;
    const std::uint32_t bits = filter.extended ? CAN_EFF_MASK : CAN_SFF_MASK;
    result.push_back({(filter.id & bits) | flag, (filter.mask & bits) | CAN_EFF_FLAG | CAN_RTR_FLAG});
  }
  return result;
}

}  // namespace

/** Buffers that the kernel reads from and writes to, allocated once. */
struct SocketCanBus::Batch {
  std::array<canfd_frame, kBatch> frames{};
  std::array<iovec, kBatch> vectors{};
  std::array<mmsghdr, kBatch> headers{};
  alignas(cmsghdr) std::array<std::array<char, kControlLength>, kBatch> control{};

  Batch() {
    for (std::size_t k = 0; k < kBatch; ++k) {
      vectors[k] = {&frames[k], sizeof frames[k]};
      headers[k].msg_hdr.msg_iov = &vectors[k];
      headers[k].msg_hdr.msg_iovlen = 1;
    }
  }
};

SocketCanBus::SocketCanBus(const std::string& interface, const BusOptions& options)
    : Bus("can:" + interface, options), link_(interface), batch_(std::make_unique<Batch>()) {
  fd_ = socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
  if (fd_ < 0)
    throw std::system_error(errno, std::generic_category(), "CAN socket for " + interface);
  try {
    configure(options);
  } catch (...) {
    close(fd_);
    throw;
  }
}

SocketCanBus::~SocketCanBus() { close(fd_); }

void SocketCanBus::configure(const BusOptions& options) {
  if (link_.mtu() != CAN_MTU && link_.mtu() != CANFD_MTU)
    throw std::system_error(ENODEV, std::generic_category(), name() + " is no CAN interface");
  if (options.fd && link_.mtu() != CANFD_MTU)
    throw std::invalid_argument(name() + ": CAN FD: found an interface without it (MTU " + std::to_string(link_.mtu()) +
                                "), expected one with it");
  if (!link_.up())
    throw std::system_error(ENETDOWN, std::generic_category(), name());
  const int on = 1;
  if (options.fd)
    set(fd_, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on, "CAN FD frames");
  fd_frames_ = options.fd;
  if (!options.filters.empty()) {
    const auto filters = kernelFilters(options.filters);
    set(fd_, SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(), filters.size() * sizeof(can_filter), "CAN filters");
  }
  // Everything but single bus errors, which can flood.
  const can_err_mask_t errors = CAN_ERR_MASK & ~CAN_ERR_BUSERROR;
  set(fd_, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors, "CAN error filter");
  set(fd_, SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on, "overflow counter");
  const int stamps = SOF_TIMESTAMPING_RX_SOFTWARE | SOF_TIMESTAMPING_SOFTWARE;
  set(fd_, SOL_SOCKET, SO_TIMESTAMPING, &stamps, sizeof stamps, "time stamps");
  // Above the system's limit if this process may; else up to the limit.
  if (setsockopt(fd_, SOL_SOCKET, SO_RCVBUFFORCE, &options.receive_buffer, sizeof options.receive_buffer) != 0)
    set(fd_, SOL_SOCKET, SO_RCVBUF, &options.receive_buffer, sizeof options.receive_buffer, "receive buffer");
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = link_.index();
  if (bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    throw std::system_error(errno, std::generic_category(), "CAN socket: bind to " + name());
}

std::size_t SocketCanBus::send(std::span<const CanFrame> frames) noexcept {
  std::size_t taken = 0;
  int error = 0;
  while (taken < frames.size() && error == 0) {
    const std::size_t count = std::min(kBatch, frames.size() - taken);
    std::size_t valid = 0;
    for (; valid < count && lengthIsValid(frames[taken + valid]); ++valid) {
      msghdr& header = batch_->headers[valid].msg_hdr;
      batch_->vectors[valid].iov_len = encodeFrame(frames[taken + valid], batch_->frames[valid]);
      header.msg_control = nullptr;
      header.msg_controllen = 0;
    }
    const int sent = valid == 0 ? 0 : sendmmsg(fd_, batch_->headers.data(), static_cast<unsigned>(valid), MSG_DONTWAIT);
    if (sent < 0) {
      error = errno == EINTR ? 0 : errno;
    } else {
      taken += static_cast<std::size_t>(sent);
      if (valid < count && static_cast<std::size_t>(sent) == valid)
        error = EMSGSIZE;
    }
  }
  const std::size_t left = frames.size() - taken;
  const bool full = error == ENOBUFS || error == EAGAIN || error == EWOULDBLOCK;
  noteSend(frames.first(taken), full ? left : 0, full ? 0 : left);
  if (error == ENETDOWN || error == ENODEV || error == ENXIO)
    noteState(BusState::kDown);
  return taken;
}

std::size_t SocketCanBus::receive(std::span<CanFrame> frames) noexcept {
  pollLink();
  std::size_t filled = 0;
  while (filled < frames.size()) {
    const std::size_t wanted = std::min(kBatch, frames.size() - filled);
    const std::size_t before = filled;
    filled += receiveBatch(frames.subspan(filled, wanted));
    if (filled - before < wanted)
      break;
  }
  noteReceived(frames.first(filled));
  return filled;
}

std::size_t SocketCanBus::receiveBatch(std::span<CanFrame> frames) noexcept {
  for (std::size_t k = 0; k < frames.size(); ++k) {
    msghdr& header = batch_->headers[k].msg_hdr;
    batch_->vectors[k].iov_len = sizeof(canfd_frame);
    header.msg_control = batch_->control[k].data();
    header.msg_controllen = kControlLength;
  }
  const int count = recvmmsg(fd_, batch_->headers.data(), static_cast<unsigned>(frames.size()), MSG_DONTWAIT, nullptr);
  if (count < 0) {
    if (errno == ENETDOWN || errno == ENODEV) {
      ++counters_.rx_failed;
      noteState(BusState::kDown);
    }
    return 0;
  }
  const std::int64_t now = monotonicNow();
  const std::int64_t offset = realtimeOffset();
  std::size_t filled = 0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k)
    filled += take(k, now, offset, frames[filled]);
  return filled;
}

bool SocketCanBus::take(std::size_t slot, std::int64_t now, std::int64_t offset, CanFrame& frame) noexcept {
  msghdr& header = batch_->headers[slot].msg_hdr;
  frame.time = now;
  for (cmsghdr* part = CMSG_FIRSTHDR(&header); part != nullptr; part = CMSG_NXTHDR(&header, part)) {
    if (part->cmsg_level != SOL_SOCKET)
      continue;
    if (part->cmsg_type == SO_TIMESTAMPING) {
      timespec stamp{};  // the first of three is the software one, on CLOCK_REALTIME
      std::memcpy(&stamp, CMSG_DATA(part), sizeof stamp);
      if (stamp.tv_sec != 0)
        frame.time = toMonotonic(stamp.tv_sec * std::int64_t{1'000'000'000} + stamp.tv_nsec, now, offset);
    } else if (part->cmsg_type == SO_RXQ_OVFL) {
      std::uint32_t dropped = 0;
      std::memcpy(&dropped, CMSG_DATA(part), sizeof dropped);
      counters_.rx_overflow += static_cast<std::uint32_t>(dropped - overflow_);
      overflow_ = dropped;
    }
  }
  if (!decodeFrame(batch_->frames[slot], batch_->headers[slot].msg_len, frame)) {
    ++counters_.rx_invalid;
    return false;
  }
  if (frame.error)
    noteError(frame);
  return true;
}

void SocketCanBus::pollLink() noexcept {
  const bool was_up = link_.up();
  const bool up = link_.poll();
  if (!up) {
    noteState(BusState::kDown);
  } else if (!was_up || state() == BusState::kDown) {
    noteState(BusState::kActive);
  }
}

}  // namespace tandem::hal::can
