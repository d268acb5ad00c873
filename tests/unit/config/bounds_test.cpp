// SPDX-License-Identifier: Apache-2.0
/** @file Bounds in the key tables: a value at its bound is usable in a control step; a value beyond it is refused at
 * its key. */
#include <yaml-cpp/yaml.h>

#include <cmath>

#include "config/cooperative.h"
#include "config/detail/exact.h"
#include "config/path.h"
#include "config/robot_files.h"
#include "control/resolver.h"
#include "hal/cia402/detail/node_setups.h"
#include "kinematics/tube_model.h"
#include "robots/plant/plant.h"
#include "services/runtime/periodic_loop.h"
#include "sim/actuation.h"
#include "sim/plant_tips.h"
#include "sim/tip_tracker.h"
#include "support.h"

namespace tandem::config::test {
namespace {

/// A number that a file has or may have: its keys and list indices, and its field.
struct Place {
  std::vector<std::string> path;
  const Field* field;
};

bool canBeEmpty(const Mapping& table) {
  return table.alternatives.empty() && !table.exactly_one && std::ranges::none_of(table.fields, &Field::is_required);
}

std::string keyIn(const YAML::Node& node, const Field& field) {
  for (const auto& [key, unit] : field.keys()) {
    if (node.IsMap() && node[key].IsDefined())
      return key;
  }
  return {};
}

bool isOneOf(const Field& field, const Mapping& table) {
  return std::ranges::any_of(table.alternatives,
                             [&](const auto& group) { return std::ranges::find(group, field.name) != group.end(); });
}

void collect(const YAML::Node& node,
             const Mapping& table,
             const std::vector<std::string>& path,
             std::vector<Place>& places) {
  for (const Field& field : table.fields) {
    const std::string key = keyIn(node, field);
    if (key.empty() && (isOneOf(field, table) || table.exactly_one))
      continue;
    if (field.type == Type::kInteger || field.type == Type::kNumber)
      places.push_back({path, &field});
    if (field.type != Type::kMapping || (key.empty() && (field.is_list || !canBeEmpty(*field.mapping))))
      continue;
    auto next = path;
    next.push_back(field.name);
    const YAML::Node below = key.empty() ? YAML::Node() : node[key];
    if (field.is_list)
      next.emplace_back("0");
    collect(field.is_list ? below[0] : below, *field.mapping, next, places);
  }
}

/// The text with this value, SI, at a place.
std::string with(const std::string& text, const Place& place, double value) {
  const YAML::Node root = YAML::Load(text);
  std::vector<YAML::Node> nodes{root};
  for (const std::string& step : place.path)
    nodes.push_back(step == "0" ? nodes.back()[0] : nodes.back()[step]);
  const Field& field = *place.field;
  if (const std::string old = keyIn(nodes.back(), field); !old.empty())
    nodes.back().remove(old);
  const auto [key, unit] = field.keys().front();
  const std::string number =
      field.type == Type::kInteger ? std::to_string(std::llround(value)) : exact(unit ? unit->fromSi(value) : value);
  for (int k = 0; k < field.min_size && field.is_list && !field.or_scalar; ++k)
    nodes.back()[key].push_back(number);
  if (!field.is_list || field.or_scalar)
    nodes.back()[key] = number;
  YAML::Emitter out;
  out << root;
  return std::string(out.c_str()) + "\n";
}

void expectSteps(const Robot& robot) {
  std::vector<std::unique_ptr<kinematics::ArmModel>> models;
  std::vector<const safety::ArmLimits*> limits;
  control::RobotVector q(robot.arms[0].jointCount() + robot.arms[1].jointCount());
  q << robot.arms[0].home, robot.arms[1].home;
  control::StepProblem problem;
  for (const Arm& arm : robot.arms)
    limits.push_back(&arm.limits);
  problem.setLimits(limits.data(), 2);
  problem.setPosition(q);
  problem.task_count = 2;
  for (control::Task& task : problem.task)
    task.jacobian.setZero(3, q.size());
  for (int k = 0, first = 0; k < 2; ++k) {
    const Arm& arm = robot.arms[static_cast<std::size_t>(k)];
    kinematics::Tip tip;
    ASSERT_EQ(kinematics::makeArmModel("rigid", arm.model)->tip(arm.home, tip), kinematics::ModelStatus::kOk);
    problem.task[0].jacobian.middleCols(first, arm.jointCount()) = (k == 0 ? 1.0 : -1.0) * tip.jacobian.topRows<3>();
    if (k == 0)
      problem.task[1].jacobian.leftCols(arm.jointCount()) = tip.jacobian.topRows<3>();
    first += arm.jointCount();
  }
  problem.task[0].velocity = Eigen::Vector3d(1e-4, 0.0, 0.0);
  problem.task[1].velocity = Eigen::Vector3d(0.0, 1e-3, 0.0);
  for (int m = 0; m < control::kMethodCount; ++m) {
    const auto method = static_cast<control::Method>(m);
    control::Solution solution;
    control::makeResolver(method, robot.parameters)->solve(problem, solution);
    EXPECT_TRUE(solution.status == control::SolveStatus::kSolved ||
                solution.status == control::SolveStatus::kInfeasible)
        << name(method) << ": " << control::name(solution.status);
    EXPECT_TRUE(solution.velocity.allFinite()) << name(method);
  }
}

void useRobot(const std::filesystem::path& file) { expectSteps(loadRobot(file)); }

void useAnyRobot(const std::filesystem::path& file) {
  const Robot robot = loadAnyRobot(file);
  for (int m = 0; m < control::kMethodCount; ++m)
    control::makeResolver(static_cast<control::Method>(m), robot.parameters);
}

void useDeployment(const std::filesystem::path& file) {
  const Deployment deployment = loadDeployment(file);
  runtime::PeriodicLoop control(deployment.control_period), plant(deployment.sim_period);
  const Robot robot = loadAnyRobot(deployment.robot);
  sim::PlantTips tips = robots::makePlantTips(robot, deployment.plant);
  for (int k = 0; k < tips.armCount(); ++k)
    tips.update(k, robot.arms[static_cast<std::size_t>(k)].home);
  sim::TipTracker tracker(tips.armCount(), deployment.plant.tracker, deployment.plant.seed);
  tracker.restart(tips, 0, 0);
  tracker.step(tips, 1'000'000'000, 1);
  sim::Actuation actuation(deployment.plant.mechanics, {}, deployment.sim_period);
  actuation.place(robot.arms[0].home);
  actuation.step(deployment.sim_period, robot.arms[0].home);
  EXPECT_TRUE(actuation.output().allFinite());
  planning::teleoperation::Pipeline pipeline(deployment.teleoperation.options, deployment.control_period);
  planning::teleoperation::TipPlaces places;
  pipeline.step({}, places);
  EXPECT_TRUE(pipeline.wanted().allFinite());
  const safety::Budgets& b = deployment.budgets;
  for (const double time :
       {b.commandAge(deployment.control_period), b.tipAge(deployment.control_period), b.planning_reference,
        b.teleoperation, b.lease, deployment.status_period, deployment.black_box.before, deployment.black_box.after})
    EXPECT_LT(1e9 * time, 0x1p63);  // counts as ns
}

void useHardware(const std::filesystem::path& file) {
  const hal::HardwareConfig hardware = loadHardware(file);
  for (const hal::AxisConfig& axis : hardware.axes) {
    const hal::AxisUnits units(axis.gearing);
    EXPECT_GT(units.toCountMagnitude(axis.quick_stop_deceleration), 0u);
    EXPECT_GT(units.toCountMagnitude(axis.velocity), 0u);
    EXPECT_GE(std::round(1e3 * axis.following_time), 1.0);  // following error time of the drive, in ms
    EXPECT_FALSE(hal::driveSetup(hardware, axis, 0.1).steps.empty());
    EXPECT_LT(1e9 * axis.stopBudget(), 0x1p63);
  }
}

void useExperiment(const std::filesystem::path& file) { loadExperiment(file); }

void useTrajectory(const std::filesystem::path& file) {
  const planning::TrajectorySpec spec = loadTrajectory(file);
  const Eigen::Vector3d start = Eigen::Vector3d::Zero();
  EXPECT_EQ(planning::sample(spec, {start, start}).size(), static_cast<std::size_t>(spec.point_count));
}

void usePath(const std::filesystem::path& file) {
  const planning::ObjectPath path = loadPath(file);
  path.check();
  planning::Twist displacement, rate;
  path.at(0.5 * path.duration, displacement, rate);
  EXPECT_TRUE(displacement.allFinite() && rate.allFinite());
}

struct Case {
  const char* preset;
  void (*use)(const std::filesystem::path&);
  const char* more = "";  ///< text to append
};

class Bounds : public testing::TestWithParam<Case> {};

/// Values inside and outside one end of a range, SI.
struct End {
  double inside, outside;
};
std::vector<End> endsOf(const Field& field) {
  const Range& range = field.range;
  const double step = field.type == Type::kInteger ? 1.0 : 1e-9;
  std::vector<End> ends;
  if (std::isfinite(range.minimum))
    ends.push_back({range.minimum + (range.exclusive_minimum ? step : 0.0),
                    range.minimum - (range.exclusive_minimum ? 0.0 : step)});
  if (std::isfinite(range.maximum))
    ends.push_back({range.maximum, range.maximum + std::max(step, 1e-9 * std::abs(range.maximum))});
  return ends;
}

TEST_P(Bounds, ValuesAtTheirBoundsAreUsable) {
  const Case& one = GetParam();
  const Folder folder;
  folder.write("robots/ark2024.yaml", readAll(presets() / "robots/ark2024.yaml"));
  const std::string good = readAll(presets() / one.preset) + one.more;
  std::vector<Place> places;
  const std::string head = YAML::Load(good)["tandem"].as<std::string>();
  collect(YAML::Load(good), tableOf(head.substr(0, head.find('/'))), {}, places);
  int loaded = 0;
  for (const Place& place : places) {
    for (const End& end : endsOf(*place.field)) {
      SCOPED_TRACE(join(place.path, ".") + "." + place.field->name + ": " + exact(end.inside));
      try {
        one.use(folder.write(one.preset, with(good, place, end.inside)));
        ++loaded;
      } catch (const Error& error) {
        // Another number causes the refusal, not the table.
        EXPECT_EQ(std::string(error.what()).find(expectation(*place.field, place.field->keys().front().second)),
                  std::string::npos)
            << error.what();
      } catch (const std::exception& error) {
        ADD_FAILURE() << "stops: " << error.what();
      }
      try {
        validate(folder.write(one.preset, with(good, place, end.outside)));
        ADD_FAILURE() << "accepted " << exact(end.outside);
      } catch (const Error& error) {
        EXPECT_GT(error.line(), 0) << error.what();
        EXPECT_NE(error.key().find(place.field->keys().front().first), std::string::npos) << error.what();
        EXPECT_NE(std::string(error.what()).find(expectation(*place.field, place.field->keys().front().second, true)),
                  std::string::npos)
            << error.what();
      }
    }
  }
  EXPECT_GE(2 * loaded, static_cast<int>(places.size()));
}

INSTANTIATE_TEST_SUITE_P(Presets,
                         Bounds,
                         testing::Values(Case{"robots/ark2024.yaml", useRobot},
                                         Case{"deployments/laptop.yaml", useDeployment,
                                              "plant: {model: compliant, tube_errors: [{arm: arm_a, tube: 1}]}\n"
                                              "port: {radius_mm: 20}\n"},
                                         Case{"hardware/ark2024-two-buses.yaml", useHardware},
                                         Case{"cooperative/ablation-pair.yaml", useAnyRobot},
                                         Case{"cooperative/ablation-assist.yaml", useAnyRobot},
                                         Case{"planar/planar-pair.yaml", useAnyRobot},
                                         Case{"experiments/table3.yaml", useExperiment},
                                         Case{"trajectories/circle.yaml", useTrajectory},
                                         Case{"paths/tip-eight.yaml", usePath}),
                         [](const auto& one) {
                           std::string name = one.param.preset;
                           std::ranges::replace_if(
                               name, [](char c) { return !std::isalnum(c); }, '_');
                           return name;
                         });

/// `nsp_damping_mm: 0` stops every method (control::makeResolver), so `tandem validate` refuses it.
TEST(Bounds, ZeroDampingIsRefusedAtItsKey) {
  expectRefusal(readAll(presets() / "robots/ark2024.yaml") + "# end\n",
                {"# end", "  nsp_damping_mm: 0", "nsp_damping_mm: 0", 16, "control.nsp_damping_mm",
                 "found 0, expected a length more than 0 in mm"},
                [](const auto& file) { validate(file); });
}

}  // namespace
}  // namespace tandem::config::test
