// SPDX-License-Identifier: Apache-2.0
#include "python/bindings/rows.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>

namespace tandem::python {
namespace {

constexpr std::size_t kBlock = 64;  // rows per work item of a thread

std::string shapeOf(const Array& array) {
  std::string text = "(";
  for (py::ssize_t i = 0; i < array.ndim(); ++i)
    text += std::to_string(array.shape(i)) + (i + 1 < array.ndim() ? ", " : array.ndim() == 1 ? ",)" : ")");
  return array.ndim() == 0 ? "()" : text;
}

/// The first failed row with its status, and the first exception.
struct RowError {
  std::mutex mutex;
  std::size_t row = std::numeric_limits<std::size_t>::max();
  kinematics::ModelStatus status = kinematics::ModelStatus::kOk;
  std::exception_ptr exception;
};

}  // namespace

Rows::Rows(const Array& array, int size, const std::string& name)
    : array_(array), data_(array_.data()), size_(size), single_(array.ndim() == 1) {
  if ((array.ndim() != 1 && array.ndim() != 2) || array.shape(array.ndim() - 1) != size) {
    const std::string n = std::to_string(size);
    throw py::value_error(name + ": found shape " + shapeOf(array) + ", expected (" + n + ",) or (N, " + n + ")");
  }
  count_ = single_ ? 1 : static_cast<std::size_t>(array.shape(0));
}

Array Rows::answers(std::vector<py::ssize_t> one) const {
  if (!single_)
    one.insert(one.begin(), static_cast<py::ssize_t>(count_));
  return Array(one);
}

OnError onErrorFromName(const std::string& name) {
  if (name == "raise")
    return OnError::kRaise;
  if (name == "nan")
    return OnError::kNan;
  throw py::value_error("errors: found '" + name + "', expected 'raise' or 'nan'");
}

void answerRows(std::size_t count,
                int threads,
                OnError on_error,
                const std::function<kinematics::ModelStatus(std::size_t)>& row) {
  if (threads < 0)
    throw py::value_error("threads: found " + std::to_string(threads) + ", expected 0 (one a core) or more");
  RowError error;
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    try {
      for (std::size_t begin = next.fetch_add(kBlock); begin < count; begin = next.fetch_add(kBlock)) {
        for (std::size_t i = begin; i < std::min(begin + kBlock, count); ++i) {
          const kinematics::ModelStatus status = row(i);
          if (status == kinematics::ModelStatus::kOk)
            continue;
          const std::lock_guard lock(error.mutex);
          if (i < error.row) {
            error.row = i;
            error.status = status;
          }
        }
      }
    } catch (...) {
      const std::lock_guard lock(error.mutex);
      error.exception = std::current_exception();
      next = count;
    }
  };
  {
    const py::gil_scoped_release released;
    const std::size_t cores = threads > 0 ? static_cast<std::size_t>(threads) : std::thread::hardware_concurrency();
    const std::size_t useful = std::min(std::max<std::size_t>(cores, 1), (count + kBlock - 1) / kBlock);
    std::vector<std::jthread> others;
    for (std::size_t i = 1; i < useful; ++i)
      others.emplace_back(work);
    work();
  }
  if (error.exception)
    std::rethrow_exception(error.exception);
  if (error.status != kinematics::ModelStatus::kOk && on_error == OnError::kRaise) {
    throw ModelError((count > 1 ? "row " + std::to_string(error.row) + ": " : "") +
                     std::string(kinematics::describe(error.status)));
  }
}

}  // namespace tandem::python
