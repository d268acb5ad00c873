// SPDX-License-Identifier: Apache-2.0
// Process end: no writer blocks on samples that a reader has not acknowledged.
#include <cstdio>
#include <cstdlib>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <future>

#include "services/dds/participant_detail.h"
#include "services/dds/wire_detail.h"
#include "support.h"

namespace tandem::dds {
namespace {

/// Creates and deletes writers that send a heartbeat every 20 us while a reader has unacknowledged samples.
void makeAndDelete(const BusOptions& options, int times) {
  detail::Participant participant(options);
  const detail::fast::TypeSupport type(new GuardedSupport<ControlRequest>);
  auto* topic = participant.topic(ddsTopicName(options.prefix, kControlRequest.name), type);
  auto qos = detail::writerQos(kControlRequest.profile, options, type->is_plain());
  qos.reliable_writer_qos().times.heartbeatPeriod = eprosima::fastrtps::Duration_t(0, 20'000);
  Sample<ControlRequest> sample;
  void* const data = static_cast<Wire<ControlRequest>::Generated*>(&sample);
  for (int i = 0; i < times; ++i) {
    auto* writer = participant.publisher()->create_datawriter(topic, qos);
    detail::fast::PublicationMatchedStatus status;
    repeatUntil([&] { return status.current_count > 0; }, [&] { writer->get_publication_matched_status(status); });
    for (int k = 0; k < 50; ++k)
      writer->write(data);
    participant.remove(writer);
  }
}

TEST(Ending, WritersCanBeDeletedDuringHeartbeats) {
  BusOptions options = testOptions();
  Bus there(options);
  Reader reader = there.reader(kControlRequest, [](const ControlRequest&) {});
  std::packaged_task<void()> task([&] { makeAndDelete(options, 200); });
  std::future<void> done = task.get_future();
  std::thread worker(std::move(task));
  if (done.wait_for(3 * kDeadline) != std::future_status::ready) {
    std::fputs("a writer is still being deleted\n", stderr);
    std::_Exit(1);  // nothing ends that thread
  }
  worker.join();
}

}  // namespace
}  // namespace tandem::dds
