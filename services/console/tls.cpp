// SPDX-License-Identifier: Apache-2.0
#include <boost/beast/ssl.hpp>
#include <boost/beast/websocket/ssl.hpp>

#include "services/console/connection.h"

namespace tandem::console {

void serveTls(net::ip::tcp::socket socket, net::ssl::context& tls, Context& context) {
  using Stream = beast::ssl_stream<beast::tcp_stream>;
  const auto connection = std::make_shared<Http<Stream>>(Stream(beast::tcp_stream(std::move(socket)), tls), context);
  connection->enter();
  beast::get_lowest_layer(connection->stream()).expires_after(seconds(kHandshakeTime));
  connection->stream().async_handshake(net::ssl::stream_base::server, [connection](Failed error) {
    if (error)
      return connection->giveUp();
    connection->read(kHandshakeTime);
  });
}

}  // namespace tandem::console
