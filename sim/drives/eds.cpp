// SPDX-License-Identifier: Apache-2.0
#include "sim/drives/eds.h"

#include <sstream>

#include "sim/drives/detail/builtin_eds.h"

namespace tandem::sim::drives {
namespace {

Eds builtIn(std::string_view text, const std::string& name) {
  std::istringstream in{std::string(text)};
  return hal::canopen::parseEds(in, name);
}

}  // namespace

const Eds& driveEds() {
  static const Eds eds = builtIn(kDriveEds, "tandem-drive.eds");
  return eds;
}

const Eds& encoderEds() {
  static const Eds eds = builtIn(kEncoderEds, "tandem-encoder.eds");
  return eds;
}

}  // namespace tandem::sim::drives
