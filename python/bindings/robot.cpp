// SPDX-License-Identifier: Apache-2.0
#include "python/bindings/robot.h"

#include <pybind11/stl.h>

#include <limits>
#include <numeric>
#include <random>

#include "config/arm_names.h"
#include "planning/joint_sampler.h"
#include "python/bindings/bind.h"
#include "robots/robot_type.h"

namespace tandem::python {
namespace {

using kinematics::ModelStatus;
using Matrix4 = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/** One arm with a kinematic model. */
class Arm {
 public:
  Arm(const Robot& robot, int index, const std::string& model)
      : robot_((robot.tubes(), robot.file)),
        index_(static_cast<std::size_t>(index)),
        name_of_model_(model),
        model_(robots::typeOf(*robot_).makeModel(*robot_, index, model)) {}

  const config::Arm& file() const { return robot_->arms[index_]; }
  const std::string& modelName() const { return name_of_model_; }
  int joints() const { return file().limits.jointCount(); }

  /// Tip results for each row of q, filled in by `write`; `shape` is that of one result.
  template <class Write>
  Array tips(const Array& q,
             const py::object& wrench,
             const std::string& errors,
             int threads,
             const std::vector<py::ssize_t>& shape,
             Write write) const {
    const std::optional<kinematics::Wrench> load = loadOf(wrench);
    return answers(q, errors, threads, shape, [&](const auto& joints_of_row, double* out) {
      kinematics::LoadedTip tip;
      kinematics::Branch branch;
      const ModelStatus status =
          load ? model_->loadedTip(joints_of_row, *load, branch, tip) : model_->tip(joints_of_row, branch, tip);
      if (status == ModelStatus::kOk)
        write(tip, out);
      return status;
    });
  }

  /// Results for each backbone point, filled in by `write`; `of_point` is the shape of one.
  template <class Write>
  Array shapes(const Array& q,
               int points,
               const std::string& errors,
               int threads,
               std::vector<py::ssize_t> of_point,
               Write write) const {
    if (points < 2)
      throw py::value_error("points: found " + std::to_string(points) + ", expected 2 or more");
    const std::size_t size = product(of_point);
    of_point.insert(of_point.begin(), points);
    return answers(q, errors, threads, of_point, [&](const auto& joints_of_row, double* out) {
      std::vector<kinematics::ShapePoint> shape;
      const ModelStatus status = model_->shape(joints_of_row, points, shape);
      for (std::size_t p = 0; status == ModelStatus::kOk && p < shape.size(); ++p)
        write(shape[p], out + p * size);
      return status;
    });
  }

  py::object withinLimits(const Array& q, double tolerance) const {
    const Rows rows(q, joints(), "q");
    if (q.ndim() == 1)
      return py::bool_(violation(rows[0]) <= tolerance);
    py::array_t<bool> inside(static_cast<py::ssize_t>(rows.count()));
    for (std::size_t i = 0; i < rows.count(); ++i)
      inside.mutable_data()[i] = violation(rows[i]) <= tolerance;
    return inside;
  }

  /// NaN, which compares as outside, if a joint is not finite.
  double violation(const Eigen::Ref<const Eigen::VectorXd>& q) const {
    return q.allFinite() ? safety::largestViolation(file().limits, q) : kNan;
  }

  Array sample(int count, std::uint64_t seed) const {
    if (count < 0)
      throw py::value_error("count: found " + std::to_string(count) + ", expected 0 or more");
    std::mt19937_64 engine(seed);
    const planning::JointSampler sampler(file().limits);
    Array joint_vectors({static_cast<py::ssize_t>(count), static_cast<py::ssize_t>(joints())});
    for (int i = 0; i < count; ++i)
      Eigen::Map<Eigen::VectorXd>(joint_vectors.mutable_data() + i * joints(), joints()) = sampler.random(engine);
    return joint_vectors;
  }

  template <class Member>
  Array ofJoints(Member member) const {
    Eigen::VectorXd values(joints());
    for (int j = 0; j < joints(); ++j)
      values[j] = file().limits.joints[static_cast<std::size_t>(j)].*member;
    return toArray(values);
  }

