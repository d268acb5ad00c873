// SPDX-License-Identifier: Apache-2.0
// Participant announcements: their period, and immediate answers to the announcement of a newcomer.
#include <linux/sockios.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <array>
#include <list>

#include "services/dds/ports.h"
#include "support.h"

namespace tandem::dds {
namespace {

constexpr double kPeriod = 1.0;  // s, between two announcements of a participant

/** Receives the announcements to the last port that participants of a domain may have. */
class Listener {
 public:
  explicit Listener(int domain) : socket_(::socket(AF_INET, SOCK_DGRAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(discoveryPort(domain, 31)));
    if (::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
      throw std::runtime_error("the port of the last participant is in use");
  }
  ~Listener() { ::close(socket_); }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  /// Waits for an announcement. @return its time of reception in the kernel, s since 1970; below zero: none within
  /// `seconds`
  double next(double seconds) const {
    const auto whole = static_cast<std::time_t>(seconds);
    const timeval limit{whole, static_cast<suseconds_t>(1e6 * (seconds - static_cast<double>(whole)))};
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    std::array<char, 2048> datagram{};
    timeval received{};
    if (::recv(socket_, datagram.data(), datagram.size(), 0) <= 0 || ::ioctl(socket_, SIOCGSTAMP, &received) != 0)
      return -1.0;
    return static_cast<double>(received.tv_sec) + 1e-6 * static_cast<double>(received.tv_usec);
  }

 private:
  int socket_;
};

BusOptions named(std::uint64_t session) {
  BusOptions options = testOptions();
  options.identity.fingerprint = 1;
  options.identity.session = session;
  return options;
}

// Each announcement is sent to 32 ports of each peer: at four per second they made half of the system calls of an idle
// service.
TEST(Announcements, ComeOnceASecond) {
  constexpr int kInitial = 5, kPeriods = 3;
  const BusOptions options = testOptions();
  const Listener listener(options.domain);
  const Bus bus(options);
  std::array<double, kInitial + kPeriods + 1> at{};
  for (double& time : at) {
    time = listener.next(20.0);
    ASSERT_GT(time, 0.0);
  }
  EXPECT_GT(at.back() - at[kInitial], 0.8 * kPeriods * kPeriod);
}

// A newcomer that announces itself before it can receive loses the answers, and discovers the others only with their
// next periodic announcements.
TEST(Announcements, OfANewcomerAreAnsweredAtOnce) {
  constexpr int kThere = 6, kNewcomers = 12;
  const Listener listener(testOptions().domain);
  std::list<Bus> there;
  for (std::uint64_t k = 1; k <= kThere; ++k)
    there.emplace_back(named(k));
  int answered = 0;
  for (std::uint64_t k = 0; k < kNewcomers; ++k) {
    // The periodic announcements have just been sent: the next ones follow after most of a period.
    ASSERT_GT(listener.next(20.0), 0.0);
    while (listener.next(0.2 * kPeriod) > 0.0) {
    }
    const auto began = std::chrono::steady_clock::now();
    const Bus newcomer(named(100 + k));
    ASSERT_TRUE(repeatUntil([&] { return newcomer.others().size() == kThere; }, [] {}));
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
    answered += took.count() < 0.5 * kPeriod ? 1 : 0;
    std::printf("newcomer %d: knows all after %.3f s\n", static_cast<int>(k), took.count());
  }
  EXPECT_GE(answered, 9) << "of " << kNewcomers << "; a busy machine may be too late for some";
}

}  // namespace
}  // namespace tandem::dds
