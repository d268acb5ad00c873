// SPDX-License-Identifier: Apache-2.0
#include "safety/alignment.h"

namespace tandem::safety {

template <>
const char EigenAlignedTo<EIGEN_MAX_ALIGN_BYTES>::kEverywhere = 0;

}  // namespace tandem::safety
