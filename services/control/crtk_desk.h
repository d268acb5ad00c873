// SPDX-License-Identifier: Apache-2.0
/** @file CRTK commands off the wire: which of them are valid, what became of them. Runs on DDS threads and the
 * publisher thread, never on the periodic one. */
#pragma once

#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "experiments/run_record.h"
#include "services/control/crtk_order.h"
#include "services/dds/bus.h"
#include "services/setup/process.h"

namespace tandem::service {

/** How old the samples of one stream are, from writers that know nothing of control's clock. */
class CrtkStream {
 public:
  /** @param by_arrival  age: by how much later than the quickest sample of the stream this one comes; the first one of
   * a stream only opens it. Otherwise by the stamp, which is then of a wall clock that agrees with ours.
   * @param budget  largest age, s */
  CrtkStream(bool by_arrival, double budget) : by_arrival_(by_arrival), budget_(budget) {}

  /// Judges a sample. @param stamp  of its header, ns; @param wall, arrival  now, ns since 1970 and on a steady clock;
  /// @param opens  the first sample of a stream counts. @return why it does not count; empty: it does.
  std::string judge(std::int64_t stamp, std::int64_t wall, std::int64_t arrival, bool opens);

 private:
  bool by_arrival_;
  double budget_;
  bool known_ = false;
  std::int64_t last_stamp_ = 0, last_arrival_ = 0;
  double quickest_ = 0.0;  ///< arrival minus stamp of the quickest sample, s; forgets slowly
};

/** All command topics of all arms and of the pair. */
class CrtkDesk {
 public:
  using OnOrder = std::function<void(const CrtkOrder&)>;
  CrtkDesk(const Setup& setup, const experiments::RobotModel& robot);

  /// Readers of all topics that the robot has.
  void listen(dds::Bus& bus, OnOrder on_order, std::vector<dds::Reader>& readers);

  /// Turns a message into an order. @return why it is none; empty: it is one.
  std::string parse(const dds::JointState& message, CrtkOrder& order) const;
  std::string parse(const dds::PoseStamped& message, CrtkOrder& order) const;
  std::string parse(const dds::TwistStamped& message, CrtkOrder& order) const;
  std::string parse(const dds::Empty& message, CrtkOrder& order) const;

  /// What became of an order.
  void settle(const CrtkOutcome& outcome);
  void fill(const CrtkMoment& moment, dds::CrtkStatus& status) const;

 private:
  struct Entry {
    CrtkStream stream;
    std::uint64_t accepted = 0, refused = 0;
    std::string refusal{};
  };
  template <class M>
  void take(const M& message, CrtkOrder order, const OnOrder& on_order);
  void note(const CrtkOrder& order, const std::string& refusal);
  std::string groupName(int group) const;
  std::vector<int> armsOf(int group) const;
  std::string badFrame(const std::string& frame) const;
  Entry& entry(int group, int verb);

  const Setup& setup_;
  const experiments::RobotModel& robot_;
  std::string frame_;
  mutable std::mutex mutex_;
  std::map<std::pair<int, int>, Entry> entries_;  ///< by group and verb
};

/// "arm_a_beta_1" ...: config::jointNames() behind the arm's name, as in measured_js.
std::vector<std::string> jointNames(const config::Arm& arm);

}  // namespace tandem::service
