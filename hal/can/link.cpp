// SPDX-License-Identifier: Apache-2.0
#include "hal/can/link.h"

#include <linux/can/netlink.h>
#include <linux/if_arp.h>
#include <linux/rtnetlink.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <span>
#include <system_error>

namespace tandem::hal::can {
namespace {

constexpr std::uint32_t kFdMtu = 72;
using Buffer = std::array<char, 1 << 15>;

[[noreturn]] void refuse(int error, const std::string& what) {
  throw std::system_error(error, std::generic_category(), what);
}

/** Netlink socket, closed by its destructor. */
class Netlink {
 public:
  Netlink() : fd_(socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE)) {
    if (fd_ < 0)
      refuse(errno, "netlink socket for CAN interfaces");
    const timeval timeout{2, 0};
    setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
  }
  ~Netlink() { close(fd_); }
  Netlink(const Netlink&) = delete;
  Netlink& operator=(const Netlink&) = delete;

  void send(const void* message, std::size_t length) {
    if (::send(fd_, message, length, 0) < 0)
      refuse(errno, "netlink request for CAN interfaces");
  }
  /// Calls `visit` for each message of the answer until its end; throws if the kernel refuses.
  template <class Visit>
  void receive(const std::string& what, Visit visit) {
    alignas(nlmsghdr) Buffer buffer;
    for (;;) {
      const ssize_t count = recv(fd_, buffer.data(), buffer.size(), 0);
      if (count < 0)
        refuse(errno, what);
      int left = static_cast<int>(count);
      for (auto* header = reinterpret_cast<nlmsghdr*>(buffer.data()); NLMSG_OK(header, left);
           header = NLMSG_NEXT(header, left)) {
        if (header->nlmsg_type == NLMSG_DONE)
          return;
        if (header->nlmsg_type == NLMSG_ERROR) {
          const auto* error = static_cast<const nlmsgerr*>(NLMSG_DATA(header));
          if (error->error == 0)
            return;
          refuse(-error->error, what);
        }
        visit(header);
      }
    }
  }

 private:
  int fd_;
};

/** A request with attributes. */
class Message {
 public:
  Message(std::uint16_t type, std::uint16_t flags, int index) {
    header()->nlmsg_len = NLMSG_LENGTH(sizeof(ifinfomsg));
    header()->nlmsg_type = type;
    header()->nlmsg_flags = static_cast<std::uint16_t>(NLM_F_REQUEST | flags);
    info()->ifi_index = index;
  }
  nlmsghdr* header() { return reinterpret_cast<nlmsghdr*>(bytes_.data()); }
  ifinfomsg* info() { return static_cast<ifinfomsg*>(NLMSG_DATA(header())); }
  rtattr* add(std::uint16_t type, const void* data, std::size_t length) {
    auto* attribute = reinterpret_cast<rtattr*>(bytes_.data() + NLMSG_ALIGN(header()->nlmsg_len));
    attribute->rta_type = type;
    attribute->rta_len = static_cast<std::uint16_t>(RTA_LENGTH(length));
    if (length > 0)
      std::memcpy(RTA_DATA(attribute), data, length);
    header()->nlmsg_len = NLMSG_ALIGN(header()->nlmsg_len) + RTA_ALIGN(attribute->rta_len);
    return attribute;
  }
  void end(rtattr* nest) {
    nest->rta_len = static_cast<std::uint16_t>(bytes_.data() + header()->nlmsg_len - reinterpret_cast<char*>(nest));
  }

