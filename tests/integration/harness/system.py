# SPDX-License-Identifier: Apache-2.0
"""Control of the real executables: test deployments, `tandem up`, clients, and waiting for events.

The folder of the executables is TANDEM_BIN, or the first argument of the test program."""
import fcntl
import json
import os
import pathlib
import queue
import random
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[3]
PRESETS = SOURCE / "config" / "presets"
_bin = os.environ.get("TANDEM_BIN")
_locks = []


def main():
    """Runs the tests of the calling program; a folder as first argument is that of the executables."""
    global _bin
    if len(sys.argv) > 1 and os.path.isdir(sys.argv[1]):
        _bin = sys.argv.pop(1)
    unittest.main(module="__main__", verbosity=2)


def executable(name="tandem"):
    if not _bin:
        raise RuntimeError("TANDEM_BIN is not set and no folder of executables was given")
    return str(pathlib.Path(_bin) / name)


def seeded(test):
    """A random generator whose seed is printed; TANDEM_SEED repeats a run."""
    seed = int(os.environ.get("TANDEM_SEED", random.SystemRandom().randrange(2**32)))
    print(f"{test.id()}: TANDEM_SEED={seed}", flush=True)
    return random.Random(seed)


def run(*arguments, text=None, timeout=60, program="tandem", inside=(), environment=None):
    """Runs a command to its end; stdout and stderr are texts. `inside`: command prefix that selects another host."""
    return subprocess.run([*inside, executable(program), *map(str, arguments)], input=text, capture_output=True, text=True,
                          timeout=timeout, check=False, env={**os.environ, **(environment or {})})


def client(path, *words, inside=()):
    """A `tandem robot` command to the deployment, left running."""
    return subprocess.Popen([*inside, executable(), "robot", "--deployment", str(path), *map(str, words)],
                            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)


def reap(process):
    """Ends a client, if it still runs."""
    if process.poll() is None:
        process.kill()
        process.wait()
    for stream in (process.stdin, process.stdout, process.stderr):
        if stream:
            stream.close()


def free_domain():
    """A DDS domain that no other test process on this machine uses while this one lives."""
    numbers = list(range(20, 101))  # higher domains share ports with outgoing connections
    random.SystemRandom().shuffle(numbers)
    for number in numbers:
        path = os.path.join(tempfile.gettempdir(), f"tandem-test-domain-{number}")
        lock = os.open(path, os.O_CREAT | os.O_RDWR | os.O_CLOEXEC, 0o666)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(lock)
            continue
        _locks.append(lock)
        return number
    raise RuntimeError("no free DDS domain")


def free_port(kind=socket.SOCK_STREAM):
    """An unused port of 127.0.0.1."""
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def deployment(folder, preset, without=(), **changes):
    """A copy of a preset in `folder`, with an unused domain and prefix, without the processes `without`, and other keys changed or
    appended. A console exists only with the key `console`, since its port is shared by the machine."""
    changes = {"robot": PRESETS / "robots" / "ark2024.yaml", "domain": free_domain(),
               "prefix": f"t{os.getpid()}", "black_box": f"{{directory: {folder}/black-box, memory_mb: 20}}",
               **changes}
    lines = (PRESETS / "deployments" / f"{preset}.yaml").read_text().splitlines()
    left_out = {*without, *(() if "console" in changes else ["console"])}
    lines = [line for line in lines if not any(f"tandem-{name}" in line for name in left_out)]
    for key, value in changes.items():
        kept = [line for line in lines if not line.startswith(f"{key}:")]
        lines = kept + [f"{key}: {value}"]
    path = pathlib.Path(folder) / f"{preset}.yaml"
    path.write_text("\n".join(lines) + "\n")
    return path


