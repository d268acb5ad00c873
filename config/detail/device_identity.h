// SPDX-License-Identifier: Apache-2.0
/** @file Fields of the identity of a CANopen device, object 0x1018. */
#pragma once

#include <string>
#include <vector>

#include "config/detail/bind.h"
#include "hal/hardware.h"

namespace tandem::config {

/// A number of object 0x1018.
template <class... Path>
Field deviceNumber(const std::string& name, const std::string& description, Path... path) {
  return text(name, description, path...)
      .orInteger()
      .matching("^(0x[0-9A-Fa-f]{1,8}|[0-9]{1,10})$", "a number below 2^32, decimal or 0x...");
}

template <class Owner>
Field identityNumber(const std::string& name,
                     const std::string& description,
                     std::uint32_t hal::DeviceIdentity::*number) {
  return deviceNumber(name, description, &Owner::identity, number).defaultNote("not checked");
}

template <class Owner>
std::vector<Field> identityFields() {
  return {
      identityNumber<Owner>("vendor", "vendor id, object 0x1018:1", &hal::DeviceIdentity::vendor),
      identityNumber<Owner>("product", "product code, object 0x1018:2", &hal::DeviceIdentity::product),
      identityNumber<Owner>("revision", "revision number, object 0x1018:3", &hal::DeviceIdentity::revision),
  };
}

}  // namespace tandem::config
