// SPDX-License-Identifier: Apache-2.0
/** @file Benchmark of DDS Security: round trip between two participants over loopback, plain and secured; `ratio` is
 * the ratio of the medians. */
#include <benchmark/benchmark.h>
#include <stdlib.h>

#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <stdexcept>
#include <string>

#include "bench/enroll.h"
#include "bench/percentiles.h"
#include "services/dds/bus.h"

namespace tandem::bench {
namespace {

constexpr std::size_t kTrips = 2000;
constexpr int kDomain = 101;
constexpr const char* kPrefix = "bench_security";

/** Credentials for the run, issued by `tandem security`. */
class Folder {
 public:
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "tandem-bench-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr)
      throw std::runtime_error("no temporary folder can be made at " + name);
    path_ = name;
    const std::string tool = std::string(TANDEM_TOOL) + " security ", folder = (path_ / "credentials").string();
    const std::string issue = "issue " + folder + " control hal --prefix " + kPrefix + " --domain " +
                              std::to_string(kDomain) + " > /dev/null";
    if (std::system((tool + "init " + folder + " > /dev/null && " + tool + issue).c_str()) != 0)
      throw std::runtime_error("`tandem security init` or `issue` failed in " + folder +
                               "; its message above names the cause");
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::filesystem::path credentials() const { return path_ / "credentials"; }

 private:
  std::filesystem::path path_;
};

dds::BusOptions optionsFor(dds::Role role, const Folder* folder) {
  dds::BusOptions options;
  options.domain = kDomain;
  options.prefix = kPrefix;
  options.command_age = 10.0;  // enough for a busy machine
  if (folder != nullptr)
    options.credentials = dds::credentialsOf(folder->credentials(), role);
  return options;
}

/** Both participants. */
class Loop {
 public:
  explicit Loop(const Folder* folder)
      : hal_(optionsFor(dds::Role::kHal, folder)),
        control_(optionsFor(dds::Role::kControl, folder)),
        states_(hal_.writer(dds::kActuationState)),
        commands_(control_.writer(dds::kActuationCommand)),
        answering_(control_.reader(dds::kActuationState,
                                   [this](const dds::ActuationState& state) {
                                     dds::ActuationCommand command;
                                     command.answers_state = state.sequence;
                                     commands_.write(command);
                                   })),
        listening_(hal_.reader(dds::kActuationCommand, [this](const dds::ActuationCommand& command) {
          const std::lock_guard lock(mutex_);
          answered_ = command.answers_state;
          came_.notify_all();
        })) {
    for (int k = 0; k < 300 && !once(0.1); ++k) {
    }
    if (!once(1.0))
      throw std::runtime_error("the two participants did not discover each other within 31 s");
  }

  /// @return whether the answer came within `seconds`.
  bool once(double seconds) {
    dds::ActuationState state;
    state.sequence = ++sequence_;
    states_.write(state);
    std::unique_lock lock(mutex_);
    return came_.wait_for(lock, std::chrono::duration<double>(seconds), [&] { return answered_ == sequence_; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable came_;
  std::uint64_t answered_ = 0, sequence_ = 0;
  dds::Bus hal_, control_;
  dds::Writer<dds::ActuationState> states_;
  dds::Writer<dds::ActuationCommand> commands_;
  dds::Reader answering_, listening_;
};

double measure(benchmark::State& state, const Folder* folder) {
  Loop loop(folder);
  Percentiles percentiles(kTrips);
  for (auto _ : state) {
    double sum = 0.0;
    for (std::size_t trip = 0; trip < kTrips; ++trip)
      sum += percentiles.timeElapsed(trip, [&] { loop.once(1.0); });
    state.SetIterationTime(sum / kTrips);
  }
  percentiles.report(state);
  return state.counters["p50"];
}

}  // namespace

void enrollAll() {
  static double plain = 0.0;
  enroll("round_trip/plain", [](benchmark::State& state) { plain = measure(state, nullptr); });
  enroll("round_trip/secured", [](benchmark::State& state) {
    const Folder folder;
    const double secured = measure(state, &folder);
    if (plain > 0.0)
      state.counters["ratio"] = secured / plain;
  });
}

}  // namespace tandem::bench
