// SPDX-License-Identifier: Apache-2.0
/** @file State that all connections of the console share, and its WebSocket sessions, requests and answers. */
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/thread_pool.hpp>
#include <list>
#include <set>

#include "services/console/server.h"

namespace tandem::console {

/** A WebSocket client, for any type of stream. */
class Session {
 public:
  virtual ~Session() = default;
  /// Sends all frames of the queue, the reason as a status, and a close frame with it; accepts no further frames.
  virtual void close(const std::string& reason) = 0;
  /// Cuts the connection if a frame has not been accepted for too long. Called about once a second.
  virtual void look() = 0;
  /// Cuts the connection at once.
  virtual void drop() = 0;
  virtual ClientReport report() const = 0;
};

struct Context {
  Hub& hub;
  const Access& access;
  const Page& page;
  Server::Api api;
  boost::asio::thread_pool& worker;  ///< one thread for slow answers: the sockets never wait for a file
  bool tls = false;
  std::set<std::shared_ptr<Session>> sessions{};
  std::size_t open = 0;  ///< connections of all kinds
  /// Connections without a decision on their access yet, the oldest first: functions that close them.
  std::list<std::function<void()>> unauthenticated{};
  std::uint64_t connections = 0, turned_away = 0, cut_off = 0;
  std::size_t slow = 0;  ///< slow answers that wait or run
};

/** The parts of a request that an answer depends on. */
struct Request {
  bool head = false, get = false, post = false;
  bool gzip = false;  ///< the client accepts compressed contents
  std::string path, query, known_etag;
  std::string repeated;  ///< header or parameter that the request has twice; empty: none
  std::string address;   ///< of the client
  AccessHeaders access_headers;
};

/** The answer to a request. */
struct Answer {
  int status = 200;
  std::string type = "application/json", body;
  std::vector<std::pair<std::string, std::string>> headers{};
  std::function<std::string()> later{};  ///< computes the body, on another thread; throws a reason
};

/// Answer to a request other than a WebSocket upgrade.
Answer answer(Context& context, const Request& request);
/// Rate in a query; 0 if absent, empty if invalid.
std::optional<double> rateOf(std::string_view query);
/// Refusal with its reason, as JSON. @param allowed  methods, of status 405
Answer refuse(Context& context, int status, const std::string& why, const std::string& allowed = "GET, HEAD");

/// Serves one connection until it closes.
void servePlain(boost::asio::ip::tcp::socket socket, Context& context);
void serveTls(boost::asio::ip::tcp::socket socket, boost::asio::ssl::context& tls, Context& context);

}  // namespace tandem::console
