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

bool& asJson() {
  static bool json = false;
  return json;
}

void answer(const std::string& text, const nlohmann::ordered_json& fields) {
  std::cout << (asJson() ? fields.dump(2) : text) << '\n';
}

void refuse(int code, const std::string& text, const nlohmann::ordered_json& place) {
  std::cerr << text << '\n';
  if (!asJson())
    return;
  nlohmann::ordered_json error{{"message", text}};
  error.update(place);
  // Texts may quote bytes of a file that are not UTF-8.
  constexpr auto kReplace = nlohmann::ordered_json::error_handler_t::replace;
  std::cout << nlohmann::ordered_json{{"error", error}, {"exit", code}}.dump(-1, ' ', false, kReplace) << std::endl;
}

nlohmann::ordered_json errorsJson(const config::Error& error) {
  nlohmann::ordered_json errors = nlohmann::ordered_json::array();
  for (const config::Error& one : error.all())
    errors.push_back({{"line", one.line()}, {"column", one.column()}, {"key", one.key()}, {"error", one.what()}});
  return errors;
}

void guarded(int& exit_code, const std::function<int()>& body) {
  try {
    exit_code = body();
  } catch (const Failure& failure) {
    std::cerr << "tandem: ";
    refuse(exit_code = failure.code(), failure.what());
  } catch (const config::Error& error) {
    refuse(exit_code = kUsage, error.what(), {{"file", error.file()}, {"errors", errorsJson(error)}});
  } catch (const std::exception& error) {
    std::cerr << "tandem: ";
    refuse(exit_code = kFailure, error.what());
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
