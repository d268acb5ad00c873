# SPDX-License-Identifier: Apache-2.0
"""The image built from the packages, and console and robot as two containers of it, in a real engine.

The first argument is the folder of the executables of a build tree; its packages are in PARENT/packages."""
import json
import pathlib
import re
import shutil
import sys
import time
import unittest

import engine
import roots

SOURCE = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(SOURCE / "tests" / "integration" / "harness"))
import system  # noqa: E402

BUILD = pathlib.Path(sys.argv.pop(1)).resolve().parent
COMPOSE = SOURCE / "deploy" / "docker"
# For a loaded machine.
BUDGETS = "budgets: {minimum_age_ms: 1000, planning_reference_ms: 2000, lease_ms: 5000}\n"


class Containers(unittest.TestCase):
    def setUp(self):
        roots.require(engine.NEEDS)
        self.engine = engine.Engine()
        self.addCleanup(self.engine.close)
        self.config = self.engine.folder / "config"
        shutil.copytree(COMPOSE / "tandem", self.config)
        with open(self.config / "deployments/containers.yaml", "a", encoding="utf-8") as file:
            file.write(BUDGETS)
        experiment = system.short_experiment(self.engine.folder, "nspqp").read_text()
        (self.config / "experiments").mkdir()
        (self.config / "experiments/short.yaml").write_text(re.sub(r"(?m)^robot: .*", "robot: ark2024", experiment))
        line = "tandem: trajectory/1\nname: line\nshape: {line: {displacement_mm: [0, 20, 0]}}\nfollowing: timed\n" \
               "speed_mm_per_s: 1\nacceleration_mm_per_s2: 5\n"
        (self.config / "trajectories").mkdir()
        (self.config / "trajectories/long.yaml").write_text(line)
        # The engine's folder belongs to root; the user of the image must be able to read what is mounted from it.
        self.engine.folder.chmod(0o755)

    def test_the_image_and_the_system_of_two_containers(self):
        for step in (self.build, self.hardening, self.two_containers, self.a_process_that_dies, self.secured, self.experiment):
            began = time.monotonic()
            step()
            print(f"{step.__name__}: {time.monotonic() - began:.1f} s", flush=True)

    def compose(self, *words, files=("compose.yaml",), **more):
        arguments = [word for file in files for word in ("-f", file)]
        return self.engine.compose(COMPOSE, *arguments, *words, TANDEM_CONFIG=str(self.config), TANDEM_EXPERIMENT="short",
                                   TANDEM_HEALTH_INTERVAL="2s", **more)

    def build(self):
        """Uses the machine's network; the following steps have none."""
        shared = BUILD.parent / "container"
        self.engine.start()
        self.engine.load(roots.base(shared), "debian:bookworm-slim")
        self.engine.docker("build", "--network", "host", "-f", COMPOSE / "Dockerfile", "-t", "tandem", BUILD / "packages",
                           timeout=400)
        self.engine.stop()
        self.engine.start(private=True)

    def hardening(self):
        """Every compose file is valid, and the image needs no capability."""
        for files in (["compose.yaml"], ["compose.yaml", "compose.ci.yaml"], ["compose.host.yaml"]):
            self.compose("config", "-q", files=files)
        self.assertEqual(self.engine.docker("run", "--rm", "--network", "none", "--entrypoint", "id", "tandem", "-un").strip(),
                         "tandem")
        output = self.engine.docker("run", "--rm", "--network", "none", "--read-only", "--tmpfs", "/tmp", "--cap-drop", "ALL",
                                    "tandem", "experiment", "table3", "--offline")
        self.assertEqual(len(re.findall(r"\b300/300\b", output)), 8)
        compilers = self.engine.docker("run", "--rm", "--network", "none", "--entrypoint", "sh", "tandem", "-c",
                                       "ls /usr/bin /usr/local/bin | grep -E 'gcc|g[+][+]|cmake|ninja' || true")
        self.assertEqual(compilers, "")

    def container(self, service):
        return self.compose("ps", "-q", service).stdout.strip()

    def inspect(self, service):
        return json.loads(self.engine.docker("inspect", self.container(service)))[0]

    def inside(self, service, *words, check=True):
        """Runs a command in a running container."""
        return self.compose("exec", "-T", service, "tandem", *words, check=check)

    def status(self, service="console"):
        text = self.inside(service, "status", "containers", "--json").stdout  # among the stderr output of others
        return json.JSONDecoder().raw_decode(text, text.index("{"))[0]

    def states(self):
        return [arm["operating_state"] for arm in self.status()["arms"]]

    def until(self, condition, seconds, what):
        try:
            return system.until(condition, seconds, what)
        except AssertionError as error:
            raise AssertionError(f"{error}\n{self.compose('logs', '--no-color').stdout[-4000:]}") from None

    def two_containers(self):
        self.compose("up", "-d")
        for service in ("robot", "console"):
            self.until(lambda: self.inspect(service)["State"]["Health"]["Status"] == "healthy", 90, f"{service} is healthy")
            host = self.inspect(service)["HostConfig"]
            self.assertTrue(host["ReadonlyRootfs"])
            self.assertEqual((host["CapDrop"], host["CapAdd"]), (["ALL"], None))
        self.until(lambda: self.states() == ["DISABLED", "DISABLED"], 60, "the console receives the robot")
        before = self.status()["arms"][0]["joints"]
        self.inside("console", "robot", "-d", "containers", "enable")
        self.assertEqual(self.states(), ["ENABLED", "ENABLED"])
        joints = before[:3] + [before[3] + 0.05] + before[4:]
        self.inside("console", "robot", "-d", "containers", "move-jp", "--arm", "a", "--", *map(str, joints))
        self.assertAlmostEqual(self.status()["arms"][0]["joints"][3], joints[3], places=3)

    def a_process_that_dies(self):
        """Control is killed: its container ends and restarts, and no arm moves."""
        self.assertEqual(self.states(), ["ENABLED", "ENABLED"])
        began = self.inspect("robot")["State"]["StartedAt"]
        self.compose("exec", "-T", "robot", "sh", "-c",
                     "for p in /proc/[0-9]*; do [ \"$(cat $p/comm)\" != tandem-control ] || kill -9 ${p#/proc/}; done")
        self.until(lambda: self.inspect("robot")["State"]["StartedAt"] != began and
                   self.inspect("robot")["State"]["Health"]["Status"] == "healthy", 120, "the robot's container is back")
        self.until(lambda: self.inside("console", "status", "containers", check=False).returncode == 0, 60,
                   "the console receives the robot again")
        self.assertEqual(self.states(), ["DISABLED", "DISABLED"])
        self.compose("down", "-t", "10")

    def secured(self):
        """The same system with credentials in its configuration: it moves, and a client without credentials receives no answer."""
        deployments = self.config / "deployments"
        credentials = self.config / "credentials"
        roots.run([BUILD / "bin" / "tandem", "security", "init", credentials], 60)
        roots.run([BUILD / "bin" / "tandem", "security", "issue", credentials, "--prefix", "tandem", "--domain", "0"], 60)
        user = int(self.engine.docker("run", "--rm", "--network", "none", "--entrypoint", "id", "tandem", "-u"))
        for path in (credentials, *credentials.rglob("*")):
            shutil.chown(path, user)  # keys are readable only by their owner
        bare = (deployments / "containers.yaml").read_text()
        (deployments / "bare.yaml").write_text(bare)
        (deployments / "containers.yaml").write_text(bare + "security: ../credentials\n")
        self.compose("up", "-d")
        self.until(lambda: self.inside("console", "status", "containers", check=False).returncode == 0, 90,
                   "the secured console receives the robot")
        self.assertTrue(self.status()["secured"])
        self.inside("console", "robot", "-d", "containers", "enable")
        self.assertEqual(self.states(), ["ENABLED", "ENABLED"], self.compose("logs", "--no-color").stdout[-4000:])
        stranger = self.inside("console", "robot", "-d", "bare", "disable", check=False)
        self.assertNotEqual(stranger.returncode, 0)
        self.assertIn("not running or not connected", stranger.stdout)
        self.assertEqual(self.states(), ["ENABLED", "ENABLED"])
        self.compose("down", "-t", "10")
        (deployments / "containers.yaml").write_text(bare)

    def experiment(self):
        """As in CI: the exit code is that of the experiment."""
        answer = self.compose("up", "--no-color", "--exit-code-from", "console", files=("compose.yaml", "compose.ci.yaml"),
                              timeout=240)
        self.assertEqual(len(re.findall(r"\b8/8 points", answer.stdout)), 2, answer.stdout[-4000:])
        self.compose("down", "-t", "10", files=("compose.yaml", "compose.ci.yaml"))


if __name__ == "__main__":
    unittest.main(verbosity=2)
