// SPDX-License-Identifier: Apache-2.0
/** @file Trace, a recorded motion as input device: CSV files, and MCAP recordings with teleop/input. */
#include <algorithm>
#include <charconv>
#include <fstream>
#include <map>
#include <numbers>
#include <vector>

#include "kinematics/rotations.h"
#include "recording/reader.h"
#include "services/dds/raw.h"
#include "services/dds/topics.h"
#include "services/recordings/message_upgrader.h"
#include "services/teleop/device.h"

namespace tandem::teleop {
namespace {

struct Line {
  double time = 0.0;  ///< s since the first one
  Reading reading;
};

[[noreturn]] void fail(const std::string& file, int line, const std::string& what) {
  throw DeviceError(file + ":" + std::to_string(line) + ": " + what);
}

std::vector<std::string> fieldsOf(const std::string& text) {
  std::vector<std::string> fields{""};
  for (const char c : text) {
    if (c == ',')
      fields.emplace_back();
    else if (c != ' ' && c != '\r')
      fields.back() += c;
  }
  return fields;
}

double numberOf(const std::string& file, int line, const std::string& column, const std::string& text) {
  double value = 0.0;
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (status != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    fail(file, line, column + ": found '" + text + "', expected a finite number");
  return value;
}

const std::vector<std::string> kVelocity{"vx_mm_per_s", "vy_mm_per_s", "vz_mm_per_s"};
const std::vector<std::string> kPlace{"x_mm", "y_mm", "z_mm"};
// Optional, all or none: angular velocity; orientation as rotation vector.
const std::vector<std::string> kAngularVelocity{"wx_deg_per_s", "wy_deg_per_s", "wz_deg_per_s"};
const std::vector<std::string> kRotation{"rx_deg", "ry_deg", "rz_deg"};

std::vector<Line> readCsv(const std::string& file) {
  std::ifstream stream(file);
  std::string text;
  if (!stream || !std::getline(stream, text))
    throw DeviceError(file +
                      ": cannot be read, or is empty; expected a CSV file with a header (docs/teleoperation.md)");
  const std::vector<std::string> columns = fieldsOf(text);
  const auto has = [&](const std::string& name) {
    return std::find(columns.begin(), columns.end(), name) != columns.end();
  };
  const bool pose = has(kPlace[0]);
  const std::vector<std::string>&moves = pose ? kPlace : kVelocity, &turns = pose ? kRotation : kAngularVelocity;
  for (const std::string& column : columns) {
    const auto among = [&](const std::vector<std::string>& names) {
      return std::find(names.begin(), names.end(), column) != names.end();
    };
    if (!among({"time_s", "present", "clutch"}) && !among(moves) && !among(turns))
      fail(file, 1,
           "found column '" + column +
               "', expected time_s, present, clutch, and either vx_mm_per_s, vy_mm_per_s, vz_mm_per_s and possibly "
               "wx_deg_per_s, wy_deg_per_s, wz_deg_per_s, or x_mm, y_mm, z_mm and possibly rx_deg, ry_deg, rz_deg");
  }
  const bool rotates = std::any_of(turns.begin(), turns.end(), has);
  std::vector<std::string> expected{"time_s", moves[0]};
  if (rotates)
    expected.insert(expected.end(), turns.begin(), turns.end());
  for (const std::string& name : expected) {
    if (!has(name))
      fail(file, 1, "found no column '" + name + "', expected it");
  }
  std::vector<Line> lines;
  for (int number = 2; std::getline(stream, text); ++number) {
    if (text.empty() || text[0] == '#')
      continue;
    const std::vector<std::string> fields = fieldsOf(text);
    if (fields.size() != columns.size())
      fail(file, number,
           "found " + std::to_string(fields.size()) + " fields, expected " + std::to_string(columns.size()));
    std::map<std::string, double> values;
    for (std::size_t i = 0; i < columns.size(); ++i)
      values[columns[i]] = numberOf(file, number, columns[i], fields[i]);
    Line line{values["time_s"], {}};
    line.reading.present = !has("present") || values["present"] != 0.0;
    line.reading.clutch = values["clutch"] != 0.0;
    line.reading.pose = pose;
    const auto vector = [&](const std::vector<std::string>& names) {
      return Eigen::Vector3d(values[names[0]], values[names[1]], values[names[2]]);
    };
    (pose ? line.reading.position : line.reading.linear) = 1e-3 * vector(moves);
    const Eigen::Vector3d rotation = std::numbers::pi / 180.0 * vector(turns);
    if (pose)
      line.reading.orientation = kinematics::rotationBy(rotation);
    else
      line.reading.angular = rotation;
    if (!lines.empty() && line.time < lines.back().time)
      fail(file, number, "time_s: found " + std::to_string(line.time) + ", expected no less than in the line before");
    lines.push_back(line);
  }
  return lines;
}

std::vector<Line> readRecording(const std::string& file) {
  recording::Reader reader(file);
  recordings::MessageUpgrader upgrader(reader);
  std::vector<Line> lines;
  recording::Selection selection;
  const std::string ending = std::string("/") + dds::kTeleopInput.name;
  selection.channel = [&](const recording::Channel& channel) { return channel.topic.ends_with(ending); };
  std::uint64_t start = 0;
  reader.forEach(selection, [&](const recording::Channel& channel, const recording::Message& message) {
    const auto bytes = upgrader(channel, message.data);
    const auto input = bytes ? dds::decode<dds::TeleopInput>(*bytes) : std::nullopt;
    if (!input)
      return true;  // skips a damaged sample
    if (lines.empty())
      start = message.log_time;
    Line line{1e-9 * static_cast<double>(message.log_time - start), {}};
    Reading& r = line.reading;
    r.present = input->operator_present != 0;
    r.clutch = input->clutch != 0;
    r.pose = input->kind == static_cast<std::uint8_t>(idl::TeleopKind::kPose);
    r.linear = Eigen::Vector3d::Map(input->linear.data());
    r.angular = Eigen::Vector3d::Map(input->angular.data());
    r.position = Eigen::Vector3d::Map(input->position.data());
    r.orientation.coeffs() = Eigen::Vector4d::Map(input->orientation.data());
    r.buttons = input->buttons;
    lines.push_back(line);
    return true;
  });
  return lines;
}

class Trace final : public Device {
 public:
  explicit Trace(const std::string& file) : file_(file) {
    try {
      lines_ = file.ends_with(".mcap") ? readRecording(file) : readCsv(file);
    } catch (const recording::Error& error) {
      throw DeviceError(error.what());
    }
    if (lines_.empty())
      throw DeviceError(file + ": found no motion");
  }

  /// The last line that is due. Before the first line and after the last one the switch is released for a short time.
  Reading read(double time) override {
    const double at = time - kBefore + lines_.front().time;
    if (time < kBefore)
      return {};
    while (next_ < lines_.size() && lines_[next_].time <= at)
      ++next_;
    if (next_ == lines_.size() && at > lines_.back().time + kBehind) {
      Reading last;
      last.end = true;
      return last;
    }
    return lines_[next_ == 0 ? 0 : next_ - 1].reading;
  }

  planning::teleoperation::Device kind() const override { return planning::teleoperation::Device::kTrace; }
  std::string describe() const override {
    return file_ + ": " + std::to_string(lines_.size()) + " lines, " +
           std::to_string(lines_.back().time - lines_.front().time) + " s";
  }

 private:
  static constexpr double kBefore = 0.3, kBehind = 0.1;  // s
  std::string file_;
  std::vector<Line> lines_;
  std::size_t next_ = 0;
};

}  // namespace

std::unique_ptr<Device> openTrace(const std::string& file) { return std::make_unique<Trace>(file); }

}  // namespace tandem::teleop
