// SPDX-License-Identifier: Apache-2.0
/** @file Tables as named matrices, for MATLAB and HDF5 files. */
#pragma once

#include <limits>
#include <string>
#include <variant>
#include <vector>

#include "recording/export.h"

namespace tandem::recording {

/** Matrix, stored by rows. */
template <class T>
struct Matrix {
  std::size_t rows = 0, columns = 1;
  std::vector<T> values;
};

/** A matrix with a name that is valid in all formats, and its original name. */
struct NamedMatrix {
  std::string name, original;
  std::variant<Matrix<double>, Matrix<std::int64_t>, Matrix<std::uint64_t>, Matrix<std::string>> matrix;
};

/** A struct (MATLAB) or group (HDF5). */
struct NamedMatrices {
  std::string name, original;
  std::vector<NamedMatrix> members;
};

/// Converts all tables. Cells shorter than the widest one of their column are padded with NaN, 0 or empty texts.
std::vector<NamedMatrices> matricesOf(const ExportSet& set);

}  // namespace tandem::recording
