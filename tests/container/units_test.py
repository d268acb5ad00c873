# SPDX-License-Identifier: Apache-2.0
"""Settings of all units in a booted systemd, and of the processes that it starts.

Settings in a file may be overridden: systemd reads drop-ins after the unit's own file. The first argument is the folder of the
executables of a build tree."""
import pathlib
import re
import shutil
import subprocess
import sys
import time
import unittest

import machine
import roots
import uml

BUILD = pathlib.Path(sys.argv.pop(1)).resolve().parent
UNITS = pathlib.Path(__file__).resolve().parents[2] / "deploy" / "systemd"
LIMIT = 600  # s, from power on to power off
MB = 1 << 20
GREEDY = 40  # MB, of a recorder that needs more
GUARDED, STRANGER = "10.66.0.1", "10.66.0.2"
PRIORITY = 70  # of the periodic thread; above those of the units
FIFO, OTHER = "1", "0"

# Properties in `systemctl show` of every unit.
SHARED = {
    "Type": "notify", "NotifyAccess": "main", "TimeoutStartUSec": "1min", "TimeoutStopUSec": "5s", "TimeoutAbortUSec": "2s",
    "Restart": "on-failure", "RestartUSec": "1s", "RestartPreventExitStatus": "2 3", "StartLimitIntervalUSec": "1min",
    "StartLimitBurst": "5", "OOMPolicy": "stop",
    "User": "tandem", "Group": "tandem", "UMask": "0027", "LimitRTPRIO": "90", "LimitMEMLOCK": "infinity",
    "MemorySwapMax": "0", "MemoryHigh": "infinity",
    "NoNewPrivileges": "yes", "CapabilityBoundingSet": "", "AmbientCapabilities": "", "ProtectSystem": "strict",
    "ProtectHome": "yes", "PrivateTmp": "yes", "PrivateDevices": "yes", "DevicePolicy": "closed", "ProtectClock": "yes",
    "ProtectControlGroups": "yes", "ProtectHostname": "yes", "ProtectKernelLogs": "yes", "ProtectKernelModules": "yes",
    "ProtectKernelTunables": "yes", "ProtectProc": "invisible", "ProcSubset": "pid", "RestrictNamespaces": "yes",
    "RestrictSUIDSGID": "yes", "LockPersonality": "yes", "MemoryDenyWriteExecute": "yes", "KeyringMode": "private",
    "RestrictAddressFamilies": "AF_INET AF_NETLINK AF_UNIX", "SystemCallArchitectures": "native", "SystemCallErrorNumber": "1",
    "Nice": "0", "CPUSchedulingPolicy": OTHER, "CPUSchedulingPriority": "0", "StateDirectory": "",
}


def unit(memory, oom, watchdog, **more):
    return {"MemoryMax": str(memory * MB), "OOMScoreAdjust": str(oom), "WatchdogUSec": watchdog, **more}


def realtime(priority):
    return {"CPUSchedulingPolicy": FIFO, "CPUSchedulingPriority": str(priority)}


# Properties that differ or are added by unit.
OWN = {
    "discovery": unit(256, -900, "10s"),
    "hal": unit(1536, -900, "2s", **realtime(30), CapabilityBoundingSet="cap_net_admin", AmbientCapabilities="cap_net_admin",
                RestrictAddressFamilies="AF_CAN AF_INET AF_NETLINK AF_UNIX", StateDirectory="tandem"),
    "sim": unit(1536, -900, "2s", **realtime(30)),
    "control": unit(2048, -900, "2s", **realtime(20)),
    "planning": unit(1024, -900, "10s", **realtime(10)),
    "recorder": unit(1024, 0, "10s", Nice="5", StateDirectory="tandem"),
    "console": unit(1536, 0, "10s", Nice="5", StateDirectory="tandem"),
}
# Relations to other units, among those that systemd adds automatically.
RELATIONS = {name: {"PartOf": {"tandem@{}.target"}, "Wants": {"network-online.target"}, "After": {"network-online.target"},
                    "Before": set(), "Conflicts": set()} for name in OWN}
