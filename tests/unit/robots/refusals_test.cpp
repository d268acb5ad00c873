// SPDX-License-Identifier: Apache-2.0
/** @file Comparison of docs/refusals.md with the capabilities of robots and the freedom of tasks. TANDEM_WRITE_DOCS=1
 * writes it. */
#include <gtest/gtest.h>

#include <sstream>

#include "config/robot_files.h"
#include "planning/task_freedom.h"
#include "robots/orientation_freedom.h"
#include "robots/robot_model.h"
#include "robots/robot_type.h"
#include "tests/unit/documented_page.h"

namespace tandem::robots {
namespace {

constexpr std::pair<Capability, const char*> kFunctions[] = {
    {Capability::kTips,
     "tasks of tips: trajectories, CRTK and teleoperation of a tip, measured tips, `tandem experiment`, `tandem "
     "solve`, Python"},
    {Capability::kCommonPath, "a path of the common object: `tandem cooperative`, `tandem robot run` of a path"},
    {Capability::kComputation,
     "computations before a motion: `tandem plan`, `tandem robot run --planned`, `tandem montecarlo`, `tandem "
     "workspace`"},
    {Capability::kStability, "elastic stability: `tandem stability`"},
};

/// Presets that differ in their tasks, at least one of each type.
std::vector<std::string> exampleRobots() {
  std::vector<std::string> names{"robots/ark2024",     "robots/timc2024",           "robots/handheld",
                                 "planar/planar-pair", "cooperative/ablation-pair", "cooperative/ablation-assist"};
  for (const config::RobotFile& type : config::robotFiles()) {
    const std::string folder = type.presets + "/";
    if (std::ranges::any_of(names, [&](const std::string& name) { return name.starts_with(folder); }))
      continue;
    for (const auto& file : std::filesystem::directory_iterator(std::filesystem::path(TANDEM_PRESETS) / type.presets))
      names.push_back(folder + file.path().stem().string());
  }
  return names;
}
const std::vector<std::string> kRobots = exampleRobots();

config::Robot robotOf(const std::string& name) {
  return config::loadAnyRobot(std::filesystem::path(TANDEM_PRESETS) / (name + ".yaml"));
}

std::string nameOf(const std::string& path) { return path.substr(path.find('/') + 1); }

/// What the refusal says after "robot: found ... of FILE, expected ": the types that have it, and the reason.
std::string reasonOf(const config::Robot& robot, Capability capability) {
  const std::string text = refusal(robot, capability), mark = ", expected ";
  const std::size_t at = text.find(mark);
  return at == std::string::npos ? "" : text.substr(at + mark.size());
}

/// Degrees of freedom that a task of a kind alone has at home; empty: the robot has too few arms.
std::string rankAtHome(const config::Robot& robot, const RobotModel& model, const kinematics::TaskKindEntry& kind) {
  if (model.armCount() < kind.arms)
    return "one arm";
  std::vector<Eigen::VectorXd> home;
  for (const config::Arm& arm : robot.arms)
    home.push_back(arm.home);
  const safety::RobotVector q = model.stack(home);
  planning::TrajectorySpec spec;
  spec.other_arm = planning::kNoArm;
  planning::FurtherTask task;
  task.kind = kind.kind;
  task.other_arm = kind.arms - 1;
  std::vector<kinematics::ShapePoint> shape;
  EXPECT_EQ(model.models()[0]->shape(q.head(model.size(0)), 11, shape), kinematics::ModelStatus::kOk);
  // A point beside the middle of the shaft for a remote centre, a target beside the tip for a direction of view.
  const bool shaft = kind.point == kinematics::TaskPoint::kShaft;
  task.target = shape[shaft ? 5 : 10].pose * Eigen::Vector3d(shaft ? 0.0 : 0.01, 0.0, shaft ? 0.0 : 0.05);
  const bool tip = kind.kind == planning::TaskKind::kTipPosition;
  const bool relative = kind.kind == planning::TaskKind::kRelativePosition;
  if (relative)
    spec.other_arm = 1;
  else if (!tip)
    spec.further = {task};
  if (const std::string wrong = spec.wrongModels(model.models()); !wrong.empty())
    return "refused";
  if (kind.soft())
    return "yes";
  const auto freedom = planning::taskFreedom({model.models(), model.limits()}, spec, q);
  if (freedom.empty())
    return "no solution";
  const planning::TaskFreedom& first = freedom.front();
  return first.rank == first.rows ? "yes" : std::to_string(first.rank) + " of " + std::to_string(first.rows);
}

/// With the model that can do the kind, if the type has one.
std::string cell(const config::Robot& robot, const kinematics::TaskKindEntry& kind) {
  const std::string rigid = rankAtHome(robot, RobotModel(robot), kind);
  if (rigid != "refused" || robot.arms[0].model.tubes.empty())
    return rigid;
  return rankAtHome(robot, RobotModel(robot, "compliant"), kind) + ", compliant model";
}

/// The reason why a model without elastic interaction does not have the task.
std::string stabilityRefusal() {
  const RobotModel planar(robotOf("planar/planar-pair"));
  planning::TrajectorySpec spec;
  planning::FurtherTask task;
  task.kind = planning::TaskKind::kElasticStability;
  spec.further = {task};
  return spec.wrongModels(planar.models());
}

/// What an arm of a robot can follow beside its positions, as orientationRefusal() says.
std::string orientationCell(const config::Robot& robot, planning::teleoperation::TipOrientation orientation) {
  if (!has(robot, Capability::kTips))
    return "refused";
  const RobotModel model(robot);
  if (orientationRefusal(robot, model, orientation).empty())
    return "yes";
  int least = 3, rows = 0;
  for (int k = 0; k < model.armCount(); ++k) {
    const planning::TaskFreedom freedom = orientationFreedom(robot, model, k, orientation);
    least = std::min(least, freedom.rank);
    rows = freedom.rows;
  }
  return "refused, " + std::to_string(least) + " of " + std::to_string(rows);
}

std::string orientationTable(const std::vector<std::pair<std::string, config::Robot>>& robots) {
  using planning::teleoperation::TipOrientation;
  std::string text =
      "\n## Orientations of operators and CRTK clients\n\n"
      "`teleoperation.orientation` of a deployment ([teleoperation.md](teleoperation.md#orientation)): the degrees of "
      "freedom that the position of a tip leaves\nto its orientation at home, of the arm with the fewest. With fewer "
      "than the key needs, `tandem validate` and the start of\n`tandem-control` refuse it.\n\n| `orientation` |";
  for (const auto& [name, robot] : robots)
    text += " `" + name + "` |";
  text += "\n|---|";
  for (std::size_t k = 0; k < robots.size(); ++k)
    text += "---|";
  for (const auto& [word, orientation] :
       {std::pair{"axis", TipOrientation::kAxis}, std::pair{"full", TipOrientation::kFull}}) {
    text += std::string("\n| `") + word + "` |";
    for (const auto& [name, robot] : robots)
      text += " " + orientationCell(robot, orientation) + " |";
  }
  const config::Robot planar = robotOf("planar/planar-pair");
  return text + "\n\nThe reason, after the file and the key: " +
         orientationRefusal(planar, RobotModel(planar), TipOrientation::kFull) + ".\n";
}

std::string page() {
  std::ostringstream out;
  out << "# Refusals\n\n"
         "The test `test_robots` writes this page from the capabilities of the types of robots (`robots/capability.h`) "
         "and from the Jacobians of\nthe preset robots, and compares the two (`TANDEM_WRITE_DOCS=1` writes it again). "
         "It lists what a robot is refused, and why. What\nan arm is refused in a state is in "
         "[permissions.md](permissions.md).\n\n## By type\n\n| function |";
  std::vector<std::pair<std::string, config::Robot>> robots;
  for (const std::string& name : kRobots)
    robots.emplace_back(nameOf(name), robotOf(name));
  for (const RobotType* type : robotTypes())
    out << ' ' << type->description() << " |";
  out << "\n|---|";
  for (std::size_t k = 0; k < robotTypes().size(); ++k)
    out << "---|";
  for (const auto& [capability, function] : kFunctions) {
    out << "\n| " << function << " |";
    for (const RobotType* type : robotTypes())
      out << (type->has(capability) ? " yes |" : " refused |");
  }
  out << "\n\nThe reason, as a command, a service, the page and Python say it, with the file of the robot before "
         "it:\n\n";
  for (const RobotType* type : robotTypes()) {
    const auto one = std::ranges::find_if(robots, [&](const auto& entry) { return &typeOf(entry.second) == type; });
    for (const auto& [capability, function] : kFunctions) {
      if (one != robots.end() && !type->has(capability))
        out << "- the " << type->description() << ": expected " << reasonOf(one->second, capability) << '\n';
    }
  }
  out << "\n## Tasks of tips\n\n"
         "Degrees of freedom of each kind of task ([tasks.md](tasks.md)) that the joints of the first arm move at "
         "home, "
         "the task alone. *yes*: all of\nthem; a smaller number: the rest of the task keeps its error; 0: nothing of "
         "it can "
         "be done there. `tandem plan check`, for types\nthat have it, prints the rank over a trajectory and refuses a "
         "task "
         "without any.\n\n| kind |";
  for (const auto& [name, robot] : robots)
    out << " `" << name << "` |";
  out << "\n|---|";
  for (std::size_t k = 0; k < robots.size(); ++k)
    out << "---|";
  for (const auto& [kind, wire_name, meaning] : idl::Enumeration<planning::TaskKind>::entries) {
    const kinematics::TaskKindEntry* entry = kinematics::findTaskKind(kind);
    if (entry == nullptr)
      continue;
    out << "\n| `" << entry->name << "` |";
    for (const auto& [name, robot] : robots)
      out << ' ' << (has(robot, Capability::kTips) ? cell(robot, *entry) : "refused") << " |";
  }
  out << "\n\n*refused*: tips of catheters cannot be commanded one by one, see above. Soft tasks (`joint_limits`, "
         "`elastic_stability`) have no rank where\nnothing is near; the reason of their refusal, after the file and "
         "the "
         "task: "
      << stabilityRefusal() << ".\n"
      << orientationTable(robots);
  return out.str();
}

TEST(Refusals, DocumentedPageMatchesTheCapabilities) {
  test::expectPage("refusals.md", page(), "build/release/tests/test_robots --gtest_filter=Refusals.*");
}

/// Every function is on the page, and every type that lacks one has a reason.
TEST(Refusals, EveryTypeHasAnExampleAndEveryRefusalAReason) {
  for (const RobotType* type : robotTypes()) {
    const auto one =
        std::ranges::find_if(kRobots, [&](const std::string& name) { return &typeOf(robotOf(name)) == type; });
    ASSERT_NE(one, kRobots.end()) << type->description();
    for (const auto& [capability, function] : kFunctions) {
      EXPECT_EQ(reasonOf(robotOf(*one), capability).empty(), type->has(capability))
          << type->description() << ": " << function;
    }
  }
}

}  // namespace
}  // namespace tandem::robots
