// SPDX-License-Identifier: Apache-2.0
/** @file Events that outlive the server, whatever has become of their file. */
#include "services/console/events_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <fstream>
#include <iostream>
#include <iterator>
#include <map>
#include <mutex>
#include <random>
#include <thread>

#include "config/arm_names.h"
#include "config/robot_files.h"
#include "services/dds/raw.h"
#include "services/runtime/temporary_folder.h"

namespace tandem::console {
namespace {

namespace fs = std::filesystem;

/** What a power cut leaves: contents of files as of their last sync, and names as of the last sync of their folder. */
class Disk {
 public:
  static Disk& instance() {
    static Disk disk;
    return disk;
  }
  int sync(int descriptor) {
    const std::lock_guard lock(mutex_);
    if (failing_) {
      errno = EIO;
      return -1;
    }
    struct stat found {};
    fstat(descriptor, &found);
    const fs::path path = "/proc/self/fd/" + std::to_string(descriptor);
    if (!S_ISDIR(found.st_mode)) {
      std::ifstream stream(path, std::ios::binary);
      contents_[found.st_ino] = {std::istreambuf_iterator<char>(stream), {}};
      return 0;
    }
    for (const fs::directory_entry& entry : fs::directory_iterator(fs::read_symlink(path)))
      if (stat(entry.path().c_str(), &found) == 0)
        names_[entry.path()] = found.st_ino;
    return 0;
  }
  /// Empty: the file would not exist.
  std::string contents(const fs::path& file) const {
    const std::lock_guard lock(mutex_);
    const auto name = names_.find(file);
    const auto found = name == names_.end() ? contents_.end() : contents_.find(name->second);
    return found == contents_.end() ? "" : found->second;
  }
  void fail(bool failing) {
    const std::lock_guard lock(mutex_);
    failing_ = failing;
  }

 private:
  mutable std::mutex mutex_;
  std::map<ino_t, std::string> contents_;
  std::map<fs::path, ino_t> names_;
  bool failing_ = false;
};

}  // namespace
}  // namespace tandem::console

// In place of the C library's, for all code of this program.
extern "C" int fdatasync(int descriptor) { return tandem::console::Disk::instance().sync(descriptor); }
extern "C" int fsync(int descriptor) { return tandem::console::Disk::instance().sync(descriptor); }

namespace tandem::console {
namespace {

class EventsOverRestarts : public testing::Test {
 protected:
  EventsOverRestarts()
      : deployment_(config::loadDeployment(config::findFile("laptop", "deployment"))),
        robot_(config::loadAnyRobot(deployment_)),
        topics_(dds::allTopics(config::armList(robot_))),
        file_(folder_.path() / "events" / "laptop.mcap"),
        seed_(std::random_device{}()),
        random_(seed_) {
    std::cout << "seed " << seed_ << "\n";
    signal(SIGXFSZ, SIG_IGN);
  }

