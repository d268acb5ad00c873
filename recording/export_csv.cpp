// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <cmath>
#include <fstream>
#include <stdexcept>

#include "recording/export.h"

namespace tandem::recording {
namespace {

/// Appends the shortest text that is parsed to the same number.
template <class T>
void append(std::string& line, T value) {
  char text[40];
  line.append(text, std::to_chars(text, text + sizeof text, value).ptr);
}

void append(std::string& line, const std::string& text) {
  line += '"';
  for (char letter : text) {
    if (letter == '"')
      line += '"';
    line += letter;
  }
  line += '"';
}

void appendValue(std::string& line, const Column& column, std::size_t at) {
  switch (column.type) {
    case Column::Type::kReal:
      return append(line, column.reals[at]);
    case Column::Type::kInteger:
      return append(line, column.integers[at]);
    case Column::Type::kUnsigned:
      return append(line, column.unsigneds[at]);
    case Column::Type::kText:
      return append(line, column.texts[at]);
  }
}

double seconds(std::uint64_t time, std::uint64_t start) {
  return 1e-9 * static_cast<double>(static_cast<std::int64_t>(time - start));
}

/** Output file that reports write errors in close(). */
class CsvFile {
 public:
  explicit CsvFile(const std::filesystem::path& file) : file_(file), stream_(file, std::ios::binary) {}
  void line(std::string text) { stream_ << (text += '\n'); }
  void close() {
    stream_.close();
    if (!stream_)
      throw std::runtime_error(file_.string() + ": cannot be written");
  }

 private:
  std::filesystem::path file_;
  std::ofstream stream_;
};

void write(const Table& table, std::uint64_t start, const std::filesystem::path& file) {
  CsvFile out(file);
  std::string line = "time_s,log_time_ns,publish_time_ns,sequence_of_writer";
  for (const Column& column : table.columns) {
    for (std::size_t i = 0; i < column.width; ++i)
      line += "," + column.name + (column.is_array ? "[" + std::to_string(i) + "]" : "");
  }
  out.line(line);
  for (std::size_t row = 0; row < table.rows(); ++row) {
    line.clear();
    append(line, seconds(table.log_times[row], start));
    append(line += ',', table.log_times[row]);
    append(line += ',', table.publish_times[row]);
    append(line += ',', table.sequences[row]);
    for (const Column& column : table.columns) {
      for (std::size_t i = 0; i < column.width; ++i) {
        line += ',';
        if (i < column.size(row))
          appendValue(line, column, column.begin(row) + i);
      }
    }
    out.line(line);
  }
  out.close();
}

void write(const AlignedTable& table, std::uint64_t start, const std::filesystem::path& file) {
  CsvFile out(file);
  std::string line = "time_s,log_time_ns";
  for (const std::string& name : table.names)
    line += "," + name;
  out.line(line);
  for (std::size_t row = 0; row < table.times.size(); ++row) {
    line.clear();
    append(line, seconds(table.times[row], start));
    append(line += ',', table.times[row]);
    for (const std::vector<double>& values : table.values) {
      line += ',';
      if (!std::isnan(values[row]))
        append(line, values[row]);
    }
    out.line(line);
  }
  out.close();
}

}  // namespace

std::string plainName(const std::string& name) {
  std::string plain;
  for (char letter : name) {
    const bool good = (letter >= 'a' && letter <= 'z') || (letter >= 'A' && letter <= 'Z') ||
                      (letter >= '0' && letter <= '9') || letter == '_';
    if (good)
      plain += letter;
    else if (!plain.empty() && plain.back() != '_' && letter != ']')
      plain += '_';
  }
  return plain;
}

void exportCsv(const ExportSet& set, const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error)
    throw std::runtime_error(folder.string() + ": cannot be created: " + error.message());
  for (const Table& table : set.tables)
    write(table, set.start, folder / (plainName(table.topic) + ".csv"));
  if (set.aligned)
    write(*set.aligned, set.start, folder / "aligned.csv");
}

}  // namespace tandem::recording