  py::tuple coupledRows() const {
    const auto count = static_cast<Eigen::Index>(file().limits.rows.size());
    RowMajor a(count, joints());
    Eigen::VectorXd b(count);
    for (Eigen::Index i = 0; i < count; ++i) {
      a.row(i) = file().limits.rows[static_cast<std::size_t>(i)].a;
      b[i] = file().limits.rows[static_cast<std::size_t>(i)].b;
    }
    return py::make_tuple(toArray(a), toArray(b));
  }

 private:
  static std::size_t product(const std::vector<py::ssize_t>& shape) {
    return std::accumulate(shape.begin(), shape.end(), std::size_t{1},
                           [](std::size_t all, py::ssize_t n) { return all * static_cast<std::size_t>(n); });
  }

  /// One result of this shape per row; NaN if `answer(row, out)` returns another status than kOk.
  template <class Answer>
  Array answers(const Array& q,
                const std::string& errors,
                int threads,
                const std::vector<py::ssize_t>& shape,
                Answer answer) const {
    const Rows rows(q, joints(), "q");
    const OnError on_error = onErrorFromName(errors);
    Array all = rows.answers(shape);
    const std::size_t size = product(shape);
    double* const out = all.mutable_data();
    answerRows(rows.count(), threads, on_error, [&](std::size_t i) {
      const ModelStatus status = answer(rows[i], out + i * size);
      if (status != ModelStatus::kOk)
        std::fill_n(out + i * size, size, kNan);
      return status;
    });
    return all;
  }

  static std::optional<kinematics::Wrench> loadOf(const py::object& wrench) {
    if (wrench.is_none())
      return std::nullopt;
    return kinematics::Wrench(Rows(py::cast<Array>(wrench), 6, "wrench")[0]);
  }

