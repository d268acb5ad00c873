# SPDX-License-Identifier: Apache-2.0
"""A separate container engine: without registry and services of this machine, and removed completely."""
import os
import pathlib
import shutil
import signal
import subprocess
import tempfile
import time

import roots

NEEDS = {**roots.NEEDS, "dockerd": "docker.io", "docker": "docker.io", "docker-compose": "docker-compose", "runc": "runc",
         "ip": "iproute2", "nsenter": "util-linux"}


class Engine:
    """dockerd on a separate folder. start() in this machine's network, or in a network namespace."""

    def __init__(self):
        self.sweep()
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix=f"tandem-docker-{os.getpid()}-"))
        self.daemon = None
        self.namespace = None
        self.environment = {**os.environ, "DOCKER_HOST": f"unix://{self.folder}/socket", "DOCKER_BUILDKIT": "0",
                            "DOCKER_CONFIG": str(self.folder), "COMPOSE_PROJECT_NAME": "tandemtest"}

    @staticmethod
    def sweep():
        """Removes remains of killed tests: their engines ended with them, their folders and network namespaces did not."""
        def dead(name):
            pid = name.removeprefix("tandem-docker-").split("-")[0]
            return pid.isdigit() and not pathlib.Path("/proc", pid).exists()

        for namespace in pathlib.Path("/run/netns").glob("tandem-docker-*"):
            if dead(namespace.name):
                subprocess.run(["ip", "netns", "del", namespace.name], check=False)
        for folder in pathlib.Path(tempfile.gettempdir()).glob("tandem-docker-*"):
            if dead(folder.name):
                shutil.rmtree(folder, ignore_errors=True)

    def start(self, private=False):
        """A private network has only its loopback and what the engine creates."""
        command = ["dockerd", "-H", f"unix://{self.folder}/socket", "--data-root", f"{self.folder}/data", "--exec-root",
                   f"{self.folder}/exec", "-p", f"{self.folder}/pid", "--bridge=none", "--iptables=false",
                   "--ip6tables=false", "--ip-forward=false", "--ip-masq=false", "--oom-score-adjust=0"]
        if private:
            self.namespace = f"tandem-docker-{os.getpid()}"
            roots.run(["ip", "netns", "add", self.namespace], 20)
            roots.run(["ip", "-n", self.namespace, "link", "set", "lo", "up"], 20)
            # Not `ip netns exec`: it mounts /sys anew, without the control groups.
            command = ["nsenter", f"--net=/run/netns/{self.namespace}", *command]
        self.log = open(self.folder / "log", "ab")
        self.daemon = roots.start(command, self.log)
        deadline = time.monotonic() + 60
        while self._docker("info").returncode != 0:
            if self.daemon.poll() is not None or time.monotonic() > deadline:
                raise AssertionError("dockerd does not start:\n" + (self.folder / "log").read_text()[-3000:])
            time.sleep(0.2)

    def stop(self):
        """Orderly shutdown, including containers, containerd and their mounts."""
        if self.daemon is None:
            return
        if self.daemon.poll() is None:
            running = self._docker("ps", "-q").stdout.split()
            if running:
                self._docker("rm", "-f", *running)
            self.daemon.send_signal(signal.SIGTERM)
            try:
                self.daemon.wait(60)
            except subprocess.TimeoutExpired:
                os.killpg(self.daemon.pid, signal.SIGKILL)
                self.daemon.wait()
        self.daemon = None
        self.log.close()
        if self.namespace:
            subprocess.run(["ip", "netns", "del", self.namespace], check=False)
            self.namespace = None

    def close(self):
        self.stop()
        mounts = [line.split()[1] for line in pathlib.Path("/proc/mounts").read_text().splitlines()]
        for mount in sorted((m for m in mounts if m.startswith(f"{self.folder}/")), reverse=True):
            subprocess.run(["umount", "-l", mount], check=False)
        shutil.rmtree(self.folder, ignore_errors=True)

    def _docker(self, *words, timeout=60):
        return subprocess.run(["docker", *words], env=self.environment, stdin=subprocess.DEVNULL, capture_output=True,
                              text=True, timeout=timeout, check=False)

    def docker(self, *words, timeout=120, **more):
        return roots.run(["docker", *words], timeout, env=self.environment, **more)

    def load(self, tarball, name):
        """Imports an image that another machine would pull from a registry."""
        with open(tarball, "rb") as stream:
            answer = subprocess.run(["docker", "import", "-", name], stdin=stream, env=self.environment, capture_output=True,
                                    text=True, timeout=300, check=False)
        if answer.returncode != 0:
            raise AssertionError(answer.stderr)

    def compose(self, folder, *words, timeout=300, check=True, **variables):
        """docker-compose in a folder; returns its exit code and output."""
        answer = subprocess.run(["docker-compose", *words], cwd=folder, env={**self.environment, **variables},
                                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                timeout=timeout, check=False)
        if check and answer.returncode != 0:
            raise AssertionError(f"docker-compose {' '.join(words)}: exit code {answer.returncode}\n{answer.stdout[-5000:]}")
        return answer
