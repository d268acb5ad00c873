// SPDX-License-Identifier: Apache-2.0
/** @file The console's sockets: HTTP and WebSocket on one port, with or without TLS. */
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/config.h"
#include "services/console/access.h"
#include "services/console/hub.h"
#include "services/console/page.h"

namespace tandem::console {

/// Time limits for clients, s; slower ones are cut off.
inline constexpr double kHandshakeTime = 5.0;   ///< of TLS, a request's header, a WebSocket's opening handshake
inline constexpr double kKeepAliveTime = 15.0;  ///< between two requests on a connection
inline constexpr double kSilenceTime = 10.0;    ///< without a frame of a WebSocket; it is pinged after half of it
inline constexpr double kStallTime = 5.0;       ///< for a client to accept a frame
/// Size limits; larger ones are cut off.
inline constexpr std::size_t kMaxConnections = 100;              ///< authenticated connections
inline constexpr std::size_t kMaxUnauthenticated = 30;           ///< connections without a valid token yet
inline constexpr std::size_t kMaxSlow = 16;                      ///< slow answers at a time
inline constexpr std::size_t kMaxHeader = 16 * 1024;             ///< bytes of a request
inline constexpr std::size_t kMaxClientFrame = 2 * 1024 * 1024;  ///< bytes of a WebSocket message

/** Report on one WebSocket client. */
struct ClientReport {
  std::string address;
  dds::Role role = dds::Role::kConsoleViewer;
  std::uint64_t messages = 0, bytes = 0, dropped = 0;  ///< sent and dropped so far
  double bytes_per_second = 0.0;                       ///< over the last second
};

struct ServerReport {
  std::vector<ClientReport> clients;
  std::uint64_t connections = 0;  ///< accepted so far
  std::uint64_t turned_away = 0;  ///< requests and connections refused so far
  std::uint64_t cut_off = 0;      ///< clients that did not read, or whose queue overflowed
  double bytes_per_second = 0.0;
};

/** Serves until `tick` returns a reason to end. All methods but run() are called within run()'s callbacks. */
class Server {
 public:
  /** Answer to a path below /api: JSON, or what a slow function returns, which runs on a thread of its own, one at a
   * time, and throws std::exception with the reason of a refusal. */
  struct ApiAnswer {
    ApiAnswer(std::string json) : body(std::move(json)) {}  // NOLINT(google-explicit-constructor): an answer is a text
    ApiAnswer(std::function<std::string()> slow, std::string media_type)
        : type(std::move(media_type)), later(std::move(slow)) {}
    std::string body, type = "application/json";
    std::function<std::string()> later;
  };
  /// Empty if there is no such path. @param address  of the client
  /// @throw std::invalid_argument with the reason of an invalid query
  using Api = std::function<std::optional<
      ApiAnswer>(std::string_view path, std::string_view query, dds::Role role, const std::string& address)>;

  /// Binds. All arguments must outlive the server.
  /// @throw std::invalid_argument with key and file of an invalid certificate or key, or with the address that cannot
  /// be bound
  Server(const config::Console& options, Hub& hub, const Access& access, const Page& page, Api api);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Serves; calls `tick` about ten times a second and ends when it returns a reason. Clients then receive all messages
  /// that have arrived, also those of the last milliseconds, the reason as status, and a close frame with it.
  void run(const std::function<std::string()>& tick);

  ServerReport report() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::console
