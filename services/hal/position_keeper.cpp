// SPDX-License-Identifier: Apache-2.0
#include "services/hal/position_keeper.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <exception>

#include "services/runtime/state_directory.h"

namespace tandem::hal_service {

std::filesystem::path positionFile(const hal::HardwareConfig& hardware) {
  std::string name = hardware.name;
  const auto plain = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9'); };
  std::ranges::replace_if(
      name, [&](char c) { return !plain(c); }, '-');
  return runtime::stateDirectory() / "positions" / (name + ".txt");
}

PositionKeeper::PositionKeeper(const hal::HardwareConfig& hardware, std::filesystem::path file, HalCore& core)
    : hardware_(hardware),
      file_(std::move(file)),
      saves_(outbox_.latest<hal::PositionSnapshot>([this](const auto& positions) { save(positions); })) {
  watches_ = std::ranges::any_of(hardware.axes, [](const auto& axis) { return axis.jump_tolerance > 0.0; });
  if (!watches_)
    return;
  const hal::StoredPositions stored = readPositions(file_, hardware);
  if (!stored.problem.empty())
    spdlog::error("last positions: {}; they have to be confirmed: tandem home --confirm", stored.problem);
  for (std::size_t i = 0; i < stored.axes.size(); ++i)
    core.restorePosition(i, stored.axes[i].state, stored.axes[i].position);
  last_ = core.robot().lastPositions();
  outbox_.start();
}

PositionKeeper::~PositionKeeper() { outbox_.stop(); }

bool PositionKeeper::moved(const hal::PositionSnapshot& positions) const noexcept {
  constexpr double kShare = 0.1;  // of the tolerance
  for (std::size_t i = 0; i < hardware_.axes.size(); ++i) {
    const hal::PositionSnapshot::One &now = positions.axes[i], &before = last_.axes[i];
    const double tolerance = hardware_.axes[i].jump_tolerance;
    if (tolerance > 0.0 && (now.known != before.known || std::abs(now.position - before.position) > kShare * tolerance))
      return true;
  }
  return false;
}

void PositionKeeper::offer(const HalCore& core, std::int64_t now) noexcept {
  if (!watches_)
    return;
  const bool powered = !core.robot().off();
  const bool lost_power = powered_ && !powered;
  powered_ = powered;
  if (!lost_power && offered_ != 0 && now - offered_ < kInterval)
    return;
  const hal::PositionSnapshot positions = core.robot().lastPositions();
  if (lost_power ? positions == last_ : !moved(positions))
    return;
  offered_ = now;
  last_ = positions;
  saves_.post(positions);
}

void PositionKeeper::save(const hal::PositionSnapshot& positions) noexcept {
  try {
    writePositions(file_, hardware_, positions);
  } catch (const std::exception& error) {
    spdlog::error("last positions: {}; after the next start they may have to be confirmed", error.what());
  }
}

}  // namespace tandem::hal_service
