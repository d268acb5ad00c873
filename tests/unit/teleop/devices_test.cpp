// SPDX-License-Identifier: Apache-2.0
/** @file Operators' devices without hardware: SDL's virtual joystick, a terminal, a daemon with the protocol of
 * spacenavd, and files. */
#include <SDL2/SDL.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "recording/conversion.h"
#include "recording/writer.h"
#include "services/dds/definitions.h"
#include "services/dds/raw.h"
#include "services/dds/topics.h"
#include "services/teleop/device.h"
#include "services/teleop/frozen_input_guard.h"
#include "services/teleop/sdl.h"  // after SDL's own header: only the numbers

namespace tandem::teleop {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

/** A folder for one test. */
struct Folder {
  Folder() : path(fs::temp_directory_path() / ("tandem-teleop-" + std::to_string(std::random_device{}()))) {
    fs::create_directories(path);
  }
  ~Folder() { fs::remove_all(path); }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(path / name) << text;
    return (path / name).string();
  }
  fs::path path;
};

std::string refusalOf(const std::string& file) {
  try {
    openTrace(file);
  } catch (const DeviceError& error) {
    return error.what();
  }
  return "";
}

TEST(Gamepad, NumbersAndHintsAreThoseOfSdlsOwnHeader) {
  static_assert(sizeof(SDL_bool) == sizeof(int));
  static_assert(sizeof(SDL_GameControllerAxis) == sizeof(int));
  static_assert(sizeof(SDL_GameControllerButton) == sizeof(int));
  static_assert(sdl::kInitGameController == SDL_INIT_GAMECONTROLLER);
  static_assert(sdl::kAxisLeftX == SDL_CONTROLLER_AXIS_LEFTX);
  static_assert(sdl::kAxisLeftY == SDL_CONTROLLER_AXIS_LEFTY);
  static_assert(sdl::kAxisRightY == SDL_CONTROLLER_AXIS_RIGHTY);
  static_assert(sdl::kAxisTriggerRight == SDL_CONTROLLER_AXIS_TRIGGERRIGHT);
  static_assert(sdl::kButtonB == SDL_CONTROLLER_BUTTON_B);
  static_assert(sdl::kButtonX == SDL_CONTROLLER_BUTTON_X);
  static_assert(sdl::kButtonY == SDL_CONTROLLER_BUTTON_Y);
  static_assert(sdl::kButtonLeftShoulder == SDL_CONTROLLER_BUTTON_LEFTSHOULDER);
  static_assert(sdl::kButtonRightShoulder == SDL_CONTROLLER_BUTTON_RIGHTSHOULDER);
  static_assert(sdl::kButtonDpadUp == SDL_CONTROLLER_BUTTON_DPAD_UP);
  static_assert(sdl::kButtonDpadDown == SDL_CONTROLLER_BUTTON_DPAD_DOWN);
  static_assert(sdl::kButtonMax == SDL_CONTROLLER_BUTTON_MAX);
  EXPECT_STREQ(sdl::kHintVideoDriver, SDL_HINT_VIDEODRIVER);
  EXPECT_STREQ(sdl::kHintJoystickAllowBackgroundEvents, SDL_HINT_JOYSTICK_ALLOW_BACKGROUND_EVENTS);
  EXPECT_STREQ(sdl::kHintNoSignalHandlers, SDL_HINT_NO_SIGNAL_HANDLERS);
}

/// SDL's virtual gamepad.
void attachVirtual(int& index, SDL_Joystick*& joystick) {
  SDL_SetHint(SDL_HINT_JOYSTICK_ALLOW_BACKGROUND_EVENTS, "1");
  SDL_SetHint(SDL_HINT_VIDEODRIVER, "dummy");
  ASSERT_EQ(SDL_InitSubSystem(SDL_INIT_GAMECONTROLLER), 0) << SDL_GetError();
  index = SDL_JoystickAttachVirtual(SDL_JOYSTICK_TYPE_GAMECONTROLLER, SDL_CONTROLLER_AXIS_MAX,
                                    SDL_CONTROLLER_BUTTON_MAX, 0);
  ASSERT_GE(index, 0) << SDL_GetError();
  joystick = SDL_JoystickOpen(index);
  ASSERT_NE(joystick, nullptr) << SDL_GetError();
}

