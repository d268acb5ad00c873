// SPDX-License-Identifier: Apache-2.0
/** @file tandem schema: JSON Schemas of the configuration files, for editors. */
#include <iostream>

#include "config/file_tables.h"
#include "services/cli/subcommand.h"

namespace tandem::cli {

void registerSchema(CLI::App& app, int& exit_code) {
  auto kind = std::make_shared<std::string>();
  CLI::App* schema = app.add_subcommand("schema", "print the JSON Schema of a configuration file, by kind of file");
  schema->add_option("kind", *kind, "kind of file")->required()->check(CLI::IsMember(config::kinds()));
  schema->callback([kind, &exit_code] {
    guarded(exit_code, [&] {
      std::cout << config::schema(*kind);
      return kOk;
    });
  });
}

}  // namespace tandem::cli
