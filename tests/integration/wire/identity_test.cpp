// SPDX-License-Identifier: Apache-2.0
// Accepted messages: those of processes with the same robot, whatever the clock of their host.
#include <atomic>
#include <fastdds/dds/publisher/DataWriter.hpp>

#include "services/dds/participant_detail.h"
#include "services/dds/wire_detail.h"
#include "support.h"

namespace tandem::dds {
namespace {

BusOptions knowing(std::uint64_t fingerprint, const std::string& process) {
  BusOptions options = testOptions();
  options.identity.fingerprint = fingerprint;
  options.identity.session = fingerprint + 1000;
  options.identity.process = process;
  return options;
}

TEST(Identity, OnlyMessagesOfTheSameRobotCount) {
  Bus ours(knowing(1, "control")), alike(knowing(1, "sim")), other(knowing(2, "sim")), nobody(testOptions());
  Watched<std::vector<Mismatch>> met;
  ours.onMismatch([&](const Mismatch& m) { met.change([&](auto& all) { all.push_back(m); }); });
  std::atomic<int> states{0}, requests{0}, everything{0};
  Reader state_reader = ours.reader(kActuationState, [&](const ActuationState&) { ++states; });
  Reader request_reader = ours.reader(kControlRequest, [&](const ControlRequest&) { ++requests; });
  Reader any =
      nobody.reader(kActuationState, [&](const ActuationState& m) { everything += m.fingerprint == 2 ? 1 : 0; });
  auto foreign = other.writer(kActuationState);
  auto foreign_request = other.writer(kControlRequest);
  auto of_no_robot = nobody.writer(kActuationState);  // fingerprint 0
  ControlRequest request;
  request.client = 5;
  request.request = 6;
  request.fingerprint = 1;  // the message's own value has no effect: the bus sets it
  const auto reported = [&](auto holds) {
    const auto all = met.get();
    return std::any_of(all.begin(), all.end(), holds);
  };
  EXPECT_TRUE(repeatUntil(
      [&] {
        return everything > 3 && reported([](const Mismatch& m) { return m.client == 0 && m.fingerprint == 2; }) &&
               reported([](const Mismatch& m) { return m.client == 5 && m.request == 6; }) &&
               reported([](const Mismatch& m) { return m.fingerprint == 0; });
      },
      [&] {
        foreign.write({});
        foreign_request.write(request);
        of_no_robot.write({});
      }));
  EXPECT_EQ(states + requests, 0);
  auto same = alike.writer(kActuationState);
  EXPECT_TRUE(repeatUntil([&] { return states > 3; }, [&] { same.write({}); }));
}

TEST(Identity, WhoIsThereIsKnownAndForgottenWhenItLeaves) {
  Bus ours(knowing(1, "control"));
  auto other = std::make_unique<Bus>(knowing(2, "sim"));
  EXPECT_TRUE(repeatUntil([&] { return ours.others().size() == 1 && other->others().size() == 1; }, [] {}));
  EXPECT_EQ(ours.others().front().process, "sim");
  Bus late(knowing(3, "cli"));
  EXPECT_TRUE(repeatUntil([&] { return late.others().size() == 2; }, [] {})) << "who comes later learns of all";
  other.reset();
  EXPECT_TRUE(repeatUntil([&] { return late.others().size() == 1 && ours.others().size() == 1; }, [] {}));
  ASSERT_TRUE(ours.identityOf(1002));
  EXPECT_EQ(ours.identityOf(1002)->process, "sim") << "who it was is remembered";
  EXPECT_FALSE(ours.identityOf(77));
}

TEST(Identity, OnlySendersThatAreAdmittedCount) {
  BusOptions one = testOptions(), two = testOptions();
  one.name = "one";
  two.name = "two";
  Bus here(testOptions()), first(one), second(two);
  std::atomic<int> admitted{0}, all{0};
  ReaderOptions options;
  options.senders = {"nobody", "two"};
  Reader some = here.reader(
      kStateCommand, "arm_a", [&](const StringStamped& m) { admitted += m.string == "two" ? 1 : 1000; }, options);
  Reader any = here.reader(kStateCommand, "arm_a", [&](const StringStamped& m) { all += m.string == "one" ? 1 : 0; });
  auto from_one = first.writer(kStateCommand, "arm_a");
  auto from_two = second.writer(kStateCommand, "arm_a");
  StringStamped message;
  EXPECT_TRUE(repeatUntil([&] { return admitted > 3 && all > 3 && some.statistics().malformed > 3; },
                          [&] {
                            message.string = "one";
                            from_one.write(message);
                            message.string = "two";
                            from_two.write(message);
                          }));
  EXPECT_LT(admitted, 1000);
  EXPECT_NE(some.lastProblem().find("not in teleoperation.crtk.clients"), std::string::npos) << some.lastProblem();
}

/// Samples from a host whose wall clock is ten minutes behind: Fast DDS stamps samples with it.
TEST(Clocks, CommandsOfAHostWhoseClockIsBehindArrive) {
  BusOptions options = testOptions();
  options.command_age = 0.3;
  Bus here(options), there(options);
  std::atomic<int> received{0};
  Reader reader = there.reader(kActuationCommand, [&](const ActuationCommand&) { ++received; });
  detail::Participant& participant = *here.participant();
  const detail::fast::TypeSupport type(new GuardedSupport<ActuationCommand>);
  auto* topic = participant.topic(ddsTopicName(options.prefix, kActuationCommand.name), type);
  auto* writer = participant.publisher()->create_datawriter(
      topic, detail::writerQos(Profile::kCommand, options, type->is_plain()));
  ASSERT_NE(writer, nullptr);
  Sample<ActuationCommand> sample;
  void* const data = static_cast<Wire<ActuationCommand>::Generated*>(&sample);
  EXPECT_TRUE(repeatUntil([&] { return received > 3; },
                          [&] {
                            const auto now = std::chrono::system_clock::now() - std::chrono::minutes(10);
                            const auto s = std::chrono::duration_cast<std::chrono::seconds>(now.time_since_epoch());
                            writer->write_w_timestamp(
                                data, eprosima::fastrtps::rtps::InstanceHandle_t(),
                                eprosima::fastrtps::Time_t(static_cast<std::int32_t>(s.count()), 0));
                          }))
      << reader.lastProblem();
  participant.remove(writer);
}

}  // namespace
}  // namespace tandem::dds
