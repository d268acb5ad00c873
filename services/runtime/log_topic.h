// SPDX-License-Identifier: Apache-2.0
/** @file Log lines on /rosout, for ROS 2 viewers. */
#pragma once

#include <spdlog/sinks/base_sink.h>

#include <memory>
#include <mutex>
#include <string>

#include "services/dds/bus.h"

namespace tandem::runtime {

/** Writes log lines to /rosout on the logging thread, never on the calling thread. At most kRate lines a second after a
 * burst of kBurst; the next line has the number of dropped ones. */
class LogTopic final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  static constexpr double kRate = 20.0;   ///< lines a second
  static constexpr double kBurst = 50.0;  ///< lines at once

  LogTopic(dds::Bus& bus, std::string service) : service_(std::move(service)), writer_(bus.writer(dds::kLog)) {}

  /// Level of rcl_interfaces/Log.
  static std::uint8_t levelOf(spdlog::level::level_enum level);

 private:
  void sink_it_(const spdlog::details::log_msg& line) override;
  void flush_() override {}
  bool mayPass(std::int64_t now);

  std::string service_;
  dds::Writer<dds::Log> writer_;
  double credit_ = kBurst;
  std::int64_t last_ = 0;       ///< ns
  std::uint64_t left_out_ = 0;  ///< lines dropped since the last published one
};

}  // namespace tandem::runtime
