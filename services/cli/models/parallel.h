// SPDX-License-Identifier: Apache-2.0
/** @file Parallel loop over many items, with a progress line. */
#pragma once

#include <cstddef>
#include <functional>
#include <string>

namespace tandem::cli {

/** Calls body(0) ... body(count - 1) once each, on several threads, in no order; stderr shows progress and how
 * long it will still take: a bar on a terminal, else a line each 30 s.
 * @param threads  how many; 0: one per core
 * @param label  of the progress line
 * @throw what the first body that failed threw; the others are then not all called. */
void parallelFor(std::size_t count,
                 int threads,
                 const std::string& label,
                 const std::function<void(std::size_t)>& body);

}  // namespace tandem::cli
