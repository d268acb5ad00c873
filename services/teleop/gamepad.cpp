// SPDX-License-Identifier: Apache-2.0
/** @file Gamepads through SDL, with its table of mappings. */
#include <algorithm>

#include "services/teleop/device.h"
#include "services/teleop/frozen_input_guard.h"
#include "services/teleop/sdl.h"

namespace tandem::teleop {
namespace {

constexpr double kHeld = 0.5;       ///< of the trigger's travel
constexpr double kStickRest = 0.1;  ///< dead zone, since sticks do not return to zero; the remainder is scaled to 0..1

class Gamepad final : public Device {
 public:
  Gamepad(double speed, double angular_speed) : speed_(speed), angular_speed_(angular_speed) {
    // No window: nothing is drawn, and events are accepted without focus.
    SDL_SetHint(sdl::kHintVideoDriver, "dummy");
    SDL_SetHint(sdl::kHintJoystickAllowBackgroundEvents, "1");
    SDL_SetHint(sdl::kHintNoSignalHandlers, "1");
    if (SDL_InitSubSystem(sdl::kInitGameController) != 0)
      throw DeviceError(std::string("gamepad: SDL does not start: ") + SDL_GetError());
    SDL_GameControllerUpdate();
    for (int i = 0; i < SDL_NumJoysticks() && pad_ == nullptr; ++i)
      pad_ = SDL_IsGameController(i) ? SDL_GameControllerOpen(i) : nullptr;
    if (pad_ == nullptr) {
      const int others = SDL_NumJoysticks();
      SDL_QuitSubSystem(sdl::kInitGameController);
      throw DeviceError(
          "gamepad: found none (" + std::to_string(others) +
          " other joysticks), expected one that SDL supports; check that it is plugged in and readable for this user "
          "(/dev/input/event*, group input)");
    }
  }
  ~Gamepad() override {
    SDL_GameControllerClose(pad_);
    SDL_QuitSubSystem(sdl::kInitGameController);
  }

  Reading read(double time) override {
    SDL_GameControllerUpdate();
    if (!SDL_GameControllerGetAttached(pad_))
      throw DeviceError("gamepad: disconnected; plug it in and start tandem teleop again");
    Reading reading;
    reading.present = axis(sdl::kAxisTriggerRight) > kHeld;
    reading.clutch = held(sdl::kButtonLeftShoulder);
    // SDL's y axes point down.
    const Eigen::Vector3d sticks(stick(sdl::kAxisLeftX), -stick(sdl::kAxisLeftY), -stick(sdl::kAxisRightY));
    if (held(sdl::kButtonRightShoulder))
      reading.angular = angular_speed_ * sticks;
    else
      reading.linear = speed_ * sticks;
    for (int b = 0; b < std::min(sdl::kButtonMax, 32); ++b)
      reading.buttons |= held(b) ? 1U << b : 0U;
    const std::vector<int> raw{rawAxis(sdl::kAxisTriggerRight), rawAxis(sdl::kAxisLeftX), rawAxis(sdl::kAxisLeftY),
                               rawAxis(sdl::kAxisRightY), static_cast<int>(reading.buttons)};
    reading.present = frozen_input_guard_.update(raw, reading.present && sticks.norm() > 0.0, reading.present, time);
    const std::uint32_t pressed = reading.buttons & ~buttons_;
    buttons_ = reading.buttons;
    const auto now = [pressed](int b) { return (pressed & (1U << b)) != 0; };
    reading.scale_steps = (now(sdl::kButtonDpadUp) ? 1 : 0) - (now(sdl::kButtonDpadDown) ? 1 : 0);
    reading.next_mode = now(sdl::kButtonY);
    reading.next_arm = now(sdl::kButtonX);
    reading.stop = now(sdl::kButtonB);
    return reading;
  }

  planning::teleoperation::Device kind() const override { return planning::teleoperation::Device::kGamepad; }
  std::string describe() const override {
    const char* name = SDL_GameControllerName(pad_);
    return std::string(name != nullptr ? name : "gamepad") +
           ": hold the right trigger to move (press it again after a stop because nothing changed for 1.5 s); left "
           "stick x and y, right stick z; right shoulder held: the sticks rotate about x, y and z; left shoulder "
           "clutch; Y "
           "mode, X arm, cross up and down scale, B stop";
  }
  void showLimited(bool limited) override {
    if (limited != limited_)
      SDL_GameControllerRumble(pad_, limited ? 0x4000 : 0, limited ? 0x8000 : 0, limited ? 300 : 0);
    limited_ = limited;
  }

 private:
  int rawAxis(int which) const { return SDL_GameControllerGetAxis(pad_, which); }
  double axis(int which) const { return rawAxis(which) / 32767.0; }
  double stick(int which) const {
    const double x = std::clamp(axis(which), -1.0, 1.0);
    const double beyond = std::max(0.0, std::abs(x) - kStickRest) / (1.0 - kStickRest);
    return x < 0.0 ? -beyond : beyond;
  }
  bool held(int which) const { return SDL_GameControllerGetButton(pad_, which) != 0; }

  double speed_, angular_speed_;
  SDL_GameController* pad_ = nullptr;
  std::uint32_t buttons_ = 0;
  bool limited_ = false;
  FrozenInputGuard frozen_input_guard_;
};

}  // namespace

std::unique_ptr<Device> openGamepad(double speed, double angular_speed) {
  return std::make_unique<Gamepad>(speed, angular_speed);
}

}  // namespace tandem::teleop