RELATIONS["hal"]["Conflicts"] = {"tandem-sim@{}.service"}
RELATIONS["sim"]["Conflicts"] = {"tandem-hal@{}.service"}
RELATIONS["control"]["After"] |= {"tandem-hal@{}.service", "tandem-sim@{}.service"}
RELATIONS["planning"]["After"] |= {"tandem-control@{}.service"}
RELATIONS["discovery"]["Before"] |= {f"tandem-{name}@{{}}.service" for name in ("hal", "sim", "control", "planning")}
# Some permitted and some forbidden system calls of the filter.
CALLS, FORBIDDEN = {"read", "mlockall", "sched_setscheduler", "sendmmsg"}, {"mount", "ptrace", "setuid", "bpf", "add_key", "reboot"}
# The deployment with which each is started.
DEPLOYMENTS = {**{name: "units" for name in OWN}, "discovery": "met", "hal": "bench"}


def files_of(name):
    """The unit's own file and its drop-ins."""
    folders = [UNITS / "tandem-.service.d", UNITS / f"tandem-{name}@.service.d"]
    return [UNITS / f"tandem-{name}@.service", *(file for folder in folders for file in sorted(folder.glob("*.conf")))]


def named_in(name):
    """Properties set in those files, for any value."""
    keys = re.findall(r"(?m)^(\w+)=", "\n".join(re.sub(r"(?ms)^\[Install\].*", "", f.read_text()) for f in files_of(name)))
    return {re.sub("Sec$", "USec", key) for key in keys} - {"Description"}


def differences(found, wanted):
    return [f"found {key}={found.get(key)}, expected {value or 'nothing'}" for key, value in wanted.items()
            if found.get(key) != value]


