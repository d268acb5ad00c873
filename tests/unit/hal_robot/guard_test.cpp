// SPDX-License-Identifier: Apache-2.0
/** @file Each guard of an axis: frames of a healthy drive or encoder are changed on the wire, so that it acts first. */
#include "tests/unit/hal_robot/robot_fixture.h"

namespace tandem::hal::test {
namespace {

constexpr std::uint32_t kDrive = 2, kEncoder = 18;  // of joint 2 of the first arm
constexpr std::uint32_t kDriveTpdo = 0x180 + kDrive, kEncoderTpdo = 0x280 + kEncoder;

bool dropped(const can::CanFrame& frame, std::uint32_t id) { return frame.id == id; }

/// Replaces the bits `mask` of the statusword.
void setStatus(can::CanFrame& frame, unsigned mask, unsigned bits) {
  if (frame.id != kDriveTpdo)
    return;
  frame.data[0] = static_cast<std::uint8_t>((frame.data[0] & ~mask) | (bits & 0xFF));
  frame.data[1] = static_cast<std::uint8_t>((frame.data[1] & ~(mask >> 8)) | (bits >> 8));
}

/** What a disturbance keeps between frames. */
struct Memory {
  int count = 0;
  std::array<std::uint8_t, 4> drive{}, encoder{};  ///< the first positions
  bool has_drive = false, has_encoder = false;
};

/// Replaces a position by the first one that was sent.
void freeze(std::uint8_t* position, std::array<std::uint8_t, 4>& first, bool& known) {
  if (!known)
    std::copy_n(position, first.size(), first.begin());
  known = true;
  std::copy(first.begin(), first.end(), position);
}

struct Disturbance {
  const char* name;
  HardwareGuard guard;
  double budget;                                       ///< s, besides four periods
  bool (*pass)(can::CanFrame& frame, Memory& memory);  ///< false: the frame is lost
};

std::ostream& operator<<(std::ostream& out, const Disturbance& disturbance) { return out << disturbance.name; }

class Guard : public testing::TestWithParam<Disturbance> {};

TEST_P(Guard, AloneStopsItsArmWithinItsBudget) {
  const Disturbance& disturbance = GetParam();
  System system;
  ASSERT_TRUE(system.boot()) << system.story();
  ASSERT_TRUE(system.enable()) << system.story();
  ArmVector slowly = ArmVector::Zero(6);
  slowly[1] = 1e-3;
  system.move(0, slowly);
  system.run(0.5);
  ASSERT_TRUE(system.all(OperatingState::kEnabled)) << system.story();
  system.events.clear();
  Memory memory;
  system.wires[0]->bus.disturbance = [&](can::CanFrame& frame) { return disturbance.pass(frame, memory); };
  EXPECT_TRUE(system.until(disturbance.budget + 4.0 * system.config.period, [&] {
    return system.robot->state(0) == OperatingState::kFault;
  })) << system.story();
  GuardMask first = 0;
  for (const HardwareEvent& event : system.events)
    first = first == 0 && event.kind == HardwareEvent::Kind::kGuard ? event.guards : first;
  EXPECT_NE(first & bit(disturbance.guard), 0u) << describeGuards(first);
  EXPECT_EQ(system.robot->faultRecord(0).joint, 1);
  EXPECT_EQ(system.robot->state(1), OperatingState::kEnabled);
}

INSTANTIATE_TEST_SUITE_P(
    On,
    Guard,
    testing::Values(Disturbance{"ASilentDrive", HardwareGuard::kDriveSilent, 0.03,
                                [](can::CanFrame& frame, Memory&) { return !dropped(frame, kDriveTpdo); }},
                    Disturbance{"ASilentEncoder", HardwareGuard::kEncoderSilent, 0.03,
                                [](can::CanFrame& frame, Memory&) { return !dropped(frame, kEncoderTpdo); }},
                    Disturbance{"LostFrames", HardwareGuard::kFramesLost, 2.0,
                                [](can::CanFrame& frame, Memory& memory) {
                                  return !dropped(frame, kDriveTpdo) || ++memory.count % 4 != 0;
                                }},
                    Disturbance{"AnEncoderAlarm", HardwareGuard::kEncoderAlarm, 0.0,
                                [](can::CanFrame& frame, Memory&) {
                                  if (frame.id == kEncoderTpdo)
                                    frame.data[4] |= 1;
                                  return true;
                                }},
                    Disturbance{"AnEncoderThatDisagrees", HardwareGuard::kEncoderMismatch, 0.0,
                                [](can::CanFrame& frame, Memory&) {
                                  if (frame.id == kEncoderTpdo)
                                    frame.data[2] ^= 1;
                                  return true;
                                }},
                    Disturbance{"ADriveInFault", HardwareGuard::kDriveFault, 0.0,
                                [](can::CanFrame& frame, Memory&) {
                                  setStatus(frame, 0x4F, 0x08);
                                  return true;
                                }},
                    Disturbance{"ADriveWithoutPower", HardwareGuard::kPowerLost, 0.0,
                                [](can::CanFrame& frame, Memory&) {
                                  setStatus(frame, 0x6F, 0x23);
                                  return true;
                                }},
                    Disturbance{"ADriveThatIgnoresCommands", HardwareGuard::kIgnoresCommand, 0.03,
                                [](can::CanFrame& frame, Memory&) {
                                  setStatus(frame, 0x1000, 0);
                                  return true;
                                }},
                    Disturbance{"AJointThatDoesNotFollow", HardwareGuard::kFollowing, 0.6,
                                [](can::CanFrame& frame, Memory& memory) {
                                  if (frame.id == kDriveTpdo)
                                    freeze(frame.data.data() + 2, memory.drive, memory.has_drive);
                                  if (frame.id == kEncoderTpdo)
                                    freeze(frame.data.data(), memory.encoder, memory.has_encoder);
                                  return true;
                                }},
                    Disturbance{"ADriveAtItsLimit", HardwareGuard::kInternalLimit, 0.0,
                                [](can::CanFrame& frame, Memory&) {
                                  setStatus(frame, 0x0800, 0x0800);
                                  return true;
                                }}),
    [](const auto& instance) { return instance.param.name; });

TEST(EmergencyMessages, StopTheirArm) {
  System system;
  ASSERT_TRUE(system.boot());
  can::VirtualBus::Port& port = system.wires[0]->bus.join("drive");
  ASSERT_TRUE(system.enable());
  system.events.clear();
  can::CanFrame frame;
  frame.id = 0x80 + kDrive;
  frame.length = 8;
  frame.data = {0x00, 0x10, 0x01};  // code 1000, generic error
  port.send({&frame, 1});
  EXPECT_TRUE(system.until(4.0 * system.config.period, [&] {
    return system.robot->state(0) == OperatingState::kFault;
  })) << system.story();
  EXPECT_EQ(system.robot->faultRecord(0).cause, safety::FaultCause::kDeviceError);
}

}  // namespace
}  // namespace tandem::hal::test
