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

/// Seconds that others have; what is slower is cut off.
inline constexpr double kHandshakeTime = 5.0;   ///< of TLS, a request's header, a WebSocket's opening
inline constexpr double kKeepAliveTime = 15.0;  ///< between two requests on a connection
inline constexpr double kSilenceTime = 10.0;    ///< of a WebSocket; it is pinged in half of that
inline constexpr double kStallTime = 5.0;       ///< until a frame is taken by a client that reads nothing
/// Sizes; what is larger is cut off.
inline constexpr std::size_t kMaxConnections = 100;              ///< of those that may look or command
inline constexpr std::size_t kMaxUnauthenticated = 30;           ///< of those that have not shown yet that they may
inline constexpr std::size_t kMaxHeader = 16 * 1024;             ///< bytes of a request
inline constexpr std::size_t kMaxClientFrame = 2 * 1024 * 1024;  ///< bytes of a WebSocket message

/** One WebSocket client, for people. */
struct ClientReport {
  std::string address;
  dds::Role role = dds::Role::kConsoleViewer;
  std::uint64_t messages = 0, bytes = 0, dropped = 0;  ///< sent so far, and left out
  double bytes_per_second = 0.0;                       ///< over the last second
};

struct ServerReport {
  std::vector<ClientReport> clients;
  std::uint64_t connections = 0;  ///< accepted so far
  std::uint64_t turned_away = 0;  ///< requests and connections refused so far
  std::uint64_t cut_off = 0;      ///< clients that did not read, or piled up more than may wait
  double bytes_per_second = 0.0;
};

/** Serves until it is asked to end. All methods but run() are called within run()'s callbacks. */
class Server {
 public:
  /// What a path below /api answers, as JSON; nothing for one that there is not.
  using Api = std::function<std::optional<std::string>(std::string_view path, dds::Role role)>;

  /// Binds. Everything given outlives the server.
  /// @throw std::invalid_argument that names key and file of a certificate or key that is not good, or the address that
  /// cannot be bound
  Server(const config::Console& options, Hub& hub, const Access& access, const Page& page, Api api);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Serves; calls `tick` about ten times a second and ends when it says false: clients get a close frame.
  void run(const std::function<bool()>& tick);

  ServerReport report() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::console
