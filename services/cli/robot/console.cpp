// SPDX-License-Identifier: Apache-2.0
/** @file tandem console: prints the address of the console, and starts it if it is not running. */
#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <iostream>
#include <optional>

#include "config/config.h"
#include "services/cli/deployment/sibling.h"
#include "services/cli/robot/console.h"
#include "services/cli/subcommand.h"
#include "services/runtime/process.h"

namespace tandem::cli {
namespace {

struct ConsoleCommand {
  std::string deployment = runtime::defaultDeployment(), page;
  std::optional<int> port;
  bool only_print = false;
};

/// Whether a process accepts connections at this address within 1 s.
bool served(const std::string& address, int port) {
  const int descriptor = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (descriptor < 0)
    return false;
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(port));
  inet_pton(AF_INET, address.c_str(), &to.sin_addr);
  bool good = connect(descriptor, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
  if (!good && errno == EINPROGRESS) {
    pollfd wait{descriptor, POLLOUT, 0};
    int error = 0;
    socklen_t size = sizeof error;
    good = poll(&wait, 1, 1000) == 1 && getsockopt(descriptor, SOL_SOCKET, SO_ERROR, &error, &size) == 0 && error == 0;
  }
  close(descriptor);
  return good;
}

int runConsole(const ConsoleCommand& options) {
  const config::Deployment deployment = runtime::loadDeployment(options.deployment);
  const config::Console& console = deployment.console;
  const int port = options.port.value_or(console.port);
  const std::string near = consoleAddress(console);
  const std::string socket = (console.tls() ? "wss://" : "ws://") + near + ":" + std::to_string(port);
  const bool is_served = !options.only_print && served(near, port);
  std::string text = consoleUrl(console, port) + "\nFoxglove, Lichtblick, PlotJuggler: " + socket;
  if (!console.operator_token.empty())
    text += "\nappend ?token=TOKEN with the token in " + console.operator_token.string() +
            (console.viewer_token.empty() ? "" : " (read only: in " + console.viewer_token.string() + ")");
  answer(text + (is_served ? "\nit is already served" : ""), {{"page", consoleUrl(console, port)},
                                                              {"socket", socket},
                                                              {"operator_token", console.operator_token.string()},
                                                              {"viewer_token", console.viewer_token.string()},
                                                              {"served", is_served}});
  std::cout << std::flush;
  if (options.only_print || is_served)
    return kOk;
  std::vector<std::string> words{"--deployment", deployment.file.string(), "--port", std::to_string(port)};
  if (!options.page.empty())
    words.insert(words.end(), {"--page", options.page});
  become("tandem-console", words);
}

}  // namespace

std::string consoleAddress(const config::Console& console) {
  return console.address == "0.0.0.0" ? "127.0.0.1" : console.address;
}

std::string consoleUrl(const config::Console& console, int port) {
  return (console.tls() ? "https://" : "http://") + consoleAddress(console) + ":" + std::to_string(port) + "/";
}

void registerConsole(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ConsoleCommand>();
  CLI::App* console = app.add_subcommand("console", "the operator's page, and the server for Foxglove and other tools");
  console->add_option("deployment,-d,--deployment", options->deployment, "deployment file, or the name of a preset")
      ->capture_default_str();
  console->add_option("--port", options->port, "TCP port instead of the deployment's console.port")
      ->check(CLI::Range(1, 65535));
  console->add_option("--page", options->page, "folder of the operator's page (default: the installed one)");
  console->add_flag("--url", options->only_print, "print the address and exit");
  console->footer(
      "Prints the console's address. If no console runs, serves it until Ctrl-C. Documentation: docs/foxglove.md");
  console->callback([options, &exit_code] { guarded(exit_code, [&] { return runConsole(*options); }); });
}

}  // namespace tandem::cli
