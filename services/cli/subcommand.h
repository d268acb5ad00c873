// SPDX-License-Identifier: Apache-2.0
/** @file Subcommands of `tandem`: registration and shared helpers. */
#pragma once

#include <CLI/CLI.hpp>

#include "services/client/arguments.h"
#include "services/client/number_checks.h"

namespace tandem::cli {

using client::answer, client::Failure, client::guarded, client::openInput, client::shareFile, client::since,
    client::statusField;
using client::kFailure, client::kOk, client::kUsage;

/** Registers a subcommand's options with `app`; the callback of the subcommand sets `exit_code`. */
using Register = void(CLI::App& app, int& exit_code);
Register registerFk, registerSolve, registerValidate, registerTopics, registerStatus, registerUp, registerExperiment,
    registerRobot, registerSchema, registerStability, registerWorkspace, registerPlan, registerCan, registerHome,
    registerJog, registerDoctor, registerSecurity, registerUnits, registerRecord, registerInfo, registerReplay,
    registerExport, registerPlot, registerConsole, registerTeleop, registerMonteCarlo, registerPresets, registerNew,
    registerShow, registerCompletion, registerConformance, registerCommission;

}  // namespace tandem::cli
