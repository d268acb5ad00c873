// SPDX-License-Identifier: Apache-2.0
#include "experiments/random_task.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>

#include "control/velocity_bounds.h"
#include "planning/joint_sampler.h"
#include "robots/plant/plant.h"
#include "sim/plant_tips.h"

namespace tandem::experiments {
namespace {

constexpr double kTranslation = 0.02;   // amplitude of a path, m
constexpr double kRotation = 1.0;       // and rad
constexpr double kSpacing = 0.8e-3;     // of targets, as in the paper, m
constexpr int kFewest = 8, kMost = 60;  // points
constexpr int kSteps = 240;             // places at which a path is looked at
constexpr double kShrink = 0.9;         // of the amplitude, from try to try
constexpr int kTries = 400;
constexpr int kTriesPerStart = 20;
constexpr double kInside = 1e-9;                   // of a limit, m or rad
constexpr double kBeyond = 5e-3, kSpread = 15e-3;  // out of reach by, m

/** Numbers that are the same with every standard library. */
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : engine_(seed) {}
  double uniform(double from, double to) {
    return from + (to - from) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
  }
  int integer(int count) { return static_cast<int>(engine_() % static_cast<std::uint64_t>(count)); }
  std::mt19937_64& engine() { return engine_; }

 private:
  std::mt19937_64 engine_;
};

/** q(t) - q_0. */
class Curve {
 public:
  Curve(PathKind kind, const RobotModel& model, double scale, Draw& draw) : kind_(kind) {
    const int n = model.jointCount();
    for (safety::RobotVector* v : {&u_, &w_, &phase_, &cycles_})
      v->setZero(n);
    piece_ = draw.uniform(0.5, 1.0);
    for (int k = 0; k < model.armCount(); ++k) {
      for (int j = 0; j < model.size(k); ++j) {
        const int i = model.offset(k) + j;
        const double most = scale * (2 * j < model.size(k) ? kTranslation : kRotation);
        u_[i] = draw.uniform(-most, most);
        w_[i] = draw.uniform(-most, most);
        phase_[i] = draw.uniform(0.0, 2.0 * std::numbers::pi);
        cycles_[i] = piece_ * (1.0 + draw.integer(3));
      }
    }
  }

  safety::RobotVector at(double t) const {
    const double angle = 2.0 * std::numbers::pi * piece_ * t;
    if (kind_ == PathKind::kLine)
      return t * u_;
    if (kind_ == PathKind::kCircle)
      return (std::cos(angle) - 1.0) * u_ + std::sin(angle) * w_;
    safety::RobotVector q(u_.size());
    for (int j = 0; j < q.size(); ++j)
      q[j] = u_[j] * (std::sin(2.0 * std::numbers::pi * cycles_[j] * t + phase_[j]) - std::sin(phase_[j]));
    return q;
  }

