# SPDX-License-Identifier: Apache-2.0
"""Random faults of processes, links, disks and clients while the arms move, over real processes.

Every cycle of sim and control is judged from their logs (cycles.py): nothing moves beyond its budget, jumps, is cleared, enabled or moved
without an operator, or loses its cause. After each fault the robot is usable again by the documented way: restart what has ended,
`disable`, `enable`, run.

TANDEM_FAULTS is the number of faults (default 50), or a list as in 3,17,4. The seed is printed, and a fault depends only on it and on its
own number: TANDEM_SEED=N TANDEM_FAULTS=K, repeats fault K alone. reduce_faults.py finds the shortest sequence that fails."""
import collections
import os
import pathlib
import random
import resource
import signal
import subprocess
import sys
import time

TESTS = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS / "integration" / "security"), str(TESTS / "network")]
import cycles  # noqa: E402
import network  # noqa: E402
from credentials import Authority, system  # noqa: E402
from operated import Operator  # noqa: E402

CONTROL_PERIOD, PERIOD = 0.02, 0.004  # s
PROGRAMS = ("sim", "control", "planning")
LACK = network.missing()


def numbers():
    text = os.environ.get("TANDEM_FAULTS", "50")
    return [int(number) for number in text.split(",") if number] if "," in text else list(range(int(text)))


class Robot:
    """The processes of a deployment, started individually as by a service manager. With `hosts`, control and planning run on the second
    one."""

    def __init__(self, path, hosts=()):
        self.path, self._hosts = path, hosts
        self.inside = hosts[1].inside if hosts else []
        self.running = {}
        for name in PROGRAMS:
            self.start(name)
        self._watchers, self.observers_restarted = {}, 0

    def spawn(self, program, *words, host=1):
        inside = self._hosts[host].inside if self._hosts else []
        return subprocess.Popen([*inside, system.executable(program), "--deployment", str(self.path), *words], start_new_session=True)

    def start(self, name):
        self.running[name] = self.spawn(f"tandem-{name}", "--log", "critical", host=0 if name == "sim" else 1)

    def restart_what_ended(self):
        for name, process in list(self.running.items()):
            if process.poll() is not None:
                self.start(name)

    def robot(self, *words):
        return system.run("robot", "--deployment", self.path, *words, inside=self.inside)

    def _observed(self, host, parts):
        """Status by an observer on that host, which is started again if it receives nothing new: rarely, a secured participant does not
        find a restarted one."""
        if host not in self._watchers:
            self._watchers[host] = system.Watcher(self.path, self._hosts[host].inside if self._hosts else ())
        try:
            return self._watchers[host].status(parts=parts)
        except AssertionError:
            self._watchers.pop(host).close()
            self.observers_restarted += 1
            raise

    def status(self, *parts):
        return self._observed(1, parts or None)

    def joints(self):
        """By the host of the simulator: the other one may be cut off."""
        def received():
            try:
                return [arm["joints"] for arm in self._observed(0, ("state",))["arms"]]
            except AssertionError:
                return None

        return system.until(received, 60, "an observer receives the joints")

    def close(self):
        for watcher in self._watchers.values():
            watcher.close()
        for process in self.running.values():
            if process.poll() is None:
                process.send_signal(signal.SIGCONT)
                process.kill()
                process.wait()


