// SPDX-License-Identifier: Apache-2.0
/** @file Common main() of all benchmark programs. */
#include "bench/enroll.h"

namespace tandem::bench {

void enroll(const std::string& name, const std::function<void(benchmark::State&)>& function) {
  benchmark::RegisterBenchmark(name.c_str(), function)->UseManualTime()->Unit(benchmark::kMicrosecond)->Iterations(5);
}

}  // namespace tandem::bench

int main(int argc, char** argv) {
  tandem::bench::enrollAll();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv))
    return 2;
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}
