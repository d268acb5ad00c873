// SPDX-License-Identifier: Apache-2.0
/** @file Lines of the log for requests: each with its client, repeated ones once. */
#include "services/control/request_log.h"

#include <gtest/gtest.h>

#include "idl/enumerations.h"

namespace tandem::control_service {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

dds::ControlRequest requestOf(dds::ControlKind kind, const std::string& text = "", const std::string& value = "") {
  dds::ControlRequest request{};
  request.client = 0xabcd1f3a;
  request.kind = static_cast<std::uint8_t>(kind);
  request.arm = dds::kAllArms;
  request.text = text;
  request.value = value;
  return request;
}

TEST(RequestsInTheLog, SayWhatIsAskedFor) {
  const std::vector<std::string> arms{"arm_a", "left"};
  auto request = requestOf(dds::ControlKind::kStateCommand, "", "pause");
  EXPECT_EQ(describeRequest(request, arms), "pause");
  request.arm = 0;
  EXPECT_EQ(describeRequest(request, arms), "pause of arm A");
  request.arm = 1;
  EXPECT_EQ(describeRequest(request, arms), "pause of arm LEFT");
  request.arm = 7;
  EXPECT_EQ(describeRequest(request, arms), "pause");
  EXPECT_EQ(describeRequest(requestOf(dds::ControlKind::kSetMethod, "nspqp"), arms), "method nspqp");
  EXPECT_EQ(describeRequest(requestOf(dds::ControlKind::kSetParameter, "tip_gain", "3"), arms), "tip_gain = 3");
  EXPECT_EQ(describeRequest(requestOf(dds::ControlKind::kAcquireLease), arms), "acquire lease");
  EXPECT_EQ(describeRequest(requestOf(dds::ControlKind::kKeepLease), arms), "");
  EXPECT_LT(describeRequest(requestOf(dds::ControlKind::kSetMethod, std::string(10'000, 'x')), arms).size(), 200u);
}

TEST(RequestsInTheLog, NameTheClientAndMentionRepeatedOnesOnce) {
  RequestLog log({"arm_a", "arm_b"});
  const auto disable = requestOf(dds::ControlKind::kStateCommand, "", "disable");
  EXPECT_EQ(log.line(disable, std::nullopt, 0), "request: disable, by client 1f3a");
  dds::Identity identity{};
  identity.process = "cli";
  identity.pid = 12;
  identity.host = "robot-pc";
  EXPECT_EQ(log.line(disable, identity, 0), "request: disable, by tandem-cli (pid 12 on robot-pc)");
  EXPECT_EQ(log.line(requestOf(dds::ControlKind::kKeepLease), identity, 0), "");
  int mentioned = 0;
  for (std::int64_t time = 0; time < 10 * kSecond; time += kSecond / 10)
    mentioned += log.line(requestOf(dds::ControlKind::kJog), std::nullopt, time).empty() ? 0 : 1;
  EXPECT_EQ(mentioned, 1);
  EXPECT_NE(log.line(requestOf(dds::ControlKind::kJog), std::nullopt, 20 * kSecond), "");
  for (int client = 0; client < 1000; ++client) {  // memory stays bounded, and each is mentioned
    auto jog = requestOf(dds::ControlKind::kJog);
    jog.client = static_cast<std::uint64_t>(client);
    EXPECT_NE(log.line(jog, std::nullopt, 30 * kSecond), "");
  }
}

}  // namespace
}  // namespace tandem::control_service
