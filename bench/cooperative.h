// SPDX-License-Identifier: Apache-2.0
/** @file Benchmark of the models of cooperating catheters. */
#pragma once

namespace tandem::bench {

/// Registers them in the program of the arm models.
void enrollCooperative();

}  // namespace tandem::bench
