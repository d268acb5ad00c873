// SPDX-License-Identifier: Apache-2.0
#include "services/control/crtk_command_handler.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>

#include "config/arm_names.h"
#include "services/runtime/clock_request_handler.h"
#include "services/runtime/periodic_loop.h"

namespace tandem::control_service {
namespace {

constexpr double kForgotten = 10.0;  ///< silence after which a new stream begins, s
constexpr double kLeak = 1e-3;       ///< largest relative drift of two clocks, s per s

std::string milliseconds(double seconds) { return fmt::format("{:.1f} ms", 1e3 * seconds); }

int verbNamed(std::string_view name) {
  for (std::size_t i = 0; i < operation::kCrtkVerbs.size(); ++i) {
    if (operation::kCrtkVerbs[i].name == name)
      return static_cast<int>(i);
  }
  return -1;
}

template <class List>
bool allFinite(const List& numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](double x) { return std::isfinite(x); });
}

}  // namespace

std::vector<std::string> jointNames(const config::Arm& arm) {
  std::vector<std::string> names = arm.joint_names;
  for (std::string& name : names)
    name = arm.name + "_" + name;
  return names;
}

std::string CrtkStream::judge(std::int64_t stamp, std::int64_t wall, std::int64_t arrival) {
  if (stamp == 0)
    return "stamp: found 0, which marks invalid samples";
  const double silence = 1e-9 * static_cast<double>(arrival - last_arrival_);
  const bool first = !known_ || silence > kForgotten;
  if (!first && stamp <= last_stamp_)
    return "stamp: found one that is not later than that of the previous sample, expected increasing stamps";
  const double offset = 1e-9 * static_cast<double>(arrival - stamp);
  quickest_ = first ? offset : std::min(offset, quickest_ + kLeak * silence);
  known_ = true;
  last_stamp_ = stamp;
  last_arrival_ = arrival;
  const double age = 1e-9 * static_cast<double>(wall - stamp);
  const bool fresh = std::abs(age) <= budget_;
  if (by_arrival_) {
    if (first && !fresh)
      return "first sample of a stream: its age is unknown because clocks differ; send the command again";
    if (offset - quickest_ > budget_)
      return "delayed by " + milliseconds(offset - quickest_) +
             " relative to the fastest sample of its stream, allowed " + milliseconds(budget_);
    return "";
  }
  if (!fresh)
    return "stamp: found an age of " + milliseconds(age) + " by the clock of this host, allowed " +
           milliseconds(budget_) + "; if the wall clocks differ, remove teleoperation.crtk.stamps: wall";
  return "";
}

std::int64_t FeedbackStamps::next(const dds::ActuationState& state, const dds::ControlStatus& status) {
  const std::lock_guard lock(mutex_);
  if (state.sequence == 0 || state.session != session_ || state.sequence != sequence_)
    stamp_ = time_.of(status.stamp);
  session_ = state.session;
  sequence_ = state.sequence;
  entries_[next_++ % entries_.size()] = {stamp_, status.sequence};
  return stamp_;
}

std::uint64_t FeedbackStamps::statusOf(std::int64_t stamp) const {
  const std::lock_guard lock(mutex_);
  const auto found = std::ranges::find(entries_, stamp, &Entry::stamp);
  return stamp == 0 || found == entries_.end() ? 0 : found->status;
}

std::uint64_t FeedbackStamps::last() const {
  const std::lock_guard lock(mutex_);
  return next_ == 0 ? 0 : entries_[(next_ - 1) % entries_.size()].status;
}

std::uint64_t CrtkCommandHandler::answered(std::int64_t stamp) const {
  if (const std::uint64_t status = feedback_.statusOf(stamp); status != 0)
    return status;
  const double age = 1e-9 * static_cast<double>(runtime::wallNow() - stamp);
  const bool by_clock = !setup_.deployment.teleoperation.crtk.by_arrival;
  return by_clock && std::abs(age) <= setup_.deployment.budgets.planning_reference ? feedback_.last() : 0;
}

CrtkCommandHandler::CrtkCommandHandler(const runtime::Setup& setup, const robots::RobotModel& robot)
    : setup_(setup),
      robot_(robot),
      frame_(setup.deployment.prefix + "_base"),
      feedback_(setup.deployment.clock == config::ClockMode::kLockStep) {}

std::string CrtkCommandHandler::groupName(int group) const {
  return group == operation::kPairGroup ? dds::kPair : setup_.robot.arms[static_cast<std::size_t>(group)].name;
}

std::vector<int> CrtkCommandHandler::armsOf(int group) const {
  return group == operation::kPairGroup ? std::vector<int>{0, 1} : std::vector<int>{group};
}

CrtkCommandHandler::Entry& CrtkCommandHandler::entry(int group, int verb) {
  const safety::Budgets& budgets = setup_.deployment.budgets;
  const double budget = operation::verbOf(verb).level == operation::CrtkLevel::kServo ? budgets.teleoperation
                                                                                      : budgets.planning_reference;
  return entries_.try_emplace({group, verb}, Entry{CrtkStream(setup_.deployment.teleoperation.crtk.by_arrival, budget)})
      .first->second;
}

