// SPDX-License-Identifier: Apache-2.0
/** @file CDR of every message type: "TYPE\n" and the bytes of a sample. What decodes is well-formed, is encoded to
 * bytes that decode to the same message, and fits the type's definition in recordings. */
#include "recording/table.h"
#include "services/dds/definitions.h"
#include "services/dds/raw.h"
#include "services/dds/validate.h"
#include "services/dds/wire_detail.h"
#include "tests/fuzz/harness.h"

using namespace tandem;
using fuzz::expect;

namespace {

template <class M>
void check(std::string_view bytes) {
  const auto message = dds::decode<M>(bytes);
  if (!message)
    return;
  expect(dds::malformed(*message) == nullptr, "what decodes is well-formed", M::kType);
  const std::string encoded = dds::encode(*message);
  const auto again = dds::decode<M>(encoded);
  expect(again.has_value(), "what was encoded decodes", M::kType);
  expect(dds::encode(*again) == encoded, "a message is encoded as it was decoded", M::kType);
  // An empty text may lack the zero at its end: 4 bytes that are encoded to 8.
  expect(encoded.size() <= 2 * bytes.size() + 16, "a message holds no more than its bytes", M::kType);
  static const recording::Definition definition =
      recording::parseDefinition(M::kType, dds::messageDefinition(M::kType));
  expect(recording::fits(definition, encoded), "an encoded message fits the definition of its type", M::kType);
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  const std::string_view type = input.upTo('\n');
#define TANDEM_CHECK(M) \
  if (type == M::kType) \
    check<M>(input.rest());
  using namespace dds;
  TANDEM_EACH_MESSAGE(TANDEM_CHECK)
#undef TANDEM_CHECK
  return 0;
}
