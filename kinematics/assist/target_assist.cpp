// SPDX-License-Identifier: Apache-2.0
#include "kinematics/assist/target_assist.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "kinematics/spectrum.h"

namespace tandem::kinematics::assist {

using catheter::kBend;
using catheter::kInsertion;
using catheter::kRoll;
using cosserat::kAllColumns;
using cosserat::kByForce;
using cosserat::kByInput;
using cosserat::kByTurn;
using cosserat::kWrenchColumns;
using cosserat::Shot;
using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

/// Entries of a wrench or a twist that a contact ties, as a square system with room for both kinds.
using Tied = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 6, 6>;

/// Twist that takes one frame to another.
Vector6 between(const Isometry3d& from, const Isometry3d& to) {
  Vector6 twist;
  twist << to.translation() - from.translation(), logarithm(to.linear() * from.linear().transpose());
  return twist;
}

/// Part of a pose: screw through the origin of the contact frame.
Isometry3d part(const Vector6& twist, double factor) {
  Isometry3d pose = Isometry3d::Identity();
  pose.translation() = factor * twist.head<3>();
  const Vector3d turn = factor * twist.tail<3>();
  pose.linear() =
      Eigen::AngleAxisd(turn.norm(), turn.norm() > 0.0 ? turn.normalized() : Vector3d::UnitX()).toRotationMatrix();
  return pose;
}

void checkRound(const cosserat::Section& section, const std::string& name) {
  const Vector3d& stiffness = section.moment_stiffness;
  if (stiffness.x() != stiffness.y() || section.force_stiffness.x() != section.force_stiffness.y())
    throw std::invalid_argument(name + ": found bending stiffnesses of " + std::to_string(stiffness.x()) + " and " +
                                std::to_string(stiffness.y()) +
                                " N m^2, expected equal bending and equal shear stiffness about both axes");
}

/// A section of the target: its proximal end alone, carrying the contact.
cosserat::Rod proximalOf(const catheter::ElasticArm& arm) {
  cosserat::Rod rod;
  rod.sections = {arm.proximal};
  rod.sections[0].intrinsic_curvature.setZero();
  rod.sections[0].length = 1.0;  // of no account: the insertion is
  return rod;
}

}  // namespace

std::string_view describe(Status status) {
  switch (status) {
    case Status::kOk:
      return "ok";
    case Status::kNotFinite:
      return "a joint position is NaN or infinite";
    case Status::kDistalInside:
      return "the target's insertion is not above zero, or the assist arm's is below zero";
    case Status::kNotConverged:
      return "no contact pose satisfies the equilibrium of both arms";
    case Status::kNoContact:
      return "no contact: the assist arm would have to pull";
    case Status::kBuckled:
      return "an arm buckles: the equilibrium is unstable";
  }
  return "unknown";
}

/// Loads and actuation of both rods, except the contact.
struct TargetAssist::Task {
  cosserat::RodInput target, assist;
  double force_unit, moment_unit;  ///< N and N m that bend the softer rod by about one radian
};

template <int kColumns>
struct TargetAssist::Shots {
  Shot<kColumns> target, assist;
  Vector6 apart;  ///< twist from the target's contact frame to the assist arm's tip
};

struct TargetAssist::Unknowns {
  Wrench wrench = Wrench::Zero();  ///< on the target
  Vector3d target = Vector3d::Zero(), assist = Vector3d::Zero();
  double pull = 0.0;  ///< of the assist arm's wire

  Unknowns plus(const Unknowns& other, double factor) const {
    return {wrench + factor * other.wrench, target + factor * other.target, assist + factor * other.assist,
            pull + factor * other.pull};
  }
};

