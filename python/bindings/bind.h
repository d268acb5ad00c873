// SPDX-License-Identifier: Apache-2.0
/** @file Registration functions of the module `tandem`, one per file. */
#pragma once

#include <pybind11/pybind11.h>

namespace tandem::python {

void bindRobot(pybind11::module_& module);       ///< Robot, Arm
void bindTrajectory(pybind11::module_& module);  ///< Trajectory
void bindController(pybind11::module_& module);  ///< relative(), tip(), Controller
void bindSimulator(pybind11::module_& module);   ///< Simulator, run()
void bindPlanner(pybind11::module_& module);     ///< Planner
void bindRecording(pybind11::module_& module);   ///< Recording
void bindClient(pybind11::module_& module);      ///< Client

}  // namespace tandem::python
