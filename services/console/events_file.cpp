// SPDX-License-Identifier: Apache-2.0
#include "services/console/events_file.h"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include "config/arm_names.h"
#include "recording/reader.h"
#include "services/recordings/message_upgrader.h"
#include "services/recordings/recorded_system.h"

namespace tandem::console {
namespace {

namespace fs = std::filesystem;

constexpr auto kPeriod = std::chrono::seconds(2);  // between two looks for new events
constexpr std::uint64_t kMemory = 64ull << 20;     // bytes of records in memory at a time

}  // namespace

EventsFile::EventsFile(History& history,
                       fs::path file,
                       const config::Deployment& deployment,
                       const config::Robot& robot)
    : history_(history),
      file_(std::move(file)),
      prefix_(deployment.prefix),
      topics_(dds::allTopics(config::armList(robot))),
      info_(recordings::describeRun(deployment, robot)) {
  info_.files.clear();
  try {
    read(deployment);
  } catch (const std::exception& unusable) {
    spdlog::warn("events of the last run are not shown: {}", unusable.what());
  }
  written_ = history_.taken();
  thread_ = std::thread([this] { run(); });
}

EventsFile::~EventsFile() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void EventsFile::read(const config::Deployment& deployment) {
  if (!fs::exists(file_))
    return;
  recording::Reader reader(file_, recording::Reader::Open::kFast, kMemory);
  if (!recordings::isRunOf(deployment, recordings::valuesOfRun(reader)))
    throw std::invalid_argument(file_.string() +
                                ": found events of another robot or deployment, or of other values of their keys");
  recordings::MessageUpgrader upgrader(reader);
  reader.forEach({}, [&](const recording::Channel& channel, const recording::Message& message) {
    for (std::uint32_t k = 0; k < topics_.size(); ++k) {
      const dds::TopicInfo& topic = topics_[k];
      if (!History::concerns(topic) || channel.topic != dds::rosTopicName(prefix_, topic.name))
        continue;
      if (auto bytes = upgrader(channel, message.data)) {
        const SampleFeatures features = featuresOf(topic.type, *bytes);
        history_.take(k, topic, {std::make_shared<const std::string>(std::move(*bytes)), message.log_time}, features);
      }
    }
    return true;
  });
  for (const std::string& damage : reader.damage())
    spdlog::warn("events of the last run: {}; the events after it are not shown", damage);
}

void EventsFile::write() {
  const std::uint64_t taken = history_.taken();
  if (taken == written_)
    return;
  const fs::path next = file_.string() + "." + std::to_string(::getpid());
  try {
    fs::create_directories(file_.parent_path());
    recordings::RunFile out(next, info_, prefix_, topics_);
    std::uint64_t sequence = 0;
    for (const HistoryEvent& event : history_.events())
      out.write({.topic = event.channel,
                 .sequence = ++sequence,
                 .log_time = event.sample.time,
                 .publish_time = event.sample.time},
                *event.sample.bytes);
    out.mcap().close();
    fs::rename(next, file_);
    written_ = taken;
    failed_ = false;
  } catch (const std::exception& error) {
    if (!std::exchange(failed_, true))
      spdlog::error("the events cannot be written for the next start; the console tries again after the next event: {}",
                    error.what());
    std::error_code ignored;
    fs::remove(next, ignored);
  }
}

void EventsFile::run() {
  for (bool end = false; !end;) {
    {
      std::unique_lock lock(mutex_);
      end = changed_.wait_for(lock, kPeriod, [this] { return ending_; });
    }
    write();
  }
}

}  // namespace tandem::console
