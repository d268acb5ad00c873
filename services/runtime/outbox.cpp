// SPDX-License-Identifier: Apache-2.0
#include "services/runtime/outbox.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace tandem::runtime {

Outbox::Outbox() : event_(eventfd(0, EFD_CLOEXEC)) {
  if (event_ < 0) {
    throw std::system_error(errno, std::generic_category(), "eventfd");
  }
}

Outbox::~Outbox() {
  stop();
  close(event_);
}

void Outbox::start() {
  if (!thread_.joinable()) {
    stop_ = false;
    thread_ = std::thread([this] { run(); });
  }
}

void Outbox::stop() {
  if (thread_.joinable()) {
    stop_ = true;
    wake();
    thread_.join();
  }
}

void Outbox::wake() noexcept {
  // Adds one to a 64-bit counter that the publisher thread resets: it cannot fill up, hence cannot block.
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = ::write(event_, &one, sizeof(one));
}

void Outbox::run() {
  bool last_round = false;
  while (!last_round) {
    std::uint64_t count = 0;
    [[maybe_unused]] const auto got = ::read(event_, &count, sizeof(count));
    last_round = stop_;
    for (const auto& channel : channels_) {
      channel->drain();
    }
  }
}

}  // namespace tandem::runtime