 private:
  PathKind kind_;
  double piece_ = 1.0;
  safety::RobotVector u_, w_, phase_, cycles_;
};

/** The path of all joints at kSteps + 1 places, and where the plant is there. */
struct Path {
  std::vector<safety::RobotVector> q;
  std::vector<planning::TrajectoryPoint> at;
  std::vector<double> length;  ///< from the start, by what the two targets move, m
  std::vector<sim::PlantTips::Configurations> placed{static_cast<std::size_t>(kSteps + 1)};
};

/// Points that a path of this length has.
int pointsOn(double length) { return static_cast<int>(std::ceil(length / kSpacing)); }

bool inside(const RobotModel& model, const safety::RobotVector& q) {
  for (int k = 0; k < model.armCount(); ++k) {
    const Eigen::VectorXd joints = q.segment(model.offset(k), model.size(k));
    if (safety::largestViolation(*model.limits()[static_cast<std::size_t>(k)], joints) > -kInside)
      return false;
  }
  return true;
}

/// Activation distance of a soft task.
double softDistance(planning::TaskKind kind) {
  return kind == planning::TaskKind::kJointLimits ? kKeptDistance : kKeptStability;
}

/// Whether arm a has nothing nearer than the activation distance of a soft task.
bool keepsAway(const RobotModel& model,
               const planning::TrajectorySpec& spec,
               const safety::RobotVector& q,
               const sim::PlantTips& tips) {
  return std::ranges::none_of(spec.further, [&](const planning::FurtherTask& task) {
    if (task.kind == planning::TaskKind::kElasticStability)
      return tips.stability(task.arm) < kKeptStability;
    return task.kind == planning::TaskKind::kJointLimits &&
           kinematics::jointLimitAvoidance(*model.limits()[static_cast<std::size_t>(task.arm)],
                                           q.segment(model.offset(task.arm), model.size(task.arm)), kKeptDistance)
                   .cost > 0.0;
  });
}

/// Adds the further task to a trajectory without one.
void addFurther(planning::TaskKind kind, planning::TrajectorySpec& spec) {
  if (kind == planning::TaskKind::kNone)
    return;
  planning::FurtherTask task;
  task.kind = kind;
  task.other_arm = task.relative() ? 1 : 0;
  spec.tip_task = kind != planning::TaskKind::kTipPose;
  if (kind == planning::TaskKind::kRelativePose)
    spec.other_arm = planning::kNoArm;
  else
    task.priority = spec.taskCount();
  spec.further.push_back(task);
}

/// The point at which the plant is, with the place of a further task.
planning::TrajectoryPoint pointOf(const planning::TrajectorySpec& spec, const sim::PlantTips& tips) {
  planning::TrajectoryPoint at = planning::positionsAt(spec, [&](int arm) { return tips.pose(arm); });
  for (std::size_t k = 0; k < spec.further.size(); ++k) {
    const planning::FurtherTask& task = spec.further[k];
    kinematics::TaskPlace& place = at.further[k];
    const kinematics::TaskKindEntry& kind = *kinematics::findTaskKind(task.kind);
    place = kind.place(tips.pose(task.arm), tips.pose(task.other_arm));
    if (kind.point == kinematics::TaskPoint::kShaft)
      place.position = tips.shaftPoint(task.arm, kShaftShare);
    if (kind.soft())
      place.position = {softDistance(task.kind), 0.0, 0.0};
    if (task.kind == planning::TaskKind::kLookAt)
      place.position += kSight * tips.pose(task.arm).linear().col(2);
  }
  return at;
}

/// The path, if it stays inside all limits, the plant follows it without a snap, and it is not too long.
bool follow(const RobotModel& model,
            const planning::TrajectorySpec& spec,
            const safety::RobotVector& start,
            const Curve& curve,
            sim::PlantTips& tips,
            Path& path) {
  path.q.clear();
  path.at.clear();
  path.length.clear();
  for (int i = 0; i <= kSteps; ++i) {
    path.q.push_back(start + curve.at(static_cast<double>(i) / kSteps));
    if (!inside(model, path.q.back()))
      return false;
  }
  tips.restart();
  std::uint32_t snaps = 0;
  for (int k = 0; k < model.armCount(); ++k)
    snaps += tips.snaps(k);
  for (const safety::RobotVector& q : path.q) {
    std::uint32_t now = 0;
    for (int k = 0; k < model.armCount(); ++k) {
      tips.update(k, q.segment(model.offset(k), model.size(k)));
      if (!tips.valid(k) || !(tips.stability(k) > 0.0))
        return false;
      now += tips.snaps(k);
    }
    if (now != snaps || !keepsAway(model, spec, q, tips))
      return false;
    tips.store(path.placed[path.at.size()]);
    const planning::TrajectoryPoint at = pointOf(spec, tips);
    path.length.push_back(path.at.empty()
                              ? 0.0
                              : path.length.back() + std::max((at.tip - path.at.back().tip).norm(),
                                                              (at.relative - path.at.back().relative).norm()));
    path.at.push_back(at);
    if (pointsOn(path.length.back()) > kMost)
      return false;
  }
  return true;
}

/// Indices into the path, evenly spaced along it; empty where it is too short.
std::vector<std::size_t> choosePoints(const Path& path) {
  const std::vector<double>& length = path.length;
  const int count = pointsOn(length.back());
  if (count < kFewest)
    return {};
  std::vector<std::size_t> points;
  for (int k = 1; k <= count; ++k) {
    const auto next = std::lower_bound(length.begin(), length.end() - 1, length.back() * k / count);
    points.push_back(static_cast<std::size_t>(next - length.begin()));
  }
  return points;
}

/// Whether the bodies of arms touch at the start or at one of the chosen places.
bool touches(const Path& path, const std::vector<std::size_t>& chosen, const sim::PlantTips& tips) {
  const auto overlap = [&](std::size_t i) { return tips.clearance(path.placed[i]) < 0.0; };
  return overlap(0) || std::ranges::any_of(chosen, overlap);
}

/// Whether every joint can go from q to next in `time`, at velocities inside the bounds at both.
bool goes(control::StepProblem& problem,
          const safety::RobotVector& q,
          const safety::RobotVector& next,
          double period,
          double rotation,
          double time) {
  const safety::RobotVector velocity = (next - q) / time;
  for (const safety::RobotVector* at : {&q, &next}) {
    problem.setPosition(*at);
    control::VelocityBounds bounds;
    velocityBounds(problem, control::BoundsKind::kCoupled, period, bounds);
    for (int j = 0; j < q.size(); ++j) {
      // The bound at the end of the step holds for going on towards the limit, not for having come there.
      const bool turns = problem.joint[static_cast<std::size_t>(j)].kind == control::JointKind::kRotation;
      if ((velocity[j] > 0.0 ? velocity[j] > bounds.upper[j] : velocity[j] < bounds.lower[j]) ||
          (turns && std::abs(velocity[j]) > rotation))
        return false;
    }
    for (int i = 0; i < bounds.row_count; ++i) {
      const control::CoupledRow& row = problem.row[static_cast<std::size_t>(i)];
      if (row.a_first * velocity[row.first] + row.a_second * velocity[row.second] >
          bounds.row_rate[static_cast<std::size_t>(i)])
        return false;
    }
  }
  return true;
}

/// Moves the last third of the tip's targets to where the arm cannot reach.
void putOutOfReach(const config::Arm& arm,
                   const planning::TrajectorySpec& spec,
                   Draw& draw,
                   std::vector<planning::TrajectoryPoint>& points) {
  const Eigen::Vector3d entry = arm.model.base.translation();
  // 25 %: an error of the plant's length of five standard deviations of 5 %.
  const double reach = 1.25 * arm.model.tubes.front().length() + arm.model.tool.translation().norm();
  const double beyond = reach + kBeyond + draw.uniform(0.0, kSpread);
  for (std::size_t i = points.size() - points.size() / 3; i < points.size(); ++i) {
    points[i].tip = entry + beyond * (points[i].tip - entry).normalized();
    if (!spec.tip_task)
      points[i].further[0].position = points[i].tip;
  }
}

}  // namespace