TargetAssist::TargetAssist(Pair pair, cosserat::Accuracy accuracy) : pair_(std::move(pair)), accuracy_(accuracy) {
  checkArm(pair_.target.arm);
  checkArm(pair_.assist.arm);
  checkRound(pair_.target.proximal, "proximal end of the target arm");
  checkRound(pair_.assist.proximal, "proximal end of the assist arm");
  checkRound(pair_.assist.distal, "distal end of the assist arm");
  pair_.assist.distal.intrinsic_curvature.setZero();  // bending is what the joint says
  if (pair_.type != grasp::ContactType::kRigid && pair_.type != grasp::ContactType::kPoint)
    throw std::invalid_argument("contact of the assist arm: found " + std::string(nameOf(pair_.type)) +
                                ", expected rigid or point");
  if (!pair_.contact.matrix().allFinite())
    throw std::invalid_argument("contact of the assist arm: found a number that is not finite");
  rows_ = pair_.type == grasp::ContactType::kRigid ? 6 : 3;
  target_ = proximalOf(pair_.target);
  assist_ = catheter::rodOf(pair_.assist);
  checkRod(target_);
  checkRod(assist_);
}

Isometry3d TargetAssist::touching(const Pair& pair, const Joints& q) {
  const auto tip = [](const catheter::Arm& arm, double insertion, double roll, double bend) -> Isometry3d {
    Vector6 by_bend;
    catheter::Arm bare = arm;
    bare.tool.setIdentity();
    Isometry3d end;
    catheter::ConstantCurvature::distal(bare, bend, end, by_bend);
    const Eigen::AngleAxisd turn(roll, Vector3d::UnitZ());
    return arm.base * Eigen::Translation3d(0.0, 0.0, insertion) * turn * end * turn.inverse() * arm.tool;
  };
  const Isometry3d base = pair.target.arm.base * Eigen::Translation3d(0.0, 0.0, q[kInsertion]);
  return base.inverse() * tip(pair.assist.arm, q[3 + kInsertion], q[3 + kRoll], q[3 + kBend]);
}

TargetAssist::Task TargetAssist::taskOf(const Joints& q) const {
  Task task{cosserat::RodInput(target_), cosserat::RodInput(assist_), 0.0, 0.0};
  task.target.base = pair_.target.arm.base;
  task.target.first_length = q[kInsertion];
  task.assist.base = pair_.assist.arm.base;
  task.assist.first_length = q[3 + kInsertion];
  actuate(pair_.assist, q[3 + kBend], {std::cos(q[3 + kRoll]), -std::sin(q[3 + kRoll]), 0.0, 0.0}, task.assist);
  task.moment_unit = std::min(momentScale(target_, task.target), momentScale(assist_, task.assist));
  task.force_unit = task.moment_unit / std::max(lengthOf(target_, task.target), lengthOf(assist_, task.assist));
  return task;
}

cosserat::SweepStart TargetAssist::assistStart(const cosserat::RodInput& input,
                                               const Unknowns& x,
                                               cosserat::HeldIndex* index) const {
  cosserat::SweepStart start{assist_, input, x.assist, 1.0, accuracy_, index};
  start.pull = x.pull;
  return start;
}

/// @param open  by how far the contact is still left open: contact frame on the target <- where the assist arm is
template <int kColumns>
bool TargetAssist::shoot(const Task& task, const Isometry3d& open, const Unknowns& x, Shots<kColumns>& shots) const {
  cosserat::RodInput target = task.target, assist = task.assist;
  target.tip = x.wrench;
  assist.tip = -x.wrench;
  if (!shots.target.shoot({target_, target, x.target, 1.0, accuracy_}, pair_.contact * open) ||
      !shots.assist.shoot(assistStart(assist, x), pair_.assist.arm.tool))
    return false;
  shots.apart = between(shots.target.tip, shots.assist.tip);
  return true;
}

