// SPDX-License-Identifier: Apache-2.0
#include "services/cli/command_table.h"

#include <functional>
#include <map>
#include <stdexcept>

#include "services/cli/suggestion.h"
#include "services/client/arguments.h"

namespace tandem::cli {
namespace {

/// Examples by the words of the command. Tests and the manual pages take them from --help.
const std::map<std::string, std::vector<std::string>>& examples() {
  static const std::map<std::string, std::vector<std::string>> table{
      {"up", {"tandem up laptop", "tandem up lab.yaml --for 60"}},
      {"experiment", {"tandem experiment table3 --csv results/csv --figures results/figures"}},
      {"robot enable", {"tandem robot enable"}},
      {"robot disable", {"tandem robot disable"}},
      {"robot pause", {"tandem robot pause"}},
      {"robot resume", {"tandem robot resume"}},
      {"robot stop", {"tandem robot stop", "tandem robot -d lab.yaml stop"}},
      {"robot move-jp", {"tandem robot move-jp --arm a -- -0.17 -0.12 -0.07 0 0 0"}},
      {"robot recover", {"tandem robot recover a"}},
      {"robot withdraw", {"tandem robot withdraw a"}},
      {"robot home", {"tandem robot home"}},
      {"robot method", {"tandem robot method snsqp"}},
      {"robot set", {"tandem robot set tip_gain 20"}},
      {"robot run", {"tandem robot run circle", "tandem robot -d one-arm run circle-one-arm --method hqp --check"}},
      {"status",
       {"tandem status --follow", "tandem status laptop-1khz --json",
        "tandem status --check || echo 'a process is silent'"}},
      {"topics", {"tandem topics", "tandem topics lab.yaml --json"}},
      {"doctor", {"tandem doctor", "tandem doctor lab.yaml --json"}},
      {"conformance hal",
       {"tandem conformance hal -d lab.yaml --yes", "tandem conformance hal -d laptop --only enable,silence --json"}},
      {"commission",
       {"tandem commission -d lab.yaml", "tandem commission -d lab.yaml --arm a --joint beta_1 --speed-percent 5"}},
      {"fk",
       {"echo -0.1,-0.08,-0.05,0.785,0.785,0.785 | tandem fk --arm a --csv -",
        "tandem fk --csv joints.csv --model compliant --wrench 0,0.1,0,0,0,0 --jacobian",
        "tandem fk --robot ablation-pair --model cosserat --csv joints.csv --wrench 0,0.01,0,0,0,0 --compliance"}},
      {"solve", {"tandem solve --csv cases.csv --method nspqp"}},
      {"stability",
       {"tandem stability -q=-0.17,-0.12,-0.07,0,3.1,3.1", "tandem stability --map --csv map.csv --figure map.pdf"}},
      {"workspace", {"tandem workspace --robot ark2024 --figures results/workspace"}},
      {"plan check",
       {"tandem plan check circle", "tandem plan check lissajous --from table3:2 --model compliant --json"}},
      {"plan repair", {"tandem plan repair far.yaml -o near.yaml"}},
      {"plan ik", {"tandem plan ik --tip a=0.02,0.01,0.3 --tip b=0.02,-0.01,0.3,0,0,1"}},
      {"plan time", {"tandem plan time circle"}},
      {"plan start", {"tandem plan start circle"}},
      {"validate", {"tandem validate laptop", "tandem validate robot.yaml deployment.yaml --json"}},
      {"show", {"tandem show ark2024 --figure arms.pdf", "tandem show circle --robot ark2024 --figure circle.png"}},
      {"schema", {"tandem schema robot > robot.schema.json"}},
      {"can scan", {"tandem can scan --bus can:can0"}},
      {"can od",
       {"tandem can od 1 6041 --bus can:can0 --eds drive.eds", "tandem can od 1 607D:1 --bus can:can0 -- -100000",
        "tandem can od 1 --bus can:can0 --protections"}},
      {"can import",
       {"tandem can import drive.eds", "tandem can import drive.eds --node 3 --hardware lab.yaml --out axis.yaml"}},
      {"can compare", {"tandem can compare drive.eds 1 --bus can:can0"}},
      {"can dump", {"tandem can dump 1 --bus can:can0 --eds drive.eds", "tandem can dump 1 --bus can:can0 --json"}},
      {"can budget", {"tandem can budget ark2024-two-buses"}},
      {"can log", {"tandem can log --bus can:can0 --out drives.log --for 10"}},
      {"can replay", {"tandem can replay drives.log --bus can:vcan0"}},
      {"can monitor", {"tandem can monitor lab.yaml", "tandem can monitor laptop --once --json"}},
      {"home",
       {"tandem home", "tandem home --arm a", "tandem home --confirm", "tandem home --arm a --measured beta_1=-120.5"}},
      {"jog", {"tandem jog a beta_1 2 --for 1.5", "tandem jog a alpha_3 -- -10"}},
      {"security init", {"tandem security init /etc/tandem/credentials"}},
      {"security issue", {"tandem security issue /etc/tandem/credentials console-operator --name anna"}},
      {"security revoke", {"tandem security revoke /etc/tandem/credentials anna"}},
      {"security verify", {"tandem security verify", "tandem security verify credentials/control credentials/hal"}},
      {"units", {"systemctl enable --now tandem@lab.target $(tandem units lab)", "tandem units lab --restrict"}},
      {"record", {"tandem record", "tandem record lab.yaml --output run.mcap --for 60"}},
      {"info", {"tandem info run.mcap", "tandem info run.mcap --json"}},
      {"replay", {"tandem replay run.mcap", "tandem replay run.mcap --simulate"}},
      {"export",
       {"tandem export run.mcap --csv tables", "tandem export run.mcap --mat run.mat --resample 100",
        "tandem export run.mcap --csv tables --topics actuation/state 'left/*'"}},
      {"plot", {"tandem plot run.mcap --figures figures"}},
      {"console", {"tandem console", "tandem console lab.yaml"}},
      {"montecarlo",
       {"tandem montecarlo --tasks 1000 --methods nspqp,snsqp --csv results/mc.csv",
        "tandem montecarlo --tip-noise-mm 0,0.1,0.2,0.5 --curvature-error 0,2%,5% --figure results/sweep.png"}},
      {"montecarlo merge", {"tandem montecarlo merge shard-1.csv shard-2.csv --csv all.csv"}},
      {"cooperative co-manipulate", {"tandem cooperative co-manipulate --shape circle --csv hold.csv"}},
      {"cooperative target-assist", {"tandem cooperative target-assist --csv assist.csv"}},
      {"cooperative mobility", {"tandem cooperative mobility"}},
      {"cooperative payload", {"tandem cooperative payload"}},
      {"cooperative reach", {"tandem cooperative reach"}},
      {"presets", {"tandem presets", "tandem presets robot"}},
      {"new",
       {"tandem new robot my-robot", "tandem new deployment my-lab --robot my-robot.yaml",
        "tandem new trajectory eight -o eight.yaml"}},
      {"completion", {"echo 'eval \"$(tandem completion)\"' >> ~/.bashrc"}},
  };
  return table;
}

/// Calls f(command, words) for the commands below `app`, those with subcommands after these.
template <class App, class F>
void forEach(App& app, const std::string& words, F&& f) {
  for (const std::string& name : subcommandsOf(app)) {
    App& part = *app.get_subcommand(name);
    const std::string all = words.empty() ? name : words + " " + name;
    forEach(part, all, f);
    f(part, all);
  }
}

/// Whether further words belong to another program, with its own help.
bool isForeign(const CLI::App& command) { return command.get_prefix_command(); }

/// The footer that ends with the examples. CLI11 gives a new subcommand the footer that its parent has at that time.
std::string footerOf(const CLI::App& command, const std::string& words) {
  const std::string& own = command.get_footer();
  const bool inherited = command.get_parent() != nullptr && own == command.get_parent()->get_footer();
  std::string footer = inherited || own.empty() ? "" : own + "\n";
  std::vector<std::string> own_examples;
  if (const auto found = examples().find(words); found != examples().end())
    own_examples = found->second;
  // A command that only groups others shows one example of each.
  for (const std::string& name : own_examples.empty() ? subcommandsOf(command) : std::vector<std::string>())
    own_examples.push_back(examples().at(words + " " + name).front());
  if (own_examples.empty())
    throw std::logic_error("command '" + words + "' has no examples");
  footer += footer.empty() ? "Examples:" : "\nExamples:";
  for (const std::string& example : own_examples)
    footer += "\n  " + example;
  return footer;
}

}  // namespace

void completeCommands(CLI::App& app) {
  forEach(app, "", [](CLI::App& command, const std::string& words) {
    if (isForeign(command))
      return;
    command.footer(footerOf(command, words));
    const bool has_json = command.get_option_no_throw("--json") != nullptr ||
                          command.get_parent()->get_option_no_throw("--json") != nullptr;
    if (!has_json && subcommandsOf(command).empty())
      command.add_flag("--json", client::asJson(), "results, and reasons of refusals, as JSON");
  });
}

std::vector<std::string> commandsOf(const CLI::App& app) {
  std::vector<std::string> commands;
  forEach(app, "", [&](const CLI::App& command, const std::string& words) {
    // Commands with subcommands that are optional are commands too.
    if (!isForeign(command) && command.get_require_subcommand_min() == 0)
      commands.push_back(words);
  });
  return commands;
}

}  // namespace tandem::cli
