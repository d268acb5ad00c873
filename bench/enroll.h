// SPDX-License-Identifier: Apache-2.0
/** @file Registration of the benchmarks of one source file with the benchmark program. */
#pragma once

#include <benchmark/benchmark.h>

#include <functional>
#include <string>

namespace tandem::bench {

/// Registers every benchmark of this program. Defined once per program.
void enrollAll();

/// Registers one benchmark. The function measures its calls itself, in five passes over the same work, for Percentiles.
void enroll(const std::string& name, const std::function<void(benchmark::State&)>& function);

}  // namespace tandem::bench
