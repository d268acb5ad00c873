// SPDX-License-Identifier: Apache-2.0
#include "hal/position_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <sstream>
#include <system_error>

namespace tandem::hal {
namespace {

constexpr const char* kHead = "tandem positions 1";

/// FNV-1a, 64 bits.
class Hash {
 public:
  void add(std::string_view bytes) noexcept {
    for (const char byte : bytes) {
      value_ ^= static_cast<unsigned char>(byte);
      value_ *= 0x100000001B3u;
    }
  }
  template <class Number>
  void number(Number number) noexcept {
    char bytes[sizeof number];
    std::copy_n(reinterpret_cast<const char*>(&number), sizeof number, bytes);
    add({bytes, sizeof bytes});
  }
  std::uint64_t value() const noexcept { return value_; }

 private:
  std::uint64_t value_ = 0xCBF29CE484222325u;
};

void add(Hash& hash, const Gearing& gearing) {
  for (const double number : {gearing.counts_per_revolution, gearing.gear_ratio, gearing.travel_per_revolution,
                              gearing.offset, gearing.reversed ? -1.0 : 1.0})
    hash.number(number);
}

std::string hexOf(std::uint64_t value) {
  char text[24];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(value));
  return text;
}

std::uint64_t sumOf(const std::string& text) {
  Hash hash;
  hash.add(text);
  return hash.value();
}

struct Entry {
  std::string revision;
  double position = 0.0;
};

/** Reads the lines; remembers the first thing that is wrong. */
class Reader {
 public:
  explicit Reader(std::string file) : file_(std::move(file)) {}

  void read(const std::string& text) {
    const std::size_t sum = text.rfind("sum ");
    if (sum == std::string::npos || (sum > 0 && text[sum - 1] != '\n'))
      return wrong(1 + static_cast<int>(std::count(text.begin(), text.end(), '\n')), "the end of the file",
                   "a line 'sum ...'");
    std::istringstream lines(text.substr(0, sum));
    std::string line;
    for (int number = 1; std::getline(lines, line) && problem_.empty(); ++number) {
      if (number == 1 && line != kHead)
        wrong(number, "'" + line + "'", std::string("'") + kHead + "'");
      else if (number > 1)
        readAxis(number, line);
      last_ = number;
    }
    const std::string expected = "sum " + hexOf(sumOf(text.substr(0, sum))) + "\n";
    if (problem_.empty() && text.substr(sum) != expected)
      wrong(last_ + 1, "another check sum", "that of the lines before it");
  }
  const std::map<std::string, Entry>& entries() const { return entries_; }
  const std::string& problem() const { return problem_; }

 private:
  void readAxis(int number, const std::string& line) {
    const std::size_t first = line.find(' '), second = line.find(' ', first + 1);
    Entry entry;
    const char* const end = line.data() + std::min(second, line.size());
    const bool parts = first != std::string::npos && second != std::string::npos;
    if (parts) {
      entry.revision = line.substr(0, first);
      const auto [rest, error] = std::from_chars(line.data() + first + 1, end, entry.position);
      if (error == std::errc{} && rest == end && std::isfinite(entry.position)) {
        entries_[line.substr(second + 1)] = entry;
        return;
      }
    }
    wrong(number, "'" + line.substr(0, 80) + "'", "REVISION POSITION AXIS");
  }
  void wrong(int line, const std::string& found, const std::string& expected) {
    problem_ = file_ + ":" + std::to_string(line) + ": found " + found + ", expected " + expected;
  }

  std::string file_, problem_;
  std::map<std::string, Entry> entries_;
  int last_ = 0;
};

[[noreturn]] void fail(const std::filesystem::path& file, const char* what) {
  throw std::system_error(errno, std::generic_category(), file.string() + ": " + what);
}

/** A file descriptor that is closed at the end. */
struct Descriptor {
  Descriptor(const std::filesystem::path& file, int flags) : number(open(file.c_str(), flags | O_CLOEXEC, 0644)) {
    if (number < 0)
      fail(file, "cannot be opened");
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { close(number); }
  int number;
};

void writeAndSync(const std::filesystem::path& file, const std::string& text) {
  const Descriptor out(file, O_WRONLY | O_CREAT | O_TRUNC);
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t wrote = write(out.number, text.data() + done, text.size() - done);
    if (wrote < 0 && errno != EINTR)
      fail(file, "cannot be written");
    done += wrote < 0 ? 0 : static_cast<std::size_t>(wrote);
  }
  if (fsync(out.number) != 0)
    fail(file, "cannot be synced");
}

}  // namespace

std::uint64_t conversionRevision(const AxisConfig& axis) {
  Hash hash;
  add(hash, axis.gearing);
  hash.number(static_cast<int>(axis.reference));
  hash.number(axis.identity.serial);
  if (axis.encoder) {
    add(hash, axis.encoder->gearing);
    hash.number(axis.encoder->identity.serial);
    // Only where they are set: what was stored without them stays valid.
    if (axis.encoder->atDrive())
      hash.number(axis.encoder->drive_input);
    if (axis.encoder->range != 0.0)
      hash.number(axis.encoder->range);
  }
  return hash.value();
}

StoredPositions readPositions(const std::filesystem::path& file, const HardwareConfig& hardware) {
  StoredPositions stored;
  stored.axes.resize(hardware.axes.size());
  std::error_code error;
  if (!std::filesystem::exists(file, error))
    return stored;
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  Reader reader(file.string());
  if (in && (text << in.rdbuf()))
    reader.read(text.str());
  stored.problem = in.bad() || !in.is_open() ? file.string() + ": cannot be read" : reader.problem();
  if (stored.problem.empty() && text.str().empty())
    stored.problem = file.string() + ":1: found an empty file, expected '" + kHead + "'";
  for (std::size_t i = 0; i < hardware.axes.size(); ++i) {
    const auto found = reader.entries().find(hardware.axes[i].name);
    if (!stored.problem.empty())
      stored.axes[i].state = LastPosition::kDamaged;
    else if (found != reader.entries().end() && found->second.revision != hexOf(conversionRevision(hardware.axes[i])))
      stored.axes[i].state = LastPosition::kChanged;
    else if (found != reader.entries().end())
      stored.axes[i] = {LastPosition::kKnown, found->second.position};
  }
  return stored;
}

void writePositions(const std::filesystem::path& file,
                    const HardwareConfig& hardware,
                    const PositionSnapshot& positions) {
  std::string text = std::string(kHead) + "\n";
  for (std::size_t i = 0; i < hardware.axes.size(); ++i) {
    const PositionSnapshot::One& one = positions.axes.at(i);
    char number[40];
    std::snprintf(number, sizeof number, "%.17g", one.position);
    if (one.known)
      text += hexOf(conversionRevision(hardware.axes[i])) + " " + number + " " + hardware.axes[i].name + "\n";
  }
  text += "sum " + hexOf(sumOf(text)) + "\n";
  const std::filesystem::path folder = file.parent_path();
  std::filesystem::create_directories(folder);
  const std::filesystem::path next = file.string() + ".new";
  writeAndSync(next, text);
  std::filesystem::rename(next, file);
  const Descriptor of_folder(folder, O_RDONLY | O_DIRECTORY);
  if (fsync(of_folder.number) != 0)
    fail(folder, "cannot be synced");
}

}  // namespace tandem::hal
