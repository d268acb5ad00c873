// SPDX-License-Identifier: Apache-2.0
/* A participant that tries by all means to read a robot and to move it. Ends when its standard input closes, and
 * then prints one line of JSON: what it received.
 *
 *   hostile_peer DOMAIN PREFIX [--credentials FOLDER ROLE] [--days-back N] [--patched]
 *
 * --days-back N: its clock is wrong, so that an expired certificate of its own is valid.
 * --patched: it skips the checks of its own permissions, like an attacker with modified middleware. */
#include <dlfcn.h>
#include <poll.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <map>
#include <mutex>
#include <string>
#include <type_traits>
#include <vector>

#include "services/dds/bus.h"

namespace {
std::time_t clock_error = 0;  // s
bool patched = false;
}  // namespace

// Replaces the clock of OpenSSL.
extern "C" std::time_t time(std::time_t* at) {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  const std::time_t answer = now.tv_sec + clock_error;
  if (at != nullptr)
    *at = answer;
  return answer;
}

// Replaces the functions of the same names in Fast DDS.
namespace eprosima::fastrtps::rtps::security {
class Handle;
class SecurityException;
class Permissions {
 public:
  // NOLINTBEGIN(readability-identifier-naming)
  bool check_create_datawriter(const Handle& handle,
                               unsigned int domain,
                               const std::string& topic,
                               const std::vector<std::string>& partitions,
                               SecurityException& exception);
  bool check_create_datareader(const Handle& handle,
                               unsigned int domain,
                               const std::string& topic,
                               const std::vector<std::string>& partitions,
                               SecurityException& exception);
  // NOLINTEND(readability-identifier-naming)
};

namespace {
using Check = bool (*)(Permissions*,
                       const Handle&,
                       unsigned int,
                       const std::string&,
                       const std::vector<std::string>&,
                       SecurityException&);

std::atomic<int> skipped{0};  // number of checks: shows that the patch is effective

/// The original check; names as mangled by the compiler.
Check original(const std::string& name) {
  void* found = dlsym(RTLD_NEXT, name.c_str());
  if (found == nullptr)
    std::abort();
  return reinterpret_cast<Check>(found);
}

constexpr const char* kClass = "_ZN8eprosima8fastrtps4rtps8security11Permissions23";
constexpr const char* kArguments =
    "ERKNS2_6HandleEjRKNSt7__cxx1112basic_stringIcSt11char_traitsIcESaIcEEERKSt6vectorISC_SaISC_EERNS2_"
    "17SecurityExceptionE";
}  // namespace

bool Permissions::check_create_datawriter(const Handle& handle,
                                          unsigned int domain,
                                          const std::string& topic,
                                          const std::vector<std::string>& partitions,
                                          SecurityException& exception) {
  skipped += patched ? 1 : 0;
  return patched || original(std::string(kClass) + "check_create_datawriter" + kArguments)(this, handle, domain, topic,
                                                                                           partitions, exception);
}

bool Permissions::check_create_datareader(const Handle& handle,
                                          unsigned int domain,
                                          const std::string& topic,
                                          const std::vector<std::string>& partitions,
                                          SecurityException& exception) {
  skipped += patched ? 1 : 0;
  return patched || original(std::string(kClass) + "check_create_datareader" + kArguments)(this, handle, domain, topic,
                                                                                           partitions, exception);
}
}  // namespace eprosima::fastrtps::rtps::security

namespace tandem::dds {
namespace {

const std::vector<std::string> kArms{"arm_a", "arm_b"};
constexpr std::uint64_t kClient = 0xbadc0de;
constexpr const char* kFrame = "hostile";

/// Whether a message is its own, which its readers also receive.
template <class M>
bool isOwn(const M& message) {
  if constexpr (requires { message.client; })
    return message.client == kClient;
  if constexpr (std::is_same_v<M, ActuationCommand>)
    return message.control_session == kClient;
  if constexpr (std::is_same_v<M, StringStamped>)
    return message.frame == kFrame;
  return false;
}

/** Readers and writers of everything that can be read or moves a robot. */
class Hostile {
 public:
  explicit Hostile(const BusOptions& options) : bus_(options) {
    forEachTopic([this](const auto& topic) {
      if (!topic.per_arm)
        return listen(topic, "");
      for (const std::string& arm : kArms)
        listen(topic, arm);
    });
    requests_ = writer(kControlRequest);
    plans_ = writer(kPlanningRequest);
    sims_ = writer(kSimRequest);
    hals_ = writer(kHalRequest);
    commands_ = writer(kActuationCommand);
    for (const std::string& arm : kArms)
      states_.push_back(writer(kStateCommand, arm));
  }

