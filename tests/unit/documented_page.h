// SPDX-License-Identifier: Apache-2.0
/** @file Comparison of a page of docs/ with the text that a test makes of the code. */
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

namespace tandem::test {

/** Expects the page to have this text; TANDEM_WRITE_DOCS=1 writes it.
 * @param name  of the file in docs/
 * @param command  that writes the page again, without the variable */
inline void expectPage(const std::string& name, const std::string& text, const std::string& command) {
  const std::string file = std::string(TANDEM_DOCS) + "/" + name;
  if (std::getenv("TANDEM_WRITE_DOCS") != nullptr)
    std::ofstream(file) << text;
  std::ifstream in(file);
  std::ostringstream there;
  there << in.rdbuf();
  EXPECT_EQ(there.str(), text) << "if the new page is right: TANDEM_WRITE_DOCS=1 " << command;
}

}  // namespace tandem::test