class RandomFaults(system.SystemTest):
    def setUp(self):
        super().setUp()
        self.seed = system.seeded(self).getrandbits(32)
        self.budgets = cycles.Budgets(CONTROL_PERIOD, PERIOD)

    # Set-ups: one host or two, plain or secured.
    def set_up(self, place, secured):
        folder = self.folder / f"{place}-{'secured' if secured else 'plain'}"
        folder.mkdir(exist_ok=True)
        keys = {"without": ["recorder"], "control_period_s": CONTROL_PERIOD, "sim_period_ms": 1e3 * PERIOD, "cycle_log": folder / "cycles",
                "domain": system.free_domain(), "prefix": f"t{os.getpid()}",
                "realtime_priority": system.priority()}
        if secured:
            authority = Authority(folder / "authority", keys["prefix"], keys["domain"])
            keys["security"] = authority.issue("hal", "control", "planning", "console-operator", "console-viewer", to=folder / "keys")
        hosts, self.wire = (), None
        if place == "hosts":
            hosts = network.Host("robot", "192.168.77.1"), network.Host("console", "192.168.77.2")
            for host in hosts:
                self.undo.append(host.close)
            self.wire = network.Wire(*hosts, self.seed)
            self.undo.append(self.wire.close)
        path = system.deployment(folder, "two-hosts" if hosts else "laptop", **keys)
        path.write_text(path.read_text().replace("tandem-control, host: robot", "tandem-control, host: console"))
        self.robot = Robot(path, hosts)
        self.undo.append(self.robot.close)
        self.operator = Operator(self, self.robot)
        system.until(lambda: len(self.robot.status()["arms"]) == 2, 30, "all processes talk")
        self.logs = folder / "cycles"

    # Faults. Each leaves processes to be restarted, and links as they were, or ends by itself.
    def process(self, *names):
        name = self.random.choice(names or (*PROGRAMS, "client"))
        return name, self.operator.client if name == "client" else self.robot.running[name]

    def kill(self):
        name, process = self.process()
        process.kill()
        process.wait(10)
        return name

    def kill_two(self):
        return f"{self.kill()} and {self.kill()}"

    def end(self):
        name, process = self.process()
        process.terminate()
        process.wait(10)
        return name

    def freeze(self):
        """For less or more than its budget."""
        name, process = self.process()
        duration = self.random.choice((0.01, 0.05, 0.1, 0.3, 1.5)) * self.random.uniform(0.5, 1.5)
        process.send_signal(signal.SIGSTOP)
        time.sleep(duration)
        process.send_signal(signal.SIGCONT)
        return f"{name} for {duration:.3f} s"

    def restart(self):
        """At once, as a service manager does."""
        name, process = self.process(*PROGRAMS)
        process.kill()
        process.wait(10)
        self.robot.start(name)
        return name

    def no_memory(self):
        """No further address space: the process ends, or goes on without."""
        name, process = self.process(*PROGRAMS)
        pages = int(pathlib.Path(f"/proc/{process.pid}/statm").read_text().split()[0])
        limit = pages * os.sysconf("SC_PAGE_SIZE")
        subprocess.run(["prlimit", f"--pid={process.pid}", f"--as={limit}:"], check=True)
        time.sleep(self.random.uniform(0.1, 1.0))
        if process.poll() is None:
            subprocess.run(["prlimit", f"--pid={process.pid}", "--as=unlimited:"], check=True)
        return f"{name}, which {'goes on' if process.poll() is None else 'ended'}"

    def full_disk(self):
        """A recording ends at the end of the disk; the robot goes on."""
        limit = self.random.choice((10_000, 100_000, 1_000_000))
        recording = subprocess.run([*self.robot.inside, system.executable(), "record", str(self.robot.path), "--for", "1.5", "--output",
                                    str(self.folder / f"{self.number}.mcap")], capture_output=True, text=True, check=False, timeout=30,
                                   preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
        return f"at {limit} bytes; the recording ended with {recording.returncode}"

    def second_master(self):
        """A second control commands the same drives."""
        second = self.robot.spawn("tandem-control", "--log", "critical", host=self.random.choice((0, 1)))
        time.sleep(self.random.uniform(0.5, 2.0))
        second.kill()
        second.wait()
        return "control"

    def second_client(self):
        """Another operator's requests, without the lease."""
        what = self.random.choice(("enable", "resume", "pause"))
        self.robot.robot(what)
        return what

    def stop(self):
        self.assert_ok(self.robot.robot("stop"))
        return ""

    def stale_requests(self):
        """Everything that clients sent in the motion before is sent once more."""
        return self.replay("control/request", "planning/request")

    def stale_stream(self):
        """Commands and references of the motion before: late, repeated, out of order."""
        return self.replay(*self.random.choice((("actuation/command",), ("planning/reference",), ("actuation/state",))))

    def replay(self, *topics):
        answer = system.run("replay", self.recording, "--deployment", self.robot.path, "--for", 2, "--topics", *topics,
                            inside=self.robot.inside)
        self.assert_ok(answer)
        return " ".join(topics)

    def trouble(self, duration, **keys):
        for key, value in keys.items():
            setattr(self.wire, key, value)
        time.sleep(duration)
        for key in keys:
            setattr(self.wire, key, type(keys[key])())
        return f"{keys} for {duration:.2f} s"

    def cut(self):
        return self.trouble(self.random.choice((0.02, 0.1, 0.5, 2.0)) * self.random.uniform(0.5, 1.5), cut=True)

    def slow(self):
        return self.trouble(self.random.uniform(0.3, 2.0), delay=self.random.choice((0.005, 0.02, 0.05, 0.3)))

    def lost(self):
        return self.trouble(self.random.uniform(0.3, 2.0), loss=self.random.choice((0.02, 0.1, 0.5)))

    def doubled(self):
        return self.trouble(self.random.uniform(0.3, 2.0), duplicates=self.random.uniform(0.1, 1.0))

    def reordered(self):
        return self.trouble(self.random.uniform(0.3, 2.0), jitter=self.random.choice((0.005, 0.02, 0.1)))

    ANYWHERE = (kill, kill_two, end, freeze, freeze, restart, no_memory, second_master, second_client, stop)
    WITHOUT_SECURITY = (full_disk, stale_requests, stale_stream)  # a client may record and replay what it may not read and write otherwise
    OF_LINKS = (cut, slow, lost, doubled, reordered)

    # One fault after the other.
    def record_a_motion(self):
        """For faults that repeat old messages."""
        self.recording = self.robot.path.parent / "motion.mcap"
        recorder = subprocess.Popen([*self.robot.inside, system.executable(), "record", str(self.robot.path), "--output",
                                     str(self.recording)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.recover()
        system.until(lambda: self.operator.begin_motion(self.long_line()) or self.recover(), 60, "a motion to be recorded")
        empty = self.recording.stat().st_size
        system.until(lambda: self.recording.stat().st_size > empty + 50_000, 60, "the motion is in the recording")
        self.recover()
        recorder.send_signal(signal.SIGINT)
        recorder.wait(20)

    def recover(self):
        """The documented way: restart what has ended; no arm moves or has power; `disable` clears what latched."""
        self.robot.restart_what_ended()

        def complete():
            try:
                return len(self.robot.status()["arms"]) == 2
            except AssertionError:
                return False  # a restarted process is not received yet

        system.until(complete, 60, "all processes talk")
        self.operator.end_motion()
        self.assertEqual([arm["operating_state"] for arm in self.robot.status()["arms"]], ["DISABLED"] * 2)

    def one_fault(self):
        deeds = self.ANYWHERE + (self.OF_LINKS if self.wire else ()) + (() if self.recording is None else self.WITHOUT_SECURITY)
        deed = self.random.choice(deeds)
        moves = self.operator.begin_motion(self.long_line())
        detail = ""
        if moves:
            time.sleep(self.random.uniform(0.0, 0.5))  # at any time of the motion
            detail = deed(self)
        self.recover()
        return (f"{deed.__name__} {detail}" if moves else f"before the motion: {self.operator.why}"), deed.__name__

    def run_set_up(self, place, secured, faults):
        self.undo = []
        try:
            self.set_up(place, secured)
            self.recording = None
            if not secured:
                self.record_a_motion()
            self.times = []
            for self.number in faults:
                self.random = random.Random(f"{self.seed}/{self.number}")
                begin = time.monotonic()
                what, kind = self.one_fault()
                self.times.append((begin, self.number))
                self.counts[kind] += 1
                print(f"  {self.number}: {what}", flush=True)
        except BaseException:
            print(f"  TANDEM_FAULTS={getattr(self, 'number', 0)}, with the seed above repeats this fault", flush=True)
            raise
        finally:
            for undo in reversed(self.undo):
                undo()
        self.judge(place, secured)

    def judge(self, place, secured):
        judges = cycles.judged(self.logs, self.budgets, self.operator.windows)
        latched = collections.Counter(faults for judge in judges for _, _, faults in judge.latches)
        late = max(max(judge.log.late) for judge in judges)
        print(f"  {place}, {'secured' if secured else 'plain'}: {sum(len(judge.log.rows) for judge in judges)} cycles of {len(judges)} "
              f"processes, {sum(latched.values())} latches, latest wake-up {1e3 * late:.0f} ms late, "
              f"{self.robot.observers_restarted} observers started again", flush=True)
        for at, text in sorted(violation for judge in judges for violation in judge.violations):
            begun = [number for begin, number in self.times if begin <= at]
            self.wrong.append(f"fault {begun[-1] if begun else 'none'}: {text}")

    def test_random_faults(self):
        self.counts, self.wrong = collections.Counter(), []
        places = ["pc"] if LACK else ["pc", "hosts"]
        set_ups = [(place, secured) for place in places for secured in (False, True)]
        for k, set_up in enumerate(set_ups):
            mine = [number for number in numbers() if number % len(set_ups) == k]
            if mine:
                self.run_set_up(*set_up, mine)
        print(f"  {dict(self.counts)}", flush=True)
        self.assertEqual(self.wrong, [], f"{len(self.wrong)} violations; TANDEM_SEED as above and TANDEM_FAULTS=K, repeat fault K")


if __name__ == "__main__":
    system.main()
