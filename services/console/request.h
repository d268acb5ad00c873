// SPDX-License-Identifier: Apache-2.0
/** @file The parts of a parsed HTTP request that an answer depends on. No sockets here. */
#pragma once

#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <string>

#include "services/console/context.h"

namespace tandem::console {

/// A header that decides on access and of which the request has two: one reader takes the first, another one the last.
inline std::string repeatedHeader(const boost::beast::http::request<boost::beast::http::empty_body>& message) {
  for (const char* name : {"Host", "Origin", "Sec-Fetch-Site", "Authorization", "Cookie"}) {
    if (message.count(name) > 1)
      return std::string("header ") + name;
  }
  return {};
}

inline Request requestOf(const boost::beast::http::request<boost::beast::http::empty_body>& message) {
  using boost::beast::http::field;
  const auto text = [&](auto name) {
    const auto value = message[name];
    return std::string(value.data(), value.size());
  };
  Request request;
  request.get = message.method() == boost::beast::http::verb::get;
  request.head = message.method() == boost::beast::http::verb::head;
  request.post = message.method() == boost::beast::http::verb::post;
  const std::string target(message.target().data(), message.target().size());
  const auto mark = target.find('?');
  request.path = target.substr(0, mark);
  request.query = mark == std::string::npos ? "" : target.substr(mark + 1);
  request.repeated = repeatedHeader(message);
  if (const auto parameter = repeatedParameter(request.query); request.repeated.empty() && parameter.data() != nullptr)
    request.repeated = "parameter " + std::string(parameter.substr(0, 40));
  request.gzip = acceptsGzip(text(field::accept_encoding));
  request.known_etag = text(field::if_none_match);
  request.access_headers = {text(field::host),          text(field::origin), text("Sec-Fetch-Site"),
                            text(field::authorization), text(field::cookie), request.query};
  return request;
}

}  // namespace tandem::console
