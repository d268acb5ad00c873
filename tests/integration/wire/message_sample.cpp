// SPDX-License-Identifier: Apache-2.0
/** @file Random messages of every topic in an MCAP file with their expected values, for tests of independent
 * decoders.
 *
 *     message_sample FILE SEED    prints one JSON array per message: type, all values in the order of the definition
 */
#include <iostream>
#include <nlohmann/json.hpp>

#include "recording/writer.h"
#include "services/dds/definitions.h"
#include "services/dds/raw.h"
#include "tests/unit/dds/random_messages.h"

namespace {

using namespace tandem;

/// Calls f with every number and text of a message, in order; f.size() with every list before its elements.
template <class T, class F>
void forEachValue(T& value, F& f) {
  if constexpr (std::is_arithmetic_v<T> || std::is_same_v<T, std::string>) {
    f(value);
  } else if constexpr (requires { T::kType; }) {
    T::members(value, [&](const char*, auto& member, auto&&...) { forEachValue(member, f); });
  } else {
    f.size(value);
    for (auto& element : value)
      forEachValue(element, f);
  }
}

struct Fill {
  dds::Randomiser random;

  template <class T>
  void operator()(T& value) {
    random(value);
  }
  void operator()(std::string& text) {
    text.resize(random.below(40));
    for (char& letter : text)
      letter = static_cast<char>(32 + random.below(95));
  }
  template <class T>
  void size(T& list) {
    if constexpr (requires { list.resize(1); })
      list.resize(random.below(6));
  }
};

struct Print {
  nlohmann::json& out;

  template <class T>
  void operator()(T& value) {
    if constexpr (std::is_integral_v<T> && sizeof(T) == 8)
      out.push_back(std::to_string(value));  // exceeds the precision of a double
    else
      out.push_back(value);
  }
  template <class T>
  void size(T&) {}
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3)
    return 2;
  Fill fill{dds::Randomiser(static_cast<unsigned>(std::stoul(argv[2])))};
  recording::Writer file(argv[1]);
  std::uint64_t time = 0;
  dds::forEachTopic([&](const auto& topic) {
    const auto schema = file.addSchema(topic.type, "ros2msg", dds::messageDefinition(topic.type));
    const auto channel = file.addChannel(std::string("/") + topic.name, schema,
                                         {{"offered_qos_profiles", dds::offeredQos(topic.profile)}});
    for (std::uint32_t i = 1; i <= 20; ++i) {
      typename std::decay_t<decltype(topic)>::Message message;
      forEachValue(message, fill);
      nlohmann::json values{topic.type};
      Print print{values};
      forEachValue(message, print);
      std::cout << values << "\n";
      file.write({channel, i, ++time, time, dds::encode(message)});
    }
  });
  file.close();
  return 0;
}
