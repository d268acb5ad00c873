// SPDX-License-Identifier: Apache-2.0
#include "services/runtime/cycle_log.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <iterator>
#include <system_error>

#include "operation/convert.h"

namespace tandem::runtime {
namespace {

using Line = std::back_insert_iterator<std::string>;

constexpr const char* kTickColumns = "cycle,lost,scheduled_ns,now_ns";
constexpr std::size_t kLongestLine = 8192;

std::string startOf(const Tick& tick, std::uint64_t lost) {
  std::string line;
  line.reserve(kLongestLine);
  fmt::format_to(Line(line), "{},{},{},{}", tick.cycle, lost, tick.scheduled, tick.now);
  return line;
}

/// Columns ARM.NAME per arm, then ARM.JOINT.NAME per joint.
std::string perArmAndJoint(const config::Robot& robot,
                           const std::vector<std::string>& of_arm,
                           const std::vector<std::string>& of_joint) {
  std::string columns;
  for (const config::Arm& arm : robot.arms) {
    for (const std::string& name : of_arm)
      fmt::format_to(Line(columns), ",{}.{}", arm.name, name);
    for (const std::string& joint : arm.joint_names) {
      for (const std::string& name : of_joint)
        fmt::format_to(Line(columns), ",{}.{}.{}", arm.name, joint, name);
    }
  }
  return columns + '\n';
}

/// Calls `arm(k)`, then `joint(index)` for each of its joints.
template <class Arm, class Joint>
void forArmsAndJoints(const config::Robot& robot, Arm arm, Joint joint) {
  for (int k = 0; k < static_cast<int>(robot.arms.size()); ++k) {
    arm(static_cast<std::size_t>(k));
    for (int j = 0; j < robot.arms[static_cast<std::size_t>(k)].jointCount(); ++j)
      joint(dds::jointIndex(k, j));
  }
}

}  // namespace

CycleFile::CycleFile(const Setup& setup, const std::string& header) {
  const std::filesystem::path& folder = setup.deployment.cycle_log;
  if (folder.empty())
    return;
  std::filesystem::create_directories(folder);
  name_ = (folder / fmt::format("{}-{}.csv", setup.name, setup.session)).string();
  descriptor_ = ::open(name_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor_ < 0)
    throw std::system_error(errno, std::generic_category(), name_);
  write(header);
}

CycleFile::~CycleFile() {
  if (descriptor_ >= 0)
    ::close(descriptor_);
}

void CycleFile::write(const std::string& line) {
  if (descriptor_ < 0)
    return;
  if (::write(descriptor_, line.data(), line.size()) == static_cast<ssize_t>(line.size()))
    return;
  spdlog::error("{}: {}; the cycle log ends here", name_,
                errno != 0 ? std::generic_category().message(errno) : "incomplete line");
  ::close(descriptor_);
  descriptor_ = -1;
}

std::string cycleHeader(const config::Robot& robot, const DriveCycle&) {
  return std::string(kTickColumns) +
         ",session,state,stop,control_session,command,answers_session,answers_state,commander" +
         perArmAndJoint(robot, {"state", "faults", "request"}, {"setpoint", "position", "velocity"});
}

std::string cycleHeader(const config::Robot& robot, const ControlCycle&) {
  return std::string(kTickColumns) +
         ",session,command,status,state_session,state,answers_command,reference,answers_status,lease_client,lease_"
         "answers,input,input_answers,lease,source" +
         perArmAndJoint(robot, {"state", "faults", "request", "moving"}, {"velocity"});
}

std::string cycleLine(const config::Robot& robot, const DriveCycle& cycle, std::uint64_t lost) {
  std::string line = startOf(cycle.tick, lost);
  const dds::ActuationState& state = cycle.state;
  const dds::ActuationCommand& command = cycle.command;
  fmt::format_to(Line(line), ",{},{},{:d}", state.session, state.sequence, cycle.stop);
  if (cycle.taken)
    fmt::format_to(Line(line), ",{},{},{},{},{}", command.control_session, command.sequence, command.state_session,
                   command.answers_state, command.commander);
  else
    line += ",,,,,";
  forArmsAndJoints(
      robot,
      [&](std::size_t k) {
        fmt::format_to(Line(line), ",{},{},", state.operating_state[k], state.faults[k]);
        if (cycle.taken)
          fmt::format_to(Line(line), "{}", command.request[k]);
      },
      [&](std::size_t j) {
        fmt::format_to(Line(line), ",{},{},{}", state.setpoint[j], state.position[j], state.velocity[j]);
      });
  return line + '\n';
}

std::string cycleLine(const config::Robot& robot, const ControlCycle& cycle, std::uint64_t lost) {
  std::string line = startOf(cycle.tick, lost);
  fmt::format_to(Line(line), ",{},{},{}", cycle.status.session, cycle.command.sequence, cycle.status.sequence);
  if (cycle.state_taken)
    fmt::format_to(Line(line), ",{},{},{}", cycle.state.session, cycle.state.sequence, cycle.state.answers_command);
  else
    line += ",,,";
  if (cycle.reference_taken)
    fmt::format_to(Line(line), ",{},{}", cycle.reference.sequence, cycle.reference.answers_control);
  else
    line += ",,";
  if (cycle.lease_client != 0)
    fmt::format_to(Line(line), ",{},{}", cycle.lease_client, cycle.lease_answers);
  else
    line += ",,";
  if (cycle.input_taken)
    fmt::format_to(Line(line), ",{},{}", cycle.input.sequence, cycle.input.answers_control);
  else
    line += ",,";
  fmt::format_to(Line(line), ",{},{}", cycle.status.lease_owner, cycle.status.source);
  forArmsAndJoints(
      robot,
      [&](std::size_t k) {
        fmt::format_to(Line(line), ",{},{},{},{}", cycle.status.operating_state[k], cycle.status.faults[k],
                       cycle.command.request[k], cycle.command.moving[k]);
      },
      [&](std::size_t j) { fmt::format_to(Line(line), ",{}", cycle.command.velocity[j]); });
  return line + '\n';
}

}  // namespace tandem::runtime