def short_experiment(folder, *methods):
    """Configuration 2 of Table 3 with both trajectories: the paper's shapes and distances between points, a twelfth of
    their length."""
    path = pathlib.Path(folder) / "short-experiment.yaml"
    path.write_text(f"""\
tandem: experiment/1
name: table3-short
robot: {PRESETS / "robots" / "ark2024.yaml"}
methods: [{", ".join(methods)}]
relative_gain_per_s: 5
tip_gain_per_s: 3
configurations:
  - name: "2"
    joints:
      - {{arm: arm_a, beta_mm: [-150, -100, -50], alpha_deg: [180, 90, 45]}}
      - {{arm: arm_b, beta_mm: [-130, -120, -100], alpha_deg: [90, -60, -270]}}
trajectories:
  - {{name: rectangle, configurations: ["2"], shape: {{rectangle: {{first_mm: [0, 1.6, 0], second_mm: [-1.6, 0, 0]}}}},
     points: 8, tolerance_mm: 0.88, max_iterations: 100}}
  - {{name: lissajous, configurations: ["2"], shape: {{lissajous: {{amplitude_mm: [0, 0.8, 0.8], cycles: [0, 1, 2]}}}},
     points: 8, tolerance_mm: 0.88, max_iterations: 100}}
""")
    return path


def black_box(folder):
    """Fault metadata of all files of a black box."""
    files = [json.loads(run("info", file, "--json").stdout) for file in sorted(folder.glob("*.mcap"))]
    return "\n".join(words for file in files for words in file["metadata"]["fault"].values())


def until(condition, seconds, what):
    """Evaluates `condition` repeatedly until it is true; every evaluation reads the running system."""
    deadline = time.monotonic() + seconds
    while True:
        answer = condition()
        if answer:
            return answer
        if time.monotonic() > deadline:
            raise AssertionError(f"not within {seconds} s: {what}")


def processes_of(text):
    """Ids of running processes whose command line contains `text`."""
    found = []
    for folder in pathlib.Path("/proc").iterdir():
        if not folder.name.isdigit():
            continue
        try:
            words = (folder / "cmdline").read_bytes()
            state = (folder / "stat").read_text().rsplit(")", 1)[1].split()[0]
        except OSError:
            continue  # it has ended meanwhile
        if text.encode() in words and state != "Z":
            found.append(int(folder.name))
    return found


class Watcher:
    """`tandem status --follow`: status of a system, line by line."""

    def __init__(self, path, inside=()):
        self._changed = threading.Condition()
        self._last, self._ended = None, False
        self._process = subprocess.Popen([*inside, executable(), "status", str(path), "--json", "--follow"],
                                         stdout=subprocess.PIPE, text=True, start_new_session=True)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self._process.stdout:
            with self._changed:
                self._last = json.loads(line)
                self._changed.notify_all()
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    def status(self, seconds=30, parts=None):
        """A status in which all parts, or the given ones, were published after this call."""
        called = time.monotonic_ns()

        def fresh():
            stamps = self._last.get("stamps_ns") if self._last is not None else {}
            return bool(stamps) and min(stamp for part, stamp in stamps.items() if parts is None or part in parts) > called

        with self._changed:
            self._changed.wait_for(lambda: self._ended or fresh(), seconds)
            if not fresh():
                raise AssertionError("`tandem status --follow` " + ("has ended" if self._ended else "says nothing new"))
            return self._last

    def close(self):
        self._process.kill()
        self._process.wait()
        self._reader.join(10)
        self._process.stdout.close()


def may_have_priorities():
    return subprocess.run(["chrt", "--fifo", "1", "true"], stderr=subprocess.DEVNULL, check=False).returncode == 0


def priority():
    """`realtime_priority` of a deployment: 0 where this user may not have one."""
    return 30 if may_have_priorities() else 0


def real_time():
    """Keys of a deployment in real time: as on a robot's PC, real-time priority and the default budgets; wide budgets only where this
    user may not have such priorities."""
    if may_have_priorities():
        return {"realtime_priority": priority()}
    return {"budgets": "{minimum_age_ms: 500, planning_reference_ms: 1000, lease_ms: 2000, clearance_ms: 5000}"}