class Units(unittest.TestCase):
    def setUp(self):
        roots.require({**roots.NEEDS, **uml.NEEDS, "cmake": "cmake"})

    def test_the_table_names_all_that_the_files_set(self):
        self.assertEqual({file.name for file in UNITS.glob("*.service")}, {f"tandem-{name}@.service" for name in OWN})
        for name in OWN:
            known = {*SHARED, *OWN[name], *RELATIONS[name], "ExecStart", "SystemCallFilter"}
            self.assertEqual(named_in(name) - known, set(), name)

    def test_what_systemd_does(self):
        began = time.monotonic()
        shared = BUILD.parent / "container"
        self.root = roots.Root(roots.base(shared), shared / "archives")
        self.addCleanup(self.root.close)
        self.root.inside("apt-get", "-q", "update", timeout=300)
        self.root.install("systemd", "systemd-sysv", "iproute2", "kmod")
        self.install()
        self.deployments()
        print(f"installed: {time.monotonic() - began:.1f} s", flush=True)
        self.boot()
        print(f"run: {time.monotonic() - began:.1f} s", flush=True)

    def install(self):
        """Installs as package tandem-robot does, without the packages that it depends on: their libraries are copied from this machine."""
        roots.run(["cmake", "--install", BUILD, "--prefix", self.root.path / "usr", "--component", "robot"], 120)
        programs = sorted((self.root.path / "usr/bin").glob("tandem*"))
        output = subprocess.run(["ldd", *programs], stdout=subprocess.PIPE, text=True, check=True).stdout
        for library in sorted(set(re.findall(r"=> (/\S+)", output))):
            target = self.root.path / library.lstrip("/")
            if not target.exists():
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(library, target)
        self.root.inside("ldconfig")
        self.root.inside("adduser", "--quiet", "--system", "--group", "--home", "/nonexistent", "--no-create-home", "tandem")

    def deployments(self):
        share, etc = self.root.path / "usr/share/tandem", self.root.path / "etc/tandem"
        for name in ("deployments", "hardware"):
            (etc / name).mkdir(parents=True)

        def write(name, more):
            machine.edit(share / "deployments/laptop.yaml", etc / f"deployments/{name}.yaml",
                         {"name": name, "robot": "ark2024", "sim_period_ms": "20", "status_period_ms": "200"}, more)

        realtime = f"realtime_priority: {PRIORITY}\nlock_memory: true\n"
        write("units", f"{realtime}budgets: {machine.SLOW_BUDGETS}\n")
        write("met", "discovery: {server: 127.0.0.1}\n")
        write("greedy", "")
        # One system, and a stranger with its complete configuration at an address of none of its hosts.
        for name, address, peers in (("guarded", GUARDED, [GUARDED]), ("stranger", STRANGER, [GUARDED, STRANGER])):
            target = etc / f"deployments/{name}.yaml"
            machine.edit(share / "deployments/laptop.yaml", target,
                         {"name": name, "robot": "ark2024", "sim_period_ms": "20", "interface_address": address,
                          "peers": f"[{', '.join(peers)}]", "domain": "66"})
            for process in ("control", "planning", "recorder", "console"):
                machine.leave_out(target, process, 1)
        # Drop-in as written by `systemctl edit`; with the unit's own limit it takes half a minute to reach it.
        folder = self.root.path / "etc/systemd/system/tandem-recorder@greedy.service.d"
        folder.mkdir(parents=True)
        (folder / "override.conf").write_text(f"[Service]\nMemoryMax={GREEDY * MB}\n")
        (etc / "deployments/wrong.yaml").write_text("tandem: deployment/1\nname: wrong\nrobot: nowhere\n")
        machine.bench(share, etc, realtime)

    def machine(self):
        guest = uml.Machine(self.root.path, "units.sh", "2G")
        guest.prepare()
        guest.prepare_modules()
        properties = {"SystemCallFilter", *SHARED, *(key for name in OWN for key in {**OWN[name], **RELATIONS[name]})}
        (guest.trial / "properties").write_text(",".join(sorted(properties)))
        (guest.trial / "units").write_text("".join(f"{name} {deployment}\n" for name, deployment in DEPLOYMENTS.items()))
        return guest

    def boot(self):
        guest = self.machine()
        guest.boot(LIMIT)
        seen = guest.results()
        print(seen, flush=True)
        try:
            self.assertIn("end", seen)
        except AssertionError:
            print(guest.story(), flush=True)
            raise
        for name in OWN:
            with self.subTest(name, judged="settings"):
                self.judge_settings(name, (guest.trial / f"show-{name}").read_text())
            with self.subTest(name, judged="process"):
                self.judge_process(name, seen)
        self.judge_ends(seen)
        self.judge_addresses(seen)

    def judge_settings(self, name, text):
        said = dict(line.split("=", 1) for line in text.splitlines())
        wanted = {**SHARED, **OWN[name]}
        self.assertEqual(differences(said, wanted), [])
        for key, others in RELATIONS[name].items():
            self.assertLessEqual({other.format(DEPLOYMENTS[name]) for other in others}, set(said[key].split()), key)
        calls = set(said["SystemCallFilter"].split())
        self.assertEqual((CALLS - calls, FORBIDDEN & calls), (set(), set()))

    def judge_process(self, name, seen):
        """The same properties, according to the kernel, of a process started by this systemd."""
        wanted = {**SHARED, **OWN[name]}
        expected = {"active": "active", "program": f"/usr/bin/tandem-{name}", "user": "tandem", "oom": wanted["OOMScoreAdjust"],
                    "nice": wanted["Nice"], "memory": wanted["MemoryMax"], "swap": "0"}
        found = {key: seen.get(f"{name}_{key}") for key in expected}
        self.assertEqual(differences(found, expected), [])
        threads = set(seen[f"{name}_threads"].strip(",").split(","))
        if wanted["CPUSchedulingPolicy"] == FIFO:
            own = "SCHED_BATCH 0" if name == "planning" else f"SCHED_FIFO {PRIORITY}"  # the thread that computes, or is periodic
            self.assertEqual(threads, {f"SCHED_FIFO {wanted['CPUSchedulingPriority']}", own})
        else:
            self.assertEqual(threads, {"SCHED_OTHER 0"})
        self.assertLess(2 * int(seen[f"{name}_peak"]), int(wanted["MemoryMax"]), "room")

    def judge_ends(self, seen):
        expected = {"killed": "1 active", "wrong_file": "2 0", "greedy": "oom-kill failed",
                    "greedy_limit": str(GREEDY * MB), "survivor": "active"}
        self.assertEqual(differences(seen, expected), [])
        # Five times within a minute: on a slow machine some of them are older.
        self.assertGreaterEqual(int(seen["greedy_started"]), 5)

    def judge_addresses(self, seen):
        """Addresses from which a service receives before `tandem units --restrict`, and after it."""
        expected = {"open_guarded": "yes", "open_stranger": "yes", "shut_guarded": "yes", "shut_stranger": "no"}
        self.assertEqual(differences(seen, expected), [])
        self.assertEqual(set(seen["shut_deny"].split()), {"::/0", "0.0.0.0/0"})
        self.assertEqual(set(seen["shut_allow"].split()), {"::1/128", f"{GUARDED}/32", "127.0.0.0/8"})


if __name__ == "__main__":
    unittest.main(verbosity=2)
