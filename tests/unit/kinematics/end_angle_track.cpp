// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/kinematics/end_angle_track.h"

#include "kinematics/end_angle_sweep.h"

namespace tandem::test {

EndAngleTrack trackOf(const kinematics::ConcentricTubeArm& arm,
                      const Eigen::VectorXd& q,
                      const Eigen::VectorXd& theta) {
  kinematics::Segmentation parts;
  kinematics::segment(arm, q, parts);
  const Eigen::Index n = theta.size();
  kinematics::TubeVector ends = kinematics::TubeVector::Zero();
  ends.head(n) = theta;
  const kinematics::EndAngleSweep<double> sweep(arm, parts, kinematics::TubeJoints(q).beta, ends, 1.0,
                                                kinematics::StepDepth::kAngles);
  return {sweep.determinant().minimum(), sweep.baseByEnd().determinant(), sweep.determinant().conjugatePoints(),
          sweep.baseAngle().head(n)};
}

}  // namespace tandem::test
