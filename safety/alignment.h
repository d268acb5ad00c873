// SPDX-License-Identifier: Apache-2.0
/** @file Link error for objects in which Eigen aligns its types differently. */
#pragma once

#include <Eigen/Core>

namespace tandem::safety {

/** Compiler flags such as -march=native change the alignment of Eigen's fixed-size types, and with it the layout of
 * most types here. Objects compiled with different flags must not be linked, nor loaded, together: they would crash.
 * Every object refers to the constant of its own alignment, and the library `safety` defines that of its own. */
template <int kBytes>
struct EigenAlignedTo {
  static const char kEverywhere;
};
template <>
const char EigenAlignedTo<EIGEN_MAX_ALIGN_BYTES>::kEverywhere;

[[gnu::used]] static const char* const kSameAlignment = &EigenAlignedTo<EIGEN_MAX_ALIGN_BYTES>::kEverywhere;

}  // namespace tandem::safety
