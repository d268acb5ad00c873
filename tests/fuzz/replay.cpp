// SPDX-License-Identifier: Apache-2.0
/** @file Runs a fuzz target on files, without libFuzzer: `fuzz_NAME FILE|FOLDER...`. A failure names the file. */
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <vector>

#include "tests/fuzz/harness.h"

namespace {

namespace fs = std::filesystem;

std::string current;

void nameFile(int signal) {
  const std::string text = "failed on " + current + "\n";
  [[maybe_unused]] const auto written = write(STDERR_FILENO, text.data(), text.size());
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

void run(const fs::path& file) {
  current = file.string();
  std::ifstream stream(file, std::ios::binary);
  const std::vector<char> bytes{std::istreambuf_iterator<char>(stream), {}};
  LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
}

}  // namespace

int main(int argc, char** argv) {
  for (const int signal : {SIGABRT, SIGSEGV, SIGFPE, SIGBUS})
    std::signal(signal, nameFile);
  std::size_t count = 0;
  for (int i = 1; i < argc; ++i) {
    std::size_t found = 0;
    if (fs::is_regular_file(argv[i])) {
      run(argv[i]);
      ++found;
    } else {
      for (const auto& entry : fs::recursive_directory_iterator(argv[i])) {
        if (!entry.is_regular_file())
          continue;
        run(entry.path());
        ++found;
      }
    }
    if (found == 0) {
      std::cerr << argv[i] << ": found no files, expected inputs\n";
      return 1;
    }
    count += found;
  }
  std::cout << count << " inputs\n";
  return count > 0 ? 0 : 1;
}
