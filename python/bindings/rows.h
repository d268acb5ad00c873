// SPDX-License-Identifier: Apache-2.0
/** @file Conversion of numpy arrays to joint vectors and back: one or many rows, without copies, on all cores. */
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "kinematics/arm_model.h"

namespace tandem::python {

namespace py = pybind11;

/// Contiguous float64; other arrays and lists are converted.
using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;

/** A kinematic model has no solution for the given joints: tandem.ModelError. */
class ModelError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/** One joint vector, shape (size,), or many, shape (N, size). */
class Rows {
 public:
  /// @throw py::value_error with the shape found and the one expected.
  Rows(const Array& array, int size, const std::string& name);

  std::size_t count() const { return count_; }
  Eigen::Map<const Eigen::VectorXd> operator[](std::size_t row) const {
    return {data_ + row * static_cast<std::size_t>(size_), size_};
  }
  /// A new array of one result per row: shape `one`, or (N, *one).
  Array answers(std::vector<py::ssize_t> one) const;

 private:
  Array array_;  ///< owns the data
  const double* data_;
  int size_;
  std::size_t count_;
  bool single_;
};

/** Handling of rows for which a model has no solution. */
enum class OnError {
  kRaise,  ///< ModelError names the first such row
  kNan,    ///< their results are NaN
};
/// "raise" or "nan". @throw py::value_error
OnError onErrorFromName(const std::string& name);

/** Computes rows on `threads` threads (0: one per core) without the GIL.
 * @param row  writes the result of a row, or NaN into all of it; called concurrently
 * @throw ModelError according to on_error; any exception of `row` */
void answerRows(std::size_t count,
                int threads,
                OnError on_error,
                const std::function<kinematics::ModelStatus(std::size_t row)>& row);

}  // namespace tandem::python