  /// One round of all attempts.
  void attack() {
    for (ControlKind kind : {ControlKind::kAcquireLease, ControlKind::kKeepLease})
      request(kind, "");
    request(ControlKind::kStateCommand, "enable");
    request(ControlKind::kJog, "");
    PlanningRequest plan{fingerprint(), kClient, ++number_, 1,
                         "{tandem: trajectory/1, name: x, shape: {line: {displacement_mm: [0, 9, 0]}}}"};
    plans_.write(plan);
    HalRequest home{fingerprint(), kClient, ++number_, 1};
    hals_.write(home);
    SimRequest reset{fingerprint(), kClient, ++number_, 1, 2};
    sims_.write(reset);
    for (auto& writer : states_)
      writer.write({0, kFrame, "enable"});
    command();
  }

  void report() {
    std::size_t topics = 0;
    std::uint64_t samples = 0;
    int matched = 0;
    const std::lock_guard lock(mutex_);
    for (const auto& [name, count] : received_) {
      ++topics;
      samples += count;
    }
    for (int readers : {requests_.matched(), plans_.matched(), sims_.matched(), hals_.matched(), commands_.matched()})
      matched += readers;
    std::printf(
        "{\"topics\": %zu, \"samples\": %llu, \"writers_refused\": %d, \"readers_refused\": %d, "
        "\"matched\": %d, \"checks_skipped\": %d}\n",
        topics, static_cast<unsigned long long>(samples), writers_refused_, readers_refused_, matched,
        eprosima::fastrtps::rtps::security::skipped.load());
  }

 private:
  template <class M>
  void listen(const Topic<M>& topic, const std::string& arm) {
    const std::string name = arm + "/" + topic.name;
    const auto take = [this, name](const M& message) {
      if (isOwn(message))
        return;
      const std::lock_guard lock(mutex_);
      ++received_[name];
      if constexpr (std::is_same_v<M, ActuationState>)
        last_ = message;
      if constexpr (std::is_same_v<M, ControlStatus>)
        status_ = message;
    };
    try {
      readers_.push_back(bus_.reader(topic, arm, take, ReaderOptions{64}));
    } catch (const std::runtime_error&) {
      ++readers_refused_;
    }
  }

  template <class M>
  Writer<M> writer(const Topic<M>& topic, const std::string& arm = "") {
    try {
      return bus_.writer(topic, arm);
    } catch (const std::runtime_error&) {
      ++writers_refused_;
      return {};
    }
  }

  /// Fingerprint of the robot, if it can be received.
  std::uint64_t fingerprint() {
    const std::lock_guard lock(mutex_);
    return last_.fingerprint;
  }

  void request(ControlKind kind, const std::string& value) {
    ControlRequest request;
    request.fingerprint = fingerprint();
    {
      const std::lock_guard lock(mutex_);
      request.control_session = status_.session;
      request.answers_control = status_.sequence;
    }
    request.client = kClient;
    request.request = ++number_;
    request.kind = static_cast<std::uint8_t>(kind);
    request.arm = kind == ControlKind::kJog ? 0 : kAllArms;
    request.value = value;
    request.joint_count = 6;
    request.joints.fill(1e-3);
    requests_.write(request);
  }

  void command() {
    ActuationCommand command;
    {
      const std::lock_guard lock(mutex_);
      command.fingerprint = last_.fingerprint;
      command.state_session = last_.session;
      command.answers_state = last_.sequence;
      command.position = last_.position;
    }
    command.control_session = kClient;
    command.sequence = ++number_;
    command.arm_count = 2;
    command.request.fill(2);
    command.moving.fill(1);
    command.velocity.fill(1e-3);
    commands_.write(command);
  }

  std::mutex mutex_;
  std::map<std::string, std::uint64_t> received_;
  ActuationState last_;
  ControlStatus status_;
  std::uint64_t number_ = 0;
  int writers_refused_ = 0, readers_refused_ = 0;
  Bus bus_;
  std::vector<Reader> readers_;
  Writer<ControlRequest> requests_;
  Writer<PlanningRequest> plans_;
  Writer<SimRequest> sims_;
  Writer<HalRequest> hals_;
  Writer<ActuationCommand> commands_;
  std::vector<Writer<StringStamped>> states_;
};

bool inputClosed(int milliseconds) {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  char byte = 0;
  return poll(&input, 1, milliseconds) == 1 && read(STDIN_FILENO, &byte, 1) <= 0;
}

int run(int argc, char** argv) {
  if (argc < 3)
    return 2;
  BusOptions options;
  options.name = "hostile";
  options.domain = std::atoi(argv[1]);
  options.prefix = argv[2];
  for (int i = 3; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--credentials" && i + 2 < argc) {
      options.credentials = credentialsOf(argv[i + 1], roleFromName(argv[i + 2]).value());
      i += 2;
    } else if (word == "--days-back" && i + 1 < argc) {
      clock_error = -86400 * std::atol(argv[++i]);
    } else if (word == "--patched") {
      patched = true;
    } else {
      return 2;
    }
  }
  Hostile hostile(options);
  std::printf("{\"started\": true}\n");
  std::fflush(stdout);
  while (!inputClosed(20))
    hostile.attack();
  hostile.report();
  return 0;
}

}  // namespace
}  // namespace tandem::dds

int main(int argc, char** argv) {
  try {
    return tandem::dds::run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "hostile_peer: %s\n", error.what());
    return 1;
  }
}
