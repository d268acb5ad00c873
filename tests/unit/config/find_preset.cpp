// SPDX-License-Identifier: Apache-2.0
/** @file Prints where a preset is found: copied into a prefix by the test of the search. Usage: find_preset NAME KIND
 */
#include <iostream>

#include "config/config.h"

int main(int argc, char** argv) {
  if (argc != 3)
    return 2;
  try {
    std::cout << tandem::config::findFile(argv[1], argv[2]).string();
    return 0;
  } catch (const tandem::config::Error& error) {
    std::cout << error.what();
    return 1;
  }
}
