// SPDX-License-Identifier: Apache-2.0
#include "python/bindings/trajectory.h"

#include "config/arm_names.h"
#include "config/config.h"
#include "python/bindings/bind.h"
#include "python/bindings/robot.h"

namespace tandem::python {
namespace {

Eigen::Vector3d point(const Array& array, const std::string& name) { return Rows(array, 3, name)[0]; }

py::tuple samples(const Trajectory& trajectory, const Array& tip, const Array& relative) {
  const auto points = planning::sample(trajectory.spec.ofPositions(), {point(tip, "tip"), point(relative, "relative")});
  const auto count = static_cast<py::ssize_t>(points.size());
  Array tips({count, py::ssize_t{3}}), relatives({count, py::ssize_t{3}});
  for (std::size_t i = 0; i < points.size(); ++i) {
    Eigen::Map<Eigen::Vector3d>(tips.mutable_data() + 3 * i) = points[i].tip;
    Eigen::Map<Eigen::Vector3d>(relatives.mutable_data() + 3 * i) = points[i].relative;
  }
  return py::make_tuple(tips, relatives);
}

}  // namespace

planning::TrajectorySpec Trajectory::of(const config::Robot& robot) const {
  planning::TrajectorySpec found = spec;
  if (const std::string wrong = config::findArms(found, robot); !wrong.empty())
    throw py::value_error("trajectory " + spec.name + ": " + wrong);
  return found;
}

void bindTrajectory(py::module_& module) {
  using namespace py::literals;
  py::class_<Trajectory>(module, "Trajectory", "Trajectory of a tip, and of the relative position of two tips.")
      .def_static(
          "load",
          [](const std::string& name_or_path) {
            return Trajectory{config::loadTrajectory(config::findFile(name_or_path, "trajectory"))};
          },
          "name_or_path"_a, "Loads a preset ('circle') or a file.")
      .def_static(
          "parse", [](const std::string& text) { return Trajectory{config::parseTrajectory(text, "text", {})}; },
          "text"_a, "Reads YAML text, as a file would hold it; it cannot name CSV files.")
      .def_property_readonly(
          "name", [](const Trajectory& t) { return t.spec.name; }, "As its file names it.")
      .def_property_readonly(
          "point_count", [](const Trajectory& t) { return t.spec.point_count; }, "Points after the start.")
      .def_property_readonly(
          "tolerance", [](const Trajectory& t) { return t.spec.tolerance; }, "m.")
      .def("points", &samples, "tip"_a, "relative"_a,
           "(tips, relatives), (points, 3) each, m: its points from a start of tip and relative position.")
      .def(
          "to_yaml", [](const Trajectory& t) { return config::formatTrajectory(t.spec); },
          "As text that parse() reads.")
      .def("__repr__", [](const Trajectory& t) {
        return "<tandem.Trajectory " + t.spec.name + ": " + std::to_string(t.spec.point_count) + " points>";
      });
}

}  // namespace tandem::python
