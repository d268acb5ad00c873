# SPDX-License-Identifier: Apache-2.0
"""The packages on a system without Tandem: installed, run under systemd, removed completely.

The first argument is the folder of the executables of a build tree; its packages are in PARENT/packages."""
import pathlib
import re
import sys
import time
import unittest

import machine
import roots
import uml

BUILD = pathlib.Path(sys.argv.pop(1)).resolve().parent
# Exposure levels of systemd-analyze, of 100. The HAL has CAN, and may restart a controller.
EXPOSURE = {"discovery": 18, "hal": 23, "sim": 18, "control": 18, "planning": 18, "recorder": 18, "console": 18}


class Packages(unittest.TestCase):
    """One file system, from the first installation to the check of the removal."""

    def test_installed_run_and_purged(self):
        roots.require({**roots.NEEDS, **uml.NEEDS})
        shared = BUILD.parent / "container"
        self.root = roots.Root(roots.base(shared), shared / "archives")
        self.addCleanup(self.root.close)
        self.root.inside("apt-get", "-q", "update", timeout=300)
        self.root.install("systemd", "systemd-sysv", "iproute2", "kmod")
        before, users = self.root.files(), self.users()
        for step in (self.install, self.experiment, self.module, self.units, self.boot, self.purge):
            began = time.monotonic()
            step()
            print(f"{step.__name__}: {time.monotonic() - began:.1f} s", flush=True)
        self.assertEqual(sorted(self.root.files() - before), [], "left behind")
        self.assertEqual(sorted(before - self.root.files()), [], "removed what was there before")
        self.assertEqual(self.users(), users)

    def users(self):
        return [(self.root.path / "etc" / name).read_text() for name in ("passwd", "group", "shadow", "gshadow")]

    def install(self):
        """All but the libraries for developers, whose dependencies (Ipopt's MPI: ssh, rdma) leave system users behind."""
        packages = roots.packages(BUILD)
        developers = [package for package in packages if package.name.startswith("libtandem-dev")]
        self.assertEqual(len(developers), 1)
        self.root.install(*(package for package in packages if package not in developers))
        self.assertIn("Inst libtandem-dev", self.root.install(*developers, simulate=True))
        self.assertIn("tandem:", (self.root.path / "etc/passwd").read_text())
        pages = sorted(path.name for path in (self.root.path / "usr/share/man/man1").glob("tandem*"))
        commands = self.root.inside("tandem", "__commands").splitlines()
        self.assertEqual(pages, sorted(["tandem.1.gz"] + [f"tandem-{each.replace(' ', '-')}.1.gz" for each in commands]))

    def experiment(self):
        """The paper's table, as the user of the services, with presets, schemas and libraries from packages only."""
        output = self.root.inside("setpriv", "--reuid=tandem", "--regid=tandem", "--init-groups", "--no-new-privs", "tandem",
                                  "experiment", "table3")
        for method in ("nspwln", "nspwln-joint", "nspqp", "snsqp"):
            self.assertRegex(output, rf"\b{method}\b.*\b300/300\b")

    def module(self):
        """The Python module works with presets and library from packages only."""
        output = self.root.inside("python3", "-c", "import tandem; arm = tandem.Robot.load('ark2024').arm('a', model='compliant'); "
                                  "print(arm.forward(arm.sample(10)).shape)")
        self.assertEqual(output.strip(), "(10, 4, 4)")

    def units(self):
        """systemd has no complaints, and the services have no rights that they do not need."""
        self.assertEqual(self.root.inside("tandem", "units", "laptop").split(),
                         [f"tandem-{name}@laptop.service" for name in ("sim", "control", "planning", "recorder", "console")])
        names = [f"tandem-{name}@laptop.service" for name in EXPOSURE]
        output = self.root.inside("systemd-analyze", "verify", "--recursive-errors=yes", "tandem@laptop.target", *names)
        self.assertEqual(output, "")
        for name, unit in zip(EXPOSURE, names):
            output = self.root.inside("systemd-analyze", "security", "--offline=true", f"--threshold={EXPOSURE[name]}", unit)
            print(re.findall(r"exposure level.*\d", output), flush=True)

    def boot(self):
        machine.Boot(self, self.root).run()

    def purge(self):
        mine = self.root.path / "etc/tandem/deployments/mine.yaml"
        mine.write_text("mine\n")
        self.root.inside("apt-get", "-q", "-y", "purge", "tandem-robot")
        self.assertEqual(mine.read_text(), "mine\n", "what people wrote is theirs")
        mine.unlink()
        mine.parent.rmdir()
        mine.parent.parent.rmdir()
        # Packages that others only recommend or suggest (iproute2: python3) were not installed before.
        self.root.inside("apt-get", "-q", "-y", "-o", "APT::AutoRemove::RecommendsImportant=false", "-o",
                         "APT::AutoRemove::SuggestsImportant=false", "autoremove", "--purge")
        self.assertNotIn("tandem", self.root.inside("dpkg", "--get-selections"))


if __name__ == "__main__":
    unittest.main(verbosity=2)
