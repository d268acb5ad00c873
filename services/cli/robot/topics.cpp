// SPDX-License-Identifier: Apache-2.0
/** @file tandem topics: topics of a running system with their writers and readers. */
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>

#include "config/arm_names.h"
#include "config/robot_files.h"
#include "services/cli/subcommand.h"
#include "services/dds/topics.h"
#include "services/runtime/process.h"

namespace tandem::cli {
namespace {

int runTopics(const std::string& name, bool as_json) {
  const config::Deployment deployment = runtime::loadDeployment(name);
  const config::Robot robot = config::loadAnyRobot(deployment);
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const dds::TopicInfo& topic : dds::allTopics(config::armList(robot))) {
    const std::string ros = dds::rosTopicName(deployment.prefix, topic.name);
    if (as_json) {
      json.push_back({{"topic", ros},
                      {"dds_topic", "rt" + ros},
                      {"type", topic.type},
                      {"dds_type", dds::ddsTypeName(topic.type)},
                      {"profile", dds::name(topic.profile)},
                      {"publisher", topic.publisher},
                      {"description", topic.description}});
    } else {
      std::printf("%-36s %-38s %-9s %-14s %s\n", ros.c_str(), topic.type.c_str(), dds::name(topic.profile),
                  topic.publisher.c_str(), topic.description.c_str());
    }
  }
  if (as_json)
    std::cout << json.dump(2) << '\n';
  return kOk;
}

}  // namespace

void registerTopics(CLI::App& app, int& exit_code) {
  auto deployment = std::make_shared<std::string>(runtime::defaultDeployment());
  auto as_json = std::make_shared<bool>(false);
  CLI::App* topics =
      app.add_subcommand("topics", "all topics of a deployment: names, types, quality of service, publishers");
  topics->add_option("deployment,-d,--deployment", *deployment, "deployment file or preset")->capture_default_str();
  topics->add_flag("--json", *as_json, "JSON instead of text");
  topics->callback([=, &exit_code] { guarded(exit_code, [&] { return runTopics(*deployment, *as_json); }); });
}

}  // namespace tandem::cli
