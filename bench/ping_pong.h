// SPDX-License-Identifier: Apache-2.0
/** @file Message ping-pong between two processes over plain Fast DDS: baseline for Tandem's round trip. */
#pragma once

#include <cstddef>
#include <vector>

namespace tandem::bench {

/** Sends `there` bytes to a separate process that answers with `back` bytes, with the transport of services/dds in
 * lock-step: UDP on loopback, reliable, in order, no shared memory. Each side answers on the thread of the listener.
 * @return times of the round trips, us, in order. @throw std::runtime_error without an answer. */
std::vector<double> pingPong(int domain, std::size_t there, std::size_t back, int trips);

}  // namespace tandem::bench
