// SPDX-License-Identifier: Apache-2.0
/** @file Recordings as data for the page: what is served of any file, and what is refused. */
#include "services/console/replay.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iostream>
#include <random>

#include "config/arm_names.h"
#include "config/robot_files.h"
#include "services/console/api.h"
#include "services/console/protocol.h"
#include "services/dds/definitions.h"
#include "services/dds/raw.h"
#include "services/recordings/run_file.h"
#include "services/runtime/process.h"

namespace tandem::console {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kRecorded = 1'700'000'000'000'000'000;  // ns
constexpr double kRecordedMs = 1e-6 * static_cast<double>(kRecorded);
constexpr std::uint64_t kStep = 1'000'000;  // ns: control at 1 kHz
constexpr int kSamples = 20'000;

struct PackedSample {
  std::uint32_t channel = 0;
  std::uint64_t time = 0;
  std::string cdr;
};

class RecordingsOfThePage : public testing::Test {
 protected:
  RecordingsOfThePage()
      : deployment_(config::loadDeployment(config::findFile("laptop", "deployment"))),
        robot_(config::loadAnyRobot(deployment_)),
        topics_(dds::allTopics(config::armList(robot_))),
        folder_(fs::temp_directory_path() / ("tandem-replay-" + std::to_string(getpid()))),
        replay_(folder_, deployment_, robot_) {
    fs::create_directories(folder_);
    while (topics_[status_].name != "control/status")
      ++status_;
  }
  ~RecordingsOfThePage() override { fs::remove_all(folder_); }

  /// 20 s of control/status, with one fault that lasts for one sample.
  fs::path write(const std::string& name, recordings::RunInfo info, const std::string& prefix = "tandem") {
    const fs::path file = folder_ / name;
    info.values["prefix"] = prefix;
    recordings::RunFile out(file, info, prefix, topics_);
    dds::ControlStatus status{};
    for (int k = 0; k < kSamples; ++k) {
      status.sequence = static_cast<std::uint64_t>(k);
      status.faults[0] = k == kFault ? 1 : 0;
      const std::uint64_t time = kRecorded + static_cast<std::uint64_t>(k) * kStep;
      out.write({.topic = status_, .sequence = static_cast<std::uint64_t>(k), .log_time = time, .publish_time = time},
                dds::encode(status));
    }
    out.mcap().close();
    return file;
  }
  recordings::RunInfo ownInfo() const { return recordings::describeRun(deployment_, robot_); }
  /// Of a deployment among the presets.
  static recordings::RunInfo infoOf(const std::string& preset) {
    const auto deployment = config::loadDeployment(config::findFile(preset, "deployment"));
    return recordings::describeRun(deployment, config::loadAnyRobot(deployment));
  }

