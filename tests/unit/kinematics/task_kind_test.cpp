// SPDX-License-Identifier: Apache-2.0
#include "kinematics/tasks/task_kind.h"

#include <gtest/gtest.h>

#include "kinematics/rigid_model.h"
#include "kinematics/rotations.h"
#include "tests/unit/support/random_tubes.h"

namespace tandem::test {
namespace {

using idl::TaskKind;
using kinematics::findTaskKind;
using kinematics::TaskKindEntry;
using kinematics::TaskPlace;
using kinematics::TaskRows;
using kinematics::Tip;

constexpr std::array kKindsOfTips{TaskKind::kRelativePosition, TaskKind::kTipPosition,         TaskKind::kTipAxis,
                                  TaskKind::kTipOrientation,   TaskKind::kRelativeOrientation, TaskKind::kLookAt,
                                  TaskKind::kTipPose,          TaskKind::kRelativePose};

Eigen::Vector3d anyDirection(Random& random) {
  const Eigen::Vector3d v = anyVector(random, 1.0);
  return v.norm() > 0.1 ? Eigen::Vector3d(v.normalized()) : Eigen::Vector3d::UnitX();
}

/// An angle up to a half turn, every third one within 0.1 of it, and every seventh within 0.002.
double anyAngle(Random& random) {
  const int kind = random.integer(0, 20);
  if (kind % 7 == 0)
    return M_PI - random.uniform(5e-4, 2e-3);
  return kind % 3 == 0 ? M_PI - random.uniform(2e-3, 0.1) : random.uniform(1e-3, 3.0);
}

/** Two random arms at random joints. */
struct TwoArms {
  kinematics::RigidModel a, b;
  Eigen::VectorXd q;  ///< of both
  Tip tip_a, tip_b;
  bool known;

