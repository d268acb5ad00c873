// SPDX-License-Identifier: Apache-2.0
/** @file Data sheets of the simulated devices. */
#pragma once

#include "hal/canopen/eds.h"

namespace tandem::sim::drives {

using hal::canopen::Access;
using hal::canopen::DataType;
using hal::canopen::Eds;
using hal::canopen::EdsObject;
using hal::canopen::ObjectAddress;

/// Built-in data sheets, read once.
const Eds& driveEds();
const Eds& encoderEds();

}  // namespace tandem::sim::drives
