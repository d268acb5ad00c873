// SPDX-License-Identifier: Apache-2.0
#include "services/console/events_file.h"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include <cerrno>
#include <condition_variable>
#include <mutex>
#include <random>
#include <system_error>

#include "config/arm_names.h"
#include "recording/reader.h"
#include "services/recordings/message_upgrader.h"
#include "services/recordings/recorded_system.h"

namespace tandem::console {
namespace {

namespace fs = std::filesystem;

constexpr auto kRetry = std::chrono::seconds(2);  // after a failure
constexpr std::uint64_t kMemory = 64ull << 20;    // bytes of records in memory at a time

/// 0: there is no such file.
std::uint64_t inodeOf(const fs::path& file) {
  struct stat found {};
  return ::stat(file.c_str(), &found) == 0 ? found.st_ino : 0;
}

/// Returns when the disk has the names in the folder: without it a power cut may take back the renaming of a file. Some
/// file systems do not offer this (EINVAL).
void syncFolder(const fs::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const bool synced = descriptor >= 0 && ::fsync(descriptor) == 0;
  const int error = errno;
  if (descriptor >= 0)
    ::close(descriptor);
  if (!synced && error != EINVAL)
    throw std::system_error(error, std::generic_category(), folder.string() + ": cannot be synced");
}

/// @return without delay when the end is requested
void pause(const std::stop_token& end) {
  std::mutex mutex;
  std::unique_lock lock(mutex);
  std::condition_variable_any().wait_for(lock, end, kRetry, [] { return false; });
}

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
  thread_ = std::jthread([this](const std::stop_token& end) { run(end); });
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

bool EventsFile::write() {
  std::uint64_t taken = written_;
  const std::vector<HistoryEvent> events = history_.eventsAfter(taken);
  const bool replaced = out_ && inodeOf(file_) != inode_;  // by another server
  if (taken == written_ && !replaced)
    return true;
  try {
    if (!out_ || replaced || in_file_ + events.size() > 2 * History::kMost || out_->mcap().size() > 2 * History::kBytes)
      replace();
    else
      append(events);
    written_ = std::max(written_, taken);
    failed_ = false;
    return true;
  } catch (const std::exception& error) {
    if (!std::exchange(failed_, true))
      spdlog::error("the events cannot be written for the next start; the console tries again: {}", error.what());
    out_.reset();
    return false;
  }
}

void EventsFile::replace() {
  // A random name: servers in two containers may have the same process number, and share the folder.
  const fs::path next = file_.string() + "." + std::to_string(std::random_device()());
  try {
    std::uint64_t taken = 0;
    const std::vector<HistoryEvent> events = history_.eventsAfter(taken);
    fs::create_directories(file_.parent_path());
    out_.emplace(next, info_, prefix_, topics_);
    in_file_ = 0;
    append(events);
    inode_ = inodeOf(next);
    fs::rename(next, file_);
    syncFolder(file_.parent_path());
    written_ = taken;
  } catch (...) {
    std::error_code ignored;
    fs::remove(next, ignored);
    throw;
  }
}

void EventsFile::append(const std::vector<HistoryEvent>& events) {
  for (const HistoryEvent& event : events)
    out_->write({.topic = event.channel,
                 .sequence = ++in_file_,
                 .log_time = event.sample.time,
                 .publish_time = event.sample.time},
                *event.sample.bytes);
  out_->mcap().sync();
}

void EventsFile::run(const std::stop_token& end) {
  while (!end.stop_requested()) {
    history_.wait(end, written_);
    if (!write())
      pause(end);
  }
  write();  // the last ones
  out_.reset();
}

}  // namespace tandem::console
