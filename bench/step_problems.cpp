// SPDX-License-Identifier: Apache-2.0
#include "bench/step_problems.h"

#include <random>

#include "bench/joint_paths.h"
#include "kinematics/rigid_model.h"

namespace tandem::bench {
safety::ArmLimits limitsOf(const kinematics::ConcentricTubeArm& arm) {
  safety::TubeLimitSpec spec;
  for (const kinematics::Tube& tube : arm.tubes) {
    spec.tube_length.push_back(tube.length());
    spec.stage_minimum.push_back(-tube.length());
    spec.stage_maximum.push_back(0.0);
  }
  spec.carriage_spacing.assign(arm.tubes.size() - 1, 0.0);
  spec.minimum_extension.assign(arm.tubes.size() - 1, 0.0);
  spec.translation.velocity = 5e-3;
  spec.translation.approach_acceleration = 1e-3;
  return safety::makeTubeLimits(spec);
}

std::vector<control::StepProblem> randomSteps(int count, std::uint32_t seed) {
  const kinematics::RigidModel model(arkArm());
  const safety::ArmLimits limits = limitsOf(model.arm());
  const safety::ArmLimits* both[] = {&limits, &limits};
  std::mt19937 engine(seed);
  const auto velocity = [&](double most) {
    std::uniform_real_distribution<double> uniform(-most, most);
    return Eigen::Vector3d(uniform(engine), uniform(engine), uniform(engine));
  };
  const auto joints = randomJoints(model.arm(), true, 2 * count, seed);
  std::vector<control::StepProblem> steps(static_cast<std::size_t>(count));
  for (std::size_t k = 0; k < steps.size(); ++k) {
    control::StepProblem& step = steps[k];
    const Eigen::VectorXd& a = joints[2 * k];
    const Eigen::VectorXd& b = joints[2 * k + 1];
    kinematics::Tip tip_a, tip_b;
    model.tip(a, tip_a);
    model.tip(b, tip_b);
    step.setLimits(both, 2);
    control::RobotVector q(12);
    q << a, b;
    step.setPosition(q);
    step.task_count = 2;
    step.task[0].jacobian.setZero(3, 12);
    step.task[0].jacobian << tip_a.jacobian.topRows<3>(), -tip_b.jacobian.topRows<3>();
    step.task[0].velocity = velocity(3e-4);
    step.task[1].jacobian.setZero(3, 12);
    step.task[1].jacobian.leftCols(6) = tip_a.jacobian.topRows<3>();
    step.task[1].velocity = velocity(3e-3);
  }
  return steps;
}

control::QuadraticProgram randomProgram(std::uint32_t seed, int rows) {
  std::mt19937 engine(seed);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine);
  };
  constexpr int kVariables = 12, kEqualities = 3;
  control::QuadraticProgram qp;
  qp.resize(kVariables, kEqualities, rows);
  const auto entry = [&] { return uniform(-1.0, 1.0); };
  const Eigen::MatrixXd root = Eigen::MatrixXd::NullaryExpr(kVariables, kVariables, entry);
  qp.H = root.transpose() * root + 1e-3 * Eigen::MatrixXd::Identity(kVariables, kVariables);
  qp.g = Eigen::VectorXd::NullaryExpr(kVariables, entry);
  const Eigen::VectorXd inside = Eigen::VectorXd::NullaryExpr(kVariables, entry);
  qp.E = Eigen::MatrixXd::NullaryExpr(kEqualities, kVariables, entry);
  qp.e = qp.E * inside;
  qp.A = Eigen::MatrixXd::NullaryExpr(rows, kVariables, entry);
  for (int i = 0; i < rows; ++i)
    qp.b[i] = qp.A.row(i).dot(inside) + uniform(0.0, 0.5);
  for (int i = 0; i < kVariables; ++i) {
    qp.lower[i] = inside[i] - uniform(0.0, 1.5);
    qp.upper[i] = inside[i] + uniform(0.0, 1.5);
  }
  return qp;
}

}  // namespace tandem::bench
