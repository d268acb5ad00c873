// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <system_error>

#include "tests/unit/recording/random_recording.h"

namespace tandem::recording::test {
namespace {

std::uint64_t seed() {
  const char* given = std::getenv("TANDEM_SEED");
  return given ? std::stoull(given) : std::random_device{}();
}

class Mcap : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string folder = (std::filesystem::temp_directory_path() / "tandem-mcap-XXXXXX").string();
    ASSERT_NE(mkdtemp(folder.data()), nullptr);
    folder_ = folder;
    const std::uint64_t number = seed();
    std::cout << "TANDEM_SEED=" << number << std::endl;
    random_.seed(number);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string contentsOf(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  std::filesystem::path put(const std::string& bytes) {
    std::ofstream(folder_ / "copy.mcap", std::ios::binary) << bytes;
    return folder_ / "copy.mcap";
  }

  std::filesystem::path folder_;
  std::mt19937_64 random_;
};

TEST_F(Mcap, HoldsWhatWasWritten) {
  for (int round = 0; round < 30; ++round) {
    const Contents contents = writeRandom(folder_ / "a.mcap", random_);
    for (const auto how : {Reader::Open::kFast, Reader::Open::kScan}) {
      Reader reader(folder_ / "a.mcap", how);
      EXPECT_TRUE(reader.finished());
      EXPECT_EQ(reader.profile(), "ros2");
      EXPECT_EQ(rowsOf(reader), contents.rows);
      EXPECT_EQ(reader.statistics().messages, contents.rows.size());
      EXPECT_EQ(reader.statistics().start, std::get<2>(contents.rows.front()));
      EXPECT_EQ(reader.statistics().end, std::get<2>(contents.rows.back()));
      std::map<std::string, std::string> attachments, notes;
      for (std::size_t i = 0; i < reader.attachments().size(); ++i)
        attachments[reader.attachments()[i].name] = reader.attachmentData(i);
      for (const Metadata& note : reader.metadata())
        notes[note.name] = note.values.at("value");
      EXPECT_EQ(attachments, contents.attachments);
      EXPECT_EQ(notes, contents.notes);
      EXPECT_TRUE(reader.damage().empty()) << reader.damage().front();
    }
  }
}

TEST_F(Mcap, SelectsByTimeAndChannel) {
  for (int round = 0; round < 20; ++round) {
    const Contents contents = writeRandom(folder_ / "a.mcap", random_);
    const std::uint64_t first = std::get<2>(contents.rows.front()), last = std::get<2>(contents.rows.back());
    const std::uint64_t from = first + random_() % (last - first + 1), to = from + random_() % (last - from + 1);
    const auto wanted = [](const std::string& topic) { return topic.back() % 2 == 0; };
    std::vector<Row> expected;
    for (const Row& row : contents.rows) {
      if (std::get<2>(row) >= from && std::get<2>(row) <= to && wanted(std::get<0>(row)))
        expected.push_back(row);
    }
    Reader reader(folder_ / "a.mcap");
    EXPECT_EQ(rowsOf(reader, {[&](const Channel& c) { return wanted(c.topic); }, from, to}), expected);
  }
}

TEST_F(Mcap, OverlappingChunksComeInOrder) {
  {
    Writer writer(folder_ / "a.mcap", {.chunk_size = 100});
    const auto channel = writer.addChannel("/a", writer.addSchema("p/msg/A", "ros2msg", ""));
    for (std::uint32_t i = 0; i < 1000; ++i)
      writer.write({channel, i, 1000 + random_() % 500, 0, "some bytes to fill a chunk with"});
  }
  Reader reader(folder_ / "a.mcap");
  const std::vector<Row> rows = rowsOf(reader);
  EXPECT_EQ(rows.size(), 1000u);
  EXPECT_TRUE(std::is_sorted(rows.begin(), rows.end(),
                             [](const Row& a, const Row& b) { return std::get<2>(a) < std::get<2>(b); }));
}

TEST_F(Mcap, CutAnywhereGivesWhatWasWhole) {
  for (int round = 0; round < 2; ++round) {
    const Contents contents = writeRandom(folder_ / "a.mcap", random_);
    const std::string whole = contentsOf(folder_ / "a.mcap");
    for (int cut = 0; cut < 100; ++cut) {
      const std::size_t size = kMagic.size() + random_() % (whole.size() - kMagic.size());
      Reader reader(put(whole.substr(0, size)));
      EXPECT_FALSE(reader.finished());
      EXPECT_FALSE(reader.damage().empty());
      const std::vector<Row> rows = rowsOf(reader);
      ASSERT_LE(rows.size(), contents.rows.size());
      EXPECT_TRUE(std::equal(rows.begin(), rows.end(), contents.rows.begin()));
      std::size_t flushed = 0;
      for (const auto& [end, messages] : contents.at)
        flushed = end <= size ? messages : flushed;
      EXPECT_GE(rows.size(), flushed) << "cut at " << size;
    }
  }
}

TEST_F(Mcap, FlippedBitsAreNoticedAndNeverBecomeMessages) {
  int noticed = 0;
  for (int round = 0; round < 100; ++round) {
    const Contents contents = writeRandom(folder_ / "a.mcap", random_);
    std::string bytes = contentsOf(folder_ / "a.mcap");
    for (std::uint64_t flips = 1 + random_() % 3; flips > 0; --flips) {
      char& byte = bytes[kMagic.size() + random_() % (bytes.size() - kMagic.size())];
      byte = static_cast<char>(byte ^ (1 << random_() % 8));
    }
    Reader reader(put(bytes), Reader::Open::kScan);
    std::size_t begin = 0;
    for (const Row& row : rowsOf(reader)) {
      const auto found = std::find(contents.rows.begin() + static_cast<long>(begin), contents.rows.end(), row);
      ASSERT_NE(found, contents.rows.end()) << "a message that nobody wrote, or in another order";
      begin = static_cast<std::size_t>(found - contents.rows.begin()) + 1;
    }
    noticed += !reader.damage().empty();
    Reader fast(put(bytes));
    EXPECT_LE(rowsOf(fast).size(), contents.rows.size());
  }
  EXPECT_GT(noticed, 80);  // the rest is in the summary, which a scan does not read
}

TEST_F(Mcap, AChunkThatClaimsMoreThanItsBytesCanHoldIsLeftOut) {
  {
    Writer writer(folder_ / "a.mcap", {.level = 1});
    writer.write({writer.addChannel("/a", writer.addSchema("p/msg/A", "ros2msg", "")), 0, 1000, 0, "data"});
  }
  std::string bytes = contentsOf(folder_ / "a.mcap");
  const std::size_t chunk = bytes.find(std::string("\x04\0\0\0zstd", 8));
  ASSERT_NE(chunk, std::string::npos);
  const std::uint64_t claim = 1u << 30;  // the size is in front of the checksum and the compression
  std::memcpy(bytes.data() + chunk - 12, &claim, sizeof claim);
  Reader reader(put(bytes), Reader::Open::kScan);
  EXPECT_TRUE(rowsOf(reader).empty());
  ASSERT_FALSE(reader.damage().empty());
  EXPECT_NE(reader.damage().front().find("found a chunk of 1073741824 bytes in "), std::string::npos)
      << reader.damage().front();
}

TEST_F(Mcap, AMessageOutsideOfTheTimesInTheIndexIsLeftOutAndReported) {
  {
    Writer writer(folder_ / "a.mcap", {.level = 0});
    const auto channel = writer.addChannel("/a", writer.addSchema("p/msg/A", "ros2msg", ""));
    for (std::uint32_t i = 0; i < 3; ++i)
      writer.write({channel, i, 1000 + i, 0, "data"});
  }
  std::string bytes = contentsOf(folder_ / "a.mcap");
  const std::uint64_t times[2] = {1000, 1002}, late = 1001;
  const std::string_view pair(reinterpret_cast<const char*>(times), sizeof times);
  std::size_t index = bytes.size();
  do
    index = bytes.rfind(pair, index - 1);
  while (index != std::string::npos && bytes[index - kRecordHead] != static_cast<char>(Opcode::kChunkIndex));
  ASSERT_NE(index, std::string::npos);
  std::memcpy(bytes.data() + index, &late, sizeof late);
  std::memset(bytes.data() + bytes.size() - kMagic.size() - 4, 0, 4);  // no checksum of the summary
  Reader reader(put(bytes));
  const std::vector<Row> rows = rowsOf(reader);
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(std::get<2>(rows.front()), 1001u);
  ASSERT_EQ(reader.damage().size(), 1u);
  EXPECT_NE(reader.damage().front().find("outside of the times in the index of its chunk"), std::string::npos);
  EXPECT_EQ(rowsOf(*std::make_unique<Reader>(folder_ / "copy.mcap", Reader::Open::kScan)).size(), 3u);
}

TEST_F(Mcap, OtherFilesAreRefusedWithTheirName) {
  for (const std::string bytes : {"", "MCAP", "some text that is long enough to be a file"}) {
    try {
      Reader reader(put(bytes));
      FAIL() << "'" << bytes << "' was taken";
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("copy.mcap: is no MCAP file"), std::string::npos) << error.what();
    }
  }
  EXPECT_THROW(Reader(folder_ / "none.mcap"), Error);
  EXPECT_THROW(Reader{folder_}, Error);
  EXPECT_THROW(Writer(folder_ / "no" / "such.mcap"), std::system_error);
}

TEST_F(Mcap, AFullDiskLeavesAReadableFile) {
  // A file size limit makes a write fail in the same way, anywhere in a record.
  signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  for (int round = 0; round < 30; ++round) {
    const rlimit small{2000 + random_() % 20000, before.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
    std::size_t written = 0, failures = 0;
    Writer writer(folder_ / "full.mcap", {.chunk_size = 1000, .level = 0});
    const auto channel = writer.addChannel("/a", writer.addSchema("p/msg/A", "ros2msg", "uint8 x"));
    const std::string data(100, 'x');
    for (std::uint32_t i = 0; i < 500; ++i, ++written) {
      try {
        writer.write({channel, i, i, i, data});
      } catch (const std::system_error& error) {
        EXPECT_NE(std::string(error.what()).find("full.mcap"), std::string::npos);
        ++failures;
      }
    }
    EXPECT_GT(failures, 0u);
    try {
      writer.close();
    } catch (const std::system_error&) {
      // The rest fits or not, depending on the limit.
    }
    setrlimit(RLIMIT_FSIZE, &before);
    EXPECT_EQ(writer.lost() + writer.statistics().messages, written);
    Reader reader(folder_ / "full.mcap", Reader::Open::kScan);
    EXPECT_EQ(rowsOf(reader).size(), writer.statistics().messages);
    EXPECT_LE(reader.damage().size(), 1u) << "at most that it is not finished";
  }
}

}  // namespace
}  // namespace tandem::recording::test
