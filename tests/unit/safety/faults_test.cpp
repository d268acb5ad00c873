// SPDX-License-Identifier: Apache-2.0
#include "safety/faults.h"

#include <gtest/gtest.h>

#include "safety/limits.h"

namespace tandem::safety {
namespace {

TEST(FaultRecord, SaysWhatWhereAndHowMuch) {
  const FaultMask drive = bit(Fault::kDrive);
  ArmLimits limits;
  limits.joints.resize(2);
  limits.joints[0].kind = JointKind::kRotation;
  EXPECT_EQ(describe({drive, FaultCause::kFollowingError, 0, 0.031, 0.02}, &limits),
            "drive (following error) of joint 1: 0.031 rad, allowed 0.02 rad");
  EXPECT_EQ(describe({drive, FaultCause::kFollowingError, 1, 0.00075, 0.0005}, &limits),
            "drive (following error) of joint 2: 0.00075 m, allowed 0.0005 m");
  EXPECT_EQ(describe({drive, FaultCause::kFollowingError, 2, 0.1, 0.0}, &limits),
            "drive (following error) of joint 3: 0.1 m or rad")
      << "a joint that the arm does not have";
  EXPECT_EQ(describe({drive, FaultCause::kOff, 0}, &limits), "drive (off) of joint 1");
  EXPECT_EQ(describe({bit(Fault::kCommandTimeout), FaultCause::kUnspecified, idl::kNoJoint, 0.151, 0.15}, &limits),
            "command_timeout: 0.151 s, allowed 0.15 s");
  EXPECT_EQ(describe({drive | bit(Fault::kSensor), FaultCause::kReported}, &limits),
            "sensor, drive (reported by the drives)");
  EXPECT_EQ(describe(FaultRecord{}), "none");
  EXPECT_EQ(describe({drive, static_cast<FaultCause>(200)}, &limits), "drive")
      << "a cause that only a newer peer knows";
}

}  // namespace
}  // namespace tandem::safety
