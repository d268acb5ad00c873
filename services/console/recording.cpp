// SPDX-License-Identifier: Apache-2.0
#include "services/console/recording.h"

#include <spdlog/spdlog.h>

#include <stdexcept>

#include "config/arm_names.h"
#include "services/recordings/capture.h"

namespace tandem::console {
namespace {

constexpr auto kDrain = std::chrono::milliseconds(20);
constexpr std::size_t kLongestMark = 200;  // bytes

}  // namespace

Recording::Recording(const config::Deployment& deployment,
                     const config::Robot& robot,
                     dds::BusOptions bus,
                     std::filesystem::path folder)
    : prefix_(deployment.prefix),
      topics_(dds::allTopics(config::armList(robot))),
      info_(recordings::describeRun(deployment, robot)),
      bus_(std::move(bus)),
      folder_(std::move(folder)),
      name_(deployment.name) {}

Recording::~Recording() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable())
    thread_.join();
}

void Recording::start() {
  std::unique_lock lock(mutex_);
  if (recording_)
    throw std::invalid_argument("a recording runs already: " + totals_.files.front().string() + "; stop it first");
  lock.unlock();
  if (thread_.joinable())
    thread_.join();  // has ended
  lock.lock();
  recording_ = true;
  ending_ = false;
  began_ = recordings::wallClock();
  marks_.clear();
  problem_.clear();
  const std::filesystem::path file = folder_ / (recordings::timeName(began_) + "_" + name_ + ".mcap");
  totals_ = {};
  totals_.files = {file};
  thread_ = std::thread([this, file] { run(file); });
}

void Recording::stop() {
  const std::lock_guard lock(mutex_);
  if (!recording_)
    throw std::invalid_argument("no recording runs; start one first");
  ending_ = true;
  changed_.notify_all();
}

void Recording::mark(const std::string& text) {
  if (text.empty() || text.size() > kLongestMark)
    throw std::invalid_argument("text: found " + std::to_string(text.size()) + " bytes, expected 1 to " +
                                std::to_string(kLongestMark));
  const std::lock_guard lock(mutex_);
  if (!recording_ || ending_)
    throw std::invalid_argument("no recording runs; start one first");
  marks_.push_back({recordings::wallClock(), text});
}

nlohmann::ordered_json Recording::state() const {
  const std::lock_guard lock(mutex_);
  nlohmann::ordered_json marks = nlohmann::ordered_json::array();
  for (const Mark& mark : marks_)
    marks.push_back({{"seconds", 1e-9 * static_cast<double>(mark.time - began_)}, {"text", mark.text}});
  const std::uint64_t end = recording_ ? recordings::wallClock() : ended_;
  return {{"recording", recording_},
          {"file", totals_.files.empty() ? "" : totals_.files.front().string()},
          {"seconds", 1e-9 * static_cast<double>(end - began_)},
          {"messages", totals_.messages},
          {"lost", totals_.lost},
          {"bytes", totals_.bytes},
          {"marks", marks},
          {"problem", problem_}};
}

void Recording::run(const std::filesystem::path& file) {
  std::string problem;
  try {
    std::filesystem::create_directories(file.parent_path());
    record(file);
  } catch (const std::exception& error) {
    problem = error.what();
    spdlog::error("recording: {}", problem);
  }
  const std::lock_guard lock(mutex_);
  recording_ = false;
  ended_ = recordings::wallClock();
  problem_ = problem;
}

void Recording::record(const std::filesystem::path& file) {
  recordings::RecorderOptions options;
  options.file = file;
  recordings::Recorder recorder(info_, prefix_, topics_, options);
  dds::Bus bus(bus_);
  const recordings::Capture capture(bus, topics_,
                                    [&](const auto& tag, std::string_view bytes) { recorder.take(tag, bytes); });
  spdlog::info("records to {}", file.string());
  std::size_t written = 0;
  for (bool end = false; !end;) {
    std::vector<Mark> marks;
    {
      std::unique_lock lock(mutex_);
      end = changed_.wait_for(lock, kDrain, [this] { return ending_; });
      marks.assign(marks_.begin() + static_cast<std::ptrdiff_t>(written), marks_.end());
    }
    for (const Mark& mark : marks)
      recorder.add(
          {"mark " + std::to_string(++written), {{"time_ns", std::to_string(mark.time)}, {"text", mark.text}}});
    recorder.drain();
    if (end)
      recorder.close();
    const std::lock_guard lock(mutex_);
    totals_ = recorder.totals();
  }
}

}  // namespace tandem::console
