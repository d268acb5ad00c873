// SPDX-License-Identifier: Apache-2.0
#include "kinematics/segmentation.h"

#include <algorithm>

namespace tandem::kinematics {
namespace {

struct Boundary {
  double s;
  int tube;
  int next;  ///< next section of the tube, kAbsent at the tube's end
};

/// Order along the backbone; outer tubes first if ends coincide, so that tube 1's end is the last.
bool before(const Boundary& left, const Boundary& right) {
  return left.s < right.s || (left.s == right.s && left.tube > right.tube);
}

}  // namespace

ModelStatus checkJoints(const ConcentricTubeArm& arm, const JointsRef& q) noexcept {
  const int n = arm.tubeCount();
  if (q.size() != 2 * n)
    return ModelStatus::kWrongSize;
  if (!q.allFinite())
    return ModelStatus::kNotFinite;
  double inner_end = 0.0;
  for (int i = 0; i < n; ++i) {
    if (q[i] > arm.tolerance)
      return ModelStatus::kProtruded;
    const double end = q[i] + arm.tubes[i].length();
    if (i == 0 && end <= 0.0)
      return ModelStatus::kNotExtended;
    if (i > 0 && end > std::max(0.0, inner_end) + arm.tolerance)
      return ModelStatus::kInnerInside;
    inner_end = end;
  }
  return ModelStatus::kOk;
}

void segment(const ConcentricTubeArm& arm, const JointsRef& q, Segmentation& result) noexcept {
  const int n = arm.tubeCount();
  std::array<int, kMaxTubes> section{};
  std::array<Boundary, Segmentation::kMaxIntervals> boundary;
  int boundaries = 0;
  double inner_end = 0.0;
  for (int i = 0; i < n; ++i) {
    const auto& sections = arm.tubes[i].sections;
    const int last = static_cast<int>(sections.size()) - 1;
    double end = q[i];
    section[i] = Segmentation::kAbsent;
    for (int k = 0; k <= last; ++k) {
      end += sections[k].length;
      if (i > 0 && k == last)
        end = std::min(end, inner_end);  // within the tolerance: the outer tube ends first
      if (end <= 0.0)
        continue;
      if (section[i] == Segmentation::kAbsent)
        section[i] = k;
      boundary[boundaries++] = {end, i, k == last ? Segmentation::kAbsent : k + 1};
    }
    inner_end = end;
  }
  std::sort(boundary.begin(), boundary.begin() + boundaries, before);
  result.count = 0;
  double start = 0.0;
  for (int k = 0; k < boundaries; ++k) {
    result.interval[result.count++] = {start, boundary[k].s, boundary[k].tube, section};
    section[boundary[k].tube] = boundary[k].next;
    start = boundary[k].s;
    if (boundary[k].tube == 0 && boundary[k].next == Segmentation::kAbsent)
      break;
  }
}

TubeVector untwistedEnds(const ConcentricTubeArm& arm, const Segmentation& parts, const JointsRef& q) noexcept {
  TubeVector ends = TubeJoints(q).alpha;
  for (int i = 0; i < arm.tubeCount(); ++i) {
    const Tube& tube = arm.tubes[i];
    if (!tube.isHelical())
      continue;
    double along = tube.length();
    for (int k = 0; k < parts.count; ++k) {
      if (parts.interval[k].section[i] != Segmentation::kAbsent)
        along = parts.interval[k].end - q[i];  // less where its end is cut off
    }
    ends[i] += tube.helixAngle(along);
  }
  return ends;
}

}  // namespace tandem::kinematics
