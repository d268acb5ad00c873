// SPDX-License-Identifier: Apache-2.0
/** @file A library for another version of the interface. */
#include "hal/fieldbus.h"

// NOLINTNEXTLINE(readability-identifier-naming): a name of C
extern "C" const tandem::hal::FieldbusLibrary* tandem_fieldbus();
extern "C" const tandem::hal::FieldbusLibrary* tandem_fieldbus() {
  static const tandem::hal::FieldbusLibrary library{.version = 0};
  return &library;
}
