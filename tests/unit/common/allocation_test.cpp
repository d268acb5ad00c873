// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <new>

#include "services/common/log.h"
#include "services/common/outbox.h"
#include "services/common/periodic_loop.h"
#include "services/dds/messages.h"

namespace {
thread_local std::uint64_t t_allocations = 0;
}  // namespace

[[gnu::noinline]] void* operator new(std::size_t size) {
  ++t_allocations;
  void* memory = std::malloc(size);
  if (memory == nullptr) {
    throw std::bad_alloc();
  }
  return memory;
}
[[gnu::noinline]] void* operator new(std::size_t size, std::align_val_t alignment) {
  ++t_allocations;
  const auto step = static_cast<std::size_t>(alignment);
  void* memory = std::aligned_alloc(step, (size + step - 1) / step * step);
  if (memory == nullptr) {
    throw std::bad_alloc();
  }
  return memory;
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace tandem::service {
namespace {

TEST(Allocation, CounterCounts) {
  const auto before = t_allocations;
  auto one = std::make_unique<int>(1);
  EXPECT_EQ(t_allocations, before + 1) << *one;
}

TEST(Allocation, APeriodicCycleAllocatesNothing) {
  std::atomic<std::uint64_t> sent{0};
  auto logger = std::make_shared<spdlog::logger>("none");
  Outbox outbox;
  auto& state = outbox.latest<dds::ActuationState>([&](const dds::ActuationState&) { ++sent; });
  auto& command = outbox.queue<dds::ActuationCommand>(64, [&](const dds::ActuationCommand&) { ++sent; });
  PeriodicLog log(outbox, logger);
  auto inbox = std::make_unique<LatestValue<dds::ActuationState>>();
  outbox.start();

  dds::ActuationState message;
  dds::ActuationCommand setpoint;
  std::uint64_t allocations = 1;
  PeriodicLoop loop(1e-3);
  loop.run([&](const Tick& tick) {
    if (tick.cycle == 1) {
      allocations = t_allocations;
    }
    message.sequence = tick.cycle;
    inbox->store(message);
    inbox->take(message);
    state.post(message);
    command.post(setpoint);
    log.warn("cycle {} is {:.6f} s late", tick.cycle, loop.statistics().lateness_max);
    return tick.cycle < 200;
  });
  EXPECT_EQ(t_allocations, allocations);
  outbox.stop();
  EXPECT_GT(sent, 0u);
}

}  // namespace
}  // namespace tandem::service
