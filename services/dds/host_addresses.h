// SPDX-License-Identifier: Apache-2.0
/** @file Network addresses of this machine. */
#pragma once

#include <set>
#include <string>

namespace tandem::dds {

/// IPv4 addresses of all interfaces, "127.0.0.1" among them. Empty if the system call fails.
std::set<std::string> hostAddresses();

}  // namespace tandem::dds