TEST(Gamepad, SaysWhatAVirtualOneIsSetTo) {
  int index = -1;
  SDL_Joystick* joystick = nullptr;
  ASSERT_NO_FATAL_FAILURE(attachVirtual(index, joystick));
  // Released triggers are at the lower end of their range.
  for (const int trigger : {SDL_CONTROLLER_AXIS_TRIGGERLEFT, SDL_CONTROLLER_AXIS_TRIGGERRIGHT})
    SDL_JoystickSetVirtualAxis(joystick, trigger, -32768);
  const auto pad = openGamepad(0.02, 0.2);
  EXPECT_EQ(pad->kind(), planning::teleoperation::Device::kGamepad);
  Reading reading = pad->read(0.0);
  EXPECT_FALSE(reading.present);
  EXPECT_EQ(reading.linear, Vector3d::Zero());
  SDL_JoystickSetVirtualAxis(joystick, SDL_CONTROLLER_AXIS_TRIGGERRIGHT, 32767);
  SDL_JoystickSetVirtualAxis(joystick, SDL_CONTROLLER_AXIS_LEFTX, 32767);
  SDL_JoystickSetVirtualAxis(joystick, SDL_CONTROLLER_AXIS_LEFTY, 32767);
  SDL_JoystickSetVirtualAxis(joystick, SDL_CONTROLLER_AXIS_RIGHTY, -1000);  // where sticks rest
  SDL_JoystickSetVirtualButton(joystick, SDL_CONTROLLER_BUTTON_Y, 1);
  SDL_JoystickSetVirtualButton(joystick, SDL_CONTROLLER_BUTTON_LEFTSHOULDER, 1);
  reading = pad->read(0.0);
  EXPECT_TRUE(reading.present);
  EXPECT_TRUE(reading.clutch);
  EXPECT_TRUE(reading.next_mode);
  EXPECT_NEAR((reading.linear - Vector3d(0.02, -0.02, 0.0)).norm(), 0.0, 1e-6);
  EXPECT_EQ(reading.angular, Vector3d::Zero());
  EXPECT_FALSE(pad->read(0.0).next_mode) << "a request is reported once";
  SDL_JoystickSetVirtualButton(joystick, SDL_CONTROLLER_BUTTON_RIGHTSHOULDER, 1);
  reading = pad->read(0.0);
  EXPECT_EQ(reading.linear, Vector3d::Zero());
  EXPECT_NEAR((reading.angular - Vector3d(0.2, -0.2, 0.0)).norm(), 0.0, 1e-6) << "the sticks rotate";
  SDL_JoystickDetachVirtual(index);
  EXPECT_THROW(pad->read(0.0), DeviceError);
  SDL_JoystickClose(joystick);
}