/// Newton's method; false where its first correction is long or the others do not shrink.
template <int kColumns>
bool TargetAssist::correct(const Task& task, const Isometry3d& open, Unknowns& x, int& sweeps) const {
  constexpr int kMaxIterations = 12;
  constexpr double kConverged = 1e-6;
  double allowed = 1.0;
  Shots<kColumns> shots;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration, ++sweeps) {
    if (!shoot(task, open, x, shots))
      return false;
    // Moments at the clamps eliminated: what they still have to change by moves the tips as well.
    const Vector3d target_step = shots.target.momentStep(), assist_step = shots.assist.momentStep();
    const Vector6 apart =
        shots.apart - shots.assist.twistByMoment() * assist_step + shots.target.twistByMoment() * target_step;
    const Tied compliance = (shots.target.compliance() + shots.assist.compliance()).topLeftCorner(rows_, rows_);
    Wrench wrench = Wrench::Zero();
    wrench.head(rows_) = compliance.partialPivLu().solve(apart.head(rows_));
    const Vector3d target_moment = shots.target.momentByWrench() * wrench - target_step;
    const Vector3d assist_moment = -shots.assist.momentByWrench() * wrench - assist_step;
    const double pull = task.assist.wire.locked() ? shots.assist.pullStep(assist_moment, -wrench.head<3>()) : 0.0;
    const double size =
        std::max({wrench.head<3>().norm() / task.force_unit, wrench.tail<3>().norm() / task.moment_unit,
                  target_moment.norm() / task.moment_unit, assist_moment.norm() / task.moment_unit, std::abs(pull)});
    if (!(size <= allowed))  // not even where it is not a number
      return false;
    x = x.plus({wrench, target_moment, assist_moment, pull}, 1.0);
    if (size < kConverged)
      return true;
    allowed = std::max(0.5 * size, kConverged);
  }
  return false;
}

bool TargetAssist::correct(const Task& task, const Isometry3d& open, Unknowns& x, int& sweeps) const {
  return task.assist.wire.locked() ? correct<kAllColumns>(task, open, x, sweeps)
                                   : correct<kWrenchColumns>(task, open, x, sweeps);
}

/// The gap between the free arms, closed step by step; without a gap there is no wrench and no moment.
bool TargetAssist::close(const Task& task, Unknowns& x, int& sweeps) const {
  constexpr double kLeastStep = 1.0 / 1024.0;
  constexpr int kMaxAttempts = 200;
  Unknowns here, slope;
  here.pull = task.assist.wire.displacement;
  Shots<kWrenchColumns> free;
  if (!shoot(task, Isometry3d::Identity(), here, free))
    return false;
  Vector6 gap;  // in the contact frame
  gap.head<3>() = free.target.tip.linear().transpose() * free.apart.head<3>();
  gap.tail<3>() = free.target.tip.linear().transpose() * free.apart.tail<3>();
  double closed = 0.0, step = 1.0;
  for (int attempt = 0; closed < 1.0; ++attempt) {
    const double next = std::min(1.0, closed + step);
    Unknowns there = here.plus(slope, next - closed);
    if (attempt > kMaxAttempts)
      return false;
    if (!correct(task, part(gap, 1.0 - next), there, sweeps)) {
      if ((step *= 0.5) < kLeastStep)
        return false;
      continue;
    }
    slope = Unknowns().plus(there, 1.0 / (next - closed)).plus(here, -1.0 / (next - closed));
    here = there;
    closed = next;
    step *= 1.5;
  }
  x = here;
  return true;
}

