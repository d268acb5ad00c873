// SPDX-License-Identifier: Apache-2.0
#include "services/client/arguments.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iostream>

#include "config/config.h"

namespace tandem::client {

std::shared_ptr<std::istream> openInput(const std::string& path) {
  if (path == "-")
    return {&std::cin, [](std::istream*) {}};
  auto file = std::make_shared<std::ifstream>(path);
  if (!*file)
    throw Failure(kUsage, path + ": cannot be opened for reading: " + std::strerror(errno));
  return file;
}

void failToWrite(int code, const std::string& file) {
  throw Failure(code, file + ": cannot be written" + (errno == 0 ? "" : std::string(": ") + std::strerror(errno)));
}

void guarded(int& exit_code, const std::function<int()>& body) {
  try {
    exit_code = body();
  } catch (const Failure& failure) {
    std::cerr << "tandem: " << failure.what() << '\n';
    exit_code = failure.code();
  } catch (const config::Error& error) {
    std::cerr << error.what() << '\n';
    exit_code = kUsage;
  } catch (const std::exception& error) {
    std::cerr << "tandem: " << error.what() << '\n';
    exit_code = kFailure;
  }
}

std::string statusField(std::string text) {
  for (char& c : text) {
    if (c == ',')
      c = ';';
    if (c == '\n' || c == '\r' || c == '"')
      c = ' ';
  }
  return text;
}

std::string shareFile(const std::string& relative) {
  if (const auto found = config::findShared(relative, {relative}); !found.empty())
    return found.string();
  throw Failure(kFailure, relative + ": not found beside the executable; is the installation complete?");
}

}  // namespace tandem::client
