// SPDX-License-Identifier: Apache-2.0
/* A participant without credentials, with a reliable writer on one topic that readers accept. Prints its GUID prefix
 * and its entity id in hexadecimal digits once it has readers: the data needed to forge RTPS control messages. Ends
 * when its standard input closes.
 *
 *   gap_peer DOMAIN PREFIX TOPIC READERS
 */
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <thread>

#include "services/dds/participant_detail.h"
#include "services/dds/wire_detail.h"

namespace tandem::dds {
namespace {

namespace fast = eprosima::fastdds::dds;

/// Creates a writer of the topic of that name. @return null if there is no such topic
fast::DataWriter* writerOf(detail::Participant& participant, const std::string& name) {
  fast::DataWriter* writer = nullptr;
  forEachTopic([&]<class M>(const Topic<M>& topic) {
    if (topic.per_arm || topic.name != name)
      return;
    const fast::TypeSupport type(new GuardedSupport<M>);
    auto qos = detail::writerQos(topic.profile, participant.options(), type->is_plain());
    qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
    writer = participant.publisher()->create_datawriter(
        participant.topic(ddsTopicName(participant.options().prefix, name), type), qos);
  });
  return writer;
}

int run(char** argv) {
  BusOptions options;
  options.name = "gap";
  options.domain = std::atoi(argv[1]);
  options.prefix = argv[2];
  detail::Participant participant(options);
  fast::DataWriter* const writer = writerOf(participant, argv[3]);
  if (writer == nullptr)
    return 2;
  fast::PublicationMatchedStatus status;
  while (writer->get_publication_matched_status(status), status.current_count < std::atoi(argv[4]))
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  const auto& guid = writer->guid();
  for (const auto byte : guid.guidPrefix.value)
    std::printf("%02x", byte);
  std::printf(" ");
  for (const auto byte : guid.entityId.value)
    std::printf("%02x", byte);
  std::printf("\n");
  std::fflush(stdout);
  char none;
  while (::read(STDIN_FILENO, &none, 1) > 0) {
  }
  return 0;
}

}  // namespace
}  // namespace tandem::dds

int main(int argc, char** argv) {
  try {
    return argc == 5 ? tandem::dds::run(argv) : 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "gap_peer: %s\n", error.what());
    return 1;
  }
}
