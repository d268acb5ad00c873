// SPDX-License-Identifier: Apache-2.0
/** @file Verdicts of conformance tests, and the list of the tests. */
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "services/cli/conformance/commander.h"

namespace tandem::cli {

/** Result of one test: the first condition that is not met, or a summary of what was measured. */
class Verdict {
 public:
  /// A condition of the test. @param found  what was found where it is not met
  void require(bool met, const std::string& expected, const std::string& found);
  /// Part of the summary of a test that passes.
  void note(const std::string& text) { summary_ += (summary_.empty() ? "" : "; ") + text; }
  bool passed() const { return passed_; }
  const std::string& expected() const { return expected_; }
  const std::string& found() const { return passed_ ? summary_ : found_; }

 private:
  bool passed_ = true;
  std::string expected_, found_, summary_;
};

/** One test. */
struct ConformanceTest {
  std::string name;  ///< for --only: "enable"
  std::string what;  ///< property that it tests
  std::function<Verdict(Commander&)> run;
  bool goes_to_limits = false;
};

/// All tests, in the order in which they run.
std::vector<ConformanceTest> conformanceTests();

/// Tests by subject; conformanceTests() joins them.
std::vector<ConformanceTest> statesTests();
std::vector<ConformanceTest> motionTests();
std::vector<ConformanceTest> stopTests();
std::vector<ConformanceTest> streamTests();
std::vector<ConformanceTest> limitTests();

// Parts of tests.

using States = std::vector<SeenState>;

/// Largest permitted distance of a joint from where it was: by arm, joint and index in messages, m or rad.
using Permitted = std::function<double(int arm, int joint, std::size_t index)>;

/// Whether an arm is to be looked at.
using Arms = std::function<bool(int arm)>;

/// Requires that no joint is farther from its position in `from` than permitted, in any of the states.
void requireWithin(const Commander& commander,
                   const dds::ActuationState& from,
                   const States& states,
                   const Permitted& permitted,
                   Verdict& verdict,
                   const Arms& arms = {});
/// Requires that no joint moves.
void requireStill(const Commander& commander, const dds::ActuationState& from, const States& states, Verdict& verdict);
/// Requires standstill at the end of the states, which last for 0.2 s at least.
void requireStanding(const Commander& commander, const States& states, Verdict& verdict, const Arms& arms = {});
/// Requires an operating state, and of FAULT a fault, of the given arms in the last state.
void requireState(const Commander& commander,
                  safety::OperatingState state,
                  safety::FaultMask faults,
                  Verdict& verdict,
                  const Arms& arms = {});

/// Distance until standstill of a joint in slow motion, from a command that ends it: a control period, the ramp, and
/// 50 ms for lag of the drives. m, rad
Permitted stopWithin(const Commander& commander);

/// All arms DISABLED.
void disableAll(Commander& commander);
/// All arms ENABLED and at standstill.
void enableAll(Commander& commander);
/// Enables all arms and moves them slowly for half the time of a slow motion. @return the change that moves them on
Commander::Change startMotion(Commander& commander);
/// Time of a short part of a test: at least five control periods, s.
double shortTime(const Commander& commander);

/// 5 mm, 0.3 rad
std::string amount(const Commander& commander, int arm, int joint, double value);

}  // namespace tandem::cli
