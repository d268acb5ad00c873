// SPDX-License-Identifier: Apache-2.0
#include "services/cli/models/stability_report.h"

#include <cstdarg>
#include <cstdio>
#include <numbers>

#include "kinematics/compliant_model.h"
#include "services/cli/models/arm_options.h"

namespace tandem::cli {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr double kSame = 1e-4;  ///< rad, between end angles of the same equilibrium

std::string format(const char* pattern, ...) __attribute__((format(printf, 1, 2)));
std::string format(const char* pattern, ...) {
  char text[256];
  va_list arguments;
  va_start(arguments, pattern);
  std::vsnprintf(text, sizeof text, pattern, arguments);
  va_end(arguments);
  return text;
}

template <class Vector>
std::string list(const char* pattern, const Vector& numbers, double factor = 1.0) {
  std::string text;
  for (const double number : numbers) {
    char one[32];
    std::snprintf(one, sizeof one, pattern, factor * number);
    text += (text.empty() ? "" : " ") + std::string(one);
  }
  return text;
}

template <class Vector>
std::vector<double> listedVector(const Vector& numbers) {
  return {numbers.begin(), numbers.end()};
}

}  // namespace

StabilityReport reportStability(const config::Arm& arm, const Eigen::VectorXd& joints) {
  const kinematics::CompliantModel model(arm.model);
  StabilityReport report;
  report.arm = arm.name;
  report.joints = joints;
  const kinematics::ModelStatus status = model.stability(joints, report.branch, report.stability);
  const int points = report.stability.conjugate_points;
  report.status = status != kinematics::ModelStatus::kOk ? std::string(describe(status))
                  : points > 0                           ? unstable(points)
                                                         : "ok";
  if (status != kinematics::ModelStatus::kOk)
    return report;
  report.equilibria = model.equilibria(joints);
  for (std::size_t k = 0; k < report.equilibria.size(); ++k) {
    if ((report.equilibria[k].branch.end_angle - report.branch.end_angle).cwiseAbs().maxCoeff() < kSame)
      report.here = static_cast<int>(k);
  }
  return report;
}

nlohmann::ordered_json toJson(const StabilityReport& report) {
  nlohmann::ordered_json json{{"arm", report.arm}, {"joints", listedVector(report.joints)}, {"status", report.status}};
  if (!report.branch.known)
    return json;
  const kinematics::Stability& s = report.stability;
  const Eigen::Index n = report.joints.size() / 2;
  json["stability"] = s.minimum;
  json["stability_at"] = s.at;
  json["conjugate_points"] = s.conjugate_points;
  json["gradient"] = listedVector(s.gradient);
  const bool bounded = std::isfinite(s.rotation_left);
  json["rotation_left"] = bounded ? nlohmann::ordered_json(s.rotation_left) : nlohmann::ordered_json(nullptr);
  json["rotation_tube"] = bounded ? nlohmann::ordered_json(s.rotation_tube + 1) : nlohmann::ordered_json(nullptr);
  json["rotation_sense"] = s.rotation_sense;
  json["equilibrium"] = report.here;
  json["equilibria"] = nlohmann::ordered_json::array();
  for (const kinematics::EquilibriumInfo& info : report.equilibria) {
    json["equilibria"].push_back({{"end_angles", listedVector(info.branch.end_angle.head(n))},
                                  {"winding", std::vector<int>(info.winding.begin(), info.winding.begin() + n)},
                                  {"energy", info.energy},
                                  {"stability", info.stability},
                                  {"conjugate_points", info.conjugate_points}});
  }
  return json;
}

std::string toText(const StabilityReport& report) {
  const Eigen::Index n = report.joints.size() / 2;
  std::string text = report.arm + " at beta " + list("%.3f", report.joints.head(n), 1e3) + " mm, alpha " +
                     list("%.3f", report.joints.tail(n), kDegrees) + " deg: " + report.status + "\n";
  if (!report.branch.known)
    return text;
  const kinematics::Stability& s = report.stability;
  text += format("stability         %.6f, least at s = %.2f mm%s\n", s.minimum, 1e3 * s.at,
                 s.at < 0.0 ? " (in the transmission)" : "");
  text += format("conjugate points  %d\n", s.conjugate_points);
  if (std::isfinite(s.rotation_left)) {
    text += format("rotation to snap  %.3f deg, tube %d in %s sense\n", kDegrees * s.rotation_left, s.rotation_tube + 1,
                   s.rotation_sense > 0 ? "positive" : "negative");
  } else {
    text += "rotation to snap  no turn of one tube alone makes the arm snap\n";
  }
  text += "gradient          by beta " + list("%.4g", s.gradient.head(n), 1e-3) + " 1/mm, by alpha " +
          list("%.4g", s.gradient.tail(n), 1.0 / kDegrees) + " 1/deg\n";
  text += "equilibria, by energy (* is where a cold start leads)\n";
  text += "    energy (mJ)  stability  conjugate points  windings  end angles (deg)\n";
  for (std::size_t k = 0; k < report.equilibria.size(); ++k) {
    const kinematics::EquilibriumInfo& info = report.equilibria[k];
    const std::vector<double> winding(info.winding.begin(), info.winding.begin() + n);
    text += format("  %s %11.4f  %9.5f  %16d  %-8s  ", static_cast<int>(k) == report.here ? "*" : " ",
                   1e3 * info.energy, info.stability, info.conjugate_points, list("%.0f", winding).c_str());
    text += list("%.3f", info.branch.end_angle.head(n), kDegrees) + "\n";
  }
  return text;
}

}  // namespace tandem::cli
