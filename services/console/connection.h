// SPDX-License-Identifier: Apache-2.0
/** @file Internal: one client connection, plain or TLS, with HTTP requests and WebSocket upgrade.
 *
 * Everything runs on the thread of the sockets. A connection exists as long as one of its operations is pending. */
#pragma once

#include <boost/asio/dispatch.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>

#include "services/console/context.h"
#include "services/console/request.h"

namespace tandem::console {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using Clock = std::chrono::steady_clock;
using Failed = beast::error_code;

inline Clock::duration seconds(double value) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(value));
}

/** Entry of a connection in the list of unauthenticated ones, until it is authenticated or closed. */
class UnauthenticatedEntry {
 public:
  explicit UnauthenticatedEntry(Context& context) : context_(context) {}
  ~UnauthenticatedEntry() { leave(); }
  UnauthenticatedEntry(const UnauthenticatedEntry&) = delete;
  UnauthenticatedEntry& operator=(const UnauthenticatedEntry&) = delete;

  /// @param end  closes the connection
  void enter(std::function<void()> end) {
    context_.unauthenticated.push_back([this, end = std::move(end)] {
      present_ = false;  // the caller has removed this entry from the list
      end();
    });
    place_ = std::prev(context_.unauthenticated.end());
    present_ = true;
  }
  void leave() {
    if (std::exchange(present_, false))
      context_.unauthenticated.erase(place_);
  }

 private:
  Context& context_;
  std::list<std::function<void()>>::iterator place_;
  bool present_ = false;
};

/** Counts a connection while the object exists. */
class ConnectionCounter {
 public:
  explicit ConnectionCounter(Context& context) : context_(&context) { ++context_->open; }
  ~ConnectionCounter() {
    if (context_)
      --context_->open;
  }
  ConnectionCounter(ConnectionCounter&& other) noexcept : context_(std::exchange(other.context_, nullptr)) {}
  ConnectionCounter(const ConnectionCounter&) = delete;
  ConnectionCounter& operator=(const ConnectionCounter&) = delete;
  ConnectionCounter& operator=(ConnectionCounter&&) = delete;

 private:
  Context* context_;
};

/// @param port  whether it follows the address
inline std::string addressOf(const beast::tcp_stream& stream, bool port) {
  Failed error;
  const auto end = stream.socket().remote_endpoint(error);
  return error ? "?" : end.address().to_string() + (port ? ":" + std::to_string(end.port()) : "");
}

template <class Stream>
class WebSocket final : public Session, public std::enable_shared_from_this<WebSocket<Stream>> {
 public:
  using Header = http::request<http::empty_body>;

  /// @param rate  maximum samples per second of a best-effort topic; 0: all
  WebSocket(Stream stream, Context& context, ConnectionCounter counter, dds::Role role, double rate)
      : socket_(std::move(stream)), context_(context), counter_(std::move(counter)), role_(role), rate_(rate) {}

  void start(const Header& request, std::string_view subprotocol) {
    report_.address = addressOf(beast::get_lowest_layer(socket_), true);
    report_.role = role_;
    beast::get_lowest_layer(socket_).expires_never();  // from here on the WebSocket's own timeouts apply
    websocket::stream_base::timeout times{};
    times.handshake_timeout = seconds(kHandshakeTime);
    times.idle_timeout = seconds(kSilenceTime);
    times.keep_alive_pings = true;
    socket_.set_option(times);
    socket_.set_option(
        websocket::stream_base::decorator([name = std::string(subprotocol)](websocket::response_type& r) {
          r.set(http::field::server, "tandem-console");
          r.set(http::field::sec_websocket_protocol, name);
        }));
    socket_.read_message_max(kMaxClientFrame);
    socket_.auto_fragment(false);
    socket_.async_accept(request, [self = this->shared_from_this()](Failed error) {
      if (!error)
        self->join();
    });
  }

  void close(const std::string& reason) override {
    if (!client_ || std::exchange(closing_, true))
      return;
    client_->note(StatusLevel::kWarning, reason, "end");
    client_->queue().seal();
    // The longest reason of a close frame: 123 bytes.
    reason_ = {websocket::close_code::going_away, reason.substr(0, 123)};
    writeNext();
  }

  void look() override {
    report_.bytes_per_second = static_cast<double>(report_.bytes - counted_bytes_);
    counted_bytes_ = report_.bytes;
    if (writing_ && Clock::now() - write_began_ > seconds(kStallTime))
      cutOff();
  }

