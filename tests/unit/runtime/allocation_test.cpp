// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <array>

#include "services/dds/messages.h"
#include "services/runtime/outbox.h"
#include "services/runtime/periodic_loop.h"
#include "tests/unit/safety/allocation_counter.h"

namespace tandem::runtime {
namespace {

TEST(Allocation, CounterCounts) {
  if (!test::canCountAllocations())
    GTEST_SKIP() << "the sanitizer brings its own allocator";
  const auto before = test::allocationCount();
  auto one = std::make_unique<int>(1);
  EXPECT_GT(test::allocationCount(), before) << *one;
}

TEST(Allocation, APeriodicCycleAllocatesNothing) {
  std::atomic<std::uint64_t> sent{0};
  Outbox outbox;
  auto& state = outbox.latest<dds::ActuationState>([&](const dds::ActuationState&) { ++sent; });
  auto& command = outbox.queue<dds::ActuationCommand>(64, [&](const dds::ActuationCommand&) { ++sent; });
  auto inbox = std::make_unique<LatestValue<dds::ActuationState>>();
  outbox.start();

  dds::ActuationState message;
  dds::ActuationCommand setpoint;
  std::size_t allocations = 1;
  PeriodicLoop loop(1e-3);
  loop.run([&](const Tick& tick) {
    if (tick.cycle == 1) {
      allocations = test::allocationCount();
    }
    message.sequence = tick.cycle;
    inbox->store(message);
    inbox->take(message);
    state.post(message);
    command.post(setpoint);
    return tick.cycle < 200;
  });
  EXPECT_EQ(test::allocationCount(), allocations);
  outbox.stop();
  EXPECT_GT(sent, 0u);
}

}  // namespace
}  // namespace tandem::runtime
