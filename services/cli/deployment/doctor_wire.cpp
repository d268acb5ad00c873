// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <numeric>
#include <system_error>

#include "config/config.h"
#include "hal/can/link.h"
#include "services/cli/deployment/doctor_checks.h"
#include "services/dds/ports.h"
#include "services/runtime/periodic_loop.h"
#include "services/runtime/process.h"
#include "services/security/verify.h"

namespace tandem::cli {
namespace {

using Level = Finding::Level;

/** Round trips of requests between two participants, under a separate prefix. */
class RoundTrip {
 public:
  explicit RoundTrip(dds::BusOptions options) {
    options.prefix = "doctor_" + std::to_string(getpid());
    near_ = std::make_unique<dds::Bus>(options);
    far_ = std::make_unique<dds::Bus>(options);
    requests_ = near_->writer(dds::kPlanningRequest);
    replies_ = far_->writer(dds::kPlanningReply);
    asked_ = far_->reader(dds::kPlanningRequest, [this](const dds::PlanningRequest& request) {
      dds::Reply reply;
      reply.request = request.request;
      replies_.write(reply);
    });
    answered_ = near_->reader(dds::kPlanningReply, [this](const dds::Reply& reply) {
      const std::lock_guard lock(mutex_);
      last_ = reply.request;
      came_.notify_all();
    });
  }

  /// Times of `count` round trips, s, in ascending order; fewer if one takes longer than 1 s.
  std::vector<double> measure(std::uint64_t count) {
    std::vector<double> times;
    // Endpoints are matched one by one; the first answer shows that all are.
    std::uint64_t k = 1;
    while (k < 100 && !once(k, 0.1))
      ++k;
    for (std::uint64_t trip = 0; trip < count; ++trip) {
      const std::int64_t begin = runtime::monotonicNow();
      if (!once(++k, 1.0))
        break;
      times.push_back(1e-9 * static_cast<double>(runtime::monotonicNow() - begin));
    }
    std::sort(times.begin(), times.end());
    return times;
  }

 private:
  /// @return whether the answer came within `seconds`.
  bool once(std::uint64_t number, double seconds) {
    dds::PlanningRequest request;
    request.request = number;
    requests_.write(request);
    std::unique_lock lock(mutex_);
    return came_.wait_for(lock, std::chrono::duration<double>(seconds), [&] { return last_ == number; });
  }

