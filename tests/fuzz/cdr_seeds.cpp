// SPDX-License-Identifier: Apache-2.0
/** @file Writes a seed for the target `cdr` per message type: cdr_seeds FOLDER. Values are random, of a fixed seed;
 * texts and lists are short. */
#include <filesystem>
#include <fstream>
#include <iostream>

#include "services/dds/raw.h"
#include "services/dds/validate.h"
#include "services/dds/wire_detail.h"
#include "tests/unit/dds/random_messages.h"

namespace {

using namespace tandem;

template <class M>
void writeSeeds(const std::filesystem::path& folder) {
  M empty{}, filled{};
  msg::Randomiser random(1);
  random(filled);
  const auto write = [&](const M& message, const char* kind) {
    std::string name = M::kType;
    std::replace(name.begin(), name.end(), '/', '.');
    std::ofstream(folder / (name + "." + kind), std::ios::binary) << M::kType << '\n' << dds::encode(message);
  };
  write(empty, "empty");
  write(filled, "random");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "cdr_seeds: expected a folder\n";
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  std::filesystem::create_directories(folder);
  using namespace dds;
#define TANDEM_WRITE(M) writeSeeds<M>(folder);
  TANDEM_EACH_MESSAGE(TANDEM_WRITE)
#undef TANDEM_WRITE
  return 0;
}
