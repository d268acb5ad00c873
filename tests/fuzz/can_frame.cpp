// SPDX-License-Identifier: Apache-2.0
/** @file Packets of a CAN socket: what decodes is encoded to a packet that decodes to the same frame, emergencies
 * likewise. */
#include "hal/can/detail/kernel_frame.h"
#include "hal/canopen/emcy.h"
#include "tests/fuzz/harness.h"

using namespace tandem::hal;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  canfd_frame packet{};
  std::memcpy(&packet, data, std::min(size, sizeof packet));
  can::CanFrame frame, again;
  if (!can::decodeFrame(packet, size, frame))
    return 0;
  tandem::fuzz::expect(can::lengthIsValid(frame), "a decoded frame has a valid length");
  tandem::fuzz::expect(frame.payload().size() <= frame.length, "the payload is inside the frame");
  canfd_frame written{};
  const std::size_t length = can::encodeFrame(frame, written);
  tandem::fuzz::expect(length == size, "a frame is encoded with the length of its packet");
  tandem::fuzz::expect(can::decodeFrame(written, length, again) && can::sameOnWire(frame, again),
                       "a frame is encoded as it was decoded");
  tandem::fuzz::expect(std::equal(packet.data, packet.data + frame.length, written.data),
                       "data are those of the packet");
  tandem::fuzz::expect(!frame.fd || written.flags == (packet.flags & (CANFD_BRS | CANFD_ESI)),
                       "flags are those of the packet");
  tandem::fuzz::expect((written.can_id & ~packet.can_id) == 0, "the identifier is that of the packet");
  if (const auto emergency = canopen::parseEmcy(frame)) {
    const can::CanFrame message = canopen::emcyFrame(frame.id, *emergency);
    tandem::fuzz::expect(std::equal(message.data.begin(), message.data.begin() + 8, frame.data.begin()),
                         "an emergency is encoded as it was decoded");
    tandem::fuzz::expect(canopen::describeErrorCode(emergency->code).size() > 4, "every error code has a text");
  }
  return 0;
}
