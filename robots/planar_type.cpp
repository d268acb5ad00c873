// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "config/planar.h"
#include "robots/types.h"

namespace tandem::robots {
namespace {

using kinematics::Branch;
using kinematics::JointsRef;
using kinematics::ModelStatus;

/** Rigid links in a plane. The tip's z axis lies along the last link, as for a backbone:
 *
 *     phi_k = q_1 + ... + q_k,   p_k = p_{k-1} + l_k (cos phi_k, sin phi_k, 0),   dp/dq_j = z x (p - p_{j-1}) */
class PlanarModel final : public kinematics::ArmModel {
 public:
  explicit PlanarModel(const config::PlanarArm& arm) : arm_(arm) {}

  int jointCount() const noexcept override { return static_cast<int>(arm_.links.size()); }
  const Eigen::Isometry3d& base() const noexcept override { return arm_.base; }

  int sections(const JointsRef&, kinematics::BodySections& sections) const noexcept override {
    double end = 0.0;
    for (std::size_t k = 0; k < arm_.links.size(); ++k) {
      end += arm_.links[k].length;
      sections[k] = {end, 0.5 * arm_.links[k].diameter, kinematics::Gradient::Zero(jointCount())};
    }
    return jointCount();
  }

  using ArmModel::shape;
  using ArmModel::tip;
  ModelStatus tip(const JointsRef& q, Branch& branch, kinematics::Tip& tip) const noexcept override {
    if (const ModelStatus status = check(q); status != ModelStatus::kOk)
      return status;
    tip = kinematics::Tip();
    tip.pose = at(q, std::numeric_limits<double>::infinity());
    tip.jacobian.resize(6, jointCount());
    const Eigen::Vector3d z = arm_.base.linear().col(2);
    double before = 0.0;
    for (int j = 0; j < jointCount(); ++j) {
      const Eigen::Vector3d joint = at(q, before).translation();
      tip.jacobian.col(j) << z.cross(tip.pose.translation() - joint), z;
      before += arm_.links[static_cast<std::size_t>(j)].length;
    }
    branch.known = true;
    return ModelStatus::kOk;
  }

  ModelStatus shape(const JointsRef& q,
                    const kinematics::Wrench& wrench,
                    Branch&,
                    int points,
                    std::vector<kinematics::ShapePoint>& shape) const override {
    if (const ModelStatus status = check(q); status != ModelStatus::kOk)
      return status;
    if (!wrench.isZero(0.0))
      return ModelStatus::kCarriesNoLoad;
    const double length = lengthOf();
    shape.assign(static_cast<std::size_t>(std::max(points, 0)), kinematics::ShapePoint());
    for (std::size_t k = 0; k < shape.size(); ++k) {
      shape[k].s = shape.size() > 1 ? length * static_cast<double>(k) / static_cast<double>(shape.size() - 1) : 0.0;
      shape[k].pose = at(q, shape[k].s);
      shape[k].psi.fill(std::numeric_limits<double>::quiet_NaN());
      shape[k].moment.fill(std::numeric_limits<double>::quiet_NaN());
      shape[k].outermost_tube = 1;
    }
    return ModelStatus::kOk;
  }

  /// In closed form, without allocation; straight beyond the last link.
  ModelStatus backbone(const JointsRef& q,
                       Branch&,
                       const std::vector<double>& s,
                       bool derivatives,
                       std::vector<kinematics::BackbonePoint>& points) const override {
    if (const ModelStatus status = check(q); status != ModelStatus::kOk)
      return status;
    const double length = lengthOf();
    const Eigen::Vector3d z = arm_.base.linear().col(2);
    points.resize(s.size());
    for (std::size_t i = 0; i < s.size(); ++i) {
      const Eigen::Isometry3d frame = at(q, s[i]);
      points[i].s = s[i];
      points[i].tangent = frame.linear().col(2);
      points[i].position = frame.translation() + std::max(0.0, s[i] - length) * points[i].tangent;
      if (!derivatives)
        continue;
      points[i].jacobian.setZero(3, jointCount());
      double before = 0.0;
      for (int j = 0; j < jointCount() && before < s[i]; ++j) {
        points[i].jacobian.col(j) = z.cross(points[i].position - at(q, before).translation());
        before += arm_.links[static_cast<std::size_t>(j)].length;
      }
    }
    return ModelStatus::kOk;
  }

 private:
  ModelStatus check(const JointsRef& q) const noexcept {
    if (q.size() != jointCount())
      return ModelStatus::kWrongSize;
    return q.allFinite() ? ModelStatus::kOk : ModelStatus::kNotFinite;
  }

  double lengthOf() const noexcept {
    return std::accumulate(arm_.links.begin(), arm_.links.end(), 0.0,
                           [](double sum, const config::PlanarLink& link) { return sum + link.length; });
  }

  /// robot base frame <- frame at arc length s, z along the link.
  Eigen::Isometry3d at(const JointsRef& q, double s) const noexcept {
    double angle = 0.0;
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    for (int j = 0; j < jointCount() && (j == 0 || s > 0.0); ++j) {
      const double length = arm_.links[static_cast<std::size_t>(j)].length;
      angle += q[j];
      place += std::min(s, length) * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0);
      s -= length;
    }
    Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
    frame.translation() = place;
    frame.linear() << 0.0, -std::sin(angle), std::cos(angle), 0.0, std::cos(angle), std::sin(angle), -1.0, 0.0, 0.0;
    return arm_.base * frame;
  }

  config::PlanarArm arm_;
};

class PlanarType final : public RobotType {
 public:
  std::string description() const override { return "planar arms"; }
  bool has(Capability capability) const noexcept override { return capability == Capability::kTips; }

  ArmAppearance appearance(const config::Robot& robot, int arm) const override {
    ArmAppearance appearance{"planar", {}, {}, armOf(robot, arm).base, Eigen::Isometry3d::Identity()};
    for (const config::PlanarLink& link : armOf(robot, arm).links) {
      const std::string number = std::to_string(appearance.tubes.size() + 1);
      appearance.tubes.push_back({"link " + number, link.length, 0.5 * link.diameter, 0.0, {}});
      appearance.joints.push_back({"q" + number, "rotation of link " + number, "link " + number});
    }
    return appearance;
  }

  std::unique_ptr<kinematics::ArmModel> makeModel(const config::Robot& robot,
                                                  int arm,
                                                  const std::string& name) const override {
    if (name != "rigid")
      throw std::invalid_argument("model: found '" + name + "', expected rigid for planar arms");
    return std::make_unique<PlanarModel>(armOf(robot, arm));
  }

 private:
  static const config::PlanarArm& armOf(const config::Robot& robot, int arm) {
    return static_cast<const config::PlanarRobot&>(*robot.data).arms[static_cast<std::size_t>(arm)];
  }
};

}  // namespace

const RobotType& planarType() {
  static const PlanarType type;
  return type;
}

}  // namespace tandem::robots