  explicit TwoArms(Random& random) : TwoArms(randomArm(random), randomArm(random), random) {}
  TwoArms(const kinematics::ConcentricTubeArm& left, const kinematics::ConcentricTubeArm& right, Random& random)
      : a(left), b(right) {
    const Eigen::VectorXd q_a = randomInside(limitsOf(left), random), q_b = randomInside(limitsOf(right), random);
    q.resize(q_a.size() + q_b.size());
    q << q_a, q_b;
    known = at(q, tip_a, tip_b);
  }
  bool at(const Eigen::VectorXd& joints, Tip& left, Tip& right) const {
    return a.tip(joints.head(a.jointCount()), left) == kinematics::ModelStatus::kOk &&
           b.tip(joints.tail(b.jointCount()), right) == kinematics::ModelStatus::kOk;
  }
  /// Whether the poses have a derivative there: the rigid Jacobian jumps where section boundaries cross.
  bool smoothAt(Eigen::Index j, double step) const {
    const Eigen::VectorXd by = step * Eigen::VectorXd::Unit(q.size(), j);
    Tip left_a, left_b, right_a, right_b;
    if (!at(q - by, left_a, left_b) || !at(q + by, right_a, right_b))
      return false;
    const auto bend = [&](const Tip& left, const Tip& here, const Tip& right) {
      return (right.pose.matrix() - 2.0 * here.pose.matrix() + left.pose.matrix()).norm() / step;
    };
    return std::max(bend(left_a, tip_a, right_a), bend(left_b, tip_b, right_b)) < 1e-4;
  }
  /// Rows of a kind by all joints.
  Eigen::MatrixXd jacobian(const TaskKindEntry& kind, const TaskRows& rows) const {
    Eigen::MatrixXd j = Eigen::MatrixXd::Zero(kind.rows, q.size());
    j.leftCols(a.jointCount()) = rows.by_arm * tip_a.jacobian;
    if (kind.relative())
      j.rightCols(b.jointCount()) = rows.by_other * tip_b.jacobian;
    return j;
  }
};

/// A wanted place, for kinds of orientations at a known angle from the present one.
TaskPlace wantedFrom(const TaskKindEntry& kind, const TaskPlace& at, Random& random) {
  TaskPlace wanted = at;
  const double angle = anyAngle(random);
  if (kind.kind == TaskKind::kLookAt) {
    const Eigen::Vector3d axis = at.orientation.toRotationMatrix().col(2);
    wanted.position += random.uniform(0.02, 0.2) * (Eigen::AngleAxisd(angle, axis.unitOrthogonal()) * axis);
  } else if (kind.part != kinematics::TaskPart::kOrientation) {
    wanted.position += anyVector(random, 0.05);
  }
  if (kind.hasOrientation()) {
    wanted.orientation = (Eigen::AngleAxisd(angle, anyDirection(random)) * at.orientation).normalized();
  }
  return wanted;
}

/// The matrix G of e' = -G (rows times joint velocities) for a constant wanted place, from the literature: of an axis
/// the derivative of the angle between unit vectors, of an orientation the inverse right Jacobian of SO(3) (Sola et al.
/// 2018, (144)).
Eigen::MatrixXd rateOf(const TaskKindEntry& kind, const Eigen::VectorXd& e) {
  if (kind.part == kinematics::TaskPart::kPose) {
    Eigen::MatrixXd rate = Eigen::MatrixXd::Identity(6, 6);
    rate.bottomRightCorner<3, 3>() =
        rateOf(*findTaskKind(TaskKind::kTipOrientation), e.tail<3>() / kinematics::kLengthPerRadian);
    return rate;
  }
  const double angle = e.norm();
  if (kind.kind == TaskKind::kTipAxis) {
    const Eigen::MatrixXd along = e * e.transpose() / (angle * angle);
    return along + angle / std::sin(angle) * (Eigen::MatrixXd::Identity(2, 2) - along);
  }
  if (kind.unit == kinematics::TaskUnit::kMetre)
    return Eigen::MatrixXd::Identity(3, 3);
  const Eigen::Matrix3d x = kinematics::skew(Eigen::Vector3d(e));
  return Eigen::Matrix3d::Identity() + 0.5 * x +
         (1.0 / (angle * angle) - (1.0 + std::cos(angle)) / (2.0 * angle * std::sin(angle))) * x * x;
}

TEST(TaskKind, RowsAreTheDerivativesOfTheResidual) {
  constexpr double kStep = 1e-7;
  std::array<int, kKindsOfTips.size()> compared{};
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 200; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const TwoArms arms(random);
    if (!arms.known)
      continue;
    for (std::size_t k = 0; k < kKindsOfTips.size(); ++k) {
      const TaskKindEntry& kind = *findTaskKind(kKindsOfTips[k]);
      SCOPED_TRACE(std::string(kind.name));
      const TaskPlace at = kind.place(arms.tip_a.pose, arms.tip_b.pose), wanted = wantedFrom(kind, at, random);
      TaskRows rows;
      rows.residual = kind.residual(at, wanted);
      kind.maps(at, wanted, arms.tip_b.pose, rows);
      ASSERT_EQ(rows.residual.size(), kind.rows);
      const double angle = rows.residual.norm();
      const Eigen::MatrixXd jacobian = arms.jacobian(kind, rows);
      for (Eigen::Index j = 0; j < arms.q.size(); ++j) {
        const auto residual = [&](double step) -> Eigen::VectorXd {
          Eigen::VectorXd q = arms.q;
          q[j] += step;
          Tip a, b;
          return arms.at(q, a, b) ? Eigen::VectorXd(kind.residual(kind.place(a.pose, b.pose), wanted))
                                  : Eigen::VectorXd::Constant(kind.rows, std::nan(""));
        };
        const Eigen::VectorXd right = residual(kStep), left = residual(-kStep);
        if (!right.allFinite() || !left.allFinite() || !arms.smoothAt(j, kStep))
          continue;
        const double scale = 1.0 + jacobian.col(j).norm();
        if (kind.kind == TaskKind::kLookAt) {  // the wanted axis moves with the tip: its length alone
          const double slope = (right.norm() - left.norm()) / (2.0 * kStep);
          EXPECT_NEAR(slope, -rows.residual.dot(jacobian.col(j)) / angle, 1e-4 * scale);
        } else {
          const Eigen::MatrixXd rate = rateOf(kind, rows.residual);
          const Eigen::VectorXd expected = -rate * jacobian.col(j), slope = (right - left) / (2.0 * kStep);
          EXPECT_LT((slope - expected).norm(), 1e-4 * scale * (1.0 + rate.norm())) << "joint " << j << ", " << angle;
        }
        ++compared[k];
      }
    }
  }
  for (const int count : compared)
    EXPECT_GT(count, 1000);
}

/// A free body turns by the least rotation: e is lambda h shorter after each step, from up to a half turn.
TEST(TaskKind, AnglesDecreaseExactlyFromUpToAHalfTurn) {
  constexpr double kShare = 0.05;  // lambda h
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 300; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    for (const TaskKind which : {TaskKind::kTipAxis, TaskKind::kTipOrientation}) {
      const TaskKindEntry& kind = *findTaskKind(which);
      TaskPlace at, wanted;
      at.orientation = Eigen::AngleAxisd(anyAngle(random), anyDirection(random));
      const Eigen::Vector3d about = which == TaskKind::kTipAxis
                                        ? at.orientation.toRotationMatrix().col(2).unitOrthogonal().eval()
                                        : anyDirection(random);
      wanted.orientation = Eigen::AngleAxisd(seed % 5 == 0 ? M_PI : anyAngle(random), about) * at.orientation;
      const double first = kind.error(at, wanted);
      for (int i = 1; i <= 40; ++i) {
        TaskRows rows;
        rows.residual = kind.residual(at, wanted);
        kind.maps(at, wanted, Eigen::Isometry3d::Identity(), rows);
        const Eigen::MatrixXd by = rows.by_arm.rightCols<3>();
        EXPECT_LT((by * by.transpose() - Eigen::MatrixXd::Identity(kind.rows, kind.rows)).norm(), 1e-12);
        const Eigen::Vector3d turn = kShare * (by.transpose() * rows.residual);
        at.orientation = (kinematics::rotationBy(turn) * at.orientation).normalized();
        EXPECT_NEAR(kind.error(at, wanted), first * std::pow(1.0 - kShare, i), 1e-9);
      }
    }
  }
}

