// SPDX-License-Identifier: Apache-2.0
#include "services/client/clocks.h"

#include <algorithm>

#include "services/runtime/clock_request_handler.h"

namespace tandem::client {

Clocks::Clocks(dds::Bus& bus, std::uint64_t client)
    : client_(client),
      requests_(bus.writer(dds::kClockRequest)),
      replies_(bus.reader(dds::kClockReply, [this](const dds::ClockReply& reply) { onReply(reply); })) {}

void Clocks::requestTimes() {
  dds::ClockRequest request;
  request.client = client_;
  {
    const std::lock_guard lock(mutex_);
    request.request = ++request_;
    sent_[request.request % sent_.size()] = runtime::wallNow();
  }
  requests_.write(request);
}

void Clocks::onReply(const dds::ClockReply& reply) {
  const std::int64_t now = runtime::wallNow();
  const std::lock_guard lock(mutex_);
  if (reply.client != client_ || reply.request > request_ || reply.request + sent_.size() <= request_)
    return;
  const std::int64_t sent = sent_[reply.request % sent_.size()];
  const auto seconds = [](std::int64_t ns) { return 1e-9 * static_cast<double>(ns); };
  const ClockOffset received{reply.host, 0.5 * (seconds(reply.received - sent) + seconds(reply.sent - now)),
                             0.5 * std::max(0.0, seconds(now - sent) - seconds(reply.sent - reply.received))};
  processes_.insert(reply.process);
  auto& answers = received_[reply.host];
  answers.push_back(received);
  if (answers.size() > kKept)
    answers.pop_front();
}

bool Clocks::received(const std::string& process) const {
  const std::lock_guard lock(mutex_);
  return processes_.count(process) > 0;
}

bool Clocks::found(const std::string& process) {
  constexpr auto kRequestAgain = std::chrono::milliseconds(100);
  if (received(process))
    return true;
  if (const auto now = std::chrono::steady_clock::now(); now - requested_ > kRequestAgain) {
    requested_ = now;
    requestTimes();
  }
  return false;
}

std::vector<ClockOffset> Clocks::offsets() const {
  const std::lock_guard lock(mutex_);
  std::vector<ClockOffset> best;
  for (const auto& [host, answers] : received_) {
    best.push_back(*std::min_element(answers.begin(), answers.end(),
                                     [](const ClockOffset& a, const ClockOffset& b) { return a.within < b.within; }));
  }
  return best;
}

}  // namespace tandem::client