  std::vector<PackedSample> samples(const std::string& file,
                                    double from,
                                    double to,
                                    double rate,
                                    std::uint64_t* reached) {
    const std::string answer =
        replay_.samples("file=" + file + "&from=" + std::to_string(from) + "&to=" + std::to_string(to) +
                        "&rate=" + std::to_string(rate) + "&topics=" + std::to_string(status_));
    EXPECT_LT(answer.size(), Replay::kAnswer + 10'000);
    std::memcpy(reached, answer.data(), sizeof *reached);
    std::vector<PackedSample> all;
    for (std::size_t at = sizeof *reached; at < answer.size();) {
      std::uint32_t length = 0;
      PackedSample one;
      std::memcpy(&length, &answer[at], 4);
      std::memcpy(&one.channel, &answer[at + 5], 4);
      std::memcpy(&one.time, &answer[at + 9], 8);
      one.cdr = answer.substr(at + 4 + kMessageHeader, length - kMessageHeader);
      all.push_back(std::move(one));
      at += 4 + length;
    }
    return all;
  }
  std::string refusal(const std::string& query) {
    try {
      replay_.describe(query);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  }

  static constexpr int kFault = 7'777;
  config::Deployment deployment_;
  config::Robot robot_;
  std::vector<dds::TopicInfo> topics_;
  fs::path folder_;
  Replay replay_;
  std::uint32_t status_ = 0;
};

TEST_F(RecordingsOfThePage, AreListedAndDescribed) {
  write("2026-01-01.mcap", ownInfo());
  std::ofstream(folder_ / "notes.txt") << "no recording";
  const auto list = replay_.list();
  ASSERT_EQ(list["recordings"].size(), 1u);
  EXPECT_EQ(list["recordings"][0]["file"], "2026-01-01.mcap");
  const auto about = replay_.describe("file=2026-01-01.mcap");
  EXPECT_EQ(about["messages"], kSamples);
  EXPECT_NEAR(about["start_ms"].get<double>(), kRecordedMs, 0.01);
  EXPECT_NEAR(about["end_ms"].get<double>(), kRecordedMs + kSamples - 1, 0.01);
}

TEST_F(RecordingsOfThePage, AnyRangeIsServedInOrderDecimatedAndWithItsEvents) {
  write("run.mcap", ownInfo(), "another");  // a prefix is no property of the robot's view
  const unsigned seed = std::random_device{}();
  std::cout << "seed " << seed << "\n";
  std::mt19937 random(seed);
  for (int run = 0; run < 20; ++run) {
    const double from = kRecordedMs + std::uniform_real_distribution(0.0, 15'000.0)(random);
    const double to = from + std::uniform_real_distribution(100.0, 5'000.0)(random);
    const double rate = std::uniform_real_distribution(1.0, 100.0)(random);
    std::uint64_t reached = 0;
    const auto all = samples("run.mcap", from, to, rate, &reached);
    EXPECT_NEAR(1e-6 * static_cast<double>(reached), to, 0.01);
    EXPECT_LE(all.size(), 3.0 + rate * (to - from) / 1000.0 + 2.0);
    EXPECT_GE(all.size(), std::floor(0.8 * rate * (to - from) / 1000.0));
    bool fault = false;
    for (const PackedSample& one : all) {
      EXPECT_EQ(one.channel, status_);
      EXPECT_TRUE(1e-6 * static_cast<double>(one.time) > from - 0.01 &&
                  1e-6 * static_cast<double>(one.time) < to + 0.01);
      const auto status = dds::decode<dds::ControlStatus>(one.cdr);
      ASSERT_TRUE(status);
      EXPECT_EQ(status->sequence, (one.time - kRecorded) / kStep);
      fault = fault || status->faults[0] != 0;
    }
    const double at = kRecordedMs + kFault;
    EXPECT_EQ(fault, from < at && at < to) << from << " " << to;
  }
}

TEST_F(RecordingsOfThePage, AnswersAreLimitedAndContinueWhereTheyEnd) {
  write("run.mcap", ownInfo());
  std::uint64_t reached = 0;
  std::uint64_t expected = 0;
  int answers = 0;
  for (double at = kRecordedMs; at < kRecordedMs + kSamples; at = 1e-6 * static_cast<double>(reached)) {
    for (const PackedSample& one : samples("run.mcap", at, kRecordedMs + kSamples, kMostRate, &reached)) {
      if (one.time < kRecorded + expected * kStep)
        continue;  // times in ms are rounded
      EXPECT_EQ(one.time, kRecorded + expected * kStep);
      ++expected;
    }
    ASSERT_LT(++answers, 1000);
  }
  EXPECT_GE(expected + 2, static_cast<std::uint64_t>(kSamples));
  EXPECT_GT(answers, 1) << "the limit was not reached";
}

TEST_F(RecordingsOfThePage, ForeignFilesAndPathsAreRefused) {
  recordings::RunInfo other = ownInfo();
  other.values["fingerprint"] = "0123456789abcdef";
  write("other.mcap", other);
  recordings::RunInfo foreign = ownInfo();
  foreign.values.erase("fingerprint");
  write("foreign.mcap", foreign);
  std::ofstream(folder_ / "text.mcap") << "no recording";
  fs::create_symlink("/etc/passwd", folder_ / "link.mcap");
  fs::create_directory(folder_ / "folder.mcap");
  EXPECT_NE(refusal("file=other.mcap").find("of another robot or deployment, ark2024 · laptop, recorded "),
            std::string::npos);
  EXPECT_NE(refusal("file=other.mcap").find("the configuration in it has other values"), std::string::npos);
  EXPECT_NE(refusal("file=foreign.mcap").find("found no fingerprint of the robot"), std::string::npos);
  EXPECT_NE(refusal("file=text.mcap").find("is no MCAP file"), std::string::npos);
  for (const char* name : {"link.mcap", "folder.mcap", "none.mcap"})
    EXPECT_NE(refusal("file=" + std::string(name)).find("found no such file"), std::string::npos) << name;
  for (const char* name :
       {"", "..", "../run.mcap", "..%2Frun.mcap", "%2Fetc%2Fpasswd", ".run.mcap", "a%00.mcap", "a/b.mcap"})
    EXPECT_NE(refusal("file=" + std::string(name)).find("expected the name of a recording"), std::string::npos) << name;
}

TEST_F(RecordingsOfThePage, OtherRobotsAreDescribedAsTheRecordingDescribesThem) {
  for (const char* preset : {"one-arm", "ablation-pair", "planar-pair", "handheld", "drives", "teleop"}) {
    const auto deployment = config::loadDeployment(config::findFile(preset, "deployment"));
    const auto robot = config::loadAnyRobot(deployment);
    write("other.mcap", infoOf(preset), deployment.prefix);
    const auto about = replay_.describe("file=other.mcap");
    EXPECT_EQ(about["description"], describeRobot(deployment, robot)) << preset;
    ASSERT_EQ(about["channels"].size(), 1u) << preset;
    const auto channel = about["channels"][0];
    EXPECT_EQ(channel["topic"], "/" + deployment.prefix + "/control/status");
    EXPECT_EQ(dds::allTopics(config::armList(robot)).at(channel["id"]).name, "control/status");
    EXPECT_EQ(about["definitions"]["tandem_msgs/msg/ControlStatus"],
              dds::messageDefinition("tandem_msgs/msg/ControlStatus"));
  }
  write("own.mcap", ownInfo());
  EXPECT_TRUE(replay_.describe("file=own.mcap")["description"].is_null());
}

TEST_F(RecordingsOfThePage, OtherRobotsWhoseDescriptionIsIncompleteAreRefused) {
  const recordings::RunInfo info = infoOf("handheld");
  for (const char* name : {"deployment.yaml", "robot.yaml", "hardware.yaml"}) {
    const auto refused_with = [&](auto change) {
      recordings::RunInfo changed = info;
      const auto file = std::find_if(changed.files.begin(), changed.files.end(),
                                     [&](const recording::Attachment& one) { return one.name == name; });
      ASSERT_NE(file, changed.files.end()) << name;
      change(changed.files, file);
      write("other.mcap", changed);
      const std::string why = refusal("file=other.mcap");
      EXPECT_NE(why.find("of another robot or deployment, "), std::string::npos) << why;
      EXPECT_NE(why.find("attachment of the recording: " + std::string(name) + ":"), std::string::npos) << why;
    };
    refused_with([](auto& files, auto file) { files.erase(file); });
    refused_with([](auto&, auto file) { file->data = "tandem: [nothing"; });
    refused_with([](auto&, auto file) { file->data.clear(); });
  }
  recordings::RunInfo changed = info;
  for (recording::Attachment& file : changed.files) {
    const std::string key = "tip_gain_per_s: ";
    if (const auto at = file.data.find(key); file.name == "deployment.yaml" && at != std::string::npos)
      file.data.insert(at + key.size(), "1");
  }
  write("other.mcap", changed);
  EXPECT_NE(refusal("file=other.mcap").find("the configuration in it has other values"), std::string::npos)
      << refusal("file=other.mcap");
}

TEST_F(RecordingsOfThePage, AnyDamageIsReportedOrRefusedAndNeverMore) {
  const fs::path good = write("good.mcap", ownInfo());
  std::ifstream stream(good, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  const unsigned seed = std::random_device{}();
  std::cout << "seed " << seed << "\n";
  std::mt19937 random(seed);
  for (int run = 0; run < 60; ++run) {
    std::string bad = bytes.substr(0, run % 2 == 0 ? bytes.size() : random() % bytes.size());
    for (int k = 0; k < run % 5 && !bad.empty(); ++k)
      bad[random() % bad.size()] = static_cast<char>(random());
    const std::string name = "bad-" + std::to_string(run) + ".mcap";
    std::ofstream(folder_ / name, std::ios::binary) << bad;
    if (refusal("file=" + name).empty()) {
      std::uint64_t reached = 0;
      try {
        samples(name, kRecordedMs, kRecordedMs + kSamples, 20.0, &reached);
      } catch (const std::invalid_argument&) {
        // With a reason.
      }
    }
    fs::remove(folder_ / name);
  }
}

TEST_F(RecordingsOfThePage, AFileThatGrowsIsShownAsItWasWhenItWasOpened) {
  const fs::path file = write("whole.mcap", ownInfo());
  std::ifstream stream(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  const auto save = [&](double share) {
    std::ofstream(folder_ / "grows.mcap", std::ios::binary)
        << bytes.substr(0, static_cast<std::size_t>(share * static_cast<double>(bytes.size())));
    return replay_.describe("file=grows.mcap")["messages"].get<int>();
  };
  const int early = save(0.5);
  std::uint64_t reached = 0;
  const auto ask = [&] { return samples("grows.mcap", kRecordedMs, kRecordedMs + kSamples, 1.0, &reached).size(); };
  const std::size_t shown = ask();
  std::ofstream(folder_ / "grows.mcap", std::ios::binary) << bytes;
  EXPECT_EQ(ask(), shown);
  EXPECT_GT(replay_.describe("file=grows.mcap")["messages"].get<int>(), early);
  EXPECT_GT(ask(), shown);
}

TEST_F(RecordingsOfThePage, AFileThatNeedsMoreMemoryIsRefused) {
  const fs::path file = write("run.mcap", ownInfo());
  EXPECT_THROW(recording::Reader(file, recording::Reader::Open::kFast, 1000), recording::Error);
  recording::Reader reader(file, recording::Reader::Open::kFast, 100'000);
  int count = 0;
  EXPECT_NO_THROW(reader.forEach({}, [&](const auto&, const auto&) { return ++count > 0; }));
  EXPECT_TRUE(count == kSamples || !reader.damage().empty());
  fs::resize_file(file, fs::file_size(file) / 2);
  EXPECT_THROW(recording::Reader(file, recording::Reader::Open::kIndexed), recording::Error);
}

}  // namespace
}  // namespace tandem::console
