// SPDX-License-Identifier: Apache-2.0
/** @file Allocation-free construction of collision bodies (capsule chains). */
#pragma once

#include "kinematics/clearance.h"

namespace tandem::kinematics {

/** makeBody() without allocation after construction, for models whose backbone() allocates nothing, and reserved
 * bodies. Not thread-safe. */
class BodyBuilder {
 public:
  /// Largest number of nodes of a body.
  static constexpr std::size_t kMostNodes = kMaxBodySections * Body::kPieces + 1;

  BodyBuilder() { s_.reserve(kMostNodes); }
  /// Reserves memory for the body of any arm.
  static void reserve(Body& body);

  ModelStatus make(const ArmModel& model, const JointsRef& q, Branch& branch, bool derivatives, Body& body);

 private:
  std::vector<double> s_;  ///< of the nodes
};

}  // namespace tandem::kinematics
