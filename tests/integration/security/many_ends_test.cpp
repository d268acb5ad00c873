// SPDX-License-Identifier: Apache-2.0
/** @file Secured participant with more endpoints than fit into one discovery message.
 *
 * Fast DDS 2.9.1 fills a message before it encrypts the complete message (rtps_protection_kind), and aborts if the
 * result no longer fits: the governance must not require it. */
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "services/security/authority.h"
#include "tests/integration/wire/support.h"

namespace tandem::dds {
namespace {

constexpr int kEnds = 400;  // about 600 bytes each, of the 64 KiB of a message
constexpr int kRounds = 2, kComing = 3;

class ManyEnds : public ::testing::Test {
 protected:
  ManyEnds() {
    const BusOptions options = testOptions();
    folder_ = std::filesystem::temp_directory_path() / ("tandem-" + options.prefix);
    security::init(folder_, "test", {});
    for (const Role role : {Role::kControl, Role::kConsoleViewer})
      security::issue(folder_, {role, name(role), {options.prefix}, {options.domain}, {}}, folder_);
  }
  ~ManyEnds() override { std::filesystem::remove_all(folder_); }

  BusOptions secured(Role role) const {
    BusOptions options = testOptions();
    options.credentials = credentialsOf(folder_, role);
    return options;
  }

  std::filesystem::path folder_;
};

std::string armName(int k) { return "arm_" + std::to_string(k); }

TEST_F(ManyEnds, AreFoundByAllWhoComeAtOnce) {
  for (int round = 0; round < kRounds; ++round) {
    Bus busy(secured(Role::kControl));
    std::vector<Writer<JointState>> writers;
    for (int k = 0; k < kEnds; ++k)
      writers.push_back(busy.writer(kMeasuredJs, armName(k)));
    std::atomic<int> found{0};
    std::vector<std::thread> coming;
    for (int c = 0; c < kComing; ++c) {
      coming.emplace_back([&] {
        Bus bus(secured(Role::kConsoleViewer));
        const Reader last = bus.reader(kMeasuredJs, armName(kEnds - 1), [](const JointState&) {});
        for (const auto deadline = std::chrono::steady_clock::now() + kDeadline;
             last.matched() == 0 && std::chrono::steady_clock::now() < deadline;)
          std::this_thread::sleep_for(std::chrono::milliseconds(20));
        found += last.matched();
      });
    }
    for (std::thread& thread : coming)
      thread.join();
    EXPECT_EQ(found, kComing) << "round " << round;
  }
}

}  // namespace
}  // namespace tandem::dds
