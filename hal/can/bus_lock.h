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

/** Lock of a bus for the lifetime of the object; the kernel releases it when the process ends, for any reason.
 *
 * The lock is advisory: it does not prevent opening the bus, so that listening tools and simulated drives need none. It
 * is an abstract AF_UNIX socket: no file, no write permission needed, and visible in one network namespace, like CAN
 * interfaces. A CAN interface is identified by its index, the socket of a bus by the location of its file: two names of
 * one bus are one lock. */
class BusLock {
 public:
  /// @param address as of openBus(). @throw BusTaken if another process has the lock, std::system_error if there is no
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
