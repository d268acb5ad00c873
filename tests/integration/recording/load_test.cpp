// SPDX-License-Identifier: Apache-2.0
// The recorder with 20 topics of 1 kHz on fully loaded cores.
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <thread>

#include "recording/gaps.h"
#include "recording/reader.h"
#include "services/dds/raw.h"
#include "services/recordings/capture.h"
#include "services/recordings/recorder.h"

namespace tandem::recordings {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr int kTopics = 20;
constexpr int kSamples = 3000;  // of each topic, one per ms

/** Threads that load all cores. */
class BusyCores {
 public:
  BusyCores() {
    for (unsigned i = 0; i < std::max(1u, std::thread::hardware_concurrency()); ++i)
      threads_.emplace_back([this] {
        while (!ending_)
          ++turns_;
      });
  }
  ~BusyCores() {
    ending_ = true;
    for (std::thread& thread : threads_)
      thread.join();
  }

 private:
  std::atomic<bool> ending_{false};
  std::atomic<std::uint64_t> turns_{0};
  std::vector<std::thread> threads_;
};

struct File {
  std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("tandem-load-" + std::to_string(getpid()) + ".mcap");
  ~File() { std::filesystem::remove(path); }
};

/// Records `kTopics` topics of this quality of service while they are written. @return number of samples missing in the
/// file
std::uint64_t lostAtFullLoad(dds::Profile profile) {
  dds::BusOptions options;
  options.domain = 101 + static_cast<int>(getpid() % 100);
  options.prefix = "load_" + std::to_string(getpid());
  std::vector<dds::TopicInfo> topics;
  for (int i = 0; i < kTopics; ++i)
    topics.push_back({"topic_" + std::to_string(i), "tandem_msgs/msg/Stop", profile, "", "", ""});
  const File file;
  dds::Bus here(options), there(options);
  RunInfo info;
  Recorder recorder(info, options.prefix, topics, {.file = file.path});
  std::vector<dds::RawWriter> writers;
  for (const dds::TopicInfo& topic : topics)
    writers.emplace_back(here, topic);
  std::uint64_t sent = 0;
  {
    const Capture capture(there, topics, [&](const auto& tag, std::string_view bytes) { recorder.take(tag, bytes); });
    const auto deadline = Clock::now() + std::chrono::seconds(30);
    while (capture.matched() < kTopics ||
           std::any_of(writers.begin(), writers.end(), [](const auto& writer) { return writer.matched() == 0; })) {
      if (Clock::now() > deadline)
        throw std::runtime_error("the recorder was not found");
      std::this_thread::sleep_for(milliseconds(5));
    }
    const BusyCores busy;
    const std::string bytes = dds::encode(dds::Stop{1, 2, std::string(200, 'x')});
    std::atomic<bool> ended{false};
    std::thread disk([&] {
      while (!ended) {
        recorder.drain();
        std::this_thread::sleep_for(milliseconds(20));
      }
    });
    const auto start = Clock::now();
    for (int i = 0; i < kSamples; ++i) {
      std::this_thread::sleep_until(start + milliseconds(i));
      for (dds::RawWriter& writer : writers)
        sent += writer.write(bytes);
    }
    // Waits for samples on their way; samples that are not repeated are lost.
    const auto end = Clock::now() + std::chrono::seconds(profile == dds::Profile::kReliable ? 10 : 1);
    while (capture.received() < sent && Clock::now() < end)
      std::this_thread::sleep_for(milliseconds(10));
    ended = true;
    disk.join();
  }
  recorder.close();

  recording::Reader reader(file.path, recording::Reader::Open::kScan);
  EXPECT_TRUE(reader.damage().empty());
  recording::GapCounter<std::uint16_t> gaps;
  std::uint64_t heads = 0, tails = 0;
  std::map<std::uint16_t, std::uint32_t> last;
  reader.forEach({}, [&](const recording::Channel& channel, const recording::Message& message) {
    gaps.see(channel.id, message.sequence);
    heads += last.contains(channel.id) ? 0 : message.sequence - 1;
    last[channel.id] = message.sequence;
    return true;
  });
  for (const auto& [channel, sequence] : last)
    tails += kSamples - sequence;
  const Recorder::Totals totals = recorder.totals();
  EXPECT_EQ(totals.overwritten, 0u);
  EXPECT_EQ(totals.lost, gaps.lost());
  EXPECT_EQ(sent, static_cast<std::uint64_t>(kTopics) * kSamples);
  EXPECT_EQ(reader.statistics().messages, totals.messages);
  // Every sample is in the file, or its number is missing, or the recording ended before it arrived.
  EXPECT_EQ(sent - totals.messages, gaps.lost() + heads + tails);
  std::cout << dds::name(profile) << ": " << totals.messages << " messages, " << gaps.lost() << " lost" << std::endl;
  return sent - totals.messages;
}

TEST(RecorderLoad, ReliableTopicsLoseNothing) {
  // A writer keeps 64 samples: a machine that suspends this process for longer than these 64 ms may lose some, and then
  // the count must still be correct.
  std::uint64_t lost = 1;
  for (int attempt = 0; attempt < 3 && lost > 0; ++attempt)
    lost = lostAtFullLoad(dds::Profile::kReliable);
  EXPECT_EQ(lost, 0u);
}

TEST(RecorderLoad, PeriodicTopicsSayWhatTheyLose) {
  // Best effort: samples dropped by the kernel are lost, and the sequence numbers show it.
  lostAtFullLoad(dds::Profile::kPeriodic);
}

}  // namespace
}  // namespace tandem::recordings
