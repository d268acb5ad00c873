// SPDX-License-Identifier: Apache-2.0
/** @file Comparison of docs/permissions.md with judge(). TANDEM_WRITE_DOCS=1 writes it. */
#include <gtest/gtest.h>

#include <map>
#include <sstream>

#include "operation/permission.h"
#include "tests/unit/documented_page.h"

namespace tandem::test {
namespace {

using namespace operation;
using safety::OperatingState;

struct Column {
  const char* name;
  Requester requester;
  RobotCondition now;
};

/// One arm, measured and homed, in this state.
RobotCondition standing(OperatingState state) {
  RobotCondition now;
  now.received = now.tips_known = true;
  now.arm_count = 1;
  now.arm[0].wanted = now.arm[0].drives = state;
  now.arm[0].valid = now.arm[0].located = now.arm[0].homed = true;
  return now;
}

std::vector<Column> columns() {
  std::vector<Column> all{
      {"DISABLED", Requester::kLeaseOwner, standing(OperatingState::kDisabled)},
      {"ENABLED", Requester::kLeaseOwner, standing(OperatingState::kEnabled)},
      {"moves in joint space", Requester::kLeaseOwner, standing(OperatingState::kEnabled)},
      {"follows a trajectory", Requester::kLeaseOwner, standing(OperatingState::kEnabled)},
      {"follows an operator", Requester::kLeaseOwner, standing(OperatingState::kEnabled)},
      {"PAUSED", Requester::kLeaseOwner, standing(OperatingState::kPaused)},
      {"is recovering", Requester::kLeaseOwner, standing(OperatingState::kEnabled)},
      {"FAULT", Requester::kLeaseOwner, standing(OperatingState::kFault)},
      {"ENABLED, no client has the lease", Requester::kNoLeaseOwner, standing(OperatingState::kEnabled)},
      {"ENABLED, another client has the lease", Requester::kOtherClient, standing(OperatingState::kEnabled)},
      {"FAULT, another client has the lease", Requester::kOtherClient, standing(OperatingState::kFault)},
      {"DISABLED, a process with another robot or deployment is present", Requester::kLeaseOwner,
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
  out << "# Permissions\n\n"
         "The test `test_operation` writes this page from `operation/permission.h`, which decides all requests to "
         "control, "
         "and compares the two (`TANDEM_WRITE_DOCS=1` writes it again).\nThe columns are states of an arm of "
         "concentric tubes "
         "in real time, with measured and homed joints; the first eight are for the client that has the control lease. "
         "A number is the reason of a\nrefusal, below.\n\n"
         "When a client loses the lease, control stops its motion and latches `lease_lost` before it handles the next "
         "request. All clients may `stop`, in every state.\n\n"
         "`set_method` also sets parameters; `start` starts a trajectory, `steer` pauses or resumes it; `crtk_move` is "
         "CRTK's `move_jp` and `move_jr`,\n`crtk_joints` its streams of joints, `crtk_tip` all its commands that move "
         "tips; `home_drives` is `tandem home`, `home` is `tandem robot home`.\n\n"
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
      const Refusal refusal = judge(action, column.requester, column.now, 0);
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

TEST(Permission, DocumentedTableMatchesJudge) {
  test::expectPage("permissions.md", page(),
                   "build/release/tests/test_operation --gtest_filter=Permission.DocumentedTableMatchesJudge");
}

}  // namespace
}  // namespace tandem::test
