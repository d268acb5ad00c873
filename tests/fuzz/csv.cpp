// SPDX-License-Identifier: Apache-2.0
/** @file CSV of others: rows of joint values, points of a trajectory, recorded motions of an operator. Numbers are
 * finite; every other row has an error with its line. The first byte selects the reader. */
#include <cmath>
#include <sstream>

#include "config/detail/loaders.h"
#include "experiments/csv.h"
#include "services/teleop/device.h"
#include "tests/fuzz/harness.h"

using namespace tandem;
using fuzz::expect;

namespace {

void readJoints(const std::string& text, int columns) {
  std::istringstream stream(text);
  int line = 0;
  for (const experiments::CsvRow& row : experiments::readRows(stream, columns)) {
    expect(row.line == ++line, "every line is a row");
    for (const double value : row.values)
      expect(std::isfinite(value), "a number is finite");
    if (row.error.empty())
      expect(static_cast<int>(row.values.size()) == columns, "a row has as many numbers as it should");
    else
      expect(row.error.starts_with("line " + std::to_string(line)), "an error names its line", row.error);
  }
}

void readShape(const std::string& text) {
  const fuzz::MemoryFile file(text);
  try {
    const auto points = config::readPoints(file.path());
    expect(!points.empty(), "a shape has points");
    std::string written;
    for (const Eigen::Vector3d& point : points) {
      expect(point.allFinite(), "a point is finite");
      for (const double value : {point[0], point[1], point[2]})
        written += experiments::number(value) + ",";
      written.back() = '\n';
    }
    expect(config::readPoints(fuzz::MemoryFile(written).path()) == points, "points are read as they are written");
  } catch (const config::Error& error) {
    fuzz::expectPlace(error.what(), file.path(), text);
  }
}

void readTrace(const std::string& text) {
  const fuzz::MemoryFile file(text);
  try {
    const auto trace = teleop::openTrace(file.path());
    expect(!trace->describe().empty(), "a motion is described");
    for (double time = 0.0; time < 5.0; time += 0.05) {
      const teleop::Reading reading = trace->read(time);
      expect(reading.linear.allFinite() && reading.position.allFinite(), "a motion is finite");
    }
    expect(trace->read(1e300).end, "a motion ends");
  } catch (const teleop::DeviceError& error) {
    expect(std::string_view(error.what()).starts_with(file.path()), "an error names its file", error.what());
  }
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  const auto which = input.number<std::uint8_t>();
  const std::string text(input.rest());
  if (which == 'p')
    readShape(text);
  else if (which == 't')
    readTrace(text);
  else
    readJoints(text, which % 8 + 1);
  return 0;
}