  std::mutex mutex_;
  std::condition_variable came_;
  std::uint64_t last_ = 0;
  std::unique_ptr<dds::Bus> near_, far_;
  dds::Writer<dds::PlanningRequest> requests_;
  dds::Writer<dds::Reply> replies_;
  dds::Reader asked_, answered_;
};

Finding checkBuffers() {
  constexpr long kWanted = 1 << 20;  // bytes, as services/dds requests
  std::ifstream file("/proc/sys/net/core/rmem_max");
  long most = 0;
  file >> most;
  Finding finding{"network", Level::kGood, fmt::format("socket buffers up to {} KiB", most / 1024), ""};
  if (most < kWanted) {
    finding.level = Level::kWarning;
    finding.advice = fmt::format("sysctl -w net.core.rmem_max={0} net.core.wmem_max={0}: bursts may be lost", kWanted);
  }
  return finding;
}

/// Larger samples cross a network in fragments. Incomplete samples wait for lost fragments in kernel memory; once that
/// memory is full, no large sample arrives any more.
Finding checkFragments() {
  constexpr int kWanted = 1;  // s
  std::ifstream file("/proc/sys/net/ipv4/ipfrag_time");
  int seconds = 0;
  file >> seconds;
  Finding finding{"network", Level::kGood, fmt::format("parts of incomplete datagrams are kept for {} s", seconds), ""};
  if (seconds > kWanted) {
    finding.level = Level::kWarning;
    finding.advice = fmt::format(
        "sysctl -w net.ipv4.ipfrag_time={}: on a network that loses frames larger samples stop for seconds", kWanted);
  }
  return finding;
}

Finding checkBus(const hal::BusConfig& bus) {
  const std::string subject = "CAN " + bus.name;
  if (!bus.address.starts_with("can:"))
    return {subject, Level::kGood, bus.address + ", a socket between processes", ""};
  const std::string name = bus.address.substr(4);
  const auto link = hal::can::findLink(name);
  if (!link)
    return {subject, Level::kBad, "CAN interface " + name + " was not found",
            "ip link show type can; see docs/hardware.md"};
  Finding finding{subject, Level::kGood, fmt::format("{}: {}, {}", name, link->kind, link->up ? "up" : "down"), ""};
  const auto advise = [&](Level level, const std::string& advice) {
    finding.level = std::max(finding.level, level);
    finding.advice += (finding.advice.empty() ? "" : "; ") + advice;
  };
  if (link->bit_rate)
    finding.found += fmt::format(", {} kbit/s", *link->bit_rate / 1000);
  if (!link->up)
    advise(Level::kBad, fmt::format("ip link set {} up", name));
  if (link->bit_rate && *link->bit_rate != static_cast<std::uint32_t>(bus.bit_rate))
    advise(Level::kBad, fmt::format("set the bit rate to {:.0f} kbit/s, as in the hardware file", bus.bit_rate / 1e3));
  if (link->restart_ms.value_or(0) > 0)
    advise(Level::kWarning, "set restart-ms 0: the HAL does not notice an automatic restart after bus-off");
  if (link->kind == "can" && link->queue_length < 64)
    advise(Level::kWarning, fmt::format("ip link set {} txqueuelen 64", name));
  return finding;
}

}  // namespace

std::vector<Finding> checkNetwork(const config::Deployment& deployment) {
  std::vector<Finding> findings;
  try {
    // Round trip between own participants, for which the deployment has no credentials.
    config::Deployment plain = deployment;
    plain.security.clear();
    plain.discovery.reset();
    const dds::BusOptions options = runtime::busOptions(plain, "doctor");
    RoundTrip trip(options);
    constexpr std::uint64_t kTrips = 500;
    const std::vector<double> times = trip.measure(kTrips);
    if (times.size() < kTrips) {
      findings.push_back(
          {"network", Level::kBad,
           fmt::format("two participants on {} do not receive each other", options.interface_address),
           fmt::format("check the firewall: UDP from port {} upwards must pass", dds::firstPort(options.domain))});
    } else {
      findings.push_back({"network", Level::kGood,
                          fmt::format("DDS on {}, domain {}: round trip {:.0f} us (median), {:.0f} us (99 %)",
                                      options.interface_address, options.domain, 1e6 * times[times.size() / 2],
                                      1e6 * times[times.size() * 99 / 100]),
                          ""});
    }
  } catch (const std::exception& error) {
    findings.push_back({"network", Level::kBad, error.what(), "correct the deployment, or bring the interface up"});
  }
  findings.push_back(checkBuffers());
  if (deployment.hosts.size() > 1)
    findings.push_back(checkFragments());
  findings.push_back({"shared memory", Level::kGood, "not used: all traffic is UDP", ""});
  return findings;
}

std::vector<Finding> checkSecurity(const config::Deployment& deployment) {
  if (deployment.security.empty()) {
    const std::string exposure = runtime::exposure(deployment);
    if (!exposure.empty())
      return {
          {"security", Level::kWarning, exposure, "tandem security init, issue; then `security` in the deployment"}};
    return {{"security", Level::kGood, "off; all traffic stays on this machine", ""}};
  }
  security::VerificationTarget target;
  target.prefix = deployment.prefix;
  target.domain = deployment.domain;
  std::vector<security::Finding> all = security::checkCommon(deployment.security, target);
  for (dds::Role role : security::rolesIn(deployment.security)) {
    for (security::Finding& finding : security::checkRole(deployment.security, role, target))
      all.push_back(std::move(finding));
  }
  std::vector<Finding> findings;
  for (const security::Finding& finding : all) {
    if (finding.level != security::Finding::Level::kGood)
      findings.push_back({"security", static_cast<Level>(finding.level), finding.text, ""});
  }
  if (findings.empty())
    findings.push_back(
        {"security", Level::kGood, "on; credentials in " + deployment.security.string() + " are valid", ""});
  return findings;
}

std::vector<Finding> checkCan(const config::Deployment& deployment) {
  if (deployment.hardware.empty()) {
    const int socket = ::socket(PF_CAN, SOCK_RAW, 1);
    if (socket >= 0)
      close(socket);
    return {{"CAN", Level::kGood,
             fmt::format("the deployment has no hardware; this kernel {} CAN", socket >= 0 ? "has" : "does not have"),
             ""}};
  }
  std::vector<Finding> findings;
  try {
    for (const hal::BusConfig& bus : config::loadHardware(deployment.hardware).buses)
      findings.push_back(checkBus(bus));
  } catch (const std::system_error& error) {
    findings.push_back({"CAN", Level::kBad, error.what(), "modprobe can can-raw; see docs/hardware.md"});
  }
  return findings;
}

double shortestPeriod(const config::Deployment& deployment) {
  double period = deployment.control_period;
  if (!deployment.hardware.empty())
    return std::min(period, config::loadHardware(deployment.hardware).period);
  return std::min(period, deployment.sim_period);
}

}  // namespace tandem::cli