 private:
  alignas(nlmsghdr) std::array<char, 1024> bytes_{};
};

template <class T>
T valueOf(const rtattr* attribute) {
  T value{};
  std::memcpy(&value, RTA_DATA(attribute), std::min<std::size_t>(sizeof value, RTA_PAYLOAD(attribute)));
  return value;
}

template <class Visit>
void forEach(const rtattr* first, int length, Visit visit) {
  for (auto* a = const_cast<rtattr*>(first); RTA_OK(a, length); a = RTA_NEXT(a, length))
    visit(a);
}
template <class Visit>
void forEachNested(const rtattr* nest, Visit visit) {
  forEach(static_cast<const rtattr*>(RTA_DATA(nest)), static_cast<int>(RTA_PAYLOAD(nest)), visit);
}

BusState stateOf(std::uint32_t state) {
  switch (state) {
    case CAN_STATE_ERROR_ACTIVE:
      return BusState::kActive;
    case CAN_STATE_ERROR_WARNING:
      return BusState::kWarning;
    case CAN_STATE_ERROR_PASSIVE:
      return BusState::kPassive;
    case CAN_STATE_BUS_OFF:
      return BusState::kOff;
    default:
      return BusState::kDown;
  }
}

void readController(const rtattr* data, LinkInfo& link) {
  forEachNested(data, [&](const rtattr* a) {
    switch (a->rta_type) {
      case IFLA_CAN_BITTIMING:
        link.bit_rate = valueOf<can_bittiming>(a).bitrate;
        link.sample_point = valueOf<can_bittiming>(a).sample_point / 1000.0;
        break;
      case IFLA_CAN_DATA_BITTIMING:
        link.data_bit_rate = valueOf<can_bittiming>(a).bitrate;
        break;
      case IFLA_CAN_STATE:
        link.state = stateOf(valueOf<std::uint32_t>(a));
        break;
      case IFLA_CAN_RESTART_MS:
        link.restart_ms = valueOf<std::uint32_t>(a);
        break;
      case IFLA_CAN_BERR_COUNTER:
        link.tx_errors = valueOf<can_berr_counter>(a).txerr;
        link.rx_errors = valueOf<can_berr_counter>(a).rxerr;
        break;
      default:
        break;
    }
  });
}

LinkInfo readLink(const nlmsghdr* header) {
  const auto* info = static_cast<const ifinfomsg*>(NLMSG_DATA(header));
  LinkInfo link;
  link.index = info->ifi_index;
  link.up = (info->ifi_flags & IFF_UP) != 0;
  forEach(IFLA_RTA(info), static_cast<int>(IFLA_PAYLOAD(header)), [&](const rtattr* a) {
    if (a->rta_type == IFLA_IFNAME) {
      link.name = static_cast<const char*>(RTA_DATA(a));
    } else if (a->rta_type == IFLA_MTU) {
      link.mtu = valueOf<std::uint32_t>(a);
    } else if (a->rta_type == IFLA_TXQLEN) {
      link.queue_length = valueOf<std::uint32_t>(a);
    } else if (a->rta_type == IFLA_LINKINFO) {
      forEachNested(a, [&](const rtattr* b) {
        if (b->rta_type == IFLA_INFO_KIND) {
          link.kind = static_cast<const char*>(RTA_DATA(b));
        } else if (b->rta_type == IFLA_INFO_DATA && link.kind == "can") {
          readController(b, link);
        }
      });
    }
  });
  link.fd = link.mtu >= kFdMtu;
  return link;
}

int requireLink(const std::string& name) {
  const auto link = findLink(name);
  if (!link)
    refuse(ENODEV, "CAN interface " + name);
  return link->index;
}

}  // namespace

std::vector<LinkInfo> listLinks() {
  Netlink netlink;
  Message request(RTM_GETLINK, NLM_F_DUMP, 0);
  netlink.send(request.header(), request.header()->nlmsg_len);
  std::vector<LinkInfo> links;
  netlink.receive("list of interfaces", [&](const nlmsghdr* header) {
    if (header->nlmsg_type == RTM_NEWLINK && static_cast<const ifinfomsg*>(NLMSG_DATA(header))->ifi_type == ARPHRD_CAN)
      links.push_back(readLink(header));
  });
  return links;
}

std::optional<LinkInfo> findLink(const std::string& name) {
  for (LinkInfo& link : listLinks()) {
    if (link.name == name)
      return std::move(link);
  }
  return std::nullopt;
}

