// SPDX-License-Identifier: Apache-2.0
#include "hal/canopen/node.h"

#include <algorithm>
#include <cstdio>
#include <stdexcept>

#include "hal/canopen/bytes.h"

namespace tandem::hal::canopen {
namespace {

constexpr int kMaxRestarts = 3;  ///< of a configuration

/// "50 (0x32)", "-3 (0xFD)".
std::string number(const SetupStep& step, std::uint64_t value) {
  const int bits = 8 * std::max(step.size, 1);
  const bool negative = step.is_signed && value == lowBits(value, bits) && signExtend(value, bits) < 0;
  char hex[24];
  std::snprintf(hex, sizeof hex, " (0x%llX)", static_cast<unsigned long long>(value));
  return (negative ? std::to_string(signExtend(value, bits)) : std::to_string(value)) + hex;
}

void append(std::vector<SetupStep>& to, const std::vector<SetupStep>& steps) {
  to.insert(to.end(), steps.begin(), steps.end());
}

template <class Pdos>
PdoSlot findSlot(const Pdos& pdos, ObjectAddress object) noexcept {
  for (std::size_t k = 0; k < pdos.size(); ++k) {
    for (int slot = 0; slot < pdos[k].layout.size(); ++slot) {
      if (pdos[k].layout[slot].object == object)
        return {static_cast<int>(k), slot};
    }
  }
  return {};
}

void requireSteps(const std::vector<SetupStep>& steps) {
  for (const SetupStep& step : steps) {
    if (step.size < (step.writes() ? 1 : 0) || step.size > 8)
      throw std::invalid_argument(step.what + " " + describe(step.object) + ": found " + std::to_string(step.size) +
                                  " bytes, expected 1 to 8");
  }
}

}  // namespace

std::string_view name(NodePhase phase) {
  constexpr std::string_view kNames[] = {"idle",     "resetting",   "configuring", "configured",
                                         "starting", "operational", "failed"};
  return kNames[static_cast<std::size_t>(phase)];
}

Node::Node(const NodeSetup& setup)
    : setup_(setup), sdo_(setup.id, setup.sdo_timeout, setup.sdo_retries), guard_(setup.guard_period) {
  if (setup.id < 1 || setup.id > kMaxNodeId)
    throw std::invalid_argument(setup.name + ": node id: found " + std::to_string(setup.id) + ", expected 1 to 127");
  append(steps_, setup.steps);
  for (const PdoConfig& pdo : setup.rpdos) {
    append(steps_, pdoSteps(pdo, PdoDirection::kReceive, setup.id));
    rpdos_.push_back({pdo.layout, cobIdOf(pdo, PdoDirection::kReceive, setup.id)});
  }
  for (const PdoConfig& pdo : setup.tpdos) {
    append(steps_, pdoSteps(pdo, PdoDirection::kTransmit, setup.id));
    tpdos_.push_back({pdo.layout, cobIdOf(pdo, PdoDirection::kTransmit, setup.id)});
  }
  append(steps_, setup.last_steps);
  requireSteps(steps_);
  values_.resize(steps_.size());
  has_value_.resize(steps_.size());
}

PdoSlot Node::tpdoSlot(ObjectAddress object) const noexcept { return findSlot(tpdos_, object); }
PdoSlot Node::rpdoSlot(ObjectAddress object) const noexcept { return findSlot(rpdos_, object); }

std::string Node::describeFailure() const {
  return "node " + std::to_string(setup_.id) + (setup_.name.empty() ? "" : " (" + setup_.name + ")") + ": " +
         describe(failure_);
}

std::string Node::describe(const NodeFailure& failure) const {
  if (failure.step >= 0 && failure.step < static_cast<int>(steps_.size())) {
    const SetupStep& step = steps_[static_cast<std::size_t>(failure.step)];
    const std::string text = step.what + " " + canopen::describe(step.object) + ": ";
    if (failure.reason == NodeFailure::Reason::kMismatch)
      return text + "found " + number(step, failure.value) + ", expected " + number(step, step.value) +
             (step.mask == SetupStep{}.mask ? "" : " in the bits " + number(step, step.mask));
    return text + (step.writes() ? "sent " + number(step, step.value) + ": " : "") + canopen::describe(failure.abort);
  }
  switch (failure.reason) {
    case NodeFailure::Reason::kNoBootUp:
      return "no boot-up message after the reset";
    case NodeFailure::Reason::kNotStarted:
      return "does not become operational";
    case NodeFailure::Reason::kHeartbeatLost:
      return setup_.guard_period > 0 ? "no answer to node guarding" : "heartbeat lost";
    case NodeFailure::Reason::kRebooted:
      return "rebooted without a request";
    case NodeFailure::Reason::kLeftOperational:
      return "left operational: " + std::string(canopen::name(static_cast<NmtState>(failure.value)));
    default:
      return "no failure";
  }
}

const std::uint64_t* Node::readValue(ObjectAddress object) const noexcept {
  for (std::size_t k = steps_.size(); k-- > 0;) {
    if (has_value_[k] && steps_[k].object == object)
      return &values_[k];
  }
  return nullptr;
}

void Node::refuse(ObjectAddress object, std::uint64_t stated) noexcept {
  const auto step = std::ranges::find(steps_, object, &SetupStep::object);
  step_ = static_cast<int>(step - steps_.begin());
  fail(NodeFailure::Reason::kMismatch, stated);
}

void Node::enter(NodePhase phase, std::int64_t now) noexcept {
  phase_ = phase;
  if (phase == NodePhase::kConfigured)
    heartbeat_time_ = now;  // heartbeat monitoring starts here
}

void Node::fail(NodeFailure::Reason reason, std::uint64_t value, SdoAbort abort) noexcept {
  const bool in_step = reason == NodeFailure::Reason::kAborted || reason == NodeFailure::Reason::kMismatch;
  failure_ = {reason, in_step ? step_ : -1, abort, value};
  phase_ = NodePhase::kFailed;
  nmt_pending_ = false;
  transferring_ = false;
  sdo_.cancel();
}

void Node::restartConfiguration() noexcept {
  step_ = 0;
  transferring_ = false;
  reading_back_ = false;
  refused_ = SdoAbort::kNone;
  lost_ = 0;
  has_value_.assign(has_value_.size(), false);
}

void Node::boot(std::int64_t now) noexcept {
  failure_ = {};
  restarts_ = 0;
  restartConfiguration();
  sdo_.reset();
  nmt_ = NmtState::kUnknown;
  guard_.restart();
  heartbeat_time_ = 0;
  nmt_pending_ = true;
  deadline_ = now + setup_.boot_timeout;
  enter(NodePhase::kResetting, now);
}

void Node::start(std::int64_t now) noexcept {
  if (phase_ != NodePhase::kConfigured)
    return;
  nmt_pending_ = true;
  deadline_ = now + setup_.start_timeout;
  enter(NodePhase::kStarting, now);
}

void Node::release() noexcept {
  sdo_.cancel();
  nmt_pending_ = false;
  transferring_ = false;
  phase_ = NodePhase::kIdle;
}

bool Node::nmtRequest(NmtCommand& command) const noexcept {
  command = phase_ == NodePhase::kResetting ? setup_.reset : NmtCommand::kStart;
  return nmt_pending_;
}

void Node::nmtSent(std::int64_t now) noexcept {
  nmt_pending_ = false;
  deadline_ = now + (phase_ == NodePhase::kResetting ? setup_.boot_timeout : setup_.start_timeout);
}

void Node::onEmcy(const Emcy& emcy) noexcept {
  emcy_ = emcy;
  ++emcy_count_;
}

bool Node::guardDue(std::int64_t now) const noexcept {
  return phase_ >= NodePhase::kConfigured && phase_ <= NodePhase::kOperational && guard_.due(now);
}

bool Node::onState(std::uint8_t byte, std::int64_t now) noexcept {
  NmtState state{};
  if (guard_.take(byte, state)) {
    onHeartbeat(state, now);
    return true;
  }
  return guard_.used();  // an answer with the toggle bit of an older one
}

void Node::onHeartbeat(NmtState state, std::int64_t now) noexcept {
  nmt_ = state;
  heartbeat_time_ = now;
  if (phase_ == NodePhase::kResetting) {
    if (state == NmtState::kBootUp && !nmt_pending_)
      enter(NodePhase::kConfiguring, now);
    return;
  }
  if (phase_ == NodePhase::kIdle || phase_ == NodePhase::kFailed)
    return;
  if (state == NmtState::kBootUp && phase_ == NodePhase::kConfiguring && restarts_ < kMaxRestarts) {
    // The node booted by itself just before the reset, and boots once more: the values written to it are lost.
    ++restarts_;
    sdo_.reset();
    restartConfiguration();
    enter(NodePhase::kConfiguring, now);
  } else if (state == NmtState::kBootUp) {
    fail(NodeFailure::Reason::kRebooted);
  } else if (phase_ == NodePhase::kStarting && state == NmtState::kOperational && !nmt_pending_) {
    enter(NodePhase::kOperational, now);
  } else if (phase_ == NodePhase::kOperational && state != NmtState::kOperational) {
    fail(NodeFailure::Reason::kLeftOperational, static_cast<std::uint64_t>(state));
  }
}

void Node::poll(std::int64_t now) noexcept {
  const bool watched = phase_ >= NodePhase::kConfigured && phase_ <= NodePhase::kOperational;
  if (watched && setup_.heartbeat_timeout > 0 && now - heartbeat_time_ > setup_.heartbeat_timeout) {
    fail(NodeFailure::Reason::kHeartbeatLost);
  } else if (phase_ == NodePhase::kResetting && now > deadline_) {
    fail(NodeFailure::Reason::kNoBootUp);
  } else if (phase_ == NodePhase::kStarting && now > deadline_) {
    fail(NodeFailure::Reason::kNotStarted);
  } else if (phase_ == NodePhase::kConfiguring) {
    configure(now);
  } else {
    sdo_.poll(now);
  }
}

void Node::configure(std::int64_t now) noexcept {
  if (transferring_) {
    sdo_.poll(now);
    if (sdo_.busy())
      return;
    transferring_ = false;
    endTransfer(now);
  }
  if (phase_ != NodePhase::kConfiguring || transferring_)
    return;
  if (step_ == static_cast<int>(steps_.size())) {
    enter(NodePhase::kConfigured, now);
  } else {
    step_deadline_ = now + steps_[step_].timeout;
    beginTransfer(now);
  }
}

void Node::beginTransfer(std::int64_t now) noexcept {
  const SetupStep& step = steps_[step_];
  if (step.writes() && !reading_back_) {
    sdo_.download(step.object, step.value, step.size, now);
  } else {
    sdo_.upload(step.object, now);
  }
  transferring_ = true;
}

void Node::nextStep() noexcept {
  ++step_;
  reading_back_ = false;
  refused_ = SdoAbort::kNone;
}

void Node::onAbort(SdoAbort abort, std::int64_t now) noexcept {
  const SetupStep& step = steps_[step_];
  const bool absent = isAbsence(abort);
  const bool informs = step.kind == SetupStep::Kind::kRead && step.optional;  // what it says is good to know, no more
  // An object that has refused its value, and cannot be read, has lost its protections; a later check of it adds
  // nothing.
  const bool given_up = abort == SdoAbort::kWriteOnly &&
                        (refused_ != SdoAbort::kNone || (!step.writes() && (step.protections & lost_) != 0));
  const bool skipped = informs || given_up || (absent && step.optional) ||
                       ((absent || isRefusal(abort)) && (step.protections != 0 || step.dispensable));
  if (!skipped) {
    fail(NodeFailure::Reason::kAborted, 0, abort);
  } else if (informs || absent || given_up || reading_back_) {
    lose(abort);
  } else {
    refused_ = abort;  // the object keeps a value of its own, which may be the right one
    reading_back_ = true;
    beginTransfer(now);
  }
}

void Node::lose(SdoAbort abort) noexcept {
  lost_ |= steps_[step_].protections;
  for (const std::uint32_t set : setup_.minimum) {
    if (steps_[step_].protections != 0 && (set & ~lost_) == 0)
      return fail(NodeFailure::Reason::kAborted, 0, abort);
  }
  nextStep();
}

void Node::endTransfer(std::int64_t now) noexcept {
  const SetupStep& step = steps_[step_];
  if (sdo_.status() == SdoStatus::kDone) {
    if (step.kind == SetupStep::Kind::kWrite && !reading_back_) {
      nextStep();
    } else if (step.kind == SetupStep::Kind::kWriteVerify && !reading_back_) {
      reading_back_ = true;
      beginTransfer(now);
    } else {
      judge(now);
    }
  } else {
    onAbort(sdo_.abort(), now);
  }
}

void Node::judge(std::int64_t now) noexcept {
  const SetupStep& step = steps_[step_];
  bool size_fits = true;
  const std::uint64_t value = sdo_.value(step.size, size_fits);
  values_[step_] = value;
  has_value_[step_] = true;
  if (size_fits && (step.kind == SetupStep::Kind::kRead || step.passes(value))) {
    nextStep();
  } else if (step.kind == SetupStep::Kind::kAwait && size_fits && now < step_deadline_) {
    beginTransfer(now);
  } else if (step.late) {
    nextStep();
  } else if (refused_ != SdoAbort::kNone || (step.protections & lost_) != 0 || step.dispensable) {
    lose(refused_);
  } else {
    fail(NodeFailure::Reason::kMismatch, value);
  }
}

}  // namespace tandem::hal::canopen
