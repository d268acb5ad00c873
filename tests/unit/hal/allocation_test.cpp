// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <unistd.h>

#include "hal/can/detail/seqpacket.h"
#include "tests/unit/safety/allocation_counter.h"
#include "tests/unit/support/drive_rig.h"

namespace tandem::hal {
namespace {

TEST(HalAllocation, CounterCounts) {
  if (!test::canCountAllocations())
    GTEST_SKIP() << "the sanitizer brings its own allocator";
  const auto before = test::allocationCount();
  auto one = std::make_unique<int>(1);
  EXPECT_GT(test::allocationCount(), before) << *one;
}

TEST(HalAllocation, BootingRunningAndFailingAllocateNothing) {
  test::DriveRig rig(6);
  const auto before = test::allocationCount();
  const bool up = rig.bringUp() && rig.enable(0);
  rig.run(0.2);
  rig.drives.inject({sim::drives::FaultKind::kOff, 2, 0.0, 0.0});
  rig.run(0.5);
  canopen::NetworkEvent event;
  while (rig.network.nextEvent(event)) {
  }
  const auto after = test::allocationCount();
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
  const auto before = test::allocationCount();
  std::size_t got = 0;
  for (int k = 0; k < 10; ++k) {
    bus.send(frames);
    got += hub.receive(frames);
    hub.send(frames);
    got += bus.receive(frames);
  }
  const auto after = test::allocationCount();
  EXPECT_EQ(got, 20 * frames.size());
  EXPECT_EQ(after, before);
}

}  // namespace
}  // namespace tandem::hal
