// SPDX-License-Identifier: Apache-2.0
/** @file docs/permissions.md is what judge() says. TANDEM_WRITE_DOCS=1 writes it. */
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>

#include "operation/permission.h"

namespace tandem::test {
namespace {

using namespace operation;
using safety::OperatingState;

struct Column {
  const char* name;
  Asker asker;
  Situation now;
};

/// One arm, measured and homed, in this state.
Situation standing(OperatingState state) {
  Situation now;
  now.received = now.tips_known = true;
  now.arm_count = 1;
  now.arm[0].wanted = now.arm[0].drives = state;
  now.arm[0].valid = now.arm[0].located = now.arm[0].homed = true;
  return now;
}

std::vector<Column> columns() {
  std::vector<Column> all{{"DISABLED", Asker::kCommander, standing(OperatingState::kDisabled)},
                          {"ENABLED", Asker::kCommander, standing(OperatingState::kEnabled)},
                          {"moves by joints", Asker::kCommander, standing(OperatingState::kEnabled)},
                          {"follows a trajectory", Asker::kCommander, standing(OperatingState::kEnabled)},
                          {"is operated", Asker::kCommander, standing(OperatingState::kEnabled)},
                          {"PAUSED", Asker::kCommander, standing(OperatingState::kPaused)},
                          {"is recovered", Asker::kCommander, standing(OperatingState::kEnabled)},
                          {"FAULT", Asker::kCommander, standing(OperatingState::kFault)},
                          {"ENABLED, nobody holds the lease", Asker::kAnybody, standing(OperatingState::kEnabled)},
                          {"ENABLED, another holds the lease", Asker::kOther, standing(OperatingState::kEnabled)},
                          {"FAULT, another holds the lease", Asker::kOther, standing(OperatingState::kFault)},
                          {"DISABLED, another robot or deployment is meant by somebody", Asker::kCommander,
                           standing(OperatingState::kDisabled)}};
  all[11].now.mismatch = true;
  all[2].now.moving = all[2].now.arm[0].joints_move = true;
  all[3].now.moving = all[3].now.followed = all[3].now.running = true;
  all[4].now.moving = all[4].now.operated = true;
  all[6].now.arm[0].recovering = true;
  return all;
}

std::string page() {
  const std::vector<Column> all = columns();
  std::ostringstream out;
  out << "# Who may do what\n\n"
         "Written from `operation/permission.h`, which decides all requests to control, by a test that also holds this "
         "page against it "
         "(`test_operation`;\n`TANDEM_WRITE_DOCS=1` writes it anew). Real time, an arm of concentric tubes whose "
         "joints are measured and homed. "
         "The first eight columns are for the\nholder of the control lease; a number is the reason of a refusal, "
         "below.\n\n"
         "What happens to a motion whose owner loses the lease: the arm stands, and latches `lease_lost`, before "
         "anybody else's request is "
         "judged.\n`stop` is everybody's, in every state.\n\n"
         "| |";
  for (const Column& column : all)
    out << ' ' << column.name << " |";
  out << "\n|---|";
  for (std::size_t k = 0; k < all.size(); ++k)
    out << "---|";
  std::map<int, Reason> reasons;
  for (const auto& [action, name, meaning] : idl::Enumeration<idl::Action>::entries) {
    out << "\n| " << name << " |";
    for (const Column& column : all) {
      const Refusal refusal = judge(action, column.asker, column.now, 0);
      if (refusal)
        reasons.emplace(static_cast<int>(refusal.reason), refusal.reason);
      out << ' ' << (refusal ? std::to_string(static_cast<int>(refusal.reason)) : "yes") << " |";
    }
  }
  out << "\n\n| reason | |\n|---|---|\n";
  for (const auto& [number, reason] : reasons)
    out << "| " << number << " | " << idl::name(reason) << " |\n";
  return out.str();
}

TEST(Permission, ThePageForPeopleIsWhatJudgeSays) {
  const std::string file = std::string(TANDEM_DOCS) + "/permissions.md";
  if (std::getenv("TANDEM_WRITE_DOCS") != nullptr)
    std::ofstream(file) << page();
  std::ifstream in(file);
  std::ostringstream there;
  there << in.rdbuf();
  EXPECT_EQ(there.str(), page());
}

}  // namespace
}  // namespace tandem::test
