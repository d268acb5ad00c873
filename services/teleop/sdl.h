// SPDX-License-Identifier: Apache-2.0
/** @file Declarations of the SDL 2 functions that the gamepad uses, so that the build needs only SDL's run-time
 * library: Debian's package with the headers depends on 250 MB of graphics development packages. SDL keeps its binary
 * interface through all of version 2; a unit test compares the numbers with SDL's own header. */
#pragma once

#include <cstdint>

// Not needed if SDL's own header was included before.
#ifndef SDL_h_
// NOLINTBEGIN(readability-identifier-naming): SDL's names
struct SDL_GameController;
enum SDL_bool : int {};  // as large as SDL's: 0 is false, 1 true

// SDL's enumerations of axes and buttons are as large as int, and passed as such.
extern "C" {
int SDL_InitSubSystem(std::uint32_t flags);
void SDL_QuitSubSystem(std::uint32_t flags);
const char* SDL_GetError();
SDL_bool SDL_SetHint(const char* name, const char* value);
int SDL_NumJoysticks();
SDL_bool SDL_IsGameController(int joystick_index);
SDL_GameController* SDL_GameControllerOpen(int joystick_index);
void SDL_GameControllerClose(SDL_GameController* pad);
void SDL_GameControllerUpdate();
SDL_bool SDL_GameControllerGetAttached(SDL_GameController* pad);
const char* SDL_GameControllerName(SDL_GameController* pad);
std::int16_t SDL_GameControllerGetAxis(SDL_GameController* pad, int axis);
std::uint8_t SDL_GameControllerGetButton(SDL_GameController* pad, int button);
int SDL_GameControllerRumble(SDL_GameController* pad,
                             std::uint16_t low_frequency,
                             std::uint16_t high_frequency,
                             std::uint32_t duration_ms);
}
// NOLINTEND(readability-identifier-naming)
#endif

namespace tandem::teleop::sdl {

inline constexpr std::uint32_t kInitGameController = 0x2000;

inline constexpr const char* kHintVideoDriver = "SDL_VIDEODRIVER";
inline constexpr const char* kHintJoystickAllowBackgroundEvents = "SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS";
inline constexpr const char* kHintNoSignalHandlers = "SDL_NO_SIGNAL_HANDLERS";

inline constexpr int kAxisLeftX = 0;
inline constexpr int kAxisLeftY = 1;
inline constexpr int kAxisRightY = 3;
inline constexpr int kAxisTriggerRight = 5;

inline constexpr int kButtonB = 1;
inline constexpr int kButtonX = 2;
inline constexpr int kButtonY = 3;
inline constexpr int kButtonLeftShoulder = 9;
inline constexpr int kButtonRightShoulder = 10;
inline constexpr int kButtonDpadUp = 11;
inline constexpr int kButtonDpadDown = 12;
inline constexpr int kButtonMax = 21;  ///< number of buttons

}  // namespace tandem::teleop::sdl
