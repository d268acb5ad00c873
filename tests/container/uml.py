# SPDX-License-Identifier: Apache-2.0
"""Boots real systemd from a file system, in user-mode Linux, and runs a script in it."""
import os
import pathlib
import shutil
import subprocess
import tempfile

import roots

NEEDS = {"linux.uml": "user-mode-linux"}
HERE = pathlib.Path(__file__).resolve().parent
KERNEL = HERE.parent / "can" / "linux_uml.sh"
MODULES = ("can-dev", "can", "can-raw", "vcan", "veth")  # in the order of their dependence
# Units of a normal boot that are irrelevant here.
MASKED = ("apt-daily.timer", "apt-daily-upgrade.timer", "e2scrub_all.timer", "fstrim.timer", "getty.target",
          "systemd-logind.service", "e2scrub_reap.service")

UNIT = """\
[Unit]
After=multi-user.target
[Service]
Type=oneshot
ExecStart=/bin/bash /trial/{script}
StandardOutput=file:/trial/log
StandardError=inherit
ExecStopPost=-/bin/journalctl --no-pager --output=short-monotonic --output-fields=MESSAGE
ExecStopPost=/bin/systemctl poweroff -ff
"""


class Machine:
    """One boot; the script and its output are in folder /trial of the file system."""

    def __init__(self, root, script, memory):
        self.root, self.script, self.memory = pathlib.Path(root), script, memory
        self.trial, self.console = self.root / "trial", ""

    def prepare(self):
        self.trial.mkdir()
        for name in ("guest_common.sh", self.script):
            shutil.copy(HERE / name, self.trial)
        wanted = self.root / "etc/systemd/system/multi-user.target.wants"
        wanted.mkdir(exist_ok=True)
        (wanted / "trial.service").symlink_to("../trial.service")
        (self.root / "etc/systemd/system/trial.service").write_text(UNIT.format(script=self.script))

    def prepare_modules(self):
        modules = max(pathlib.Path("/usr/lib/uml/modules").iterdir())
        for name in MODULES:
            for file in modules.rglob(f"{name}.ko*"):
                shutil.copy(file, self.trial / f"{name}.ko")

    def boot(self, limit):
        """Boots, and waits up to `limit` seconds for power-off; after that the log shows how far it came."""
        with tempfile.TemporaryDirectory(prefix="tandem-uml-") as work:
            command = [KERNEL, work, f"mem={self.memory}", "rootfstype=hostfs", f"rootflags={self.root}", "rw",
                       "init=/lib/systemd/systemd", "con=null", "con0=null,fd:1", "quiet", f"umid=tandem{os.getpid()}",
                       f"uml_dir={work}/", *(f"systemd.mask={unit}" for unit in MASKED)]
            with open(f"{work}/console", "w+", encoding="utf-8", errors="replace") as console:
                guest = roots.start(command, console)
                self.favour(guest.pid)
                try:
                    guest.wait(limit)
                except subprocess.TimeoutExpired:
                    pass
                finally:
                    self.end(guest)
                    console.seek(0)
                    self.console = console.read()

    @staticmethod
    def end(guest):
        """User-mode Linux consists of many processes, in sessions of their own."""
        if guest.poll() is None:
            guest.terminate()
            try:
                guest.wait(5)
            except subprocess.TimeoutExpired:
                guest.kill()
                guest.wait()

    @staticmethod
    def favour(pid):
        """Gives the machine, whose programs have deadlines, priority over compilers, if this user may set priorities."""
        try:
            os.setpriority(os.PRIO_PGRP, pid, -15)
            pathlib.Path(f"/proc/{pid}/autogroup").write_text("-15")
        except OSError:
            pass

    def results(self):
        """KEY=VALUE lines that the script has noted."""
        file = self.trial / "results"
        return dict(line.split("=", 1) for line in file.read_text().splitlines()) if file.exists() else {}

    def story(self):
        """Trace and logs, for failure analysis."""
        files = [self.trial / "trace", self.trial / "log"]
        text = "".join(f.read_text(errors="replace")[-8000:] if f.exists() else f"no {f.name}\n" for f in files)
        return text + self.console[-2000:]

    def clean(self):
        shutil.rmtree(self.trial, ignore_errors=True)
        for path in ("trial.service", "multi-user.target.wants/trial.service"):
            (self.root / "etc/systemd/system" / path).unlink(missing_ok=True)
