// SPDX-License-Identifier: Apache-2.0
/** @file Deterministic test messages computed from seed and number on both sides, and their text form. */
#pragma once

#include <cstdio>
#include <random>
#include <string>

#include "safety/dimensions.h"
#include "services/dds/messages.h"

namespace tandem::dds {

inline ActuationState patternState(unsigned seed, std::uint64_t sequence) {
  std::mt19937_64 random(seed + sequence);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  ActuationState state;
  state.session = seed;
  state.sequence = sequence;
  state.stamp = -static_cast<std::int64_t>(random() >> 2);
  state.answers_command = random();
  state.arm_count = 2;
  for (int arm = 0; arm < safety::kMaxArms; ++arm) {
    state.joint_count[arm] = static_cast<std::uint8_t>(random() % 9);
    state.valid[arm] = static_cast<std::uint8_t>(random() % 2);
    state.operating_state[arm] = static_cast<std::uint8_t>(random() % 4);
    state.faults[arm] = static_cast<std::uint32_t>(random());
  }
  for (int joint = 0; joint < safety::kMaxJoints; ++joint) {
    state.position[joint] = number(random);
    state.velocity[joint] = number(random);
    state.setpoint[joint] = number(random);
  }
  return state;
}

/// The stamp follows from the sequence number.
inline JointState patternJoints(unsigned seed, std::uint64_t sequence) {
  std::mt19937_64 random(seed + sequence);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  JointState joints;
  joints.stamp = static_cast<std::int64_t>(sequence) * 1'000'000'007;
  joints.frame = "arm_a_base";
  for (int i = 0; i < 6; ++i) {
    joints.name.push_back("joint_" + std::to_string(random() % 1000));
    joints.position.push_back(number(random));
    joints.velocity.push_back(number(random));
  }
  return joints;  // effort remains empty: not measured
}

/// Appends every number as "%a ", which is exact.
template <class List>
void appendNumbers(const List& list, std::string& text) {
  char buffer[40];
  for (const double value : list) {
    std::snprintf(buffer, sizeof(buffer), "%a ", value);
    text += buffer;
  }
}

/// Text as printed by cyclone_peer.
inline std::string textOf(const ActuationState& s) {
  std::string text = "state " + std::to_string(s.session) + " " + std::to_string(s.sequence) + " " +
                     std::to_string(s.stamp) + " " + std::to_string(s.answers_command) + " " +
                     std::to_string(s.lock_step) + " " + std::to_string(s.arm_count) + " ";
  for (int arm = 0; arm < safety::kMaxArms; ++arm) {
    text += std::to_string(s.joint_count[arm]) + " " + std::to_string(s.valid[arm]) + " " +
            std::to_string(s.operating_state[arm]) + " " + std::to_string(s.faults[arm]) + " ";
  }
  appendNumbers(s.position, text);
  appendNumbers(s.velocity, text);
  appendNumbers(s.setpoint, text);
  return text;
}

/// Text as printed by cyclone_peer.
inline std::string textOf(const JointState& j) {
  std::string text = "joints " + std::to_string(j.stamp / 1'000'000'000) + " " +
                     std::to_string(j.stamp % 1'000'000'000) + " " + j.frame + " ";
  for (const std::string& name : j.name) {
    text += name + " ";
  }
  text += "| ";
  appendNumbers(j.position, text);
  text += "| ";
  appendNumbers(j.velocity, text);
  text += "| ";
  appendNumbers(j.effort, text);
  return text;
}

}  // namespace tandem::dds
