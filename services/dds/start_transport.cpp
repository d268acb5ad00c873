// SPDX-License-Identifier: Apache-2.0
#include "services/dds/start_transport.h"

#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastrtps/rtps/network/SenderResource.h>

#include <utility>

namespace tandem::dds::detail {
namespace {

namespace rtps = eprosima::fastdds::rtps;

class StartTransport final : public rtps::ChainingTransport {
 public:
  using Resource = eprosima::fastrtps::rtps::SenderResource;
  using Octet = eprosima::fastrtps::rtps::octet;
  using Locators = eprosima::fastrtps::rtps::LocatorsIterator;
  using Locator = eprosima::fastrtps::rtps::Locator_t;

  StartTransport(const rtps::ChainingTransportDescriptor& descriptor, std::shared_ptr<const std::atomic<bool>> open)
      : ChainingTransport(descriptor), open_(std::move(open)) {}

  rtps::TransportDescriptorInterface* get_configuration() override { return low_level_transport_->get_configuration(); }

  bool send(Resource* below,
            const Octet* buffer,
            std::uint32_t size,
            Locators* begin,
            Locators* end,
            const std::chrono::steady_clock::time_point& timeout) override {
    return !*open_ || below->send(buffer, size, begin, end, timeout);
  }

  void receive(rtps::TransportReceiverInterface* next,
               const Octet* buffer,
               std::uint32_t size,
               const Locator& local,
               const Locator& remote) override {
    next->OnDataReceived(buffer, size, local, remote);
  }

 private:
  std::shared_ptr<const std::atomic<bool>> open_;
};

}  // namespace

StartTransportDescriptor::StartTransportDescriptor(std::shared_ptr<rtps::TransportDescriptorInterface> below)
    : ChainingTransportDescriptor(std::move(below)) {}

rtps::TransportInterface* StartTransportDescriptor::create_transport() const {
  return new StartTransport(*this, open_);
}

}  // namespace tandem::dds::detail
