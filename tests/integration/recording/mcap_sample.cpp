// SPDX-License-Identifier: Apache-2.0
/** @file Command-line MCAP writer and reader for interoperability tests.
 *
 *     mcap_sample write FILE SEED    writes a random file, prints its contents
 *     mcap_sample read FILE          prints the contents of a file
 */
#include <iomanip>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "recording/compression.h"
#include "tests/unit/recording/random_recording.h"

namespace {

using namespace tandem::recording;
using nlohmann::json;

/// Topic, sequence, log time, and length and checksum of the data.
json describe(const test::Row& row) {
  const auto& [topic, sequence, log_time, publish_time, data] = row;
  return {topic, sequence, std::to_string(log_time), data.size(), crc32(data)};
}

json describe(const std::vector<test::Row>& rows,
              const std::map<std::string, std::string>& attachments,
              const std::map<std::string, std::string>& notes) {
  json out{{"messages", json::array()}, {"attachments", json::object()}, {"notes", notes}};
  for (const test::Row& row : rows)
    out["messages"].push_back(describe(row));
  for (const auto& [name, data] : attachments)
    out["attachments"][name] = crc32(data);
  return out;
}

int read(const std::string& file) {
  Reader reader(file);
  const std::vector<test::Row> rows = test::rowsOf(reader);
  std::map<std::string, std::string> attachments, notes;
  for (std::size_t i = 0; i < reader.attachments().size(); ++i)
    attachments[reader.attachments()[i].name] = reader.attachmentData(i);
  for (const Metadata& note : reader.metadata())
    notes[note.name] = note.values.at("value");
  json out = describe(rows, attachments, notes);
  out["finished"] = reader.finished();
  out["damage"] = reader.damage();
  std::cout << out << std::endl;
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() == 2 && words[0] == "read")
    return read(words[1]);
  if (words.size() != 3 || words[0] != "write")
    return 2;
  std::mt19937_64 random(std::stoull(words[2]));
  const test::Contents contents = test::writeRandom(words[1], random);
  std::cout << describe(contents.rows, contents.attachments, contents.notes) << std::endl;
  return 0;
}