  std::shared_ptr<const config::Robot> robot_;
  std::size_t index_;
  std::string name_of_model_;
  std::unique_ptr<kinematics::ArmModel> model_;
};

void writePose(const Eigen::Isometry3d& pose, double* out) { Eigen::Map<Matrix4>{out} = pose.matrix(); }

constexpr const char* kBatch =
    "\n\nq: joints [beta_1..beta_n, alpha_1..alpha_n], m and rad, shape (2n,) or (N, 2n). errors: 'raise', or 'nan' "
    "for rows without a solution of the model. threads: 0 is one per core.";

void bindArm(py::module_& module) {
  using namespace py::literals;
  const auto text = [](const std::string& words) { return py::str(words + kBatch).cast<std::string>(); };
  static const std::string forward = text(
      "Tip pose in the robot base frame: (4, 4) or (N, 4, 4), m. wrench: force (N) "
      "and moment (N m) at the tip, base frame, shape (6,); compliant models only.");
  static const std::string jacobian = text(
      "Velocity of the tip per joint velocity, rows linear (m/s) then angular "
      "(rad/s), base frame: (6, 2n) or (N, 6, 2n). Exact, at equilibrium.");
  static const std::string shape = text(
      "Backbone from the entry point to the tip, m, base frame: (points, 3) or (N, "
      "points, 3), evenly spaced by arc length.");
  static const std::string frames = text("Backbone frames: (points, 4, 4) or (N, points, 4, 4); z along the backbone.");
  static const std::string stability = text(
      "Smallest value along the arm of the determinant that vanishes where it "
      "snaps: 1 where nothing interacts. A number, or (N,).");
  static const std::string compliance = text(
      "Twist of the tip per wrench at the tip, (6, 6) or (N, 6, 6): linear and "
      "force first. Compliant models only.");
  py::class_<Arm>(module, "Arm", "One arm of a Robot, with a kinematic model.")
      .def_property_readonly(
          "name", [](const Arm& a) { return a.file().name; }, "As the robot file names it.")
      .def_property_readonly("model", &Arm::modelName, "'rigid' or 'compliant'.")
      .def_property_readonly("joint_count", &Arm::joints, "2n.")
      .def_property_readonly(
          "tube_count", [](const Arm& a) { return a.file().model.tubeCount(); }, "n.")
      .def_property_readonly(
          "home", [](const Arm& a) { return toArray(a.file().home); }, "Joints at home, m and rad.")
      .def_property_readonly(
          "lower", [](const Arm& a) { return a.ofJoints(&safety::JointLimit::lower); },
          "Smallest joint positions, m and rad.")
      .def_property_readonly(
          "upper", [](const Arm& a) { return a.ofJoints(&safety::JointLimit::upper); },
          "Largest joint positions, m and rad.")
      .def_property_readonly(
          "velocity_limit", [](const Arm& a) { return a.ofJoints(&safety::JointLimit::velocity); },
          "Largest joint speeds, m/s and rad/s.")
      .def_property_readonly("coupled_limits", &Arm::coupledRows,
                             "(A, b): neighbouring tubes keep A q <= b, m (equation (1) of Alsaka et al. 2024).")
      .def(
          "forward",
          [](const Arm& a, const Array& q, const py::object& wrench, const std::string& errors, int threads) {
            return a.tips(q, wrench, errors, threads, {4, 4},
                          [](const kinematics::Tip& tip, double* out) { writePose(tip.pose, out); });
          },
          "q"_a, py::kw_only(), "wrench"_a = py::none(), "errors"_a = "raise", "threads"_a = 0, forward.c_str())
      .def(
          "jacobian",
          [](const Arm& a, const Array& q, const py::object& wrench, const std::string& errors, int threads) {
            return a.tips(q, wrench, errors, threads, {6, a.joints()}, [](const kinematics::Tip& tip, double* out) {
              Eigen::Map<RowMajor>(out, 6, tip.jacobian.cols()) = tip.jacobian;
            });
          },
          "q"_a, py::kw_only(), "wrench"_a = py::none(), "errors"_a = "raise", "threads"_a = 0, jacobian.c_str())
      .def(
          "compliance",
          [](const Arm& a, const Array& q, const py::object& wrench, const std::string& errors, int threads) {
            const py::object load = wrench.is_none() ? toArray(kinematics::Wrench::Zero()) : wrench;
            return a.tips(q, load, errors, threads, {6, 6}, [](const kinematics::LoadedTip& tip, double* out) {
              Eigen::Map<RowMajor>(out, 6, 6) = tip.compliance;
            });
          },
          "q"_a, py::kw_only(), "wrench"_a = py::none(), "errors"_a = "raise", "threads"_a = 0, compliance.c_str())
      .def(
          "stability",
          [](const Arm& a, const Array& q, const std::string& errors, int threads) -> py::object {
            Array values = a.tips(q, py::none(), errors, threads, {},
                                  [](const kinematics::Tip& tip, double* out) { *out = tip.stability; });
            return values.ndim() == 0 ? py::object(py::float_(*values.data())) : std::move(values);
          },
          "q"_a, py::kw_only(), "errors"_a = "raise", "threads"_a = 0, stability.c_str())
      .def(
          "shape",
          [](const Arm& a, const Array& q, int points, const std::string& errors, int threads) {
            return a.shapes(q, points, errors, threads, {3}, [](const kinematics::ShapePoint& point, double* out) {
              Eigen::Map<Eigen::Vector3d>{out} = point.pose.translation();
            });
          },
          "q"_a, "points"_a = 50, py::kw_only(), "errors"_a = "raise", "threads"_a = 0, shape.c_str())
      .def(
          "frames",
          [](const Arm& a, const Array& q, int points, const std::string& errors, int threads) {
            return a.shapes(q, points, errors, threads, {4, 4},
                            [](const kinematics::ShapePoint& point, double* out) { writePose(point.pose, out); });
          },
          "q"_a, "points"_a = 50, py::kw_only(), "errors"_a = "raise", "threads"_a = 0, frames.c_str())
      .def("within_limits", &Arm::withinLimits, "q"_a, py::kw_only(), "tolerance"_a = 0.0,
           "Whether joints, (2n,) or (N, 2n), are inside boxes and coupled limits, up to a tolerance in m or rad.")
      .def("sample", &Arm::sample, "count"_a, "seed"_a = 1, "Random joints inside all limits, (count, 2n).")
      .def("__repr__", [](const Arm& a) {
        return "<tandem.Arm " + a.file().name + ": " + std::to_string(a.joints()) + " joints, " + a.modelName() +
               " model>";
      });
}

}  // namespace

void checkModel(const std::string& model) {
  if (model != "rigid" && model != "compliant")
    throw py::value_error("model: found '" + model + "', expected 'rigid' or 'compliant'");
}

const config::Robot& Robot::tubes() const {
  if (const std::string why = refusal(*file, robots::Capability::kTips); !why.empty())
    throw py::value_error(why);
  return *file;
}

int Robot::indexOf(const std::string& arm) const {
  if (const auto k = config::findArm(*file, arm))
    return static_cast<int>(*k);
  throw py::key_error("arm: found '" + arm + "', expected one of " + config::armNames(*file));
}

int Robot::jointCount() const {
  int count = 0;
  for (const config::Arm& arm : file->arms)
    count += arm.limits.jointCount();
  return count;
}

safety::RobotVector Robot::stack(const py::object& joints, const std::string& name) const {
  if (py::isinstance<py::dict>(joints) || (py::isinstance<py::sequence>(joints) && !py::isinstance<py::array>(joints) &&
                                           py::len(joints) == file->arms.size() && file->arms.size() > 1)) {
    safety::RobotVector all(jointCount());
    int at = 0;
    for (std::size_t k = 0; k < file->arms.size(); ++k) {
      const int size = file->arms[k].limits.jointCount();
      const std::string& arm = file->arms[k].name;
      const py::object one = py::isinstance<py::dict>(joints) ? joints[py::str(arm)] : joints[py::int_(k)];
      all.segment(at, size) = Rows(py::cast<Array>(one), size, name + " of " + arm)[0];
      at += size;
    }
    return all;
  }
  const Array array = py::cast<Array>(joints);
  if (array.ndim() != 1)
    throw py::value_error(name + ": expected one vector with the joints of all arms, or one vector per arm");
  return Rows(array, jointCount(), name)[0];
}

std::vector<Eigen::VectorXd> Robot::split(const safety::RobotVector& joints) const {
  std::vector<Eigen::VectorXd> arms;
  int at = 0;
  for (const config::Arm& arm : file->arms) {
    arms.emplace_back(joints.segment(at, arm.limits.jointCount()));
    at += arm.limits.jointCount();
  }
  return arms;
}

safety::RobotVector Robot::home() const {
  safety::RobotVector all(jointCount());
  int at = 0;
  for (const config::Arm& arm : file->arms) {
    all.segment(at, arm.home.size()) = arm.home;
    at += static_cast<int>(arm.home.size());
  }
  return all;
}

void bindRobot(py::module_& module) {
  using namespace py::literals;
  py::register_exception<ModelError>(module, "ModelError", PyExc_ArithmeticError).attr("__doc__") =
      "A kinematic model has no solution at these joints.";
  py::register_exception<config::Error>(module, "ConfigError", PyExc_ValueError).attr("__doc__") =
      "A file or text is refused: FILE:LINE:COLUMN: KEY: found ..., expected ...";
  bindArm(module);
  py::class_<Robot>(module, "Robot", "A robot file: arms, limits, parameters of the methods.")
      .def_static(
          "load", [](const std::string& name_or_path) { return Robot(name_or_path); }, "name_or_path"_a,
          "Loads a preset ('ark2024') or a file. ConfigError names file, line, key, what was found and what was "
          "expected.")
      .def_property_readonly(
          "name", [](const Robot& r) { return r.file->name; }, "As its file names it.")
      .def_property_readonly(
          "file", [](const Robot& r) { return r.file->file.string(); }, "Path of its file.")
      .def_property_readonly(
          "warnings", [](const Robot& r) { return r.file->warnings; },
          "What its file has that is unusual, with line and key.")
      .def_property_readonly("joint_count", &Robot::jointCount, "Joints of all arms.")
      .def_property_readonly(
          "home", [](const Robot& r) { return toArray(r.home()); }, "Joints of all arms at home.")
      .def_property_readonly(
          "arms",
          [](const Robot& r) {
            std::vector<std::string> names;
            for (const config::Arm& arm : r.file->arms)
              names.push_back(arm.name);
            return names;
          },
          "Names of the arms, in the order of stacked joint vectors.")
      .def(
          "arm",
          [](const Robot& r, const std::string& name, const std::string& model) {
            checkModel(model);
            return std::make_unique<Arm>(r, r.indexOf(name), model);
          },
          "name"_a, py::kw_only(), "model"_a = "rigid",
          "An arm by its name, 'arm_a' or 'a', with a 'rigid' or 'compliant' model.")
      .def("__repr__", [](const Robot& r) {
        return "<tandem.Robot " + r.file->name + ": " + std::to_string(r.file->arms.size()) + " arms>";
      });
}

}  // namespace tandem::python
