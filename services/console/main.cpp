// SPDX-License-Identifier: Apache-2.0
/** @file tandem-console: serves browsers and tools: the Foxglove WebSocket protocol, the operator's page, JSON. */
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>

#include "config/arm_names.h"
#include "services/console/api.h"
#include "services/console/events_file.h"
#include "services/console/markers.h"
#include "services/console/recording.h"
#include "services/console/replay.h"
#include "services/console/server.h"
#include "services/console/shapes.h"
#include "services/runtime/clock_request_handler.h"
#include "services/runtime/diagnostics.h"
#include "services/runtime/periodic_loop.h"
#include "services/runtime/process.h"
#include "services/runtime/state_directory.h"
#include "services/runtime/stop_signal.h"

using namespace tandem;

namespace {

struct Options {
  std::optional<int> port;
  std::filesystem::path page;
};

std::vector<std::string> ownNames() {
  char name[256] = {};
  if (gethostname(name, sizeof name - 1) != 0)
    return {};
  return {name};
}

/// The folder of the page: given, installed, or built. @throw std::invalid_argument if the given one has no index.html.
console::Page findPage(const std::filesystem::path& given) {
  console::Page page(given.empty() ? config::findShared("console", {"console/dist"}) : given);
  if (!given.empty() && !page.present())
    throw std::invalid_argument("--page " + given.string() + ": found no index.html in it");
  return page;
}

/// Folder `name` beside the files of the black box.
std::filesystem::path folderOf(const config::Deployment& deployment, const char* name) {
  const auto& given = deployment.black_box.directory;
  return (given.empty() ? runtime::stateDirectory() : given) / name;
}

/** CPU load of this process, in cores, over the last second. */
class Load {
 public:
  double look() {
    const std::int64_t now = runtime::monotonicNow();
    if (now - looked_ < 1'000'000'000)
      return share_;
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const double used = seconds(usage.ru_utime) + seconds(usage.ru_stime);
    if (looked_ != 0)
      share_ = (used - used_) / (1e-9 * static_cast<double>(now - looked_));
    used_ = used;
    looked_ = now;
    return share_;
  }

 private:
  static double seconds(const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  }
  std::int64_t looked_ = 0;
  double used_ = 0.0, share_ = 0.0;
};

/** The complete process. */
class Console {
 public:
  Console(const runtime::Setup& setup, const Options& options)
      : setup_(setup),
        options_(withPort(setup.deployment.console, options.port)),
        access_(options_, !setup.deployment.security.empty(), ownNames()),
        page_(findPage(options.page)),
        robot_(console::describeRobot(setup.deployment, setup.robot)),
        trajectories_(console::describeTrajectories(setup.robot).dump()),
        bus_(runtime::busOptions(setup.deployment, setup.name)),
        bytes_(runtime::ofAnyRobot(runtime::busOptions(setup.deployment, setup.name + "-bytes", dds::Role::kConsole))),
        diagnostics_(bus_, setup),
        markers_(bus_, setup.robot),
        clock_(bus_, setup),
        events_(
            history_,
            folderOf(setup.deployment, "events") / (setup.deployment.name + "_" + setup.deployment.prefix + ".mcap"),
            setup.deployment,
            setup.robot),
        hub_(bytes_, history_, config::armList(setup.robot), std::to_string(setup.session)),
        shapes_(setup.robot, setup.deployment.model),
        recording_(
            setup.deployment,
            setup.robot,
            runtime::ofAnyRobot(runtime::busOptions(setup.deployment, setup.name + "-recording", dds::Role::kConsole)),
            folderOf(setup.deployment, "recordings")),
        replay_(folderOf(setup.deployment, "recordings"), setup.deployment, setup.robot),
        server_(options_, hub_, access_, page_, [this](auto path, auto query, auto role, const auto& address) {
          return answer(path, query, role, address);
        }) {}

  void run(runtime::StopSignal& stop) {
    spdlog::info("ready: {}://{}:{}/{}{}", options_.tls() ? "https" : "http", options_.address, options_.port,
                 access_.asksForToken() ? "?token=..." : "",
                 page_.present() ? "" : ", without the operator's page; deploy/run.sh --with page builds it");
    server_.run([&] {
      setup_.heartbeat->beat();
      load_.look();
      markers_.look();
      reportHealth();
      return stop.requested() ? "tandem-console ended: " + runtime::reasonOfStop() : std::string();
    });
  }

 private:
  static config::Console withPort(config::Console options, const std::optional<int>& port) {
    options.port = port.value_or(options.port);
    return options;
  }

