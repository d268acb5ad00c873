// SPDX-License-Identifier: Apache-2.0
/** @file Benchmark of the round trip state -> control -> command over DDS in lock-step, compared with a plain Fast
 * DDS ping-pong of equal message size. */
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <variant>

#include "bench/enroll.h"
#include "bench/percentiles.h"
#include "bench/ping_pong.h"
#include "config/config.h"
#include "services/planning/planning_core.h"
#include "services/runtime/mailbox.h"
#include "services/simulation/sim_core.h"

extern char** environ;

namespace tandem::bench {
namespace {

constexpr int kTrips = 5000, kWarm = 200;
constexpr std::uint64_t kClient = 7;
const int kDomain = 20 + getpid() % 80;

/** A process of this project, ended by the destructor. */
class Program {
 public:
  Program(const std::string& path, const std::string& deployment) {
    std::string option = "--deployment", log = "--log", level = "error", file = deployment, name = path;
    char* arguments[] = {name.data(), option.data(), file.data(), log.data(), level.data(), nullptr};
    if (posix_spawn(&pid_, path.c_str(), nullptr, nullptr, arguments, environ) != 0)
      throw std::runtime_error("cannot start " + path);
  }
  ~Program() {
    kill(pid_, SIGTERM);
    waitpid(pid_, nullptr, 0);
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

 private:
  pid_t pid_ = 0;
};

/** The preset lockstep with an unused domain, as a file. */
class DeploymentFile {
 public:
  DeploymentFile()
      : path_(std::filesystem::temp_directory_path() / ("tandem-bench-" + std::to_string(getpid()) + ".yaml")) {
    const std::filesystem::path presets = std::filesystem::path(TANDEM_SOURCE) / "config/presets";
    std::ifstream from(presets / "deployments/lockstep.yaml");
    std::ofstream to(path_);
    for (std::string line; std::getline(from, line);) {
      if (line.starts_with("domain:"))
        line = "domain: " + std::to_string(kDomain);
      if (line.starts_with("robot:"))
        line = "robot: " + (presets / "robots/ark2024.yaml").string();
      to << line << '\n';
    }
  }
  ~DeploymentFile() { std::filesystem::remove(path_); }
  std::string path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/** All services except control. */
class Robot {
 public:
  explicit Robot(const runtime::Setup& setup)
      : sim_(setup), planning_(setup), bus_(runtime::busOptions(setup.deployment, "sim")) {
    states_ = bus_.writer(dds::kActuationState);
    references_ = bus_.writer(dds::kPlanningReference);
    requests_ = bus_.writer(dds::kControlRequest);
    const auto put = [this](const auto& message) { mailbox_.put(message); };
    readers_.push_back(bus_.reader(dds::kActuationCommand, put));
    readers_.push_back(bus_.reader(dds::kControlStatus, put));
  }

  /// Lease, enable, a trajectory longer than the measurement.
  void begin() {
    until([this] { return status_.sequence > 0; }, [] {});
    until([this] { return status_.lease_owner == kClient; }, [this] { ask(dds::ControlKind::kAcquireLease); });
    until([this] { return status_.operating_state[0] == enabled() && status_.operating_state[1] == enabled(); },
          [this] { ask(dds::ControlKind::kStateCommand, "enable"); });
    planning::TrajectorySpec spec;
    spec.name = "line";
    spec.shape = planning::Line{{0.0, 0.01, 0.0}};
    spec.following = planning::Following::kTimed;
    spec.speed = 1e-5;
    dds::PlanningRequest start;
    start.client = kClient;
    start.kind = 1;
    start.trajectory = config::formatTrajectory(spec);
    std::optional<dds::Path> path;
    if (const dds::Reply reply = planning_.onRequest(start, path); reply.accepted == 0)
      throw std::runtime_error("planning: " + reply.reason);
  }

