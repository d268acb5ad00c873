// SPDX-License-Identifier: Apache-2.0
#include "python/bindings/bind.h"

PYBIND11_MODULE(_tandem, module) {
  module.doc() =
      "Models, control, simulation, planning, recordings and running robots of Tandem. SI units; numpy in, numpy out.";
  module.attr("__version__") = TANDEM_VERSION;
  module.attr("_supports_numpy_2") = PYBIND11_VERSION_HEX >= 0x020C0000;
  tandem::python::bindRobot(module);
  tandem::python::bindTrajectory(module);
  tandem::python::bindController(module);
  tandem::python::bindSimulator(module);
  tandem::python::bindPlanner(module);
  tandem::python::bindRecording(module);
  tandem::python::bindClient(module);
}
