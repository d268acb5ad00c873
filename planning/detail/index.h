// SPDX-License-Identifier: Apache-2.0
/** @file Conversion of arm, task and point numbers to container indices. */
#pragma once

#include <cstddef>

namespace tandem::planning {

inline std::size_t at(int index) noexcept { return static_cast<std::size_t>(index); }

}  // namespace tandem::planning
