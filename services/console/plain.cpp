// SPDX-License-Identifier: Apache-2.0
#include "services/console/connection.h"

namespace tandem::console {

void servePlain(net::ip::tcp::socket socket, Context& context) {
  const auto connection = std::make_shared<Http<beast::tcp_stream>>(beast::tcp_stream(std::move(socket)), context);
  connection->enter();
  connection->read(kHandshakeTime);
}

}  // namespace tandem::console
