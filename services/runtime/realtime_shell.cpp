// SPDX-License-Identifier: Apache-2.0
#include "services/runtime/realtime_shell.h"

#include <spdlog/spdlog.h>

namespace tandem::runtime {

RealtimeShell::RealtimeShell(const Setup& setup, double period)
    : setup_(setup),
      loop_(period),
      status_interval_(std::max<std::uint64_t>(1, static_cast<std::uint64_t>(setup.deployment.status_period / period))),
      beats_(outbox_.latest<LoopStatistics>([this](const auto& m) { setup_.heartbeat->beat(m); })),
      faults_(publisher_.queue<FaultReport>(64, [this](const auto& m) { logFault(setup_.robot, m); })) {}

void RealtimeShell::noteLateness(const Tick& tick) noexcept {
  constexpr std::int64_t kRemembered = 2'000'000'000;  // ns
  const double late =
      1e-9 * static_cast<double>(tick.now - tick.scheduled) + static_cast<double>(tick.skipped) * loop_.period();
  if (late < late_ && tick.now - late_since_ < kRemembered)
    return;
  late_ = late;
  late_since_ = tick.now;
}

void RealtimeShell::run(const std::string& what, const std::function<bool(const Tick&)>& cycle) {
  outbox_.start();
  publisher_.start();
  for (const std::string& refusal : enterRealtime(setup_.deployment.realtime_priority, setup_.deployment.lock_memory)) {
    spdlog::warn("{}", refusal);
  }
  spdlog::info("ready: {}, period {} s", what, loop_.period());
  loop_.run([&](const Tick& tick) {
    noteLateness(tick);
    return cycle(tick);
  });
  outbox_.stop();
  publisher_.stop();
}

}  // namespace tandem::runtime
