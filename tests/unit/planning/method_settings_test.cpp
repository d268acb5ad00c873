// SPDX-License-Identifier: Apache-2.0
#include "planning/method_settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tandem::test {
namespace {

using planning::MethodSettings;

std::string refusal(const std::string& name, const std::string& text) {
  MethodSettings settings;
  const auto before = settings.values();
  try {
    settings.set(name, text);
  } catch (const std::invalid_argument& error) {
    EXPECT_EQ(settings.values(), before) << "a refused value changes nothing";
    return error.what();
  }
  return "";
}

TEST(MethodSettings, AreRestoredExactlyFromTheirValues) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 dice(seed);
  std::uniform_real_distribution<double> decades(-300.0, 300.0);
  for (int round = 0; round < 100; ++round) {
    MethodSettings settings;
    settings.parameters.bounds = round % 2 == 0 ? control::BoundsKind::kCoupled : control::BoundsKind::kFrozen;
    settings.gains = {std::pow(10.0, decades(dice)), std::pow(10.0, decades(dice))};
    for (const control::TunableParameter& parameter : control::kTunableParameters)
      settings.parameters.*parameter.member = std::pow(10.0, decades(dice));
    MethodSettings restored;
    for (const auto& [name, text] : settings.values())
      restored.set(name, text);
    EXPECT_EQ(restored.parameters.bounds, settings.parameters.bounds);
    EXPECT_EQ(restored.gains.relative, settings.gains.relative);
    EXPECT_EQ(restored.gains.tip, settings.gains.tip);
    for (const control::TunableParameter& parameter : control::kTunableParameters)
      EXPECT_EQ(restored.parameters.*parameter.member, settings.parameters.*parameter.member) << parameter.name;
  }
}

TEST(MethodSettings, RefusalsNameWhatWasFoundAndWhatWasExpected) {
  for (const char* text : {"", "0", "-1", "nan", "inf", "1e999", "5 1/s", " 5", "0x10"})
    EXPECT_EQ(refusal("tip_gain", text),
              "tip_gain: found '" + std::string(text) + "', expected a finite number above zero");
  EXPECT_EQ(refusal("bounds", "loose"), "bounds: found 'loose', expected coupled or frozen");
  EXPECT_THAT(refusal("backend", "ipopt"),
              testing::StartsWith("found parameter 'backend', expected one of: bounds, relative_gain, tip_gain, "));
  EXPECT_EQ(refusal("nspqp_zeta", "1e-6"), "");
}

}  // namespace
}  // namespace tandem::test
