// SPDX-License-Identifier: Apache-2.0
/** @file Writers and readers of all processes, as discovery reports them. */
#pragma once

#include <string>

namespace tandem::dds {

/** A writer or reader of another participant. */
struct Endpoint {
  std::string topic;        ///< its name in ROS 2: "/tandem/control/status"
  std::string participant;  ///< its name
  bool writes = false;      ///< or reads
};

}  // namespace tandem::dds
