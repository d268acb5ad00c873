// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>
#include <stdexcept>

#include "robots/catheters.h"
#include "robots/types.h"

namespace tandem::robots {
namespace {

namespace catheter = kinematics::catheter;
using kinematics::Branch;
using kinematics::JointsRef;
using kinematics::ModelStatus;
using kinematics::cosserat::RodBranch;

const config::CooperativeRobot& fileOf(const config::Robot& robot) {
  return static_cast<const config::CooperativeRobot&>(*robot.data);
}

/// The arm of a file. @param number  in the robot's order
const config::CatheterArm& armOf(const config::Robot& robot, int number) {
  const config::CooperativeRobot& file = fileOf(robot);
  return file.arms[static_cast<std::size_t>(config::armsInOrder(file)[static_cast<std::size_t>(number)])];
}

/** One catheter: an arc of constant curvature, or Cosserat rods. Of a Branch it uses `known`, `load` (moment in the rod
 * at the entry point, in its frame there) and `end_angle[0]` (pull of the wire whose displacement is given). */
class CatheterModel final : public kinematics::ArmModel {
 public:
  CatheterModel(const config::CatheterArm& arm, bool elastic)
      : radius_(arm.outer_diameter / 2), elastic_(elastic), arc_(arm.model.arm), rods_(arm.model) {}

  int jointCount() const noexcept override { return catheter::kJoints; }
  const Eigen::Isometry3d& base() const noexcept override { return arc_.arm().base; }
  bool carriesLoad() const noexcept override { return elastic_; }

  int sections(const JointsRef& q, kinematics::BodySections& sections) const noexcept override {
    sections[0] = {q[catheter::kInsertion] + arc_.arm().bending_length, radius_,
                   kinematics::Gradient::Unit(catheter::kJoints, catheter::kInsertion)};
    return 1;
  }

  using ArmModel::shape;
  using ArmModel::tip;
  ModelStatus tip(const JointsRef& q, Branch& branch, kinematics::Tip& tip) const noexcept override {
    if (!elastic_)
      return arc_.tip(q, tip);
    kinematics::LoadedTip unloaded;
    const ModelStatus status = loadedTip(q, kinematics::Wrench::Zero(), branch, unloaded);
    if (status == ModelStatus::kOk)
      tip = unloaded;
    return status;
  }

  ModelStatus loadedTip(const JointsRef& q,
                        const kinematics::Wrench& wrench,
                        Branch& branch,
                        kinematics::LoadedTip& tip) const noexcept override {
    if (!elastic_)
      return ArmModel::loadedTip(q, wrench, branch, tip);
    RodBranch rod = rodBranch(branch);
    const ModelStatus status = rods_.tip(q, wrench, rod, tip);
    setBranch(rod, branch);
    return status;
  }

  ModelStatus shape(const JointsRef& q,
                    const kinematics::Wrench& wrench,
                    Branch& branch,
                    int points,
                    std::vector<kinematics::ShapePoint>& shape) const override {
    if (!elastic_)
      return wrench.isZero(0.0) ? arc_.shape(q, points, shape) : ModelStatus::kCarriesNoLoad;
    std::vector<kinematics::cosserat::RodPoint> along;
    RodBranch rod = rodBranch(branch);
    const ModelStatus status = rods_.shape(q, wrench, rod, points, along);
    setBranch(rod, branch);
    shape.assign(status == ModelStatus::kOk ? along.size() : 0, kinematics::ShapePoint());
    for (std::size_t k = 0; k < shape.size(); ++k) {
      shape[k].s = along[k].s;
      shape[k].pose = along[k].pose;
      shape[k].psi.fill(std::numeric_limits<double>::quiet_NaN());
      shape[k].moment.fill(std::numeric_limits<double>::quiet_NaN());
      shape[k].outermost_tube = 1;
    }
    return status;
  }

 private:
  static RodBranch rodBranch(const Branch& branch) noexcept {
    return {branch.known, branch.load.tail<3>(), branch.end_angle[0]};
  }
  static void setBranch(const RodBranch& rod, Branch& branch) noexcept {
    branch.known = rod.known;
    branch.load.tail<3>() = rod.base_moment;
    branch.end_angle[0] = rod.pull;
  }

  double radius_;  ///< m
  bool elastic_;
  catheter::ConstantCurvature arc_;
  catheter::ElasticCatheter rods_;
};

class CatheterType final : public RobotType {
 public:
  std::string description() const override { return "catheters"; }
  bool has(Capability capability) const noexcept override { return capability == Capability::kCommonPath; }
  idl::Model model(const std::string&) const override { return idl::Model::kElastic; }

  ArmAppearance appearance(const config::Robot& robot, int number) const override {
    const config::CatheterArm& arm = armOf(robot, number);
    const catheter::Arm& model = arm.model.arm;
    const double length =
        arm.limits.joints[0].upper + model.bending_length + std::max(0.0, model.tool.translation().z());
    return {"catheter",
            {{"catheter", length, arm.outer_diameter / 2, 0.0, {}}},
            {{"insertion", "insertion", "insertion"}, {"roll", "roll", "roll"}, {"bend", "bend", "bend"}},
            model.base,
            model.tool};
  }

  std::unique_ptr<kinematics::ArmModel> makeModel(const config::Robot& robot,
                                                  int arm,
                                                  const std::string& name) const override {
    const bool elastic = name == elasticModel() || name == "compliant";
    if (!elastic && name != "rigid" && name != "constant-curvature")
      throw std::invalid_argument("model: found '" + name + "', expected constant-curvature or cosserat for catheters");
    return std::make_unique<CatheterModel>(armOf(robot, arm), elastic);
  }
  std::string elasticModel() const override { return "cosserat"; }

  /// A wire off the axis by r is shorter by r b on the inside of a bend b: exact for arcs, and what the knob commands.
  std::string tipColumn() const override { return "pull"; }
  double tipValue(const config::Robot& robot, int arm, const JointsRef& q, const kinematics::Tip&) const override {
    return armOf(robot, arm).tendon_offset * q[catheter::kBend];
  }

  std::unique_ptr<Mechanism> makeMechanism(const config::Robot& robot) const override {
    if (fileOf(robot).object)
      return std::make_unique<GraspedObjectMechanism>(fileOf(robot));
    return std::make_unique<AssistedMechanism>(fileOf(robot));
  }

  const config::GraspedObject* graspedObject(const config::Robot& robot) const noexcept override {
    return fileOf(robot).object ? &*fileOf(robot).object : nullptr;
  }
};

}  // namespace

const RobotType& catheterType() {
  static const CatheterType type;
  return type;
}

}  // namespace tandem::robots