  template <class M>
  void take(History& history, const std::string& topic, const M& message) {
    const auto found = std::find_if(topics_.begin(), topics_.end(), [&](const auto& one) { return one.name == topic; });
    const auto bytes = std::make_shared<const std::string>(dds::encode(message));
    time_ += 1 + random_() % 1'000'000'000;
    history.take(static_cast<std::uint32_t>(found - topics_.begin()), *found, {bytes, time_},
                 featuresOf(found->type, *bytes));
  }
  void takeSome(History& history, int count) {
    for (int k = 0; k < count; ++k) {
      dds::Log line{};
      line.msg = "line " + std::to_string(random_());
      dds::ControlStatus status{};
      status.faults[0] = static_cast<std::uint32_t>(random_() % 8);
      dds::RunSummary summary{};
      summary.trajectory_id = static_cast<std::uint32_t>(random_());
      switch (random_() % 3) {
        case 0:
          take(history, "/rosout", line);
          break;
        case 1:
          take(history, "control/status", status);
          break;
        default:
          take(history, "planning/summary", summary);
      }
    }
  }
  /// The server from its start to its end. @return its history at the end
  template <class Run>
  std::string serve(Run run) {
    History history;
    {
      const EventsFile events(history, file_, deployment_, robot_);
      run(history);
    }
    return history.packed(0);
  }
  std::string served() {
    return serve([](History&) {});
  }
  std::string contents() const {
    std::ifstream stream(file_, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  void overwrite(const std::string& bytes) const { std::ofstream(file_, std::ios::binary) << bytes; }

  const runtime::TemporaryFolder folder_;
  config::Deployment deployment_;
  config::Robot robot_;
  std::vector<dds::TopicInfo> topics_;
  fs::path file_;
  unsigned seed_;
  std::mt19937 random_;
  std::uint64_t time_ = 1'700'000'000'000'000'000;
};

TEST_F(EventsOverRestarts, AreRestoredInOrderWithTheirTimes) {
  std::string before = served();
  for (int run = 0; run < 5; ++run) {
    std::string found;
    const std::string after = serve([&](History& history) {
      found = history.packed(0);
      takeSome(history, 1 + static_cast<int>(random_() % 300));
    });
    EXPECT_EQ(found, before);
    EXPECT_GT(after.size(), before.size());
    before = after;
  }
  serve([&](History& history) { takeSome(history, 2 * static_cast<int>(History::kMost)); });
  History last;
  const EventsFile events(last, file_, deployment_, robot_);
  EXPECT_LE(last.events().size(), History::kMost);
  EXPECT_GT(last.events().size(), History::kMost / 2);
  EXPECT_EQ(std::distance(fs::directory_iterator(file_.parent_path()), {}), 1) << "other files were left";
}

TEST_F(EventsOverRestarts, AreNotTakenOnceMoreWhenTheirWriterSendsThemToTheNewReader) {
  dds::RunSummary summary{};
  summary.trajectory_id = 7;
  const std::string before = serve([&](History& history) { take(history, "planning/summary", summary); });
  EXPECT_EQ(serve([&](History& history) { take(history, "planning/summary", summary); }), before);
}

TEST_F(EventsOverRestarts, OfTwoServersThoseOfTheOneThatRunsOnAreWhole) {
  for (int run = 0; run < 20; ++run) {
    const std::string expected = serve([&](History& history) {
      takeSome(history, 1 + static_cast<int>(random_() % 20));
      serve([&](History& other) {
        takeSome(other, 1 + static_cast<int>(random_() % 20));
        takeSome(history, static_cast<int>(random_() % 20));
      });
      takeSome(history, 1 + static_cast<int>(random_() % 20));
    });
    EXPECT_EQ(served(), expected);
  }
}

TEST_F(EventsOverRestarts, TwoServersThatReplaceTheFileAtOnceLeaveAWholeOne) {
  for (int run = 0; run < 50; ++run) {
    const std::string expected = serve([&](History& history) {
      serve([&](History& other) {
        for (int k = 0; k < 100; ++k)
          takeSome(k % 2 == 0 ? history : other, 1);
      });
      takeSome(history, 1);
    });
    ASSERT_EQ(served(), expected) << "run " << run;
  }
}

TEST_F(EventsOverRestarts, ADamagedFileLosesEventsAndNothingElse) {
  const std::string whole = serve([&](History& history) { takeSome(history, 200); });
  const std::string bytes = contents();
  for (int run = 0; run < 60; ++run) {
    std::string bad = bytes.substr(0, run % 2 == 0 ? bytes.size() : random_() % bytes.size());
    for (int k = 0; k < run % 7 && !bad.empty(); ++k)
      bad[random_() % bad.size()] = static_cast<char>(random_());
    overwrite(bad);
    EXPECT_LE(served().size(), whole.size());
  }
  overwrite("no MCAP file");
  EXPECT_EQ(served(), History().packed(0));
  const std::string after = serve([&](History& history) { takeSome(history, 5); });
  EXPECT_EQ(served(), after) << "the broken file is not replaced";
}

TEST_F(EventsOverRestarts, OfAnotherRobotAreLeftOut) {
  serve([&](History& history) { takeSome(history, 20); });
  deployment_.values += "another: value\n";
  EXPECT_EQ(served(), History().packed(0));
}

TEST_F(EventsOverRestarts, AfterAFullDiskEventsAreWrittenAgain) {
  const std::string before = serve([&](History& history) { takeSome(history, 50); });
  rlimit limit{};
  getrlimit(RLIMIT_FSIZE, &limit);
  const rlimit full{100, limit.rlim_max};  // a file size limit makes a write fail as a full disk does
  setrlimit(RLIMIT_FSIZE, &full);
  serve([&](History& history) { takeSome(history, 50); });
  setrlimit(RLIMIT_FSIZE, &limit);
  EXPECT_EQ(served(), before) << "the file from before is not whole";
  EXPECT_EQ(std::distance(fs::directory_iterator(file_.parent_path()), {}), 1) << "a part of a file was left";

  History history;
  setrlimit(RLIMIT_FSIZE, &full);
  const EventsFile events(history, file_, deployment_, robot_);
  const auto old = fs::last_write_time(file_);
  takeSome(history, 50);
  setrlimit(RLIMIT_FSIZE, &limit);
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (fs::last_write_time(file_) == old && std::chrono::steady_clock::now() < deadline)
    std::this_thread::yield();
  EXPECT_NE(fs::last_write_time(file_), old);
}

TEST_F(EventsOverRestarts, SurviveAPowerCutWhileTheServerRuns) {
  History history;
  const EventsFile events(history, file_, deployment_, robot_);
  for (int run = 0; run < 10; ++run) {
    Disk::instance().fail(run % 3 == 1);
    takeSome(history, 1 + static_cast<int>(random_() % 20));
    Disk::instance().fail(false);
    const fs::path left = folder_.path() / ("left-" + std::to_string(run) + ".mcap");
    const auto after_power_cut = [&] {
      std::ofstream(left, std::ios::binary) << Disk::instance().contents(file_);
      History restored;
      const EventsFile of_left(restored, left, deployment_, robot_);
      return restored.packed(0);
    };
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (after_power_cut() != history.packed(0) && std::chrono::steady_clock::now() < deadline)
      std::this_thread::yield();
    ASSERT_EQ(after_power_cut(), history.packed(0)) << "run " << run;
  }
}

TEST_F(EventsOverRestarts, AFolderThatCannotBeMadeStopsNoService) {
  std::ofstream(folder_.path() / "events") << "a file";
  const std::string empty = served();
  EXPECT_GT(serve([&](History& history) { takeSome(history, 5); }).size(), empty.size());
  EXPECT_EQ(served(), empty);
}

}  // namespace
}  // namespace tandem::console