  std::optional<console::Server::ApiAnswer> answer(std::string_view path,
                                                   std::string_view query,
                                                   dds::Role role,
                                                   const std::string& address) {
    if (path == "/robot") {
      nlohmann::ordered_json robot = robot_;
      robot["session"] = std::to_string(setup_.session);
      robot["client_address"] = address;
      robot["role"] = role == dds::Role::kConsoleOperator ? "operator" : "viewer";
      return robot.dump();
    }
    if (path == "/trajectories")
      return trajectories_;
    if (path == "/shape")
      return shapes_.at(console::parameterOf(query, "joints"));
    if (path == "/span")
      return shapes_.span(console::Shapes::spanIn(query));
    if (path.starts_with("/recordings"))
      return answerReplay(path, std::string(query));
    if (path.starts_with("/recording"))
      return answerRecording(path, query);
    if (path == "/events")
      return console::Server::ApiAnswer([this] { return hub_.history(); }, "application/octet-stream");
    if (path == "/clock")
      return nlohmann::json{{"now_ms", 1e-6 * static_cast<double>(runtime::wallNow())}}.dump();
    if (path == "/stats")
      return statistics();
    return std::nullopt;
  }

  std::optional<console::Server::ApiAnswer> answerReplay(std::string_view path, const std::string& query) {
    constexpr const char* kJson = "application/json";
    const auto text = [](const nlohmann::ordered_json& json) {
      return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    };
    if (path == "/recordings")
      return console::Server::ApiAnswer([this, text] { return text(replay_.list()); }, kJson);
    if (path == "/recordings/about")
      return console::Server::ApiAnswer([this, text, query] { return text(replay_.describe(query)); }, kJson);
    if (path == "/recordings/samples")
      return console::Server::ApiAnswer([this, query] { return replay_.samples(query); }, "application/octet-stream");
    if (path == "/recordings/span")
      return console::Server::ApiAnswer([this, query] { return replay_.span(query); }, kJson);
    return std::nullopt;
  }

  std::optional<console::Server::ApiAnswer> answerRecording(std::string_view path, std::string_view query) {
    if (path == "/recording/start")
      recording_.start();
    else if (path == "/recording/mark")
      recording_.mark(console::decoded(console::parameterOf(query, "text")));
    else if (path == "/recording/stop")
      recording_.stop();
    else if (path != "/recording")
      return std::nullopt;
    return recording_.state().dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  }

  std::string statistics() {
    const console::ServerReport report = server_.report();
    nlohmann::ordered_json clients = nlohmann::ordered_json::array();
    for (const console::ClientReport& client : report.clients)
      clients.push_back({{"address", client.address},
                         {"role", client.role == dds::Role::kConsoleOperator ? "operator" : "viewer"},
                         {"messages", client.messages},
                         {"bytes", client.bytes},
                         {"bytes_per_second", client.bytes_per_second},
                         {"dropped", client.dropped}});
    return nlohmann::ordered_json{{"clients", clients},
                                  {"bytes_per_second", report.bytes_per_second},
                                  {"cpu", load_.look()},
                                  {"connections", report.connections},
                                  {"turned_away", report.turned_away},
                                  {"cut_off", report.cut_off},
                                  {"topics_read", hub_.openReaders()},
                                  {"received", hub_.received()},
                                  {"published", hub_.published()},
                                  {"refused", hub_.refused()},
                                  {"markers", markers_.active()}}
        .dump();
  }

  void reportHealth() {
    const console::ServerReport report = server_.report();
    const std::int64_t now = runtime::monotonicNow();
    diagnostics_.publish(now, runtime::Diagnostics::Level::kOk, "serves " + std::to_string(report.clients.size()),
                         {{"clients", std::to_string(report.clients.size())},
                          {"bytes_per_second", fmt::format("{:.0f}", report.bytes_per_second)},
                          {"cpu", fmt::format("{:.3f}", load_.look())},
                          {"turned_away", std::to_string(report.turned_away)},
                          {"cut_off", std::to_string(report.cut_off)},
                          {"refused", std::to_string(hub_.refused())}});
  }

  const runtime::Setup& setup_;
  config::Console options_;
  console::Access access_;
  console::Page page_;
  nlohmann::ordered_json robot_;
  std::string trajectories_;
  // Serialized samples have a bus of their own, beside the one for the console's own topics.
  dds::Bus bus_, bytes_;
  runtime::Diagnostics diagnostics_;
  console::Markers markers_;
  runtime::ClockRequestHandler clock_;
  console::History history_;
  console::EventsFile events_;  // before the hub, whose last events it writes
  console::Hub hub_;
  console::Shapes shapes_;
  console::Recording recording_;
  console::Replay replay_;  // used by the server's worker, which ends before
  console::Server server_;
  Load load_;
};

}  // namespace

int main(int argc, char** argv) {
  Options options;
  return runtime::runService(
      argc, argv, "console", "Serves browsers and tools: the Foxglove WebSocket protocol, the operator's page, JSON.",
      [&](const runtime::Setup& setup, runtime::StopSignal& stop) { Console(setup, options).run(stop); },
      [&](CLI::App& app) {
        app.add_option("--port", options.port, "TCP port instead of the deployment's console.port")
            ->check(CLI::Range(1, 65535));
        app.add_option("--page", options.page, "folder of the operator's page (default: the installed one)");
      });
}