namespace {

/// Stable: no negative direction of both rods together, tied at the contact.
int conjugatePoints(const Matrix6& target_compliance, const Matrix6& assist_compliance, int rows) {
  const Matrix6 target = target_compliance.inverse(), assist = assist_compliance.inverse();
  if (rows == 6)
    return negativeDirections(target + assist);
  Form form = Form::Zero(9, 9);  // place; turn of the target; turn of the assist arm
  form.topLeftCorner<6, 6>() = target;
  form.topLeftCorner<3, 3>() += assist.topLeftCorner<3, 3>();
  form.block<3, 3>(0, 6) = assist.topRightCorner<3, 3>();
  form.block<3, 3>(6, 0) = assist.bottomLeftCorner<3, 3>();
  form.block<3, 3>(6, 6) = assist.bottomRightCorner<3, 3>();
  return negativeDirections(form);
}

/** Twist of the tool tip by a roll that turns the plane of bending and not the tool. As the rod is round, its axis
 * moves as with a turn of the clamp about `axis`; against that, the tool turns back about the rod's end. */
Vector6 rollInCollar(const Shot<kAllColumns>& shot, const Vector3d& axis, const Wrench& wrench) {
  const Vector3d back = -shot.end.pose.linear().col(2);
  const Vector3d lever = shot.tip.translation() - shot.end.pose.translation();
  const Vector3d moved = back.cross(lever);
  Vector6 twist = shot.twist_by.middleCols<3>(kByTurn) * axis;
  twist.head<3>() += moved;
  twist.tail<3>() += back;
  const Vector3d residual = shot.residual_by.middleCols<3>(kByTurn) * axis - moved.cross(wrench.head<3>());
  return twist - shot.twistByMoment() * shot.residualByMoment().partialPivLu().solve(residual);
}

/// Twist of a point by that of another one on the same body.
Matrix6 shifted(const Vector3d& offset) {
  Matrix6 result = Matrix6::Identity();
  result.topRightCorner<3, 3>() = -skew(offset);
  return result;
}

}  // namespace

bool TargetAssist::complete(const Joints& q, const Task& task, Unknowns& x, Chain& chain) const {
  constexpr int kMaxIterations = 4;
  constexpr double kConverged = 1e-9;
  Shots<kAllColumns> shots;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration, ++chain.sweeps) {
    cosserat::HeldIndex target_index, assist_index;
    cosserat::RodInput target = task.target, assist = task.assist;
    target.tip = x.wrench;
    assist.tip = -x.wrench;
    if (!shots.target.shoot({target_, target, x.target, 1.0, accuracy_, &target_index}, pair_.contact) ||
        !shots.assist.shoot(assistStart(assist, x, &assist_index), pair_.assist.arm.tool))
      return false;
    shots.apart = between(shots.target.tip, shots.assist.tip);
    const double moment = std::max(shots.target.momentStep().norm(), shots.assist.momentStep().norm());
    const double length = task.moment_unit / task.force_unit;
    const double pull =
        task.assist.wire.locked() ? std::abs(shots.assist.pullStep(Vector3d::Zero(), Vector3d::Zero())) : 0.0;
    chain.gap = shots.apart.head<3>().norm();
    chain.turn = rows_ == 6 ? shots.apart.tail<3>().norm() : 0.0;
    if (std::max({moment / task.moment_unit, chain.gap / length, chain.turn, pull}) > kConverged) {
      if (!correct(task, Isometry3d::Identity(), x, chain.sweeps))
        return false;
      continue;
    }
    chain.wrench = x.wrench;
    chain.contact = shots.target.tip;
    chain.push = chain.contact.linear().col(2).dot(x.wrench.head<3>());
    chain.conjugate_points = target_index.count() + assist_index.count() - shots.assist.removed +
                             conjugatePoints(shots.target.compliance(), shots.assist.compliance(), rows_);
    differentiate(q, task, shots, chain);
    return true;
  }
  return false;
}