void CrtkCommandHandler::listen(dds::Bus& bus,
                                OnRequest on_request,
                                const dds::ReaderOptions& admitted,
                                std::vector<dds::Reader>& readers) {
  std::vector<int> groups(static_cast<std::size_t>(robot_.armCount()));
  for (std::size_t k = 0; k < groups.size(); ++k)
    groups[k] = static_cast<int>(k);
  if (groups.size() >= 2)
    groups.push_back(operation::kPairGroup);
  dds::forEachTopic([&](const auto& topic) {
    using M = typename std::decay_t<decltype(topic)>::Message;
    const int verb = verbNamed(topic.name);
    if constexpr (requires(operation::CrtkRequest request) { this->parse(M(), request); }) {
      for (const int group : verb < 0 ? std::vector<int>{} : groups) {
        {
          const std::lock_guard lock(mutex_);
          entry(group, verb);
        }
        operation::CrtkRequest request;
        request.verb = verb;
        request.group = group;
        readers.push_back(bus.reader(
            topic, groupName(group),
            [this, request, on_request](const M& message) { take(message, request, on_request); }, admitted));
      }
    }
  });
}

template <class M>
void CrtkCommandHandler::take(const M& message, operation::CrtkRequest request, const OnRequest& on_request) {
  std::string refusal = parse(message, request);
  if constexpr (requires { message.stamp; }) {
    const std::lock_guard lock(mutex_);
    const std::string late =
        entry(request.group, request.verb).stream.judge(message.stamp, runtime::wallNow(), runtime::monotonicNow());
    refusal = late.empty() ? refusal : late;
  }
  if (refusal.empty()) {
    on_request(request);
  } else {
    note(request, refusal);
  }
}

void CrtkCommandHandler::note(const operation::CrtkRequest& request, const std::string& refusal) {
  const std::lock_guard lock(mutex_);
  Entry& of = entry(request.group, request.verb);
  ++of.refused;
  if (of.refusal != refusal && of.refusal.substr(0, 12) != refusal.substr(0, 12))
    spdlog::warn("{}/{} refused: {}", groupName(request.group), operation::verbOf(request.verb).name, refusal);
  of.refusal = refusal;
}

std::string CrtkCommandHandler::badFrame(const std::string& frame) const {
  if (frame.empty() || frame == frame_)
    return "";
  return "frame_id: found '" + frame.substr(0, 60) + "', expected " + frame_ + " or nothing";
}

std::string CrtkCommandHandler::parse(const dds::JointState& message, operation::CrtkRequest& request) const {
  std::vector<std::string> names;
  for (const int k : armsOf(request.group)) {
    for (const std::string& name : jointNames(setup_.robot.arms[static_cast<std::size_t>(k)]))
      names.push_back(name);
  }
  const bool velocity = operation::verbOf(request.verb).kind == operation::CrtkKind::kVelocity;
  const std::vector<double>& values = velocity ? message.velocity : message.position;
  const char* member = velocity ? "velocity" : "position";
  if (values.size() != names.size())
    return fmt::format("{}: found {} numbers, expected {}", member, values.size(), names.size());
  if (!allFinite(values))
    return fmt::format("{}: found NaN or infinity, expected finite numbers", member);
  if (!message.name.empty() && message.name != names)
    return "name: expected the joints in their order, " + names.front() + " to " + names.back() + ", or nothing";
  request.count = static_cast<int>(values.size());
  std::copy(values.begin(), values.end(), request.values.begin());
  return "";
}

std::string CrtkCommandHandler::parse(const dds::PoseStamped& message, operation::CrtkRequest& request) const {
  const auto& q = message.orientation;
  const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!allFinite(message.position))
    return "position: found NaN or infinity, expected finite numbers";
  if (!(std::abs(norm - 1.0) <= 1e-2))
    return fmt::format("orientation: found a quaternion of length {:.3g}, expected 1", norm);
  request.count = 3;
  request.orientation = q;
  std::copy(message.position.begin(), message.position.end(), request.values.begin());
  return badFrame(message.frame);
}

std::string CrtkCommandHandler::parse(const dds::TwistStamped& message, operation::CrtkRequest& request) const {
  if (!allFinite(message.linear) || !allFinite(message.angular))
    return "twist: found NaN or infinity, expected finite numbers";
  request.count = 3;
  std::copy(message.linear.begin(), message.linear.end(), request.values.begin());
  request.angular = message.angular;
  return badFrame(message.frame);
}

std::string CrtkCommandHandler::parse(const dds::Empty&, operation::CrtkRequest& request) const {
  request.count = 0;
  return "";
}

void CrtkCommandHandler::report(const operation::CrtkOutcome& outcome) {
  operation::CrtkRequest request;
  request.verb = outcome.verb;
  request.group = outcome.group;
  if (!outcome.accepted && outcome.counts)
    return note(request, outcome.reason.data());
  const std::lock_guard lock(mutex_);
  Entry& of = entry(request.group, request.verb);
  of.accepted += outcome.accepted ? 1 : 0;
  if (!outcome.accepted)
    of.refusal = outcome.reason.data();
}

void CrtkCommandHandler::fill(const operation::CrtkSnapshot& snapshot, dds::CrtkStatus& status) const {
  status.commanding = snapshot.commanding ? 1 : 0;
  status.stamps = setup_.deployment.teleoperation.crtk.by_arrival ? "arrival" : "wall";
  const std::lock_guard lock(mutex_);
  for (const auto& [key, entry] : entries_) {
    const auto& [group, verb] = key;
    const bool active = snapshot.active[static_cast<std::size_t>(group)] == verb;
    status.commands.push_back({groupName(group) + "/" + std::string(operation::verbOf(verb).name),
                               static_cast<std::uint8_t>(active ? 1 : 0), entry.accepted, entry.refused,
                               entry.refusal});
  }
}

}  // namespace tandem::control_service