  /// One step. @return us from the state to the command that answers it.
  double step(int number) {
    if (number % 100 == 0)
      ask(dds::ControlKind::kKeepLease);
    planning_.onState(state_);
    const auto reference = planning_.take();
    const auto begin = std::chrono::steady_clock::now();
    states_.write(state_);
    if (reference)
      references_.write(*reference);
    while (true) {
      const auto event = mailbox_.take(2.0);
      if (!event)
        throw std::runtime_error("no message from tandem-control for 2 s; its log above names the cause");
      if (const auto* status = std::get_if<dds::ControlStatus>(&*event)) {
        take(*status);
        continue;
      }
      const auto& command = std::get<dds::ActuationCommand>(*event);
      if (command.answers_state != state_.sequence)
        continue;
      const double time = 1e6 * std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
      if (sim_.onCommand(command, runtime::monotonicNow()))
        sim_.state(runtime::monotonicNow(), state_);
      return time;
    }
  }

 private:
  static constexpr std::uint8_t enabled() { return static_cast<std::uint8_t>(safety::OperatingState::kEnabled); }

  void ask(dds::ControlKind kind, const std::string& value = "") {
    dds::ControlRequest request;
    request.client = kClient;
    request.request = ++request_;
    request.kind = static_cast<std::uint8_t>(kind);
    request.value = value;
    requests_.write(request);
  }
  void take(const dds::ControlStatus& status) {
    status_ = status;
    planning_.onStatus(status);
  }

  /// Repeats the state, like an idle simulator.
  template <class Condition, class Do>
  void until(Condition condition, Do act) {
    sim_.state(runtime::monotonicNow(), state_);
    for (int i = 0; i < 400; ++i) {
      if (i % 10 == 0)
        act();
      states_.write(state_);
      planning_.onState(state_);
      if (const auto reference = planning_.take())
        references_.write(*reference);
      while (const auto event = mailbox_.take(0.02)) {
        if (const auto* status = std::get_if<dds::ControlStatus>(&*event))
          take(*status);
        else if (sim_.onCommand(std::get<dds::ActuationCommand>(*event), runtime::monotonicNow()))
          sim_.state(runtime::monotonicNow(), state_);
        if (condition())
          return;
        break;
      }
    }
    throw std::runtime_error("tandem-control did not become ready in time; its log above names the cause");
  }

  simulation::SimCore sim_;
  planning_service::PlanningCore planning_;
  runtime::Mailbox<std::variant<dds::ActuationCommand, dds::ControlStatus>> mailbox_;
  dds::Bus bus_;
  dds::Writer<dds::ActuationState> states_;
  dds::Writer<dds::PlanningReference> references_;
  dds::Writer<dds::ControlRequest> requests_;
  std::vector<dds::Reader> readers_;
  dds::ActuationState state_;
  dds::ControlStatus status_;
  std::uint64_t request_ = 0;
};

std::vector<double> throughControl() {
  const DeploymentFile file;
  runtime::Setup setup;
  setup.name = "sim";
  setup.deployment = config::loadDeployment(file.path());
  setup.robot = config::loadRobot(setup.deployment.robot);
  setup.session = runtime::randomIdentity();
  const Program control(std::filesystem::read_symlink("/proc/self/exe").parent_path() / "tandem-control", file.path());
  Robot robot(setup);
  robot.begin();
  std::vector<double> times;
  for (int i = 0; i < kWarm + kTrips; ++i) {
    const double time = robot.step(i);
    if (i >= kWarm)
      times.push_back(time);
  }
  return times;
}

}  // namespace

void enrollAll() {
  const auto add = [](const char* name, std::vector<double> (*measure)()) {
    benchmark::RegisterBenchmark(name,
                                 [measure](benchmark::State& state) {
                                   for (auto _ : state) {
                                     const std::vector<double> times = measure();
                                     state.SetIterationTime(1e-6 * std::accumulate(times.begin(), times.end(), 0.0));
                                     reportPercentiles(state, times);
                                     state.counters["failed"] = 0;
                                   }
                                 })
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond)
        ->Iterations(1);
  };
  // The baseline first: it forks, which is not allowed in a process with DDS threads.
  add("round_trip/ping_pong",
      [] { return pingPong(kDomain, sizeof(dds::ActuationState), sizeof(dds::ActuationCommand), kTrips); });
  add("round_trip/control", throughControl);
}

}  // namespace tandem::bench
