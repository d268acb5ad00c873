// SPDX-License-Identifier: Apache-2.0
#include <dlfcn.h>

#include <algorithm>
#include <stdexcept>
#include <string>

#include "services/hal/bus_setup.h"

namespace tandem::hal_service {

std::unique_ptr<hal::Fieldbus> openLibrary(const hal::HardwareConfig& hardware, int bus) {
  constexpr std::string_view kScheme = hal::kLibraryScheme;
  const std::string& address = hardware.buses.at(static_cast<std::size_t>(bus)).address;
  const std::string path = address.substr(kScheme.size(), address.find(',') - kScheme.size());
  const auto refuse = [&](const std::string& why) -> std::runtime_error {
    return std::runtime_error(path + ": " + why);
  };
  void* const handle = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (handle == nullptr)
    throw std::runtime_error(dlerror());  // names the file
  using Entry = const hal::FieldbusLibrary* (*)();
  const auto entry = reinterpret_cast<Entry>(dlsym(handle, "tandem_fieldbus"));
  const hal::FieldbusLibrary* const library = entry == nullptr ? nullptr : entry();
  if (library == nullptr)
    throw refuse("found no function tandem_fieldbus that returns a bus, expected one (docs/own-hardware.md)");
  const hal::FieldbusLibrary own;
  if (library->version != own.version || !std::ranges::equal(library->sizes, own.sizes))
    throw refuse("found a library for another version of tandem-hal (interface " + std::to_string(library->version) +
                 ", expected " + std::to_string(own.version) + "): compile it with the headers of this one");
  std::unique_ptr<hal::Fieldbus> opened(library->open == nullptr ? nullptr : library->open(hardware, bus));
  if (opened == nullptr)
    throw refuse("its function open returned no bus for " + hardware.buses[static_cast<std::size_t>(bus)].name +
                 ", expected one (docs/own-hardware.md)");
  return opened;
}

}  // namespace tandem::hal_service
