// SPDX-License-Identifier: Apache-2.0
#include "services/recordings/message_upgrader.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "recording/writer.h"
#include "services/dds/definitions.h"
#include "services/dds/raw.h"

namespace tandem::recordings {
namespace {

/** One message of a type, in a file whose schema says what it is given. */
class MessageUpgraderTest : public testing::Test {
 protected:
  ~MessageUpgraderTest() override { std::filesystem::remove(file_); }
  void write(const std::string& type, const std::string& definition, const std::string& bytes) {
    recording::Writer writer(file_);
    writer.write({writer.addChannel("/r/topic", writer.addSchema(type, "ros2msg", definition), {}), 1, 5, 5, bytes});
    writer.close();
    reader_.emplace(file_);
    upgrader_.emplace(*reader_);
  }
  const recording::Channel& channel() { return reader_->channels().begin()->second; }

  std::filesystem::path file_ =
      std::filesystem::temp_directory_path() / ("tandem-today-" + std::to_string(getpid()) + ".mcap");
  std::optional<recording::Reader> reader_;
  std::optional<MessageUpgrader> upgrader_;
  const std::string type_ = "tandem_msgs/msg/Reply", definition_ = dds::messageDefinition(type_);
};

/// The definition with another text in place of one line.
std::string with(std::string definition, const std::string& line, const std::string& instead) {
  const auto at = definition.find("\n" + line) + 1;
  return definition.replace(at, definition.find('\n', at) - at, instead);
}

TEST_F(MessageUpgraderTest, WhatIsTheSameStaysTheSameBytes) {
  const std::string bytes = dds::encode(dds::Reply{.client = 3, .reason = "why"}) + "padding";
  for (const std::string& definition : {definition_, "uint8 OK=0\n# of old\n" + definition_}) {
    write(type_, definition, bytes);
    EXPECT_EQ(upgrader_->changes(channel()), "");
    EXPECT_EQ((*upgrader_)(channel(), bytes), bytes);
  }
  write("somebody/msg/Else", "uint8 x", "anything");
  EXPECT_EQ((*upgrader_)(channel(), "anything"), "anything");
}

TEST_F(MessageUpgraderTest, WhatHasChangedIsConvertedThereAndBack) {
  write(type_, with(definition_, "uint16 code", "uint8 gone"), "");
  EXPECT_EQ(upgrader_->changes(channel()),
            "members missing in the recording: code: set to 0 or empty; members that no longer exist: gone: left out");
  // client, request, accepted, gone, padding, "why", padding, value.
  const std::string then{"\0\1\0\0\3\0\0\0\0\0\0\0\4\0\0\0\0\0\0\0\1\7\0\0\4\0\0\0why\0\5\0\0\0", 36};
  const auto bytes = (*upgrader_)(channel(), then);
  ASSERT_TRUE(bytes);
  const auto reply = dds::decode<dds::Reply>(*bytes);
  ASSERT_TRUE(reply);
  EXPECT_EQ(std::tie(reply->client, reply->request, reply->accepted, reply->code, reply->reason, reply->value),
            std::tuple(3u, 4u, 1, 0, "why", 5u));
  std::string back = then;
  back[21] = 0;
  EXPECT_EQ(upgrader_->back(channel(), *bytes), back);
  EXPECT_FALSE((*upgrader_)(channel(), then.substr(0, 30)));
}

TEST_F(MessageUpgraderTest, AnotherTypeIsRefusedWithBoth) {
  write(type_, with(definition_, "uint32 value", "float64 value"), "");
  try {
    (*upgrader_)(channel(), "");
    FAIL();
  } catch (const recording::Error& error) {
    EXPECT_EQ(error.what(), file_.string() +
                                ": /r/topic: the definition of tandem_msgs/msg/Reply has changed and cannot be "
                                "converted: value: float64 before, uint32 after; tandem export and tandem "
                                "plot can read it");
  }
}

}  // namespace
}  // namespace tandem::recordings
