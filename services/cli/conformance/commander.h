// SPDX-License-Identifier: Apache-2.0
/** @file Commands the drives in place of tandem-control, for conformance tests of a process of the role hal. */
#pragma once

#include <array>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "config/config.h"
#include "safety/operating_state.h"
#include "services/cli/subcommand.h"
#include "services/client/client.h"
#include "services/runtime/stop_signal.h"

namespace tandem::cli {

/** Ends all tests: an interruption, control beside the test, a process that has fallen silent, or a joint outside its
 * permitted range. */
struct Aborted : Failure {
  using Failure::Failure;
};

/** A state of the drives with the time of its arrival. */
struct SeenState {
  dds::ActuationState state;
  std::int64_t at = 0;  ///< ns, monotonic
};

/** Motion of the joints of one test: how fast each is commanded, and how far it goes in the time of a test. Arrays over
 * joints are indexed as in the messages; m, rad, s. */
struct SlowMotion {
  std::array<double, safety::kMaxJoints> speed{};
  double seconds = 1.0;  ///< of motion in one test: at least ten control periods
};

/** Publishes actuation/command once per control period, and records all that the drives publish. Every command is
 * complete and correct until the caller changes it. The calling thread sends; DDS threads record.
 *
 * All waits throw Aborted if the user interrupts, control appears, or a joint leaves its permitted range; the drives
 * have received a stop then. */
class Commander {
 public:
  using Command = dds::ActuationCommand;
  using Change = std::function<void(Command&)>;
  using Condition = std::function<bool(const dds::ActuationState&)>;

  Commander(const config::Deployment& deployment, const config::Robot& robot, const runtime::StopSignal& stop);

  /// Waits for a process of the role hal. @throw Failure if none answers, or control runs.
  void connect(double seconds);
  /// Processes of the roles hal and sim on this robot's topics.
  std::vector<dds::Identity> drives() const;

  /// The next command of the stream: answers the last state; all arms hold.
  Command next();
  void send(const Command& command);
  /** Sends commands for `seconds`, or until a state meets `until`.
   * @param change  changes each command before it is sent
   * @return whether `until` was met */
  bool stream(double seconds, const Change& change = {}, const Condition& until = {});
  /// Waits without commands; as stream().
  bool silence(double seconds, const Condition& until = {});
  void publishStop(const std::string& reason) { client_.publishStop(reason); }
  /// Continues as a new session, as a restarted control would.
  void beginSession(std::uint64_t session);
  std::uint64_t session() const { return session_; }

  /// Streams a request until all arms are in `state`. @throw Failure with their states and faults after `seconds`, or
  /// when an arm is in FAULT that the request cannot clear.
  void request(safety::DriveRequest request, safety::OperatingState state, double seconds = 20.0);
  /// Velocities of slow motion of all arms, towards where each joint has room; alternating about the start.
  Change slowly();

  /// Last state.
  dds::ActuationState state() const;
  dds::HalStatus status() const;
  /// States since the last forget(), in order of arrival.
  std::vector<SeenState> seen() const;
  /// Forgets all recorded states but the last.
  void forget();
  /// Largest delay of this process since resetLateness(), s: of a command, or of the last state when one was sent.
  double lateness() const { return lateness_; }
  void resetLateness() { lateness_ = 0.0; }
  /// When a command was sent, ns.
  std::int64_t sentAt(std::uint64_t sequence) const;
  std::uint64_t sequence() const { return sequence_; }

  /// From now on, joints may be this far from where they are, m, rad; beyond, the test is aborted.
  void permit(double translation, double rotation);
  const config::Deployment& deployment() const { return deployment_; }
  const config::Robot& robot() const { return robot_; }
  const SlowMotion& slow() const { return slow_; }
  /// Largest age of a command, s.
  double budget() const;
  double period() const { return deployment_.control_period; }
  bool isTranslation(int arm, int joint) const {
    return robot_.arms[static_cast<std::size_t>(arm)].limits.isTranslation(joint);
  }
  /// Difference of two readings of a joint that does not move, m or rad: noise and resolution of its encoder included.
  double stillness(int arm, int joint) const;
  /// Calls f(arm, joint, index in arrays of messages).
  void forEachJoint(const std::function<void(int, int, std::size_t)>& f) const;
  std::string nameOf(int arm, int joint) const;

 private:
  void record(const dds::ActuationState& state);
  void check();
  bool wait(std::int64_t until, const Condition& condition);
  [[noreturn]] void abort(const std::string& why);

  const config::Deployment& deployment_;
  const config::Robot& robot_;
  const runtime::StopSignal& stop_;
  SlowMotion slow_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t arrivals_ = 0;  ///< states received
  std::vector<SeenState> seen_;
  std::optional<dds::ActuationState> start_;  ///< with the permitted range
  double translation_range_ = 0.0, rotation_range_ = 0.0;
  std::string outside_;  ///< a joint that has left the permitted range
  std::vector<std::pair<std::uint64_t, std::int64_t>> sent_;
  std::uint64_t session_, sequence_ = 0;
  double lateness_ = 0.0;
  std::array<double, safety::kMaxJoints> home_{};  ///< positions about which slow motion alternates
  client::Client client_;
  dds::Bus bus_;  ///< without an identity: commands carry the fingerprint that the test gives them
  dds::Writer<Command> commands_;
};

}  // namespace tandem::cli