void changeLink(const std::string& name, const LinkChange& change) {
  Message request(RTM_NEWLINK, NLM_F_ACK, requireLink(name));
  if (change.up) {
    request.info()->ifi_change = IFF_UP;
    request.info()->ifi_flags = *change.up ? IFF_UP : 0;
  }
  if (change.queue_length)
    request.add(IFLA_TXQLEN, &*change.queue_length, sizeof *change.queue_length);
  if (change.bit_rate || change.restart_ms) {
    rtattr* outer = request.add(IFLA_LINKINFO, nullptr, 0);
    request.add(IFLA_INFO_KIND, "can", 4);
    rtattr* inner = request.add(IFLA_INFO_DATA, nullptr, 0);
    if (change.bit_rate) {
      can_bittiming timing{};
      timing.bitrate = *change.bit_rate;
      request.add(IFLA_CAN_BITTIMING, &timing, sizeof timing);
    }
    if (change.restart_ms)
      request.add(IFLA_CAN_RESTART_MS, &*change.restart_ms, sizeof *change.restart_ms);
    request.end(inner);
    request.end(outer);
  }
  Netlink netlink;
  netlink.send(request.header(), request.header()->nlmsg_len);
  netlink.receive("change of " + name, [](const nlmsghdr*) {});
}

void restartLink(const std::string& name) {
  Message request(RTM_NEWLINK, NLM_F_ACK, requireLink(name));
  rtattr* outer = request.add(IFLA_LINKINFO, nullptr, 0);
  request.add(IFLA_INFO_KIND, "can", 4);
  rtattr* inner = request.add(IFLA_INFO_DATA, nullptr, 0);
  const std::uint32_t yes = 1;
  request.add(IFLA_CAN_RESTART, &yes, sizeof yes);
  request.end(inner);
  request.end(outer);
  Netlink netlink;
  netlink.send(request.header(), request.header()->nlmsg_len);
  netlink.receive("restart of " + name, [](const nlmsghdr*) {});
}

LinkMonitor::LinkMonitor(const std::string& name) {
  fd_ = socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, NETLINK_ROUTE);
  sockaddr_nl address{};
  address.nl_family = AF_NETLINK;
  address.nl_groups = RTMGRP_LINK;
  if (fd_ < 0 || bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    const int error = errno;
    close(fd_);
    refuse(error, "netlink");
  }
  try {
    // After the subscription, so that no change is missed.
    const auto link = findLink(name);
    if (!link)
      refuse(ENODEV, "CAN interface " + name);
    index_ = link->index;
    up_ = link->up;
    mtu_ = link->mtu;
  } catch (...) {
    close(fd_);
    throw;
  }
}

LinkMonitor::~LinkMonitor() { close(fd_); }

bool LinkMonitor::poll() noexcept {
  alignas(nlmsghdr) std::array<char, 8192> buffer;
  for (;;) {
    const ssize_t count = recv(fd_, buffer.data(), buffer.size(), MSG_DONTWAIT);
    if (count < 0 && errno == ENOBUFS) {
      // Messages were lost: request the state; the answer comes with the next poll.
      Message request(RTM_GETLINK, 0, index_);
      send(fd_, request.header(), request.header()->nlmsg_len, MSG_DONTWAIT);
      continue;
    }
    if (count <= 0)
      return up_;
    int left = static_cast<int>(count);
    for (auto* header = reinterpret_cast<nlmsghdr*>(buffer.data()); NLMSG_OK(header, left);
         header = NLMSG_NEXT(header, left)) {
      if (header->nlmsg_type != RTM_NEWLINK && header->nlmsg_type != RTM_DELLINK)
        continue;
      const auto* info = static_cast<const ifinfomsg*>(NLMSG_DATA(header));
      if (info->ifi_index == index_)
        up_ = header->nlmsg_type == RTM_NEWLINK && (info->ifi_flags & IFF_UP) != 0;
    }
  }
}

}  // namespace tandem::hal::can
