// SPDX-License-Identifier: Apache-2.0
#include "services/console/connection.h"

namespace tandem::console {

void servePlain(net::ip::tcp::socket socket, Context& context) {
  std::make_shared<Http<beast::tcp_stream>>(beast::tcp_stream(std::move(socket)), context)->read(kHandshakeTime);
}

}  // namespace tandem::console
