// SPDX-License-Identifier: Apache-2.0
/** @file SpaceMouse and similar devices through spacenavd. */
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>

#include "services/teleop/device.h"
// After Eigen: spnav.h includes Xlib.h, whose macros are names in Eigen.
#include <spnav.h>
#undef Bool  // macro of Xlib.h

namespace tandem::teleop {
namespace {

constexpr double kFull = 350.0;  ///< value of a fully deflected axis
constexpr double kMostEvents = 1000;

class SpaceMouse final : public Device {
 public:
  SpaceMouse(double speed, double angular_speed) : speed_(speed), angular_speed_(angular_speed) {
    if (spnav_open() == -1)
      throw DeviceError("SpaceMouse: found no spacenavd; install and start it (apt install spacenavd)");
  }
  ~SpaceMouse() override { spnav_close(); }

  Reading read(double) override {
    Reading reading;
    // libspnav does not report the end of the daemon: a button held at that time would appear held for ever.
    char byte = 0;
    const ssize_t there = recv(spnav_fd(), &byte, 1, MSG_PEEK | MSG_DONTWAIT);
    if (there == 0 || (there < 0 && errno != EAGAIN && errno != EINTR))
      throw DeviceError(
          "SpaceMouse: spacenavd has ended; start it (systemctl start spacenavd) and start tandem teleop again");
    spnav_event event;
    for (int i = 0; i < kMostEvents && spnav_poll_event(&event) != 0; ++i) {
      if (event.type == SPNAV_EVENT_MOTION) {
        // The daemon's y axis points up, its z axis away from the operator, as in Reading.
        const auto& m = event.motion;
        linear_ = speed_ / kFull * Eigen::Vector3d(m.x, m.y, m.z);
        angular_ = angular_speed_ / kFull * Eigen::Vector3d(m.rx, m.ry, m.rz);
      } else if (event.type == SPNAV_EVENT_DEV && event.dev.op == SPNAV_DEV_RM) {
        throw DeviceError("SpaceMouse: disconnected; plug it in and start tandem teleop again");
      } else if (event.type == SPNAV_EVENT_BUTTON && event.button.bnum < 32) {
        const std::uint32_t bit = 1U << event.button.bnum;
        buttons_ = event.button.press != 0 ? buttons_ | bit : buttons_ & ~bit;
        if (event.button.press != 0) {
          reading.next_mode = reading.next_mode || event.button.bnum == 2;
          reading.next_arm = reading.next_arm || event.button.bnum == 3;
        }
      }
    }
    reading.linear = linear_.cwiseMax(-speed_).cwiseMin(speed_);
    reading.angular = angular_.cwiseMax(-angular_speed_).cwiseMin(angular_speed_);
    reading.buttons = buttons_;
    reading.present = (buttons_ & 1U) != 0;
    reading.clutch = (buttons_ & 2U) != 0;
    return reading;
  }

  planning::teleoperation::Device kind() const override { return planning::teleoperation::Device::kSpaceMouse; }
  std::string describe() const override {
    return "SpaceMouse: hold button 1 to move and rotate; button 2 clutch, button 3 mode, button 4 arm";
  }

 private:
  double speed_, angular_speed_;
  Eigen::Vector3d linear_ = Eigen::Vector3d::Zero(), angular_ = Eigen::Vector3d::Zero();
  std::uint32_t buttons_ = 0;
};

}  // namespace

std::unique_ptr<Device> openSpaceMouse(double speed, double angular_speed) {
  return std::make_unique<SpaceMouse>(speed, angular_speed);
}

}  // namespace tandem::teleop
