// SPDX-License-Identifier: Apache-2.0
/** @file Tables as named matrices, for MATLAB and HDF5 files. */
#pragma once

#include <limits>
#include <string>
#include <variant>
#include <vector>

#include "recording/export.h"

namespace tandem::recording {

/** Rows times columns, row by row. */
template <class T>
struct Matrix {
  std::size_t rows = 0, columns = 1;
  std::vector<T> values;
};

/** A matrix with a name that every program takes, and the one that it had. */
struct NamedMatrix {
  std::string name, original;
  std::variant<Matrix<double>, Matrix<std::int64_t>, Matrix<std::uint64_t>, Matrix<std::string>> matrix;
};

/** A struct or group. */
struct NamedMatrices {
  std::string name, original;
  std::vector<NamedMatrix> members;
};

/// All tables. Cells shorter than the widest one of their column are filled up with NaN, 0 or empty texts.
std::vector<NamedMatrices> matricesOf(const ExportSet& set);

}  // namespace tandem::recording
