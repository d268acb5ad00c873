// SPDX-License-Identifier: Apache-2.0
#include "hal/can/bus_lock.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <optional>
#include <system_error>

#include "hal/can/detail/seqpacket.h"

namespace tandem::hal::can {
namespace {

/// A temporary folder, removed with the test.
struct Folder {
  Folder() : path(testing::TempDir() + "tandem-lock-" + std::to_string(getpid())) {
    std::filesystem::create_directory(path);
  }
  ~Folder() { std::filesystem::remove_all(path); }
  std::string address(const char* name, const char* kind = "unix:") const { return kind + path + "/" + name; }
  std::string path;
};

/// Owner of the lock; empty if it is free.
std::optional<int> holder(const std::string& address) {
  try {
    const BusLock lock(address);
  } catch (const BusTaken& taken) {
    EXPECT_NE(std::string(taken.what()).find("process " + std::to_string(taken.holder)), std::string::npos)
        << taken.what();
    return taken.holder;
  }
  return std::nullopt;
}

TEST(BusLock, OneAtATimeAndTheHolderIsNamed) {
  const Folder folder;
  std::optional<BusLock> lock(std::in_place, folder.address("a"));
  EXPECT_EQ(holder(folder.address("a")), getpid());
  EXPECT_EQ(holder(folder.address("b")), std::nullopt) << "another bus";
  BusLock moved(std::move(*lock));
  lock.reset();
  EXPECT_EQ(holder(folder.address("a")), getpid()) << "still held";
}

TEST(BusLock, TwoNamesOfOneBusAreOneLock) {
  const Folder folder;
  std::filesystem::create_directory_symlink(folder.path, folder.path + "/link");
  const BusLock lock(folder.address("a"));
  EXPECT_EQ(holder(folder.address("a", "unix-hub:")), getpid());
  EXPECT_EQ(holder(folder.address("link/a")), getpid());
  // Neither the bus in another folder, nor names that differ only at their end.
  const std::string longest(70, 'x');
  std::filesystem::create_directory(folder.path + "/other");
  EXPECT_EQ(holder(folder.address("other/a")), std::nullopt);
  const BusLock first(folder.address((longest + "1").c_str()));
  EXPECT_EQ(holder(folder.address((longest + "1").c_str())), getpid());
  EXPECT_EQ(holder(folder.address((longest + "2").c_str())), std::nullopt);
}

TEST(BusLock, LockDoesNotBlockTheInterface) {
  const Folder folder;
  const BusLock lock(folder.address("a"));
  SeqpacketHub hub(folder.path + "/a");
  SeqpacketBus listener(folder.path + "/a");
  EXPECT_EQ(listener.state(), BusState::kActive);
}

TEST(BusLock, GoesWithTheProcessHoweverThatEnds) {
  const Folder folder;
  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const BusLock lock(folder.address("a"));
    const char done = 1;
    if (write(ready[1], &done, 1) != 1)
      _exit(1);
    for (;;)
      pause();
  }
  char done = 0;
  ASSERT_EQ(read(ready[0], &done, 1), 1);
  for (int k = 0; k < 100; ++k)
    ASSERT_EQ(holder(folder.address("a")), child) << "asked " << k << " times";
  kill(child, SIGKILL);
  ASSERT_EQ(waitpid(child, nullptr, 0), child);
  EXPECT_EQ(holder(folder.address("a")), std::nullopt);
  close(ready[0]);
  close(ready[1]);
}

TEST(BusLock, MissingBusCannotBeLocked) {
  EXPECT_THROW(BusLock("can:none0"), std::system_error);
  EXPECT_THROW(BusLock("unix:/nowhere/bus"), std::system_error);
}

}  // namespace
}  // namespace tandem::hal::can
