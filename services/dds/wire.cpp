// SPDX-License-Identifier: Apache-2.0
#include <exception>

#include "services/dds/validate.h"
#include "services/dds/wire_detail.h"

namespace tandem::dds {

template <class M>
bool GuardedSupport<M>::deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) {
  auto* sample = static_cast<Sample<M>*>(static_cast<Generated*>(data));
  sample->decoded = false;
  if (payload->length > kMaxPayload) {
    return true;
  }
  try {
    sample->decoded = Wire<M>::Support::deserialize(payload, data);
  } catch (const std::exception&) {
    // Fast CDR throws on bytes that do not decode; the reader counts the sample as malformed.
    sample->decoded = false;
  }
  return true;
}

#define TANDEM_INSTANTIATE(M) template class GuardedSupport<M>;
TANDEM_EACH_MESSAGE(TANDEM_INSTANTIATE)
#undef TANDEM_INSTANTIATE

}  // namespace tandem::dds
