// SPDX-License-Identifier: Apache-2.0
/** @file tandem cooperative payload: stiffness and payload of a grasped object, for all arms and for each arm
 * alone. */
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <numbers>
#include <tuple>

#include "experiments/payload.h"
#include "robots/track.h"
#include "services/cli/models/cooperative.h"
#include "services/cli/models/figure.h"
#include "services/cli/models/parallel.h"
#include "services/cli/models/table.h"
#include "services/cli/subcommand.h"

namespace tandem::cli {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using Json = nlohmann::ordered_json;
using experiments::Payload;

struct PayloadCommand {
  GraspOptions grasp;
  std::string csv;
  FigureOptions figure;
  double sag = 10e-3, most = 10.0, finest_deg = 1.0;
  int directions = 24, threads = 0;
  bool json = false;
};

/// One direction of the figure: planes are xy, yz and zx, angles from the first axis.
struct Ray {
  int plane;
  double angle;
  Vector3d direction;
};

Ray rayAt(int plane, double angle) {
  return {plane, angle, std::cos(angle) * Vector3d::Unit(plane) + std::sin(angle) * Vector3d::Unit((plane + 1) % 3)};
}

std::vector<Ray> raysOf(int count) {
  std::vector<Ray> rays;
  for (int plane = 0; plane < 3; ++plane) {
    for (int k = 0; k < count; ++k)
      rays.push_back(rayAt(plane, 2.0 * std::numbers::pi * k / count));
  }
  return rays;
}

struct Answer {
  std::size_t carrier;
  Ray ray;
  Payload payload;
};

std::vector<Answer> answersOf(const experiments::PayloadStudy& study,
                              const std::vector<Ray>& rays,
                              const experiments::PayloadOptions& options,
                              int threads) {
  std::vector<Answer> answers;
  for (std::size_t carrier = 0; carrier < study.carriers().size(); ++carrier) {
    for (const Ray& ray : rays)
      answers.push_back({carrier, ray, {}});
  }
  parallelFor(answers.size(), threads, "directions", [&](std::size_t k) {
    answers[k].payload = study.carried(answers[k].carrier, answers[k].ray.direction, options);
  });
  return answers;
}

/// Whether two neighbours differ so much that a line between them could hide a peak.
bool differ(const Payload& one, const Payload& other) {
  constexpr double kPart = 0.05;
  const auto apart = [](double a, double b) { return std::abs(a - b) > kPart * std::max(a, b); };
  return apart(one.load, other.load) || apart(one.stiffness, other.stiffness);
}

/// All carriers in three planes: `count` directions per plane, and directions halfway between neighbours that differ,
/// until those are `finest` apart. By carrier, plane and angle.
std::vector<Answer> planesOf(const experiments::PayloadStudy& study,
                             int count,
                             double finest,
                             const experiments::PayloadOptions& options,
                             int threads) {
  const auto before = [](const Answer& a, const Answer& b) {
    return std::tie(a.carrier, a.ray.plane, a.ray.angle) < std::tie(b.carrier, b.ray.plane, b.ray.angle);
  };
  std::vector<Answer> answers = answersOf(study, raysOf(count), options, threads);
  std::ranges::sort(answers, before);
  for (double step = std::numbers::pi / count; 2.0 * step > 1.01 * finest; step *= 0.5) {
    std::vector<Answer> more;
    for (std::size_t k = 0; k < answers.size(); ++k) {
      const Answer& one = answers[k];
      // The neighbour of the last direction in a plane is the first one.
      const auto same = [&one](const Answer& a) { return a.carrier == one.carrier && a.ray.plane == one.ray.plane; };
      const bool last = k + 1 == answers.size() || !same(answers[k + 1]);
      const Answer& other = last ? *std::ranges::find_if(answers, same) : answers[k + 1];
      const double gap = other.ray.angle - one.ray.angle + (last ? 2.0 * std::numbers::pi : 0.0);
      if (gap > 1.5 * step && differ(one.payload, other.payload))
        more.push_back({one.carrier, rayAt(one.ray.plane, one.ray.angle + 0.5 * gap), {}});
    }
    parallelFor(more.size(), threads, "finer directions", [&](std::size_t k) {
      more[k].payload = study.carried(more[k].carrier, more[k].ray.direction, options);
    });
    answers.insert(answers.end(), more.begin(), more.end());
    std::ranges::sort(answers, before);
  }
  return answers;
}

void write(const std::string& file, const std::vector<Answer>& answers) {
  if (fs::path(file).has_parent_path())
    fs::create_directories(fs::path(file).parent_path());
  std::ofstream out(file);
  Table table(out, {"carrier", "plane", "angle", "dx", "dy", "dz", "stiffness", "payload", "sag"}, false);
  for (const auto& [carrier, ray, payload] : answers) {
    table.add({double(carrier), double(ray.plane), ray.angle, ray.direction.x(), ray.direction.y(), ray.direction.z(),
               payload.stiffness, payload.load, payload.sag},
              payload.limit);
  }
  if (!table.finish())
    client::failToWrite(kFailure, file);
}

void printPayload(const Json& json) {
  std::printf("joints at standstill, constant %s; permitted displacement of the object %g mm\n",
              json["actuation"].get<std::string>().c_str(), 1e3 * json["most_sag_m"].get<double>());
  for (const Json& carrier : json["carriers"]) {
    std::printf("carried by %s%s\n", carrier["name"].get<std::string>().c_str(),
                carrier["refused"] == "" ? "" : (": " + carrier["refused"].get<std::string>()).c_str());
    if (carrier["refused"] != "")
      continue;
    std::printf("  %-4s %14s %12s %10s  %s\n", "load", "stiffness N/m", "payload N", "sag mm", "limited by");
    for (const Json& row : carrier["directions"])
      std::printf("  %-4s %14.4g %12.4g %10.3f  %s\n", row["along"].get<std::string>().c_str(),
                  row["stiffness_N_per_m"].get<double>(), row["payload_N"].get<double>(),
                  1e3 * row["sag_m"].get<double>(), row["limit"].get<std::string>().c_str());
  }
}

int runPayload(const PayloadCommand& o) {
  config::CooperativeRobot robot = graspingRobot(o.grasp);
  robots::GraspedObjectMechanism mechanism(robot);
  robots::TrackOptions track;
  track.parameters = robot.parameters;
  robots::RobotVector joints;
  if (const std::string why = robots::prepare(mechanism, track, joints); !why.empty()) {
    std::printf("refused: %s\n", why.c_str());
    return kFailure;
  }
  const experiments::PayloadStudy study(robot, mechanism);
  const experiments::PayloadOptions options{o.sag, o.most};
  std::vector<Ray> axes;
  const char* const names[] = {"+x", "-x", "+y", "-y", "+z", "-z"};
  for (int k = 0; k < 6; ++k)
    axes.push_back({0, 0.0, (k % 2 ? -1.0 : 1.0) * Vector3d::Unit(k / 2)});
  Json json{{"robot", o.grasp.robot},
            {"actuation", actuationOf(robot)},
            {"most_sag_m", o.sag},
            {"squeeze_N", robot.object->squeeze}};
  for (const Answer& answer : answersOf(study, axes, options, o.threads)) {
    Json& carriers = json["carriers"];
    if (carriers.size() <= answer.carrier)
      carriers.push_back({{"name", study.carriers()[answer.carrier]},
                          {"refused", study.refusal(answer.carrier)},
                          {"directions", Json::array()}});
    Json& rows = carriers.back()["directions"];
    rows.push_back({{"along", names[rows.size()]},
                    {"stiffness_N_per_m", answer.payload.stiffness},
                    {"payload_N", answer.payload.load},
                    {"sag_m", answer.payload.sag},
                    {"limit", answer.payload.limit}});
  }
  std::string csv = o.csv;
  if (o.figure.wanted() && csv.empty())
    csv = fs::path(o.figure.path).replace_extension(".csv").string();
  if (!csv.empty())
    write(csv, planesOf(study, o.directions, o.finest_deg * std::numbers::pi / 180.0, options, o.threads));
  if (o.figure.wanted()) {
    std::vector<std::string> arguments{"payload", csv, o.figure.path};
    append(arguments, study.carriers());
    drawFigures("cooperative.py", arguments, o.figure);
  }
  if (o.json)
    std::cout << json.dump(2) << '\n';
  else
    printPayload(json);
  return kOk;
}

}  // namespace

