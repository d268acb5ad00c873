// SPDX-License-Identifier: Apache-2.0
/** @file Cancellable Ipopt problem. */
#pragma once

#include <IpTNLP.hpp>

#include <functional>

namespace tandem::planning {

/** Checks for cancellation between Ipopt's iterations; a cancelled problem ends with User_Requested_Stop. */
class CancellableNlp : public Ipopt::TNLP {
 public:
  /// @param cancelled  outlives this; empty: never cancelled
  explicit CancellableNlp(const std::function<bool()>& cancelled) : cancelled_(cancelled) {}

  bool wasCancelled() const { return was_cancelled_; }

  bool intermediate_callback(Ipopt::AlgorithmMode,
                             Ipopt::Index,
                             Ipopt::Number,
                             Ipopt::Number,
                             Ipopt::Number,
                             Ipopt::Number,
                             Ipopt::Number,
                             Ipopt::Number,
                             Ipopt::Number,
                             Ipopt::Number,
                             Ipopt::Index,
                             const Ipopt::IpoptData*,
                             Ipopt::IpoptCalculatedQuantities*) final {
    was_cancelled_ = cancelled_ && cancelled_();
    return !was_cancelled_;
  }

 private:
  const std::function<bool()>& cancelled_;
  bool was_cancelled_ = false;
};

}  // namespace tandem::planning
