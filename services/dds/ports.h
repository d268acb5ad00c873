// SPDX-License-Identifier: Apache-2.0
/** @file UDP ports of a domain, by the default rule of RTPS. */
#pragma once

namespace tandem::dds {

/// The first port of a domain.
constexpr int firstPort(int domain) { return 7400 + 250 * domain; }

/// Discovery port of a participant of this machine, counted from 0.
constexpr int discoveryPort(int domain, int participant) { return firstPort(domain) + 10 + 2 * participant; }

}  // namespace tandem::dds
