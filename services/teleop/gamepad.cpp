// SPDX-License-Identifier: Apache-2.0
/** @file Gamepads through SDL, with its table of mappings. */
#include <SDL2/SDL.h>

#include <algorithm>

#include "services/teleop/device.h"

namespace tandem::teleop {
namespace {

constexpr double kHeld = 0.5;       ///< of a trigger
constexpr double kStickRest = 0.1;  ///< sticks never come back to zero: the rest of the way is stretched

class Gamepad final : public Device {
 public:
  explicit Gamepad(double speed) : speed_(speed) {
    // No window: nothing shall be drawn, and events count although none has the focus.
    SDL_SetHint(SDL_HINT_VIDEODRIVER, "dummy");
    SDL_SetHint(SDL_HINT_JOYSTICK_ALLOW_BACKGROUND_EVENTS, "1");
    SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");
    if (SDL_InitSubSystem(SDL_INIT_GAMECONTROLLER) != 0)
      throw DeviceError(std::string("gamepad: SDL does not start: ") + SDL_GetError());
    SDL_GameControllerUpdate();
    for (int i = 0; i < SDL_NumJoysticks() && pad_ == nullptr; ++i)
      pad_ = SDL_IsGameController(i) ? SDL_GameControllerOpen(i) : nullptr;
    if (pad_ == nullptr) {
      const int others = SDL_NumJoysticks();
      SDL_QuitSubSystem(SDL_INIT_GAMECONTROLLER);
      throw DeviceError("gamepad: found none (" + std::to_string(others) +
                        " other joysticks), expected one that SDL knows; plugged in, and readable for this user "
                        "(/dev/input/event*, group input)?");
    }
  }
  ~Gamepad() override {
    SDL_GameControllerClose(pad_);
    SDL_QuitSubSystem(SDL_INIT_GAMECONTROLLER);
  }

  Reading read(double) override {
    SDL_GameControllerUpdate();
    if (SDL_GameControllerGetAttached(pad_) == SDL_FALSE)
      throw DeviceError("gamepad: it is gone");
    Reading reading;
    reading.present = axis(SDL_CONTROLLER_AXIS_TRIGGERRIGHT) > kHeld;
    reading.clutch = held(SDL_CONTROLLER_BUTTON_LEFTSHOULDER);
    // SDL's y axes point down.
    reading.linear = speed_ * Eigen::Vector3d(stick(SDL_CONTROLLER_AXIS_LEFTX), -stick(SDL_CONTROLLER_AXIS_LEFTY),
                                              -stick(SDL_CONTROLLER_AXIS_RIGHTY));
    for (int b = 0; b < std::min<int>(SDL_CONTROLLER_BUTTON_MAX, 32); ++b)
      reading.buttons |= held(static_cast<SDL_GameControllerButton>(b)) ? 1U << b : 0U;
    const std::uint32_t pressed = reading.buttons & ~buttons_;
    buttons_ = reading.buttons;
    const auto now = [pressed](SDL_GameControllerButton b) { return (pressed & (1U << b)) != 0; };
    reading.scale_steps = (now(SDL_CONTROLLER_BUTTON_DPAD_UP) ? 1 : 0) - (now(SDL_CONTROLLER_BUTTON_DPAD_DOWN) ? 1 : 0);
    reading.next_mode = now(SDL_CONTROLLER_BUTTON_Y);
    reading.next_arm = now(SDL_CONTROLLER_BUTTON_X);
    reading.stop = now(SDL_CONTROLLER_BUTTON_B);
    return reading;
  }

  planning::teleoperation::Device kind() const override { return planning::teleoperation::Device::kGamepad; }
  std::string describe() const override {
    const char* name = SDL_GameControllerName(pad_);
    return std::string(name != nullptr ? name : "gamepad") +
           ": hold the right trigger to move; left stick x and y, right stick z; left shoulder clutch; Y mode, X arm, "
           "cross up and down scale, B stop";
  }
  void showLimited(bool limited) override {
    if (limited != limited_)
      SDL_GameControllerRumble(pad_, limited ? 0x4000 : 0, limited ? 0x8000 : 0, limited ? 300 : 0);
    limited_ = limited;
  }

 private:
  double axis(SDL_GameControllerAxis which) const { return SDL_GameControllerGetAxis(pad_, which) / 32767.0; }
  double stick(SDL_GameControllerAxis which) const {
    const double x = std::clamp(axis(which), -1.0, 1.0);
    const double beyond = std::max(0.0, std::abs(x) - kStickRest) / (1.0 - kStickRest);
    return x < 0.0 ? -beyond : beyond;
  }
  bool held(SDL_GameControllerButton which) const { return SDL_GameControllerGetButton(pad_, which) != 0; }

  double speed_;
  SDL_GameController* pad_ = nullptr;
  std::uint32_t buttons_ = 0;
  bool limited_ = false;
};

}  // namespace

std::unique_ptr<Device> openGamepad(double speed) { return std::make_unique<Gamepad>(speed); }

}  // namespace tandem::teleop