  void drop() override {
    if (!client_)
      return;
    context_.hub.leave(client_);
    client_.reset();
    // The set may have the last reference.
    const auto self = this->shared_from_this();
    context_.sessions.erase(self);
    beast::get_lowest_layer(socket_).close();
  }

  ClientReport report() const override {
    ClientReport report = report_;
    report.dropped = client_ ? client_->queue().dropped() : 0;
    return report;
  }

 private:
  void join() {
    // Otherwise a client that does not read has seconds of old samples in the kernel.
    Failed ignored;
    beast::get_lowest_layer(socket_).socket().set_option(net::socket_base::send_buffer_size(256 * 1024), ignored);
    client_ =
        std::make_shared<Client>(role_, rate_, [weak = this->weak_from_this(), executor = socket_.get_executor()] {
          net::post(executor, [weak] {
            if (const auto self = weak.lock())
              self->writeNext();
          });
        });
    context_.sessions.insert(this->shared_from_this());
    context_.hub.join(client_);
    read();
  }

  void read() {
    socket_.async_read(incoming_,
                       [self = this->shared_from_this()](Failed error, std::size_t) { self->onRead(error); });
  }

  void onRead(Failed error) {
    if (error || !client_)
      return drop();
    const auto data = incoming_.cdata();
    const std::string_view frame(static_cast<const char*>(data.data()), data.size());
    if (socket_.got_text())
      context_.hub.onText(client_, frame);
    else
      context_.hub.onBinary(client_, frame);
    incoming_.consume(incoming_.size());
    if (incoming_.capacity() > kLargeBuffer)
      incoming_.shrink_to_fit();
    read();
  }

  void writeNext() {
    if (writing_ || closed_ || !client_)
      return;
    if (client_->queue().overflown())
      return cutOff();
    const auto next = client_->queue().pop();
    if (!next) {
      if (closing_) {
        closed_ = true;
        socket_.async_close(reason_, [self = this->shared_from_this()](Failed) { self->drop(); });
      }
      return;
    }
    current_ = *next;
    writing_ = true;
    write_began_ = Clock::now();
    socket_.text(current_.kind == FrameKind::kText);
    const std::size_t header = current_.kind == FrameKind::kSample ? current_.header.size() : 0;
    report_.bytes += header + current_.payload->size();
    ++report_.messages;
    const std::array<net::const_buffer, 2> buffers{net::buffer(current_.header.data(), header),
                                                   net::buffer(*current_.payload)};
    socket_.async_write(buffers, [self = this->shared_from_this()](Failed error, std::size_t) {
      self->writing_ = false;
      if (error)
        return self->drop();
      self->writeNext();
    });
  }

  void cutOff() {
    ++context_.cut_off;
    drop();
  }

  static constexpr std::size_t kLargeBuffer = 64 * 1024;

  websocket::stream<Stream> socket_;
  Context& context_;
  ConnectionCounter counter_;
  dds::Role role_;
  double rate_;
  std::shared_ptr<Client> client_;
  beast::flat_buffer incoming_;
  Outgoing current_;
  ClientReport report_;
  std::uint64_t counted_bytes_ = 0;
  bool writing_ = false;
  bool closing_ = false;  ///< once the queue is empty
  bool closed_ = false;   ///< the close frame is being sent
  websocket::close_reason reason_;
  Clock::time_point write_began_{};
};

template <class Stream>
class Http final : public std::enable_shared_from_this<Http<Stream>> {
 public:
  Http(Stream stream, Context& context)
      : stream_(std::move(stream)), context_(context), counter_(context), unauthenticated_(context) {}

  /// Called before the first byte.
  void enter() {
    unauthenticated_.enter([weak = this->weak_from_this()] {
      if (const auto self = weak.lock())
        self->giveUp();
    });
  }

  /// @param time  s, time limit of the request
  void read(double time) {
    parser_.emplace();
    parser_->header_limit(kMaxHeader);
    parser_->body_limit(0);
    beast::get_lowest_layer(stream_).expires_after(seconds(time));
    http::async_read(stream_, buffer_, *parser_,
                     [self = this->shared_from_this()](Failed error, std::size_t) { self->onRead(error); });
  }

  Stream& stream() { return stream_; }
  void giveUp() { beast::get_lowest_layer(stream_).close(); }

