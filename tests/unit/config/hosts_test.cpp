// SPDX-License-Identifier: Apache-2.0
/** @file Deployments that spread over several hosts. */
#include "support.h"

namespace tandem::config::test {
namespace {

std::string onHosts() { return std::string("tandem: deployment/1\nname: lab\nrobot: ark2024\n") + kHosts; }

TEST(Deployment, HostsAreFoundByTheirAddresses) {
  const Folder folder;
  const Deployment d = loadDeployment(folder.write("d.yaml", onHosts()));
  ASSERT_EQ(d.hosts.size(), 2u);
  EXPECT_EQ(d.processes.at(0).host, "robot");
  EXPECT_EQ(d.processes.at(1).host, "console");
  const Host* host = hostAmong(d, {"127.0.0.1", "10.0.0.2"});
  ASSERT_NE(host, nullptr);
  EXPECT_EQ(host->name, "console");
  EXPECT_EQ(hostAmong(d, {"127.0.0.1", "10.0.0.3"}), nullptr);
  EXPECT_EQ(hostAmong(loadDeployment(presets() / "deployments/laptop.yaml"), {"127.0.0.1"}), nullptr);
}

TEST(Deployment, SecurityIsAFolderAndADiscoveryServerAHost) {
  const Folder folder;
  const Deployment served = loadDeployment(folder.write("d.yaml", onHosts() + "discovery: {server: console}\n"));
  ASSERT_TRUE(served.discovery.has_value());
  EXPECT_EQ(served.discovery->address, "10.0.0.2");
  EXPECT_EQ(served.discovery->port, 11811);
  EXPECT_TRUE(served.security.empty());
  const std::filesystem::path file = folder.write("d.yaml", onHosts() + "security: credentials\n");
  EXPECT_THROW(loadDeployment(file), Error);  // the folder does not exist
  std::filesystem::create_directory(file.parent_path() / "credentials");
  EXPECT_EQ(loadDeployment(file).security, file.parent_path() / "credentials");
}

TEST(Deployment, RefusalsOfHosts) {
  const Refusal refusals[] = {
      {"name: console, a", "name: robot, a", "robot, address: 10.0.0.2", 0, "hosts[1].name",
       "found 'robot' a second time"},
      {"10.0.0.2", "10.0.0.1", "10.0.0.1}\nproc", 0, "hosts[1].address", "found 10.0.0.1, which is host 'robot'"},
      {"10.0.0.2", "127.0.0.1", "127", 0, "hosts[1].address", "which other hosts cannot reach"},
      {"10.0.0.2", "console", "console}", 0, "hosts[1].address", "expected an IPv4 address"},
      {"planning, host: console", "planning, host: moon", "moon", 0, "processes[1].host",
       "found 'moon', expected one of robot, console"},
      {"planning, host: console", "planning", "planning, executable", 0, "processes[1].name",
       "found a process without host, expected one of robot, console"},
      {"hosts:", "peers: [10.0.0.9]\nhosts:", "[10", 0, "peers", "found together with `hosts`"},
  };
  for (const Refusal& refusal : refusals)
    expectRefusal(onHosts(), refusal, [](const std::filesystem::path& file) { loadDeployment(file); });
  const std::string laptop = readAll(presets() / "deployments/laptop.yaml");
  expectRefusalBesideRobot(laptop,
                           {"executable: tandem-sim", "executable: tandem-sim, host: robot", "robot}", 0,
                            "processes[0].host", "but the deployment has no `hosts`"},
                           [](const std::filesystem::path& file) { loadDeployment(file); });
}

}  // namespace
}  // namespace tandem::config::test
