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
  for (const fs::path& given : std::vector<fs::path>(argv + 1, argv + argc)) {
    const std::size_t before = count;
    std::error_code missing;
    if (fs::is_regular_file(given)) {
      run(given);
      ++count;
    }
    for (const auto& entry : fs::recursive_directory_iterator(given, missing)) {
      if (!entry.is_regular_file())
        continue;
      run(entry.path());
      ++count;
    }
    if (count == before) {
      std::cerr << given.string() << ": found no inputs, expected a file or a folder with files\n";
      return 1;
    }
  }
  std::cout << count << " inputs\n";
  return count > 0 ? 0 : 1;
}
