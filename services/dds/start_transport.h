// SPDX-License-Identifier: Apache-2.0
/** @file Private: UDP transport that sends nothing before its participant can receive. */
#pragma once

#include <fastdds/rtps/transport/ChainingTransportDescriptor.h>

#include <atomic>
#include <memory>

namespace tandem::dds::detail {

/** Sends nothing until open() is called.
 *
 * Fast DDS 2.9 sends the first announcement of a participant before it registers its receivers
 * (RTPSParticipantImpl::enable()). Others reply to an announcement once, so replies that arrive in between are lost,
 * and the new participant discovers these participants only at their next periodic announcement. Replies to its later
 * initial announcements, which this transport sends, arrive when it can receive. */
class StartTransportDescriptor final : public eprosima::fastdds::rtps::ChainingTransportDescriptor {
 public:
  explicit StartTransportDescriptor(std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> below);

  /// Enables sending; called after the participant has been created.
  void open() { *open_ = true; }

  eprosima::fastdds::rtps::TransportInterface* create_transport() const override;

 private:
  std::shared_ptr<std::atomic<bool>> open_ = std::make_shared<std::atomic<bool>>(false);
};

}  // namespace tandem::dds::detail