/// A wireless gamepad out of range: SDL repeats its last values.
TEST(Gamepad, ThatFallsSilentMovesNothingUntilItsTriggerIsLetGoOf) {
  int index = -1;
  SDL_Joystick* joystick = nullptr;
  ASSERT_NO_FATAL_FAILURE(attachVirtual(index, joystick));
  const auto set = [&](int axis, int value) { SDL_JoystickSetVirtualAxis(joystick, axis, static_cast<Sint16>(value)); };
  const auto pad = openGamepad(0.02);
  double time = 0.0;
  const auto last = [&](double seconds, int sway) {  // s, and amplitude of a hand tremor
    bool present = true;
    for (const double end = time + seconds; time < end; time += 0.1) {
      set(SDL_CONTROLLER_AXIS_LEFTX, 20000 + (static_cast<int>(std::lround(10 * time)) % 2) * sway);
      present = pad->read(time).present;
    }
    return present;
  };
  set(SDL_CONTROLLER_AXIS_TRIGGERRIGHT, 32767);
  EXPECT_TRUE(last(10.0, 40)) << "a hand";
  EXPECT_TRUE(last(FrozenInputGuard::kLongest - 0.3, 0));
  EXPECT_FALSE(last(0.6, 0)) << "it has fallen silent";
  EXPECT_FALSE(last(3.0, 40)) << "it speaks again, but nobody has let go of the trigger";
  set(SDL_CONTROLLER_AXIS_TRIGGERRIGHT, -32768);
  EXPECT_FALSE(last(0.2, 40));
  set(SDL_CONTROLLER_AXIS_TRIGGERRIGHT, 32767);
  EXPECT_TRUE(last(1.0, 40));
  set(SDL_CONTROLLER_AXIS_LEFTX, 0);
  for (const double end = time + 5.0; time < end; time += 0.1)
    EXPECT_TRUE(pad->read(time).present) << "what commands nothing may rest";
  SDL_JoystickDetachVirtual(index);
  SDL_JoystickClose(joystick);
}

TEST(Gamepad, MissingGamepadIsAnErrorThatNamesTheDevices) {
  try {
    openGamepad(0.02);
    GTEST_SKIP() << "this machine has one";
  } catch (const DeviceError& error) {
    EXPECT_NE(std::string(error.what()).find("/dev/input"), std::string::npos);
  }
}

/** Standard input is a terminal while this object exists. */
struct Terminal {
  Terminal() : before(dup(STDIN_FILENO)) {
    int slave = -1;
    EXPECT_EQ(openpty(&master, &slave, nullptr, nullptr, nullptr), 0);
    dup2(slave, STDIN_FILENO);
    close(slave);
  }
  ~Terminal() {
    dup2(before, STDIN_FILENO);
    close(before);
    close(master);
  }
  void type(const std::string& keys) const {
    ASSERT_EQ(write(master, keys.data(), keys.size()), static_cast<ssize_t>(keys.size()));
  }
  int before, master = -1;
};

TEST(Keyboard, KeyCountsAsHeldForAMomentAfterEachCharacter) {
  const Terminal terminal;
  const auto keyboard = openKeyboard(0.01, 0.2);
  EXPECT_FALSE(keyboard->read(0.0).present);
  terminal.type("w");
  Reading reading = keyboard->read(1.0);
  EXPECT_TRUE(reading.present);
  EXPECT_EQ(reading.linear, Vector3d(0.0, 0.01, 0.0));
  EXPECT_TRUE(keyboard->read(1.09).present);
  EXPECT_FALSE(keyboard->read(1.11).present);
  terminal.type("wwwr");
  EXPECT_EQ(keyboard->read(2.0).linear, Vector3d(0.0, 0.0, 0.01));
  EXPECT_EQ(keyboard->read(2.0).angular, Vector3d::Zero());
  for (const auto& [key, axis] : {std::pair<std::string, Vector3d>{"i", {1, 0, 0}},
                                  {"k", {-1, 0, 0}},
                                  {"l", {0, 1, 0}},
                                  {"j", {0, -1, 0}},
                                  {"o", {0, 0, 1}},
                                  {"u", {0, 0, -1}}}) {
    terminal.type(key);
    reading = keyboard->read(2.02);
    EXPECT_TRUE(reading.present);
    EXPECT_EQ(reading.angular, 0.2 * axis) << key;
    EXPECT_EQ(reading.linear, Vector3d::Zero());
  }
  terminal.type("m\t+ ");
  reading = keyboard->read(2.05);
  EXPECT_TRUE(reading.next_mode && reading.next_arm && reading.stop);
  EXPECT_FALSE(reading.present) << "stop goes before everything";
  EXPECT_EQ(reading.scale_steps, 1);
  terminal.type("q");
  EXPECT_TRUE(keyboard->read(3.0).end);
}

