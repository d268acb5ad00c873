// SPDX-License-Identifier: Apache-2.0
#include "services/console/server.h"

#include <spdlog/spdlog.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <stdexcept>

#include "services/console/context.h"

namespace tandem::console {

namespace net = boost::asio;
using net::ip::tcp;
using Failed = boost::system::error_code;

namespace {

constexpr auto kTick = std::chrono::milliseconds(100);
constexpr auto kLook = std::chrono::seconds(1);
constexpr auto kLastMessages = std::chrono::milliseconds(300);
constexpr auto kGoodbye = std::chrono::seconds(1);  // for clients to close

void expect(const Failed& error, const std::string& what) {
  if (error)
    throw std::invalid_argument(what + ": " + error.message());
}

}  // namespace

struct Server::Impl {
  Impl(const config::Console& options, Hub& hub, const Access& access, const Page& page, Api api)
      : context{hub, access, page, std::move(api), worker, options.tls()} {
    if (options.tls()) {
      tls.emplace(net::ssl::context::tls_server);
      Failed error;
      tls->set_options(net::ssl::context::default_workarounds | net::ssl::context::no_sslv2 |
                       net::ssl::context::no_sslv3 | net::ssl::context::no_tlsv1 | net::ssl::context::no_tlsv1_1);
      tls->use_certificate_chain_file(options.certificate.string(), error);
      expect(error, "console.certificate: " + options.certificate.string());
      expectPrivate(options.key, "console.key: " + options.key.string());
      tls->use_private_key_file(options.key.string(), net::ssl::context::pem, error);
      expect(error, "console.key: " + options.key.string());
    }
    const std::string where = "console.address, console.port: " + options.address + ":" + std::to_string(options.port);
    Failed error;
    const auto address = net::ip::make_address_v4(options.address, error);
    expect(error, where);
    acceptor.open(tcp::v4());
    acceptor.set_option(net::socket_base::reuse_address(true));
    acceptor.bind({address, static_cast<std::uint16_t>(options.port)}, error);
    if (error == net::error::address_in_use)
      throw std::runtime_error(
          where + ": another program uses this port; stop it, or set another console.port in the deployment");
    expect(error, where);
    acceptor.listen(net::socket_base::max_listen_connections, error);
    expect(error, where);
  }

  void accept() {
    acceptor.async_accept([this](Failed error, tcp::socket socket) {
      if (error == net::error::operation_aborted)
        return;
      if (error) {
        // Out of file descriptors: existing connections continue, and accepting is retried.
        retry.expires_after(kTick);
        return retry.async_wait([this](Failed ended) {
          if (!ended)
            accept();
        });
      }
      welcome(std::move(socket));
      accept();
    });
  }

  void welcome(tcp::socket socket) {
    ++context.connections;
    if (context.open - context.unauthenticated.size() >= kMaxConnections) {
      ++context.turned_away;
      return;  // its destructor closes it
    }
    // Unauthenticated connections must not block others: the oldest one is closed.
    if (context.unauthenticated.size() >= kMaxUnauthenticated) {
      ++context.turned_away;
      const auto leave = std::move(context.unauthenticated.front());
      context.unauthenticated.pop_front();
      leave();
    }
    Failed ignored;
    socket.set_option(tcp::no_delay(true), ignored);
    if (tls)
      serveTls(std::move(socket), *tls, context);
    else
      servePlain(std::move(socket), context);
  }

  void onTick(const std::function<std::string()>& tick) {
    const auto now = std::chrono::steady_clock::now();
    if (now - looked > kLook) {
      looked = now;
      // A copy: sessions that are cut off leave the set.
      for (const auto& session : std::set(context.sessions))
        session->look();
      context.hub.reportDropped();
    }
    context.hub.look();
    if (end = tick(); !end.empty())
      return io.stop();
    timer.expires_after(kTick);
    timer.async_wait([this, &tick](Failed error) {
      if (!error)
        onTick(tick);
    });
  }

  void sayGoodbye() {
    Failed ignored;
    acceptor.close(ignored);
    io.restart();
    // Processes that end at the same time say why; their messages are still forwarded.
    const auto last = std::chrono::steady_clock::now() + kLastMessages;
    while (io.run_one_until(last) > 0) {
    }
    for (const auto& session : std::set(context.sessions))
      session->close(end);
    for (const auto limit = std::chrono::steady_clock::now() + kGoodbye;
         !context.sessions.empty() && std::chrono::steady_clock::now() < limit;)
      io.run_one_for(kTick);
    for (const auto& session : std::set(context.sessions))
      session->drop();
  }

  Context context;
  net::io_context io{1};
  net::thread_pool worker{1};  // ends before the context and the sockets, which its functions use
  std::optional<net::ssl::context> tls;
  tcp::acceptor acceptor{io};
  net::steady_timer timer{io}, retry{io};
  std::chrono::steady_clock::time_point looked{};
  std::string end;  ///< why the server ends
};

Server::Server(const config::Console& options, Hub& hub, const Access& access, const Page& page, Api api)
    : impl_(std::make_unique<Impl>(options, hub, access, page, std::move(api))) {}

Server::~Server() = default;

void Server::run(const std::function<std::string()>& tick) {
  impl_->accept();
  impl_->onTick(tick);
  impl_->io.run();
  impl_->sayGoodbye();
}

ServerReport Server::report() const {
  ServerReport report;
  report.connections = impl_->context.connections;
  report.turned_away = impl_->context.turned_away;
  report.cut_off = impl_->context.cut_off;
  for (const auto& session : impl_->context.sessions) {
    report.clients.push_back(session->report());
    report.bytes_per_second += report.clients.back().bytes_per_second;
  }
  return report;
}

}  // namespace tandem::console
