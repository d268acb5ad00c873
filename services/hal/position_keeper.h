// SPDX-License-Identifier: Apache-2.0
/** @file Keeps the last positions of axes with a `jump_tolerance` on disk. */
#pragma once

#include <filesystem>
#include <optional>

#include "hal/position_file.h"
#include "services/hal/hal_core.h"
#include "services/runtime/outbox.h"

namespace tandem::hal_service {

/// File of the last positions of this hardware in the folder of the service's state.
std::filesystem::path positionFile(const hal::HardwareConfig& hardware);

/** Restores the positions at the start, and writes them on a thread of its own: a disk may take longer than any period.
 * Hardware without a `jump_tolerance` has no file. */
class PositionKeeper {
 public:
  /// Reads the file into the core; logs what is wrong with it. Before HalCore::start().
  PositionKeeper(const hal::HardwareConfig& hardware, std::filesystem::path file, HalCore& core);
  /// Writes what was offered last.
  ~PositionKeeper();

  /** Every period: writes if an arm has lost its power, and at most once per kInterval if a position has changed by a
   * tenth of its tolerance. Neither allocates nor blocks. */
  void offer(const HalCore& core, std::int64_t now) noexcept;

  static constexpr std::int64_t kInterval = 1'000'000'000;  ///< ns

 private:
  void save(const hal::PositionSnapshot& positions) noexcept;
  bool moved(const hal::PositionSnapshot& positions) const noexcept;

  const hal::HardwareConfig& hardware_;
  std::filesystem::path file_;
  bool watches_ = false;
  bool powered_ = false;
  std::int64_t offered_ = 0;
  hal::PositionSnapshot last_;  ///< as offered last
  runtime::Outbox outbox_;
  runtime::Outbox::Latest<hal::PositionSnapshot>& saves_;
};

}  // namespace tandem::hal_service
