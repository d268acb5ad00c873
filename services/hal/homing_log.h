// SPDX-License-Identifier: Apache-2.0
/** @file Lines of the log for homing requests and measured positions of clients: who, which joints, and the result. */
#pragma once

#include <map>
#include <optional>
#include <string>

#include "services/hal/hal_core.h"

namespace tandem::hal_service {

/** Chooses what is logged of requests that are repeated while a homing run lasts: their beginning and their result.
 * On one thread. */
class HomingLog {
 public:
  struct Line {
    std::string text;  ///< runtime::requestLine() or refusalLine(); empty: nothing to log
    bool refused = false;
  };

  /// @param robot  outlives this
  explicit HomingLog(const config::Robot& robot) : robot_(robot) {}

  /// @param now  ns, monotonic @param who  identity of the client, if it is known
  Line answered(const HalAnswer& answer, const std::optional<dds::Identity>& who, std::int64_t now);
  /// To be called regularly: the line for a run whose client does not repeat its request any more.
  Line look(std::int64_t now);

 private:
  enum class Said { kNothing, kBegin, kDone };
  /** Requests of one client without a pause. */
  struct Run {
    std::optional<dds::Identity> who;
    std::string what;     ///< "home the drives of arm_a (beta_1, beta_2)"
    std::string refusal;  ///< the last one that was logged
    Said said = Said::kNothing;
    std::int64_t last = 0;  ///< ns, of the last request
  };

  std::string describe(const HalAnswer& answer) const;
  Line measured(const HalAnswer& answer, const std::optional<dds::Identity>& who) const;

  const config::Robot& robot_;
  std::map<std::uint64_t, Run> runs_;  ///< by client
};

}  // namespace tandem::hal_service
