# SPDX-License-Identifier: Apache-2.0
"""File systems for package installations: a small Debian 12 from this machine's package sources."""
import ctypes
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

SOURCES = pathlib.Path("/etc/apt/sources.list.d/debian.sources")
MOST_AGE = 7 * 24 * 3600  # s, of a base that is reused
PR_SET_PDEATHSIG = 1
NEEDS = {"mmdebstrap": "mmdebstrap", "unshare": "util-linux", "dpkg": "dpkg"}


# A test that receives SIGTERM cleans up first.
signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))


def start(command, output):
    """Starts a process that ends with the test: it receives SIGTERM when this process ends, for whatever reason."""
    def bind():
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, int(signal.SIGTERM))

    return subprocess.Popen([str(word) for word in command], stdin=subprocess.DEVNULL, stdout=output, stderr=output,
                            start_new_session=True, preexec_fn=bind)


def require(tools):
    """Fails with all missing tools: these tests are never skipped."""
    if os.geteuid() != 0:
        raise AssertionError("these tests make file systems and namespaces: run them as root")
    missing = [f"{tool} (package {package})" for tool, package in tools.items() if not shutil.which(tool)]
    if missing:
        raise AssertionError("not installed: " + ", ".join(missing))


def run(command, timeout, **more):
    """Runs a command to its end; fails with its output if the exit code is not 0."""
    answer = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                            stdin=subprocess.DEVNULL, timeout=timeout, check=False, **more)
    if answer.returncode != 0:
        raise AssertionError(f"{' '.join(map(str, command))}: exit code {answer.returncode}\n{answer.stdout[-6000:]}")
    return answer.stdout


def packages(build):
    """The packages built by this build tree."""
    found = sorted(pathlib.Path(build, "packages").glob("*.deb"))
    if not found:
        raise AssertionError(f"no package in {build}/packages; `cpack` in {build} makes them")
    return found


def base(folder):
    """A tarball with the smallest Debian 12 that has apt; renewed once a week."""
    tarball = pathlib.Path(folder) / "base.tar"
    if tarball.exists() and time.time() - tarball.stat().st_mtime < MOST_AGE:
        return tarball
    tarball.parent.mkdir(parents=True, exist_ok=True)
    fresh = tarball.with_suffix(f".{os.getpid()}.tar")
    try:
        sources = [str(SOURCES)] if SOURCES.exists() else []
        run(["mmdebstrap", "--quiet", "--variant=minbase", "--include=ca-certificates", "bookworm", fresh, *sources], 600)
        fresh.rename(tarball)
    finally:
        fresh.unlink(missing_ok=True)
    return tarball


class Root:
    """A separate file system in a temporary folder; commands in it have separate mounts and processes."""

    def __init__(self, tarball, archives):
        self.path = pathlib.Path(tempfile.mkdtemp(prefix="tandem-root-"))
        self.archives = pathlib.Path(archives)
        self.archives.mkdir(parents=True, exist_ok=True)
        run(["tar", "-C", self.path, "-xf", tarball], 120)
        shutil.copy("/etc/resolv.conf", self.path / "etc/resolv.conf")
        # Prevents packages from starting services.
        (self.path / "usr/sbin/policy-rc.d").write_text("#!/bin/sh\nexit 101\n")
        (self.path / "usr/sbin/policy-rc.d").chmod(0o755)

    def inside(self, *words, timeout=120):
        """Output of a command that runs in this file system as root."""
        script = (f"mount --bind {self.archives} {self.path}/var/cache/apt/archives && "
                  f"mount -t proc proc {self.path}/proc && mount -t tmpfs tmpfs {self.path}/run && "
                  f'exec chroot {self.path} /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 '
                  'DEBIAN_FRONTEND=noninteractive "$@"')
        return run(["unshare", "--mount", "--pid", "--fork", "--kill-child", "bash", "-c", script, "-", *words], timeout)

    def install(self, *what, simulate=False):
        """Installs packages by name or as files, with their dependencies and without recommended packages; or prints the planned
        actions."""
        names = []
        for item in what:
            if isinstance(item, pathlib.Path):
                shutil.copy(item, self.path / "root")
                names.append(f"/root/{item.name}")
            else:
                names.append(item)
        words = ["apt-get", "-q", "-y", "-o", "APT::Keep-Downloaded-Packages=true", "-o", "APT::Sandbox::User=root",
                 "install", "--no-install-recommends", *(["--simulate"] if simulate else []), *names]
        output = self.inside(*words, timeout=400)
        for item in what:
            if isinstance(item, pathlib.Path):
                (self.path / "root" / item.name).unlink()
        return output

    def files(self):
        """All paths except the records of package tools and systemd."""
        own = ("/var/lib/dpkg", "/var/lib/apt", "/var/lib/systemd", "/var/cache", "/var/log", "/proc", "/run", "/tmp")
        found = set()
        for folder, folders, names in os.walk(self.path):
            here = "/" + os.path.relpath(folder, self.path).removeprefix(".")
            folders[:] = [name for name in folders if os.path.join(here, name) not in own]
            found.update(os.path.join(here, name) for name in folders + names)
        return found

    def close(self):
        """The mounts have ended with the processes."""
        subprocess.run(["rm", "-rf", "--one-file-system", str(self.path)], check=False)
