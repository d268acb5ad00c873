// SPDX-License-Identifier: Apache-2.0
/** @file Terminal keyboard as input device: reports presses and repeats, but no releases. */
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <map>

#include "services/teleop/device.h"

namespace tandem::teleop {
namespace {

/// Time for which a key is treated as held after each report, s: longer than a terminal's repeat period (33 ms).
constexpr double kKeyHeld = 0.1;

class Keyboard final : public Device {
 public:
  Keyboard(double speed, double angular_speed) : speed_(speed), angular_speed_(angular_speed) {
    if (tcgetattr(STDIN_FILENO, &before_) != 0)
      throw DeviceError("keyboard: found no terminal on standard input; start it in a terminal");
    termios raw = before_;
    raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
    raw.c_cc[VMIN] = 0;
    raw.c_cc[VTIME] = 0;
    tcsetattr(STDIN_FILENO, TCSANOW, &raw);
  }
  ~Keyboard() override { tcsetattr(STDIN_FILENO, TCSANOW, &before_); }

  Reading read(double time) override {
    static const std::map<char, Eigen::Vector3d> moves{{'d', {1, 0, 0}},  {'a', {-1, 0, 0}}, {'w', {0, 1, 0}},
                                                       {'s', {0, -1, 0}}, {'r', {0, 0, 1}},  {'f', {0, 0, -1}}};
    static const std::map<char, Eigen::Vector3d> turns{{'i', {1, 0, 0}},  {'k', {-1, 0, 0}}, {'l', {0, 1, 0}},
                                                       {'j', {0, -1, 0}}, {'o', {0, 0, 1}},  {'u', {0, 0, -1}}};
    Reading reading;
    pollfd input{STDIN_FILENO, POLLIN, 0};
    char key = 0;
    while (poll(&input, 1, 0) > 0) {
      if (::read(STDIN_FILENO, &key, 1) <= 0)
        throw DeviceError("keyboard: the terminal was closed");
      const auto move = moves.find(key), turn = turns.find(key);
      if (move != moves.end() || turn != turns.end()) {
        until_ = time + kKeyHeld;
        direction_ = move != moves.end() ? move->second : Eigen::Vector3d(Eigen::Vector3d::Zero());
        axis_ = turn != turns.end() ? turn->second : Eigen::Vector3d(Eigen::Vector3d::Zero());
      }
      reading.next_mode = reading.next_mode || key == 'm';
      reading.next_arm = reading.next_arm || key == '\t';
      reading.scale_steps += key == '+' ? 1 : key == '-' ? -1 : 0;
      reading.stop = reading.stop || key == ' ';
      reading.end = reading.end || key == 'q' || key == 4;
    }
    reading.present = time < until_ && !reading.stop;
    if (reading.present) {
      reading.linear = speed_ * direction_;
      reading.angular = angular_speed_ * axis_;
    }
    return reading;
  }

  planning::teleoperation::Device kind() const override { return planning::teleoperation::Device::kKeyboard; }
  std::string describe() const override {
    return "keyboard: hold a and d for x, s and w for y, f and r for z; k and i, j and l, u and o to rotate about x, "
           "y, "
           "z; m mode, Tab arm, + and - scale, space stop, q end";
  }

 private:
  double speed_, angular_speed_;
  termios before_{};
  Eigen::Vector3d direction_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis_ = Eigen::Vector3d::Zero();  ///< of the rotation
  double until_ = -1.0;
};

}  // namespace

std::unique_ptr<Device> openKeyboard(double speed, double angular_speed) {
  return std::make_unique<Keyboard>(speed, angular_speed);
}

}  // namespace tandem::teleop
