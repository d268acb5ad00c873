// SPDX-License-Identifier: Apache-2.0
/** @file tandem conformance hal: whether a process keeps the contract of the role hal (docs/own-hardware.md). */
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "config/robot_files.h"
#include "services/cli/conformance/limits.h"
#include "services/cli/conformance/verdict.h"
#include "services/cli/subcommand.h"
#include "services/runtime/periodic_loop.h"

namespace tandem::cli {
namespace {

struct ConformanceCommand {
  std::string deployment = runtime::defaultDeployment();
  std::vector<std::string> only;
  bool yes = false, no_limits = false;
};

using Json = nlohmann::ordered_json;

/// Whether no real joint moves: the simulator, or simulated drives of this deployment.
bool isSimulated(const Commander& commander) {
  const auto drives = commander.drives();
  const bool simulator =
      !drives.empty() && std::ranges::all_of(drives, [](const auto& d) { return d.process == "sim"; });
  return simulator || std::ranges::any_of(commander.deployment().processes, [](const config::Process& process) {
           return std::filesystem::path(process.executable).filename() == "tandem-drive-sim";
         });
}

std::vector<ConformanceTest> chosenTests(const ConformanceCommand& options) {
  std::vector<ConformanceTest> tests = conformanceTests();
  std::erase_if(tests, [&](const ConformanceTest& test) {
    const bool chosen = options.only.empty() || std::ranges::find(options.only, test.name) != options.only.end();
    return !chosen || (test.goes_to_limits && options.no_limits);
  });
  return tests;
}

std::vector<std::string> testNames() {
  std::vector<std::string> names;
  for (const ConformanceTest& test : conformanceTests())
    names.push_back(test.name);
  return names;
}

/** Travel of the joints in all tests except those at limits. */
struct Range {
  double translation = 0.0, rotation = 0.0;  ///< m, rad
};

Range rangeOf(const Commander& commander) {
  Range range;
  commander.forEachJoint([&](int arm, int joint, std::size_t i) {
    const safety::ArmLimits& limits = commander.robot().arms[static_cast<std::size_t>(arm)].limits;
    const double fast = limits.joints[static_cast<std::size_t>(joint)].velocity * commander.period();
    const double way =
        2.0 * commander.slow().speed[i] * commander.slow().seconds + (std::isfinite(fast) ? 2.0 * fast : 0.0);
    double& of = commander.isTranslation(arm, joint) ? range.translation : range.rotation;
    of = std::max(of, way);
  });
  return range;
}

std::string warningOf(const Commander& commander, const Range& range, const std::vector<ConformanceTest>& tests) {
  std::string text =
      fmt::format("The robot will move: each joint slowly, up to {:.3g} mm or {:.3g} rad from where it stands",
                  1e3 * range.translation, range.rotation);
  for (const bool coupled : {false, true}) {
    const bool goes =
        std::ranges::any_of(tests, [&](const auto& t) { return t.name == (coupled ? "coupled" : "limit"); });
    const auto travel = nearestLimit(commander.robot(), commander.state(), coupled);
    if (goes && travel)
      text += "; then " + describe(*travel, commander.robot()) + ", and back";
  }
  return text + ". Ctrl-C stops it.";
}

/// Permits the range of a test, which for the tests at limits is the way to them.
void permit(Commander& commander, const Range& range, const ConformanceTest& test) {
  Range permitted = range;
  const auto travel = nearestLimit(commander.robot(), commander.state(), test.name == "coupled");
  if (test.goes_to_limits && travel) {
    const bool translation = commander.isTranslation(travel->arm, travel->joint);
    (translation ? permitted.translation : permitted.rotation) += 1.5 * travel->distance;
  }
  commander.permit(permitted.translation, permitted.rotation);
}

Verdict attempt(Commander& commander, const ConformanceTest& test) {
  try {
    return test.run(commander);
  } catch (const Aborted&) {
    throw;
  } catch (const Failure& failure) {
    Verdict verdict;
    verdict.require(false, "the test to come to its end", failure.what());
    return verdict;
  }
}

/// Repeats a test that fails while this PC does not let this process send in time.
Verdict judge(Commander& commander, const ConformanceTest& test) {
  constexpr int kAttempts = 3;
  for (int k = 1;; ++k) {
    commander.resetLateness();
    const Verdict verdict = attempt(commander, test);
    const bool late = commander.lateness() > 0.5 * commander.budget();
    if (verdict.passed() || !late || k == kAttempts)
      return verdict;
    std::cerr << fmt::format("{}: this command was {:.0f} ms late; again\n", test.name, 1e3 * commander.lateness());
  }
}

void print(const ConformanceTest& test, const Verdict& verdict) {
  std::cout << fmt::format("{}  {:<14} {}: ", verdict.passed() ? "pass" : "FAIL", test.name, test.what);
  std::cout << (verdict.passed() ? verdict.found() : "found " + verdict.found() + ", expected " + verdict.expected())
            << '\n'
            << std::flush;
}

Json jsonOf(const ConformanceTest& test, const Verdict& verdict) {
  Json row{{"test", test.name}, {"what", test.what}, {"pass", verdict.passed()}, {"found", verdict.found()}};
  if (!verdict.passed())
    row["expected"] = verdict.expected();
  return row;
}

/// Takes the power from all arms, and leaves the robot as it was found.
void finish(Commander& commander) {
  constexpr double kTimeout = 10.0;  // s
  try {
    commander.request(safety::DriveRequest::kDisable, safety::OperatingState::kDisabled, kTimeout);
  } catch (const Failure& failure) {
    std::cerr << "the arms are not DISABLED: " << failure.what() << '\n';
  }
}

int run(const ConformanceCommand& options) {
  const std::vector<ConformanceTest> tests = chosenTests(options);
  runtime::StopSignal stop;
  const config::Deployment deployment = runtime::loadDeployment(options.deployment);
  if (deployment.clock == config::ClockMode::kLockStep)
    throw Failure(kUsage, deployment.file.string() + ": clock: found lock_step, expected real_time");
  const config::Robot robot = config::loadAnyRobot(deployment);
  // As tandem-control, whose place this process takes; without the right to a priority it runs without.
  constexpr int kPriority = 20;
  runtime::enterRealtime(kPriority, false);
  Commander commander(deployment, robot, stop);
  constexpr double kConnect = 10.0;  // s
  commander.connect(kConnect);
  const Range range = rangeOf(commander);
  const std::string warning = warningOf(commander, range, tests);
  if (!isSimulated(commander) && !options.yes)
    throw Failure(kUsage, warning + " Nothing has moved yet; --yes starts the test");
  std::cerr << warning << '\n';
  Json rows = Json::array();
  std::size_t passed = 0;
  for (const ConformanceTest& test : tests) {
    permit(commander, range, test);
    const Verdict verdict = judge(commander, test);
    passed += verdict.passed() ? 1 : 0;
    rows.push_back(jsonOf(test, verdict));
    if (!client::asJson())
      print(test, verdict);
  }
  finish(commander);
  const std::size_t left_out = conformanceTests().size() - tests.size();
  answer(fmt::format("{} of {} tests passed{}", passed, tests.size(),
                     left_out == 0 ? "" : fmt::format(", {} left out", left_out)),
         {{"deployment", deployment.name}, {"passed", passed}, {"left_out", left_out}, {"tests", rows}});
  return passed == tests.size() ? kOk : kFailure;
}

}  // namespace

void registerConformance(CLI::App& app, int& exit_code) {
  CLI::App* conformance = app.add_subcommand("conformance", "test whether own processes keep Tandem's contracts");
  conformance->require_subcommand(1);
  auto options = std::make_shared<ConformanceCommand>();
  CLI::App* hal = conformance->add_subcommand(
      "hal", "test a running process of the role hal, which drives the robot: states, stops, limits, refusals");
  hal->add_option("-d,--deployment", options->deployment, "deployment file or preset")->capture_default_str();
  hal->add_flag("--yes", options->yes, "move, also if the drives are not simulated");
  hal->add_flag("--no-limits", options->no_limits, "leave out the tests in which a joint travels to a limit");
  hal->add_option("--only", options->only, "run these tests only; several with commas between them")
      ->delimiter(',')
      ->check(CLI::IsMember(testNames()));
  hal->footer(
      "Start the process alone, without control: `my-hal -d DEPLOYMENT`, or `tandem-sim`, `tandem-hal`. This command "
      "then\n"
      "commands the drives in place of control, and moves every joint slowly by a few millimetres; it refuses to run\n"
      "beside tandem-control. For drives that are not simulated it needs --yes: keep the emergency stop at hand.\n"
      "Each line: pass or FAIL, the name of the test, its subject, what was measured, and where it fails what was\n"
      "expected. Exit code 0: all passed; 1: a test failed, or no process answers. docs/own-hardware.md has the "
      "contract.");
  hal->callback([options, &exit_code] { guarded(exit_code, [&] { return run(*options); }); });
}

}  // namespace tandem::cli
