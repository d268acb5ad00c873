// SPDX-License-Identifier: Apache-2.0
/** @file Recordings with random contents. */
#pragma once

#include <filesystem>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "recording/reader.h"
#include "recording/writer.h"

namespace tandem::recording::test {

/** Values of a message: topic, sequence, log time, publish time, data. */
using Row = std::tuple<std::string, std::uint32_t, std::uint64_t, std::uint64_t, std::string>;

/** Expected contents of a file. */
struct Contents {
  std::vector<Row> rows;                                  ///< in the order of writing
  std::vector<std::pair<std::uint64_t, std::size_t>> at;  ///< after each flush: file size, and number of messages
  std::map<std::string, std::string> attachments, notes;
};

inline std::string randomBytes(std::mt19937_64& random, std::size_t most) {
  std::string bytes(random() % (most + 1), '\0');
  const bool compressible = random() % 2;
  for (char& byte : bytes)
    byte = static_cast<char>(compressible ? random() % 3 : random());
  return bytes;
}

/// Writes a file with ascending log times.
inline Contents writeRandom(const std::filesystem::path& file, std::mt19937_64& random) {
  Contents contents;
  Writer writer(file, {.chunk_size = 256 + random() % 8192, .level = static_cast<int>(random() % 3)});
  std::vector<std::uint16_t> ids;
  std::vector<std::string> topics;
  std::uint64_t time = 1'700'000'000'000'000'000 + random() % 1'000'000;
  const int count = 1 + static_cast<int>(random() % 400);
  for (int i = 0; i < count; ++i) {
    if (ids.empty() || random() % 40 == 0) {
      const auto schema = writer.addSchema("pkg/msg/T" + std::to_string(random() % 5), "ros2msg", "uint8 x\n");
      topics.push_back("/topic_" + std::to_string(topics.size()));
      ids.push_back(writer.addChannel(topics.back(), schema, {{"offered_qos_profiles", "- depth: 1"}}));
    }
    const std::size_t k = random() % ids.size();
    const std::string data = randomBytes(random, 600);
    time += random() % 3 == 0 ? 0 : random() % 1'000'000;
    writer.write({ids[k], static_cast<std::uint32_t>(i), time, time - random() % 1000, data});
    contents.rows.emplace_back(topics[k], i, time, 0, data);
    if (random() % 50 == 0) {
      const std::string name = "file " + std::to_string(i);
      contents.attachments[name] = randomBytes(random, 2000);
      writer.attach({time, time, name, "text/plain", contents.attachments[name]});
    }
    if (random() % 50 == 0) {
      contents.notes["note " + std::to_string(i)] = std::to_string(random());
      writer.add({"note " + std::to_string(i), {{"value", contents.notes["note " + std::to_string(i)]}}});
    }
    if (random() % 20 == 0) {
      writer.flush();
      contents.at.emplace_back(writer.size(), contents.rows.size());
    }
  }
  writer.close();
  return contents;
}

/// All messages of a file.
inline std::vector<Row> rowsOf(Reader& reader, const Selection& selection = {}) {
  std::vector<Row> rows;
  reader.forEach(selection, [&](const Channel& channel, const Message& message) {
    rows.emplace_back(channel.topic, message.sequence, message.log_time, 0, std::string(message.data));
    return true;
  });
  return rows;
}

}  // namespace tandem::recording::test