void registerPayload(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<PayloadCommand>();
  CLI::App* command =
      app.add_subcommand("payload", "stiffness and payload of a grasped object, for all arms and for each arm alone");
  addGraspOptions(*command, options->grasp);
  command->add_option("--sag", options->sag, "permitted displacement of the object, m")
      ->check(CLI::Range(1e-5, 1.0))
      ->capture_default_str();
  command->add_option("--most", options->most, "largest load of the search, N")
      ->check(CLI::Range(1e-6, 1e4))
      ->capture_default_str();
  command
      ->add_option("--directions", options->directions,
                   "number of directions per plane (three planes) in --csv and --figure, before refinement")
      ->check(CLI::Range(4, 3600))
      ->capture_default_str();
  command
      ->add_option(
          "--finest-deg", options->finest_deg,
          "smallest angle between neighbouring directions, deg; directions are added where the results of neighbours "
          "differ by more than 5 %")
      ->check(CLI::Range(0.01, 180.0))
      ->capture_default_str();
  command->add_option("-t,--threads", options->threads, "threads; 0: one per core")->check(client::kNonNegative);
  command->add_option("--csv", options->csv, "CSV file, one row per carrier (all arms, or one arm) and direction, SI");
  addFigureOption(*command, options->figure, "stiffness and payload by direction");
  command->add_flag("--json", options->json, "JSON instead of text");
  command->footer(
      "Exit code 1: the arms cannot carry the object; the reason is printed.\n"
      "Documentation: docs/cooperative.md");
  command->callback([options, &exit_code] { guarded(exit_code, [&] { return runPayload(*options); }); });
}

}  // namespace tandem::cli