 private:
  void onRead(Failed error) {
    if (error == http::error::header_limit)
      return send(refuse(context_, 431, "the header is longer than " + std::to_string(kMaxHeader) + " bytes"), false);
    if (error == http::error::body_limit || error == http::error::unexpected_body)
      return send(refuse(context_, 413, "request body: found one, expected none"), false);
    if (error.category() == http::make_error_code(http::error::bad_method).category() &&
        error != http::error::end_of_stream && error != http::error::partial_message)
      return send(refuse(context_, 400, "not an HTTP request: " + error.message()), false);
    if (error)
      return giveUp();
    const auto& message = parser_->get();
    Request request = requestOf(message);
    request.address = addressOf(beast::get_lowest_layer(stream_), false);
    if (!request.repeated.empty())
      return send(refuse(context_, 400, request.repeated + ": found it more than once, expected it once"), false);
    const bool known = context_.access.judge(request.access_headers).role.has_value();
    if (known)
      unauthenticated_.leave();
    if (websocket::is_upgrade(message))
      return upgrade(request, message);
    head_ = request.head;
    const Answer answered = answer(context_, request);
    if (!answered.later)
      return send(answered, known && message.keep_alive());
    if (context_.slow >= kMaxSlow)
      return send(refuse(context_, 503,
                         "found " + std::to_string(kMaxSlow) +
                             " requests for recordings in progress, expected fewer; repeat the request later"),
                  false);
    compute(answered, known && message.keep_alive());
  }

  void upgrade(const Request& request, const http::request<http::empty_body>& message) {
    const AccessDecision decision = context_.access.judge(request.access_headers);
    if (!decision.role)
      return send(refuse(context_, decision.status, decision.why), false);
    const auto offered = message[http::field::sec_websocket_protocol];
    const auto subprotocol = chooseSubprotocol({offered.data(), offered.size()});
    if (!subprotocol)
      return send(refuse(context_, 400,
                         "Sec-WebSocket-Protocol: expected " + std::string(kSubprotocols[0]) + " or " +
                             std::string(kSubprotocols[1])),
                  false);
    const auto rate = rateOf(request.query);
    if (!rate)
      return send(refuse(context_, 400, kExpectedRate), false);
    const auto socket =
        std::make_shared<WebSocket<Stream>>(std::move(stream_), context_, std::move(counter_), *decision.role, *rate);
    socket->start(message, *subprotocol);
  }

  /// Computes the body on the worker's thread, and sends it.
  void compute(Answer answer, bool keep_alive) {
    ++context_.slow;
    beast::get_lowest_layer(stream_).expires_never();
    net::post(context_.worker, [self = this->shared_from_this(), answer = std::move(answer), keep_alive]() mutable {
      std::string why;
      try {
        answer.body = answer.later();
      } catch (const std::exception& error) {
        why = error.what();
      }
      net::post(self->stream_.get_executor(),
                [self, answer = std::move(answer), keep_alive, why = std::move(why)]() mutable {
                  --self->context_.slow;
                  self->send(why.empty() ? answer : refuse(self->context_, 400, why), keep_alive);
                });
    });
  }

  void send(const Answer& answer, bool keep_alive) {
    const auto response = std::make_shared<http::response<http::string_body>>();
    response->version(11);
    response->result(static_cast<unsigned>(answer.status));
    response->set(http::field::server, "tandem-console");
    response->set(http::field::content_type, answer.type);
    response->set("X-Content-Type-Options", "nosniff");
    response->set("Referrer-Policy", "no-referrer");
    response->set("Cross-Origin-Resource-Policy", "same-origin");
    for (const auto& [name, value] : answer.headers)
      response->set(name, value);
    response->keep_alive(keep_alive);
    response->body() = head_ ? std::string() : answer.body;
    response->prepare_payload();
    if (head_ && answer.status != 304)
      response->content_length(answer.body.size());
    head_ = false;
    beast::get_lowest_layer(stream_).expires_after(seconds(kKeepAliveTime));
    http::async_write(stream_, *response, [self = this->shared_from_this(), response](Failed error, std::size_t) {
      if (error || response->need_eof())
        return self->giveUp();
      self->read(kKeepAliveTime);
    });
  }

  Stream stream_;
  Context& context_;
  ConnectionCounter counter_;
  UnauthenticatedEntry unauthenticated_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::empty_body>> parser_;
  bool head_ = false;
};

}  // namespace tandem::console
