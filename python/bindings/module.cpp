// SPDX-License-Identifier: Apache-2.0
#include "python/bindings/bind.h"

PYBIND11_MODULE(_tandem, module) {
  module.doc() =
      "Models, control, simulation, planning, recordings and running robots of Tandem. SI units; numpy in, numpy out.";
  tandem::python::bindRobot(module);
  tandem::python::bindTrajectory(module);
  tandem::python::bindController(module);
  tandem::python::bindSimulator(module);
  tandem::python::bindPlanner(module);
  tandem::python::bindRecording(module);
  tandem::python::bindClient(module);
}
