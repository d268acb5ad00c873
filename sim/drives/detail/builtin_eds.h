// SPDX-License-Identifier: Apache-2.0
/** @file EDS files compiled into the program. */
#pragma once

#include <string_view>

namespace tandem::sim::drives {

extern const std::string_view kDriveEds;
extern const std::string_view kEncoderEds;

}  // namespace tandem::sim::drives
