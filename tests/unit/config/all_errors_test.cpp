// SPDX-License-Identifier: Apache-2.0
// All errors of a file are reported at once, in its order, and likely causes of syntax errors are named.
#include <random>

#include "config/detail/syntax_hint.h"
#include "support.h"

namespace tandem::config::test {
namespace {

std::vector<Error> errorsOf(const std::string& text) {
  try {
    parseTrajectory(text, "file", {});
  } catch (const Error& error) {
    EXPECT_EQ(error.line(), error.all().front().line());
    std::string lines;
    for (const Error& one : error.all())
      lines += (lines.empty() ? "" : "\n") + std::string(one.what());
    EXPECT_EQ(error.what(), lines);
    return error.all();
  }
  return {};
}

TEST(AllErrors, EachOfARandomSetIsReportedInOrder) {
  struct Fault {
    const char *good, *bad, *key;
  };
  const std::vector<Fault> faults{
      {"points: 40", "points: many", "points"},
      {"tolerance_mm: 0.8", "tolerance: 0.8", "tolerance"},
      {"speed_mm_per_s: 2", "speed_mm_per_s: -2", "speed_mm_per_s"},
      {"following: timed", "folowing: timed", "folowing"},
      {"normal: [0, 0, 1]", "normal: [0, 0]", "shape.circle.normal"},
      {"turns: 1", "turns: ", "shape.circle.turns"},
      {"acceleration_mm_per_s2: 5", "acceleration_mm_per_s2: .nan", "acceleration_mm_per_s2"}};
  std::string valid = "tandem: trajectory/1\nname: x\n";
  for (const std::size_t k : {0u, 1u, 2u, 3u, 6u})
    valid += std::string(faults[k].good) + '\n';
  valid += "shape:\n  circle:\n    center_offset_mm: [0, 5, 0]\n    normal: [0, 0, 1]\n    turns: 1\n";
  ASSERT_TRUE(errorsOf(valid).empty());
  std::mt19937 random(7);
  for (int run = 0; run < 200; ++run) {
    std::string text = valid;
    std::set<std::string> wanted, found;
    for (const Fault& fault : faults) {
      if (random() % 2 == 0)
        continue;
      text = replaced(text, fault.good, fault.bad);
      wanted.insert(fault.key);
    }
    int line = 0;
    for (const Error& error : errorsOf(text)) {
      EXPECT_GE(error.line(), line);
      line = error.line();
      found.insert(error.key());
    }
    EXPECT_EQ(found, wanted) << text;
  }
}

/// Contradictions between values, which no key shows alone: `text` becomes `wrong`.
struct Contradiction {
  std::string text, wrong, key;
};

/// Loads a file with each of a random set of contradictions: every one is reported.
template <class Load>
void expectEachOf(const std::vector<Contradiction>& all, const std::string& valid, const Folder& folder, Load load) {
  std::mt19937 random(11);
  for (int run = 0; run < 60; ++run) {
    std::string text = valid;
    std::set<std::string> wanted, found;
    for (const Contradiction& one : all) {
      if (random() % 2 == 0)
        continue;
      text = replaced(text, one.text, one.wrong);
      wanted.insert(one.key);
    }
    try {
      load(folder.write("folder/file.yaml", text));
    } catch (const Error& error) {
      for (const Error& one : error.all())
        EXPECT_TRUE(found.insert(one.key()).second) << "twice: " << one.what();
    }
    EXPECT_EQ(found, wanted) << "run " << run << "\n" << text;
  }
}

TEST(AllErrors, ContradictionsOfARobotAreReportedTogether) {
  // One for each independent part of the file: what comes after it in the same part cannot be judged.
  const std::vector<Contradiction> all{
      {"outer_diameter_mm: 1.524, inner_diameter_mm: 1.3,", "outer_diameter_mm: 1.524, inner_diameter_mm: 1.53,",
       "arms[0].tubes[0].inner_diameter_mm"},
      {"outer_diameter_mm: 1.8, inner_diameter_mm: 1.62,", "outer_diameter_mm: 1.8, inner_diameter_mm: 1.81,",
       "arms[0].tubes[1].inner_diameter_mm"},
      {"name: arm_b", "name: pair", "arms[1].name"}};
  expectEachOf(all, readAll(presets() / "robots/ark2024.yaml"), Folder(), loadRobot);
  expectEachOf({{"carriage_spacing_mm: 0", "carriage_spacing_mm: [0, 0, 0]", "arms[0].limits.carriage_spacing_mm"},
                {"minimum_extension_mm: 0", "minimum_extension_mm: [0, 0, 0]", "arms[0].limits.minimum_extension_mm"},
                {"rotation: {lower_deg: unlimited, upper_deg: unlimited,", "rotation: {lower_deg: 90, upper_deg: -90,",
                 "arms[0].limits.rotation.lower_deg"},
                {"name: arm_b", "name: pair", "arms[1].name"}},
               readAll(presets() / "robots/ark2024.yaml"), Folder(), loadRobot);
}

TEST(AllErrors, ContradictionsOfADeploymentAreReportedTogether) {
  const std::vector<Contradiction> all{
      {"sim_period_ms: 1", "sim_period_ms: 200", "sim_period_ms"},
      {"address: 192.168.77.2", "address: 127.0.0.1", "hosts[1].address"},
      {"tandem-recorder, host: robot", "tandem-recorder, host: robto", "processes[2].host"},
      {"tandem-planning, host: console", "tandem-planning", "processes[3].name"},
      {"method: nspqp", "method: nspqp\nsecurity: nowhere", "security"},
      {"clock: real_time", "clock: real_time\nconsole: {viewer_token: abcdefghijklmnop}", "console.viewer_token"},
      {"prefix: tandem", "prefix: tandem\nblack_box: {memory_mb: 200}\nmemory_limit_mb: 300", "black_box.memory_mb"}};
  const Folder folder;
  folder.write("robots/ark2024.yaml", readAll(presets() / "robots/ark2024.yaml"));
  expectEachOf(all, readAll(presets() / "deployments/two-hosts.yaml"), folder, loadDeployment);
}

TEST(AllErrors, AMisspelledKeyIsNotMissingToo) {
  const std::vector<Error> errors =
      errorsOf("tandem: trajectory/1\nnaem: x\nshape: {line: {displacement: [1, 0, 0]}}\n");
  ASSERT_EQ(errors.size(), 2u);
  EXPECT_NE(std::string(errors[0].what()).find("naem: unknown key; did you mean name?"), std::string::npos);
  EXPECT_NE(std::string(errors[1].what()).find("displacement: a key without its unit"), std::string::npos);
}

TEST(SyntaxHint, NamesTheLineAndTheCause) {
  EXPECT_EQ(syntaxHint("a: 1\n\tb: 2\n", 1), "; a tab indents line 2, expected spaces");
  EXPECT_EQ(syntaxHint("a: [1, 2}\n", 0), "; the '[' of line 1 is closed by '}' in line 1");
  EXPECT_EQ(syntaxHint("a: {b: [1, 2]\nc: 3\n", 1), "; the '{' of line 1 is not closed");
  EXPECT_EQ(syntaxHint("a: 1]\n", 0), "; the ']' of line 1 closes nothing");
  EXPECT_EQ(syntaxHint("a: \"x\nb: 2\n", 1), "; the quote \" of line 1 is not closed");
  EXPECT_EQ(syntaxHint("a: 1\nb 2\nc: 3\n", 2), "; line 2 has no colon with a blank after it, expected `key: value`");
  EXPECT_EQ(syntaxHint("a: 1  # [ { \" it's\n  b: 'don''t'\n", 1),
            "; check the indentation of line 2 and of the line before it");
}

}  // namespace
}  // namespace tandem::config::test