class System:
    """`tandem up` of one deployment, and commands to it. Use as a context manager, which ends all processes.

    Logs go to `stderr`, to that of the test if it is None. `inside`: command prefix that runs a command on this system's host, with
    several hosts; `parts`: the parts that status() waits for."""

    stderr = None

    def __init__(self, path, inside=(), await_ready=True, parts=None):
        self.path = path
        self.inside = inside
        self.parts = parts
        self.events = []
        self._watcher = None
        self._incoming = queue.Queue()
        self.up = subprocess.Popen([*inside, executable(), "up", str(path), "--json", "--log", "warn"],
                                   stdout=subprocess.PIPE, stderr=self.stderr, text=True, start_new_session=True)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        try:
            self.pids = self.event("started", 20)["pids"]
            if await_ready:
                self.event("ready", 20)
        except BaseException:
            self.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def _read(self):
        for line in self.up.stdout:
            self._incoming.put((time.monotonic(), line))
        self._incoming.put((time.monotonic(), ""))

    def event(self, name, seconds):
        """The next event of that name, with its time of arrival as `at`, s."""
        deadline = time.monotonic() + seconds
        while True:
            try:
                at, line = self._incoming.get(timeout=max(0.0, deadline - time.monotonic()))
            except queue.Empty:
                raise AssertionError(
                    f"`tandem up` did not say '{name}' within {seconds} s; it said {self.events}") from None
            if not line:
                self._incoming.put((at, ""))
                raise AssertionError(f"`tandem up` ended without saying '{name}'; it said {self.events}")
            event = {**json.loads(line), "at": at}
            self.events.append(event)
            if event.get("event") == name:  # a refusal has none
                return event

    def end_watch(self):
        if self._watcher:
            self._watcher.close()
            self._watcher = None

    def close(self):
        self.end_watch()
        for pid in getattr(self, "pids", {}).values():
            if pid in processes_of(str(self.path)):
                os.kill(pid, signal.SIGCONT)
        if self.up.poll() is None:
            self.up.send_signal(signal.SIGINT)
        try:
            self.up.wait(10)
        except subprocess.TimeoutExpired:
            self.up.kill()
            self.up.wait()
        self._reader.join(10)
        self.up.stdout.close()

    # Commands.
    def robot(self, *arguments, timeout=60):
        return run("robot", "--deployment", self.path, *arguments, timeout=timeout, inside=self.inside)

    def status(self):
        """Status published after this call."""
        if not self._watcher:
            self._watcher = Watcher(self.path, self.inside)
        return self._watcher.status(parts=self.parts)

    def joints(self):
        return [arm["joints"] for arm in self.status()["arms"]]

    def states(self):
        return [arm["operating_state"] for arm in self.status()["arms"]]

    def await_motion(self, run_process, seconds=60):
        """Waits until a trajectory runs and the joints move."""
        first = self.joints()

        def moving():
            if run_process.poll() is not None:
                raise AssertionError(f"the run ended early: {run_process.communicate()}")
            status = self.status()
            return status["trajectory"]["phase"] == "running" and [a["joints"] for a in status["arms"]] != first

        until(moving, seconds, "the arms move")

    def assert_still(self, test, looks=2):
        """Asserts bitwise equal joints in `looks` statuses, each with new samples."""
        first = self.joints()
        for _ in range(looks - 1):
            test.assertEqual(first, self.joints(), "a joint moves")
        return first


class SystemTest(unittest.TestCase):
    """A test with a temporary folder and trajectories in it."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="tandem-test-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def trajectory(self, name, displacement_mm, **keys):
        lines = ["tandem: trajectory/1", f"name: {name}", "shape:", f"  line: {{displacement_mm: {displacement_mm}}}"]
        path = self.folder / f"{name}.yaml"
        path.write_text("\n".join(lines + [f"{key}: {value}" for key, value in keys.items()]) + "\n")
        return path

    def long_line(self, seconds=20):
        """A motion of the arms for about that long."""
        return self.trajectory("long", [0, 20, 0], following="timed", speed_mm_per_s=20 / seconds, acceleration_mm_per_s2=5)

    def start(self, preset, **changes):
        system = System(deployment(self.folder, preset, **changes))
        self.addCleanup(system.close)
        return system

    def start_run(self, system, trajectory):
        """Starts a `tandem robot run` that ends with the test."""
        process = client(system.path, "run", trajectory, inside=system.inside)
        self.addCleanup(reap, process)
        return process

    def assert_ok(self, answer):
        self.assertEqual(answer.returncode, 0, answer.stdout + answer.stderr)
        return answer

    def assert_refused(self, answer, *reasons):
        self.assertEqual(answer.returncode, 1, answer.stdout + answer.stderr)
        for reason in reasons:
            self.assertIn(reason, answer.stderr)

    def assert_nothing_left(self):
        until(lambda: not processes_of(str(self.folder)), 2, f"no process of {self.folder} is left")
