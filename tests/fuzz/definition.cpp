// SPDX-License-Identifier: Apache-2.0
/** @file Message definitions of recordings, and messages by them: "TYPE\n", a definition, a NUL, a second definition, a
 * NUL, and the bytes of a message. A table takes what fits and refuses the rest; a conversion gives what fits the
 * second definition. */
#include "recording/definition.h"
#include "recording/conversion.h"
#include "recording/table.h"
#include "tests/fuzz/harness.h"

using namespace tandem::recording;
using tandem::fuzz::expect;

namespace {

void tabulate(const std::string& type, const std::string& text, const Definition& definition, std::string_view bytes) {
  Table table("topic", {1, type, "ros2msg", text});
  Message message;
  message.data = bytes;
  const bool added = table.add(message);
  expect(added == fits(definition, bytes), "a table takes what fits the definition");
  expect(table.rows() == (added ? 1u : 0u), "a refused message leaves no row");
  for (const Column& column : table.columns) {
    const std::size_t values =
        column.reals.size() + column.integers.size() + column.unsigneds.size() + column.texts.size();
    expect(column.ends.size() <= table.rows() && (column.ends.empty() || column.ends.back() == values),
           "a cell ends at the last value of its column", column.name);
  }
}

void convert(const Definition& from, const Definition& to, std::string_view bytes) {
  const bool fit = fits(from, bytes);
  const Conversion none(from, from);
  expect(none.same(), "a definition is the same as itself");
  const Conversion conversion(from, to);
  const auto converted = conversion(bytes);
  expect(!converted || fit, "only what fits the old definition is converted");
  expect(!converted || fits(to, *converted), "what is converted fits the new definition");
  const bool small = std::ranges::all_of(to.types, [](const auto& type) {
    return std::ranges::all_of(type.second, [](const Field& field) { return field.length <= 10; });
  });
  expect(converted || !fit || !small || !conversion.mismatched().empty(),
         "what fits is converted, unless types differ");
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tandem::fuzz::Input input(data, size);
  const std::string type(input.upTo('\n')), first(input.upTo('\0')), second(input.upTo('\0'));
  try {
    const Definition from = parseDefinition(type, first);
    tabulate(type, first, from, input.rest());
    convert(from, parseDefinition(type, second), input.rest());
  } catch (const Error& error) {
    // what() ends at a NUL.
    expect(std::string_view(error.what()).find(type.c_str()) != std::string_view::npos, "an error names the type",
           error.what());
  }
  return 0;
}