/// Derivatives of the contact wrench and of the target's tip by the joints; the tip by equation (11).
void TargetAssist::differentiate(const Joints& q,
                                 const Task& task,
                                 const Shots<kAllColumns>& shots,
                                 Chain& chain) const {
  // Twists of the contact on each side at a constant wrench.
  Eigen::Matrix<double, 6, kJoints> target = Eigen::Matrix<double, 6, kJoints>::Zero(), assist = target;
  target.col(kInsertion) = shots.target.byBase() * shots.target.end.base_strain;
  assist.col(3 + kInsertion) = shots.assist.byBase() * shots.assist.end.base_strain;
  if (task.assist.wire.locked()) {
    assist.col(3 + kRoll) = rollInCollar(shots.assist, pair_.assist.arm.base.linear().col(2), -chain.wrench);
    assist.col(3 + kBend) = shots.assist.byDisplacement();
  } else {
    const Eigen::Matrix<double, 6, 2> by_input = shots.assist.elastic<2>(kByInput);
    assist.col(3 + kRoll) = by_input.col(0) * task.assist.inputs[1] - by_input.col(1) * task.assist.inputs[0];
    assist.col(3 + kBend) = by_input.col(0) * std::cos(q[3 + kRoll]) - by_input.col(1) * std::sin(q[3 + kRoll]);
  }

  const Matrix6 target_compliance = shots.target.compliance();
  const auto tied = Tied((target_compliance + shots.assist.compliance()).topLeftCorner(rows_, rows_)).partialPivLu();
  chain.wrench_by_joints.setZero();
  chain.wrench_by_joints.topRows(rows_) = tied.solve(Eigen::Matrix<double, 6, kJoints>(assist - target).topRows(rows_));

  const Isometry3d base = shots.target.end.pose;
  const Eigen::AngleAxisd roll(q[kRoll], Vector3d::UnitZ());
  Isometry3d distal;
  Vector6 by_bend;
  catheter::ConstantCurvature::distal(pair_.target.arm, q[kBend], distal, by_bend);
  const Isometry3d rolled = base * roll;
  chain.tip = Tip();
  chain.tip.pose = rolled * distal;
  chain.tip.conjugate_points = chain.conjugate_points;
  const Vector3d tip = chain.tip.pose.translation();
  const Matrix6 from_contact = shifted(tip - chain.contact.translation());
  chain.tip.jacobian = from_contact * (target + target_compliance * chain.wrench_by_joints);
  chain.tip.jacobian.col(kRoll).head<3>() += base.linear().col(2).cross(tip - base.translation());
  chain.tip.jacobian.col(kRoll).tail<3>() += base.linear().col(2);
  chain.tip.jacobian.col(kBend).head<3>() += rolled.linear() * by_bend.head<3>();
  chain.tip.jacobian.col(kBend).tail<3>() += rolled.linear() * by_bend.tail<3>();

  // A wrench at the base of bending acts beside the contact's, on the same body; the assist arm takes its share.
  const Matrix6 to_contact = shifted(base.translation() - chain.contact.translation()).transpose();
  Matrix6 share = Matrix6::Zero();  // of a wrench at the contact point, what the contact hands on to the assist arm
  share.topRows(rows_) = tied.solve(target_compliance.topRows(rows_));
  chain.compliance = from_contact * target_compliance * (Matrix6::Identity() - share) * to_contact;
}

Status TargetAssist::judge(const Joints& q, const Task& task, Unknowns& x, Chain& chain) const {
  if (!complete(q, task, x, chain))
    return Status::kNotConverged;
  if (chain.conjugate_points > 0)
    return Status::kBuckled;
  return pair_.pushes_only && chain.push < 0.0 ? Status::kNoContact : Status::kOk;
}

Status TargetAssist::solve(const Joints& q, ChainBranch& branch, Chain& chain) const noexcept {
  if (!q.allFinite() || !branch.wrench.allFinite() || !branch.target_moment.allFinite() ||
      !branch.assist_moment.allFinite())
    return Status::kNotFinite;
  if (q[kInsertion] <= 0.0 || q[3 + kInsertion] < 0.0)
    return Status::kDistalInside;
  const Task task = taskOf(q);
  chain = Chain();
  Status status = Status::kNotConverged;
  Unknowns x;
  if (branch.known) {
    x = {branch.wrench, branch.target_moment, branch.assist_moment, branch.assist_pull};
    if (correct(task, Isometry3d::Identity(), x, chain.sweeps))
      status = judge(q, task, x, chain);
  }
  if (status != Status::kOk && close(task, x, chain.sweeps))
    status = judge(q, task, x, chain);
  if (status == Status::kOk)
    branch = {true, x.wrench, x.target, x.assist, x.pull};
  return status;
}

Tip TargetAssist::alone(const Joints& q) const noexcept {
  Tip tip;
  catheter::ConstantCurvature(pair_.target.arm).tip(q.head<catheter::kJoints>(), tip);
  return tip;
}

}  // namespace tandem::kinematics::assist
