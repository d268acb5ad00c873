// SPDX-License-Identifier: Apache-2.0
/** @file Bus lock: at most one commanding process per bus on this host. */
#pragma once

#include <stdexcept>
#include <string>

namespace tandem::hal::can {

/** Another process of this host commands the bus. */
struct BusTaken : std::runtime_error {
  BusTaken(const std::string& what, int process) : std::runtime_error(what), holder(process) {}
  int holder;  ///< its process id; 0: not known, or of another pid namespace
};

/** Holds the lock of a bus as long as it lives; the kernel gives it back when the process dies, however it dies.
 *
 * An agreement between masters: it hinders nobody from opening the bus, so that tools that listen, and simulated
 * drives, take none. It is an abstract AF_UNIX socket: no file, no right to write anywhere, and seen by all of one
 * network namespace, as CAN interfaces are. A CAN interface is known by its index, the socket of a bus by the place of
 * its file: two names of one bus are one lock. */
class BusLock {
 public:
  /// @param address as of openBus(). @throw BusTaken where somebody else has it, std::system_error where there is no
  /// such bus or the kernel refuses.
  explicit BusLock(const std::string& address);
  ~BusLock();
  BusLock(BusLock&& other) noexcept;
  BusLock& operator=(BusLock&&) = delete;
  BusLock(const BusLock&) = delete;
  BusLock& operator=(const BusLock&) = delete;

 private:
  int fd_ = -1;
};

}  // namespace tandem::hal::can
