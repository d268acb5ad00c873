// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <new>

#include "hal/can/seqpacket.h"
#include "tests/unit/support/drive_rig.h"

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
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace tandem::hal {
namespace {

TEST(HalAllocation, CounterCounts) {
  const auto before = t_allocations;
  auto one = std::make_unique<int>(1);
  EXPECT_EQ(t_allocations, before + 1) << *one;
}

TEST(HalAllocation, BootingRunningAndFailingAllocateNothing) {
  test::DriveRig rig(6);
  const auto before = t_allocations;
  const bool up = rig.bringUp() && rig.enable(0);
  rig.run(0.2);
  rig.drives.inject({sim::drives::FaultKind::kOff, 2, 0.0, 0.0});
  rig.run(0.5);
  canopen::NetworkEvent event;
  while (rig.network.nextEvent(event)) {
  }
  const auto after = t_allocations;
  EXPECT_TRUE(up);
  EXPECT_TRUE(rig.network.anyFailed());
  EXPECT_EQ(after, before);
}

TEST(HalAllocation, SocketsAllocateNothing) {
  const std::string path = testing::TempDir() + "tandem-allocation-" + std::to_string(getpid());
  can::SeqpacketHub hub(path);
  can::SeqpacketBus bus(path);
  std::array<can::CanFrame, 32> frames;
  frames.fill(can::makeFrame(0x181, std::array<std::uint8_t, 6>{}));
  const auto before = t_allocations;
  std::size_t got = 0;
  for (int k = 0; k < 10; ++k) {
    bus.send(frames);
    got += hub.receive(frames);
    hub.send(frames);
    got += bus.receive(frames);
  }
  const auto after = t_allocations;
  EXPECT_EQ(got, 20 * frames.size());
  EXPECT_EQ(after, before);
}

}  // namespace
}  // namespace tandem::hal
