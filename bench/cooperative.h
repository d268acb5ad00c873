// SPDX-License-Identifier: Apache-2.0
/** @file Benchmark of the models of cooperating catheters. */
#pragma once

namespace tandem::bench {

/// Registers them beside the arm models of the same program.
void enrollCooperative();

}  // namespace tandem::bench
