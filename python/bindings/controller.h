// SPDX-License-Identifier: Apache-2.0
/** @file Parameters of a control step from keyword arguments. */
#pragma once

#include "experiments/simulated_robot.h"
#include "python/bindings/robot.h"

namespace tandem::python {

/// "nspqp" ... @throw py::value_error that lists the methods.
control::Method methodFrom(const std::string& name);

/// The robot's parameters, with those given: period, bounds, backend, and the numbers of control::kTunableParameters.
/// @throw py::value_error or py::type_error with the argument, the value found and the one expected.
control::MethodParameters parametersFrom(const Robot& robot, double period, const py::kwargs& options);

}  // namespace tandem::python
