// SPDX-License-Identifier: Apache-2.0
/** @file Factories of the methods, one per source file. Used by resolver.cpp alone. */
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

}  // namespace tandem::control
