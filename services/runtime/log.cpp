// SPDX-License-Identifier: Apache-2.0
#include "services/runtime/log.h"

#include <spdlog/async.h>
#include <spdlog/sinks/dist_sink.h>
#include <spdlog/sinks/stdout_color_sinks.h>

#include <algorithm>
#include <cstdlib>
#include <stdexcept>

namespace tandem::runtime {
namespace {

constexpr std::size_t kPendingLines = 8192;

spdlog::level::level_enum levelFrom(const std::string& option) {
  const char* environment = std::getenv("TANDEM_LOG");
  const std::string text = !option.empty() ? option : environment != nullptr ? environment : "info";
  const auto level = spdlog::level::from_str(text);
  // from_str() returns "off" for unknown levels.
  if (level == spdlog::level::off && text != "off") {
    throw std::invalid_argument("--log or TANDEM_LOG: found '" + text +
                                "', expected trace, debug, info, warn, error, critical or off");
  }
  return level;
}

/// Null before startLog() and after stopLog().
std::shared_ptr<spdlog::sinks::dist_sink_mt> places() {
  const auto logger = spdlog::default_logger();
  return logger && !logger->sinks().empty()
             ? std::dynamic_pointer_cast<spdlog::sinks::dist_sink_mt>(logger->sinks().front())
             : nullptr;
}

}  // namespace

void startLog(const std::string& service, const std::string& level) {
  const auto chosen = levelFrom(level);
  spdlog::init_thread_pool(kPendingLines, 1);
  // Sinks may be added while lines are written.
  auto sink = std::make_shared<spdlog::sinks::dist_sink_mt>();
  auto terminal = std::make_shared<spdlog::sinks::stderr_color_sink_mt>();
  terminal->set_level(chosen);
  sink->add_sink(std::move(terminal));
  // A full queue drops its oldest lines and never blocks the logging thread.
  auto logger = std::make_shared<spdlog::async_logger>(service, std::move(sink), spdlog::thread_pool(),
                                                       spdlog::async_overflow_policy::overrun_oldest);
  logger->set_pattern("[%Y-%m-%dT%H:%M:%S.%e] [%n] [%^%l%$] %v");
  // Sinks that are added are for operators, who need all events whatever the terminal shows.
  logger->set_level(std::min(chosen, spdlog::level::info));
  logger->flush_on(spdlog::level::warn);
  spdlog::set_default_logger(std::move(logger));
}

void addLogSink(const spdlog::sink_ptr& sink) {
  if (const auto all = places())
    all->add_sink(sink);
}

void removeLogSink(const spdlog::sink_ptr& sink) {
  if (const auto all = places())
    all->remove_sink(sink);
}

void stopLog() { spdlog::shutdown(); }

}  // namespace tandem::runtime
