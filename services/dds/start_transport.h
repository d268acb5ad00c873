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
 * (RTPSParticipantImpl::enable()). Others answer an announcement once, so the answers that come in between are lost,
 * and the newcomer knows these participants only after their next periodic announcement. The later initial
 * announcements of the newcomer, which this transport lets pass, are answered when it can receive. */
class StartTransportDescriptor final : public eprosima::fastdds::rtps::ChainingTransportDescriptor {
 public:
  explicit StartTransportDescriptor(std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> below);

  /// The participant has been created.
  void open() { *open_ = true; }

  eprosima::fastdds::rtps::TransportInterface* create_transport() const override;

 private:
  std::shared_ptr<std::atomic<bool>> open_ = std::make_shared<std::atomic<bool>>(false);
};

}  // namespace tandem::dds::detail
