// SPDX-License-Identifier: Apache-2.0
/** @file Random and mutated frames on the buses of a whole robot: no motion.
 *
 * By hand, a million frames per bus: TANDEM_FUZZ_FRAMES=1000000 build/release/tests/test_hal_robot
 * --gtest_filter='HardwareFuzz.*' */
#include <cstdlib>

#include "robot_fixture.h"
#include "tests/unit/support/can_attack.h"

namespace tandem::hal::test {
namespace {

using tandem::test::Attack;

int frameCount() {
  const char* text = std::getenv("TANDEM_FUZZ_FRAMES");
  return text != nullptr ? std::atoi(text) : 60'000;
}

/** A foreign node on each bus that sends frames of drives and encoders; frames that command drives it corrupts. */
class Intruder {
 public:
  explicit Intruder(System& system) {
    for (auto& wire : system.wires)
      ports_.push_back(&wire->bus.join("intruder"));
  }
  void send(int frames) {
    for (can::VirtualBus::Port* port : ports_) {
      for (int k = 0; k < frames; ++k) {
        can::CanFrame frame = attack_.next();
        tandem::test::spoilDownload(frame, attack_.random());
        tandem::test::spoilNmt(frame, attack_.random(), true);
        tandem::test::spoilSetpoint(frame, attack_.random());
        tandem::test::spoilBusOff(frame);
        port->send({&frame, 1});
      }
      tandem::test::drain(*port);
    }
  }
  int any(int lower, int upper) { return attack_.random().integer(lower, upper); }
  bool chance(double probability) { return attack_.random().chance(probability); }

 private:
  Attack attack_{4};
  std::vector<can::VirtualBus::Port*> ports_;
};

/** Positions of the arms at standstill; a joint that leaves them fails the test. */
class Watch {
 public:
  explicit Watch(System& system) : system_(system), stood_{system.truth(0), system.truth(1)} {}
  /// Largest travel of any joint so far, m and rad.
  void look() {
    for (int a = 0; a < 2; ++a) {
      const ArmVector distance = (system_.truth(a) - stood_[static_cast<std::size_t>(a)]).cwiseAbs();
      translation = std::max(translation, distance.head(3).maxCoeff());
      rotation = std::max(rotation, distance.tail(3).maxCoeff());
    }
  }
  double translation = 0.0, rotation = 0.0;

 private:
  System& system_;
  std::array<ArmVector, 2> stood_;
};

/// Without the intruder, the robot recovers as after any fault, and is enabled. Data that an arm without torque
/// received from its drives may appear as a fault when it is enabled, which `disable` clears.
void recover(System& system) {
  for (int attempt = 0; attempt < 2 && !system.all(OperatingState::kEnabled); ++attempt) {
    system.request(DriveRequest::kDisable);
    ASSERT_TRUE(system.until(10.0, [&] { return system.all(OperatingState::kDisabled) && system.allHomed(); }))
        << system.story();
    system.enable();
  }
  ASSERT_TRUE(system.all(OperatingState::kEnabled)) << system.story();
  system.events.clear();
}

TEST(HardwareFuzz, RobotStaysAtStandstillUnderRandomFrames) {
  System system;
  ASSERT_TRUE(system.boot()) << system.story();
  ASSERT_TRUE(system.enable()) << system.story();
  Intruder intruder(system);
  SCOPED_TRACE(tandem::test::trace(tandem::test::baseSeed()));
  Watch watch(system);
  int faults = 0, enabled = 0;
  for (int sent = 0; sent < frameCount();) {
    ASSERT_NO_FATAL_FAILURE(recover(system)) << "after " << sent << " frames";
    const int burst = intruder.any(1, 40);
    for (int k = 0; k < 50; ++k, sent += burst) {
      intruder.send(burst);
      system.request(intruder.chance(0.95)  ? DriveRequest::kKeep
                     : intruder.chance(0.5) ? DriveRequest::kEnable
                                            : DriveRequest::kDisable);
      system.period();
      watch.look();
      for (int a = 0; a < 2; ++a) {
        faults += system.robot->state(a) == OperatingState::kFault;
        enabled += system.robot->state(a) == OperatingState::kEnabled;
      }
    }
    system.request(DriveRequest::kKeep);
    ASSERT_LT(watch.translation, 1e-6) << "m, after " << sent << " frames";
    ASSERT_LT(watch.rotation, 1e-4) << "rad, one count of the encoder; after " << sent << " frames";
  }
  EXPECT_GT(faults, 0);
  EXPECT_GT(enabled, 0);
  std::cout << "periods of an arm in FAULT " << faults << ", ENABLED " << enabled << "; way " << watch.translation
            << " m, " << watch.rotation << " rad\n";
}

}  // namespace
}  // namespace tandem::hal::test