/// A wanted place that moves with the feed-forward twist leaves no error behind where the tip has none.
TEST(TaskKind, FeedForwardFollowsAMovingReference) {
  constexpr double kStep = 1e-5;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 200; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    for (const TaskKind which : {TaskKind::kTipAxis, TaskKind::kTipOrientation, TaskKind::kRelativeOrientation,
                                 TaskKind::kTipPose, TaskKind::kRelativePose}) {
      const TaskKindEntry& kind = *findTaskKind(which);
      Eigen::Isometry3d tip = Eigen::Isometry3d::Identity(), other = tip;
      tip.linear() = Eigen::AngleAxisd(anyAngle(random), anyDirection(random)).toRotationMatrix();
      other.linear() = Eigen::AngleAxisd(anyAngle(random), anyDirection(random)).toRotationMatrix();
      tip.translation() = anyVector(random, 0.1);
      TaskPlace wanted = kind.place(tip, other);
      const Eigen::Vector3d turn = anyVector(random, 1.0);
      const Eigen::Vector3d way =
          kind.part == kinematics::TaskPart::kPose ? anyVector(random, 0.1) : Eigen::Vector3d::Zero();
      TaskRows rows;
      kind.maps(wanted, wanted, other, rows);
      Eigen::Matrix<double, 6, 1> twist;
      twist << way, turn;
      const Eigen::VectorXd velocity = rows.by_feed_forward * twist;
      const Eigen::MatrixXd by_arm = rows.by_arm;
      const Eigen::VectorXd rate = by_arm.completeOrthogonalDecomposition().solve(velocity);
      tip.linear() = kinematics::rotationBy(kStep * rate.tail<3>()).toRotationMatrix() * tip.linear();
      tip.translation() += kStep * rate.head<3>();
      wanted.orientation = kinematics::rotationBy(kStep * turn) * wanted.orientation;
      wanted.position += kStep * way;
      EXPECT_LT(kind.error(kind.place(tip, other), wanted), 10.0 * kStep * kStep) << kind.name;
    }
  }
}

TEST(TaskKind, TheTableNamesEachKindOnce) {
  for (const TaskKind kind : kKindsOfTips) {
    const TaskKindEntry* entry = findTaskKind(kind);
    ASSERT_NE(entry, nullptr);
    EXPECT_EQ(entry->kind, kind);
    EXPECT_EQ(findTaskKind(entry->name), entry);
    EXPECT_LE(entry->rows, kinematics::kMaxKindRows);
  }
  EXPECT_EQ(findTaskKind(TaskKind::kNone), nullptr);
  EXPECT_EQ(findTaskKind(TaskKind::kObjectPose), nullptr);
  EXPECT_EQ(findTaskKind("object"), nullptr);
}

}  // namespace
}  // namespace tandem::test
