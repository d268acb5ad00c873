// SPDX-License-Identifier: Apache-2.0
/** @file Factory functions of all methods, used by resolver.cpp, and entry points for benchmarks. */
#pragma once

#include <memory>

#include "control/resolver.h"

namespace tandem::control {

std::unique_ptr<Resolver> makeNsp(const MethodParameters& parameters);
std::unique_ptr<Resolver> makeNspwln(const MethodParameters& parameters);
std::unique_ptr<Resolver> makeNspwlnJoint(const MethodParameters& parameters);
std::unique_ptr<Resolver> makeNspqp(const MethodParameters& parameters);
std::unique_ptr<Resolver> makeSnsqp(const MethodParameters& parameters);
std::unique_ptr<Resolver> makeSns(const MethodParameters& parameters);
std::unique_ptr<Resolver> makeHqp(const MethodParameters& parameters);

/// Whether a method solves quadratic programs, so that MethodParameters::backend affects its time.
constexpr bool solvesProgrammes(Method method) {
  return method == Method::kNspqp || method == Method::kSnsqp || method == Method::kHqp;
}

}  // namespace tandem::control
