// SPDX-License-Identifier: Apache-2.0
#include "services/recorder/black_box.h"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <system_error>

#include "services/runtime/state_directory.h"

namespace tandem::recorder {
namespace {

constexpr std::size_t kMostEvents = 100;  // in one file
constexpr std::size_t kMegabyte = 1'000'000;

std::uint64_t nanoseconds(double seconds) { return static_cast<std::uint64_t>(1e9 * seconds); }

}  // namespace

std::filesystem::path blackBoxDirectory(const config::Deployment& deployment) {
  if (!deployment.black_box.directory.empty())
    return deployment.black_box.directory;
  return runtime::stateDirectory() / "black-box";
}

BlackBox::BlackBox(const config::Deployment& deployment, const config::Robot& robot, std::vector<dds::TopicInfo> topics)
    : deployment_(deployment),
      topics_(std::move(topics)),
      directory_(blackBoxDirectory(deployment)),
      info_(recordings::describeRun(deployment, robot)),
      ring_(static_cast<std::size_t>(deployment.black_box.memory) * kMegabyte),
      trigger_(robot) {
  checkDirectory();
  thread_ = std::jthread([this](const std::stop_token& end) { run(end); });
}

/// Reports an unwritable folder at the start, before the first fault.
void BlackBox::checkDirectory() {
  std::error_code error;
  std::filesystem::create_directories(directory_, error);
  if (!error && access(directory_.c_str(), W_OK) != 0)
    error.assign(errno, std::generic_category());
  if (error) {
    status_.problem = directory_.string() + ": cannot be written: " + error.message();
    spdlog::error("black box: {}", status_.problem);
  }
}

void BlackBox::take(const recording::SampleTag& tag, std::string_view bytes) {
  ring_.push(tag, bytes);
  const auto description = trigger_.eventOf(topics_[tag.topic].name, bytes);
  if (!description)
    return;
  const std::lock_guard lock(mutex_);
  ++status_.faults;
  status_.last_event = *description;
  if (events_.size() < kMostEvents)
    events_.push_back({tag.log_time, *description});
  changed_.notify_all();
}

BlackBox::Status BlackBox::status() const {
  const recording::SampleRing::Extent extent = ring_.extent();
  const std::lock_guard lock(mutex_);
  Status status = status_;
  if (extent.oldest != 0)
    status.held =
        1e-9 * static_cast<double>(recordings::wallClock() - std::min(recordings::wallClock(), extent.oldest));
  status.too_small =
      extent.begin.sample > 0 && status.held < deployment_.black_box.before + deployment_.black_box.after;
  return status;
}

void BlackBox::run(const std::stop_token& end) {
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, end, [this] { return !events_.empty(); })) {
    // Events within this time belong to the same fault.
    changed_.wait_for(lock, end, std::chrono::duration<double>(deployment_.black_box.after), [] { return false; });
    const std::vector<Event> events = std::exchange(events_, {});
    lock.unlock();
    writeFile(events);
    lock.lock();
  }
}

void BlackBox::writeFile(const std::vector<Event>& events) {
  const std::uint64_t first = events.front().time, since = first - nanoseconds(deployment_.black_box.before);
  const std::filesystem::path file =
      directory_ /
      (recordings::timeName(first) + "_" + std::filesystem::path(deployment_.prefix).filename().string() + ".mcap");
  std::string problem;
  const recording::SampleRing::Extent extent = ring_.extent();
  try {
    std::filesystem::create_directories(directory_);
    prune();
    recordings::RunFile out(file, info_, deployment_.prefix, topics_);
    std::map<std::string, std::string> values{{"fault", events.front().description},
                                              {"fault_time_ns", std::to_string(first)},
                                              {"details", trigger_.details()}};
    for (std::size_t i = 1; i < events.size(); ++i)
      values["event " + std::to_string(i)] = std::to_string(events[i].time) + ": " + events[i].description;
    out.mcap().add({"fault", values});
    recording::SampleTag tag;
    std::string bytes;
    std::uint64_t missed = 0;
    for (auto place = extent.begin; place.byte < extent.end.byte && ring_.next(place, tag, bytes, missed);) {
      if (tag.log_time >= since)
        out.write(tag, bytes);
    }
    const recording::Statistics statistics = out.mcap().statistics();
    out.mcap().add(
        {"black_box",
         {{"seconds_before", std::to_string(1e-9 * static_cast<double>(first - std::min(first, statistics.start)))},
          {"seconds_after",
           std::to_string(1e-9 * static_cast<double>(statistics.end - std::min(statistics.end, first)))},
          {"overwritten_while_writing", std::to_string(missed)}}});
    out.mcap().close();
    spdlog::error("black box: {}: {} ({:.1f} s)", events.front().description, file.string(), statistics.duration());
  } catch (const std::exception& error) {
    problem = error.what();
    spdlog::error("black box: {}: not saved: {}", events.front().description, problem);
  }
  const std::lock_guard lock(mutex_);
  status_.problem = problem;
  if (problem.empty()) {
    ++status_.files;
    status_.last_file = file.string();
  }
}

/// Deletes the oldest files, so that with the next one their number is within the limit.
void BlackBox::prune() const {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(directory_)) {
    if (entry.is_regular_file() && entry.path().extension() == ".mcap")
      files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());  // their names begin with the time
  const std::size_t most = static_cast<std::size_t>(deployment_.black_box.files) - 1;
  for (std::size_t i = 0; i + most < files.size(); ++i)
    std::filesystem::remove(files[i]);
}

}  // namespace tandem::recorder
