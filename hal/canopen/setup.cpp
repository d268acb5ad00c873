// SPDX-License-Identifier: Apache-2.0
#include "hal/canopen/setup.h"

#include <algorithm>
#include <cstdlib>

#include "hal/canopen/bytes.h"

namespace tandem::hal::canopen {
namespace {

SetupStep step(SetupStep::Kind kind, ObjectAddress object, std::int64_t value, int size, std::string what) {
  SetupStep result;
  result.kind = kind;
  result.object = object;
  result.size = size;
  result.value = size > 0 ? lowBits(static_cast<std::uint64_t>(value), 8 * size) : 0;
  result.is_signed = value < 0;
  result.what = std::move(what);
  return result;
}

}  // namespace

bool SetupStep::passes(std::uint64_t number) const noexcept {
  if (!refused.empty())
    return std::ranges::find(refused, number) == refused.end();
  if (tolerance > 0) {
    const std::int64_t read = signExtend(number, 8 * size), wanted = signExtend(value, 8 * size);
    return static_cast<std::uint64_t>(std::abs(read - wanted)) <= tolerance;
  }
  return ((number ^ value) & mask) == 0;
}

SetupStep write(ObjectAddress object, std::int64_t value, int size, std::string what) {
  return step(SetupStep::Kind::kWriteVerify, object, value, size, std::move(what));
}

SetupStep writeOnly(ObjectAddress object, std::int64_t value, int size, std::string what) {
  return step(SetupStep::Kind::kWrite, object, value, size, std::move(what));
}

SetupStep check(ObjectAddress object, std::int64_t value, int size, std::string what) {
  return step(SetupStep::Kind::kCheck, object, value, size, std::move(what));
}

SetupStep checkBits(ObjectAddress object, std::uint64_t value, std::uint64_t mask, int size, std::string what) {
  SetupStep result = step(SetupStep::Kind::kCheck, object, static_cast<std::int64_t>(value), size, std::move(what));
  result.mask = mask;
  return result;
}

SetupStep read(ObjectAddress object, int size, std::string what) {
  return step(SetupStep::Kind::kRead, object, 0, size, std::move(what));
}

std::vector<SetupStep> identitySteps(const Identity& identity) {
  std::vector<SetupStep> steps;
  const auto add = [&](ObjectAddress object, std::uint32_t value, const char* what) {
    if (value != 0)
      steps.push_back(check(object, value, 4, what));
  };
  add({0x1000, 0}, identity.device_type, "device type");
  add({0x1018, 1}, identity.vendor, "vendor");
  add({0x1018, 2}, identity.product, "product code");
  add({0x1018, 3}, identity.revision, "revision");
  add({0x1018, 4}, identity.serial, "serial number");
  return steps;
}

std::vector<SetupStep> guardingSteps(const Guarding& guarding) {
  const std::int64_t consumer =
      guarding.our_heartbeat_timeout == 0 ? 0 : std::int64_t{guarding.our_id} << 16 | guarding.our_heartbeat_timeout;
  // Without the object a node enters pre-operational (CiA 301).
  SetupStep error_behaviour = write({0x1029, 1}, guarding.error_behaviour, 1, "behaviour after a communication error");
  error_behaviour.optional = guarding.error_behaviour == 0;
  if (guarding.guard_time != 0) {
    SetupStep no_heartbeat = write({0x1017, 0}, 0, 2, "no heartbeat, but node guarding");
    no_heartbeat.optional = true;
    SetupStep time = write({0x100C, 0}, guarding.guard_time, 2, "guard time");
    SetupStep factor = write({0x100D, 0}, guarding.life_factor, 1, "life time factor");
    time.protections = factor.protections = guarding.protections;
    return {no_heartbeat, time, factor, error_behaviour};
  }
  SetupStep watch = write({0x1016, 1}, consumer, 4, "watch on our heartbeat");
  watch.protections = guarding.protections;
  return {watch, write({0x1017, 0}, guarding.node_heartbeat, 2, "heartbeat period"), error_behaviour};
}

}  // namespace tandem::hal::canopen