std::string_view name(PathKind kind) {
  constexpr std::array<std::string_view, kPathKinds> kNames{"line", "circle", "lissajous"};
  return kNames[static_cast<std::size_t>(kind)];
}

bool isRandomKind(planning::TaskKind kind) {
  const kinematics::TaskKindEntry* entry = kinematics::findTaskKind(kind);
  return entry != nullptr && isFurther(kind);
}

std::uint64_t seedOf(std::uint64_t seed, int index) {
  // SplitMix64.
  std::uint64_t x = seed + 0x9E3779B97F4A7C15u * (static_cast<std::uint64_t>(index) + 1);
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
  return x ^ (x >> 31);
}

RandomTask randomTask(const config::Robot& robot,
                      const RobotModel& model,
                      const LoopOptions& options,
                      double rotation,
                      std::uint64_t seed,
                      int index,
                      bool feasible,
                      planning::TaskKind further) {
  Draw draw(seedOf(seed, index));
  std::vector<planning::JointSampler> samplers;
  for (const config::Arm& arm : robot.arms)
    samplers.emplace_back(arm.limits);
  sim::PlantTips tips = robots::makePlantTips(robot, options.plant);
  control::StepProblem problem;
  problem.setLimits(model.limits().data(), model.armCount());

  RandomTask task;
  task.feasible = feasible;
  planning::TrajectorySpec& spec = task.plan.trajectory;
  spec.point_duration = 1.0;
  if (model.armCount() < 2)
    spec.other_arm = planning::kNoArm;
  addFurther(further, spec);
  const double time = spec.max_iterations * options.control_period;
  Path path;
  for (int attempt = 0; attempt < kTries; ++attempt) {
    const double scale = std::pow(kShrink, attempt % kTriesPerStart);
    if (attempt % kTriesPerStart == 0) {
      task.kind = static_cast<PathKind>(draw.integer(kPathKinds));
      task.plan.start.clear();
      for (const planning::JointSampler& sampler : samplers)
        task.plan.start.emplace_back(sampler.random(draw.engine()));
    }
    const safety::RobotVector start = model.stack(task.plan.start);
    if (!follow(model, spec, start, Curve(task.kind, model, scale, draw), tips, path))
      continue;
    const std::vector<std::size_t> chosen = choosePoints(path);
    bool possible = !chosen.empty();
    for (std::size_t k = 0; possible && k < chosen.size(); ++k)
      possible =
          goes(problem, path.q[k == 0 ? 0 : chosen[k - 1]], path.q[chosen[k]], options.control_period, rotation, time);
    if (!possible || (feasible && touches(path, chosen, tips)))
      continue;
    for (const std::size_t i : chosen) {
      task.plan.points.push_back(path.at[i]);
      if (feasible)
        task.witness.push_back(path.q[i]);
    }
    if (!feasible)
      putOutOfReach(robot.arms.front(), spec, draw, task.plan.points);
    if (!spec.further.empty())
      spec.further[0].target = path.at.front().further[0].position;
    spec.name = std::string(name(task.kind));
    spec.point_count = static_cast<int>(chosen.size());
    task.plan.key = {spec.name, std::to_string(index), control::Method::kNspqp};
    return task;
  }
  throw std::runtime_error("task " + std::to_string(index) + " of seed " + std::to_string(seed) +
                           ": found no path inside all limits; use another seed");
}

}  // namespace tandem::experiments
