// SPDX-License-Identifier: Apache-2.0
/** @file Private: state shared by all connections. */
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <list>
#include <set>

#include "services/console/server.h"

namespace tandem::console {

/** A WebSocket client, whatever its stream. */
class Session {
 public:
  virtual ~Session() = default;
  /// Says goodbye; what is on its way may still go.
  virtual void close() = 0;
  /// Cuts the connection where a frame has not been taken for too long. About once a second.
  virtual void look() = 0;
  /// Leaves at once.
  virtual void drop() = 0;
  virtual ClientReport report() const = 0;
};

struct Context {
  Hub& hub;
  const Access& access;
  const Page& page;
  Server::Api api;
  bool tls = false;
  std::set<std::shared_ptr<Session>> sessions{};
  std::size_t open = 0;  ///< connections of all kinds
  /// Those of which nobody knows yet whether they may do anything, the longest first: what ends them.
  std::list<std::function<void()>> unauthenticated{};
  std::uint64_t connections = 0, turned_away = 0, cut_off = 0;
};

/** A request, as far as an answer needs to know it. */
struct Request {
  bool head = false, get = false;
  std::string path, query, known_etag;
  AccessHeaders access_headers;
};

/** The answer to a request. */
struct Answer {
  int status = 200;
  std::string type = "application/json", body;
  std::vector<std::pair<std::string, std::string>> headers{};
};

/// What a request that is no WebSocket's gets.
Answer answer(Context& context, const Request& request);
/// What a query says of the rate; 0 where it says nothing, nothing where it is wrong.
std::optional<double> rateOf(std::string_view query);
/// Words of a refusal, as JSON.
Answer refuse(Context& context, int status, const std::string& why);

/// Serves one connection from its first byte to its last.
void servePlain(boost::asio::ip::tcp::socket socket, Context& context);
void serveTls(boost::asio::ip::tcp::socket socket, boost::asio::ssl::context& tls, Context& context);

}  // namespace tandem::console
