// SPDX-License-Identifier: Apache-2.0
#include "safety/faults.h"

#include <gtest/gtest.h>

namespace tandem::safety {
namespace {

TEST(FaultRecord, SaysWhatWhereAndHowMuch) {
  const FaultMask drive = bit(Fault::kDrive);
  EXPECT_EQ(describe({drive, FaultCause::kFollowingError, 3, 0.031, 0.02}, 6),
            "drive (following error) of joint 4: 0.031 rad, allowed 0.02 rad");
  EXPECT_EQ(describe({drive, FaultCause::kFollowingError, 2, 0.00075, 0.0005}, 6),
            "drive (following error) of joint 3: 0.00075 m, allowed 0.0005 m");
  // Of a catheter's three joints the insertion alone is a length.
  EXPECT_EQ(describe({drive, FaultCause::kFollowingError, 1, 0.031, 0.02}, 3),
            "drive (following error) of joint 2: 0.031 rad, allowed 0.02 rad");
  EXPECT_EQ(describe({drive, FaultCause::kFollowingError, 0, 0.00075, 0.0005}, 3),
            "drive (following error) of joint 1: 0.00075 m, allowed 0.0005 m");
  EXPECT_EQ(describe({drive, FaultCause::kOff, 0}, 6), "drive (off) of joint 1");
  EXPECT_EQ(describe({bit(Fault::kCommandTimeout), FaultCause::kUnspecified, idl::kNoJoint, 0.151, 0.15}, 6),
            "command_timeout: 0.151 s, allowed 0.15 s");
  EXPECT_EQ(describe({drive | bit(Fault::kSensor), FaultCause::kReported}, 6),
            "sensor, drive (reported by the drives)");
  EXPECT_EQ(describe({}, 6), "none");
  EXPECT_EQ(describe({drive, static_cast<FaultCause>(200)}, 6), "drive") << "a cause that only a newer peer knows";
}

}  // namespace
}  // namespace tandem::safety