TEST(SpaceMouse, SaysWhatItsDaemonSays) {
  const Folder folder;
  const std::string path = (folder.path / "spnav.sock").string();
  const int listener = socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof(address.sun_path) - 1);
  ASSERT_EQ(bind(listener, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  ASSERT_EQ(listen(listener, 1), 0);
  setenv("SPNAV_SOCKET", path.c_str(), 1);
  const auto mouse = openSpaceMouse(0.035, 0.2);  // connects before the daemon accepts
  const int daemon = accept(listener, nullptr, nullptr);
  ASSERT_GE(daemon, 0);
  EXPECT_FALSE(mouse->read(0.0).present);
  // An event is eight 32-bit numbers: type (0 motion, 1 press, 2 release), then six axes, or the button; ms.
  const auto say = [daemon](std::array<std::int32_t, 8> event) {
    ASSERT_EQ(write(daemon, event.data(), sizeof(event)), static_cast<ssize_t>(sizeof(event)));
  };
  say({1, 0, 0, 0, 0, 0, 0, 0});
  say({0, 350, -175, 70, 0, 350, 0, 16});
  const Reading reading = mouse->read(0.0);
  EXPECT_TRUE(reading.present);
  EXPECT_FALSE(reading.clutch);
  EXPECT_NEAR(reading.linear.x(), 0.035, 1e-9);
  EXPECT_NEAR(reading.linear.cwiseAbs().sum(), 0.035 * (1.0 + 0.5 + 0.2), 1e-9);
  EXPECT_NEAR(reading.angular.cwiseAbs().sum(), 0.2, 1e-9);
  say({2, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_FALSE(mouse->read(0.0).present);
  say({1, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_TRUE(mouse->read(0.0).present);
  close(daemon);  // while the button is held
  EXPECT_THROW(mouse->read(0.0), DeviceError);
  close(listener);
}

TEST(Trace, VelocitiesAndPlacesAtTheirTimes) {
  const Folder folder;
  const auto velocities = openTrace(folder.write("v.csv",
                                                 "time_s,present,vx_mm_per_s,vy_mm_per_s,vz_mm_per_s\n"
                                                 "0,0,0,0,0\n1,1,2,-3,4\n\n# a remark\n2,0,0,0,0\n"));
  EXPECT_FALSE(velocities->read(0.0).present) << "the switch is seen released first";
  EXPECT_FALSE(velocities->read(1.2).present);
  const Reading reading = velocities->read(1.4);
  EXPECT_TRUE(reading.present);
  EXPECT_EQ(reading.linear, 1e-3 * Vector3d(2, -3, 4));
  EXPECT_FALSE(velocities->read(2.35).end);
  EXPECT_TRUE(velocities->read(2.5).end);
  const auto places = openTrace(folder.write("p.csv", "x_mm,y_mm,z_mm,time_s\n1,2,3,5\n4,5,6,6\n"));
  EXPECT_TRUE(places->read(0.4).pose);
  EXPECT_EQ(places->read(0.4).position, 1e-3 * Vector3d(1, 2, 3));
  EXPECT_EQ(places->read(0.4).orientation.coeffs(), Eigen::Quaterniond::Identity().coeffs());
  const auto turns = openTrace(folder.write("w.csv",
                                            "time_s,vx_mm_per_s,vy_mm_per_s,vz_mm_per_s,wx_deg_per_s,wy_deg_per_s,"
                                            "wz_deg_per_s\n0,0,0,0,90,0,-45\n1,0,0,0,0,0,0\n"));
  EXPECT_LT((turns->read(0.4).angular - M_PI * Vector3d(0.5, 0, -0.25)).norm(), 1e-12);
  const auto poses =
      openTrace(folder.write("r.csv", "time_s,x_mm,y_mm,z_mm,rx_deg,ry_deg,rz_deg\n0,0,0,0,0,90,0\n1,0,0,0,0,0,0\n"));
  EXPECT_LT((poses->read(0.4).orientation * Vector3d::UnitZ() - Vector3d::UnitX()).norm(), 1e-12);
}

TEST(Trace, BadFilesAreNamedLineByLine) {
  const Folder folder;
  const auto has = [&](const std::string& text, const char* part) {
    return refusalOf(folder.write("bad.csv", text)).find(part) != std::string::npos;
  };
  EXPECT_TRUE(has("", "empty"));
  EXPECT_TRUE(has("time_s,vx\n", "bad.csv:1: found column 'vx'"));
  EXPECT_TRUE(has("vx_mm_per_s\n", "found no column 'time_s', expected it"));
  EXPECT_TRUE(has("time_s,x_mm,y_mm,z_mm,wx_deg_per_s\n", "bad.csv:1: found column 'wx_deg_per_s'"));
  EXPECT_TRUE(has("time_s,x_mm,y_mm,z_mm,rx_deg\n", "bad.csv:1: found no column 'ry_deg', expected it"));
  const std::string head = "time_s,vx_mm_per_s,vy_mm_per_s,vz_mm_per_s\n";
  EXPECT_TRUE(has(head, "no motion"));
  EXPECT_TRUE(has(head + "0,0,0\n", "bad.csv:2: found 3 fields, expected 4"));
  EXPECT_TRUE(has(head + "0,0,x,0\n", "bad.csv:2: vy_mm_per_s: found 'x'"));
  EXPECT_TRUE(has(head + "1,0,0,0\n0,0,0,0\n", "bad.csv:3: time_s"));
  EXPECT_TRUE(has(head + "0,nan,0,0\n", "finite"));
  EXPECT_NE(refusalOf((folder.path / "none.csv").string()).find("cannot be read"), std::string::npos);
  EXPECT_NE(refusalOf(folder.write("no.mcap", "nonsense")), "");
}

TEST(Trace, RecordingsGiveBackWhatWasSent) {
  const Folder folder;
  const std::string type = dds::kTeleopInput.type, today = dds::messageDefinition(type), angular = "float64[3] angular";
  std::string older = today;
  older.replace(older.find(angular), angular.size(), "");
  for (const std::string& definition : {today, older}) {
    const std::string file = (folder.path / "hand.mcap").string();
    const recording::Conversion then(recording::parseDefinition(type, today),
                                     recording::parseDefinition(type, definition));
    {
      recording::Writer writer(file);
      const auto schema = writer.addSchema(type, "ros2msg", definition);
      const auto channel = writer.addChannel("/tandem/teleop/input", schema, {});
      for (std::uint32_t i = 0; i < 10; ++i) {
        dds::TeleopInput input;
        input.kind = 2;
        input.operator_present = i > 2 ? 1 : 0;
        input.position = {0.001 * i, 0.0, 0.0};
        const auto bytes = then(dds::encode(input));
        writer.write({channel, i, 1'000'000'000 + 100'000'000ULL * i, 0, bytes.value()});
      }
      writer.close();
    }
    const auto trace = openTrace(file);
    EXPECT_FALSE(trace->read(0.31).present);
    const Reading reading = trace->read(0.3 + 0.55);
    EXPECT_TRUE(reading.present && reading.pose);
    EXPECT_EQ(reading.position, Vector3d(0.005, 0.0, 0.0));
    EXPECT_TRUE(trace->read(1.5).end);
  }
}

TEST(Trace, RecordingsOfOlderCommitsOpen) {
  const auto trace = openTrace(TANDEM_ARCHIVE "/5e7986a/recordings/teleoperation.mcap");
  int fast = 0;
  for (double time = 0.0; time < 20.0; time += 0.01)
    fast += trace->read(time).present && trace->read(time).linear.isApprox(Vector3d(0.0, 0.008, 0.0)) ? 1 : 0;
  EXPECT_GT(fast, 20) << "a quarter of the half second in which the hand went sideways (hand.csv)";
}

}  // namespace
}  // namespace tandem::teleop
