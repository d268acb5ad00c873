// SPDX-License-Identifier: Apache-2.0
/** @file Python classes Robot and Arm. */
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "config/robot_files.h"
#include "python/bindings/rows.h"
#include "robots/robot_model.h"

namespace tandem::python {

/** A robot file. */
struct Robot {
  explicit Robot(const std::string& name_or_path)
      : file(std::make_shared<const config::Robot>(
            config::loadAnyRobot(config::findFile(name_or_path, config::robotKinds())))) {}

  /// A robot of any type, already loaded.
  explicit Robot(std::shared_ptr<const config::Robot> loaded) : file(std::move(loaded)) {}

  /// The file, for robots with independent tips. @throw py::value_error without robots::Capability::kTips
  const config::Robot& tubes() const;
  /// Index of an arm by its name, with or without "arm_". @throw py::key_error
  int indexOf(const std::string& arm) const;
  int jointCount() const;
  /// Joints of all arms from one stacked vector, or from one vector per arm. @throw py::value_error
  safety::RobotVector stack(const py::object& joints, const std::string& name) const;
  std::vector<Eigen::VectorXd> split(const safety::RobotVector& joints) const;
  safety::RobotVector home() const;

  std::shared_ptr<const config::Robot> file;
};

/// "rigid" or "compliant". @throw py::value_error
void checkModel(const std::string& model);

/// A numpy array of an Eigen object, 1-D for vectors.
template <class Derived>
Array toArray(const Eigen::MatrixBase<Derived>& m) {
  if constexpr (Derived::IsVectorAtCompileTime) {
    Array array(m.size());
    Eigen::Map<Eigen::VectorXd>(array.mutable_data(), m.size()) = m;
    return array;
  } else {
    Array array({m.rows(), m.cols()});
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    Eigen::Map<RowMajor>(array.mutable_data(), m.rows(), m.cols()) = m;
    return array;
  }
}

}  // namespace tandem::python
