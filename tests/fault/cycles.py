# SPDX-License-Identifier: Apache-2.0
"""Cycle logs (docs/csv.md) of sim, hal and control, judged against docs/safety.md.

Ages are computed here from what each process took and published, on its own clock: an independent second computation. Lateness by the
host is part of those ages, so it explains a stop and excuses none. All times are s of CLOCK_MONOTONIC, which is common to all processes
and to the test."""
import collections
import csv
import dataclasses
import pathlib

DISABLED, ENABLED, PAUSED, FAULT = range(4)
STALE_COMMAND, OUT_OF_SEQUENCE, COMMAND_TIMEOUT, STATE_TIMEOUT, REFERENCE_TIMEOUT, LEASE_LOST = 2, 4, 32, 64, 128, 2048
STOP_REQUESTED = 1024
ENABLE = 2  # request to the drives
PLANNING, TELEOPERATION = 1, 2  # sources of a motion
INFINITE = float("inf")
STILL = 1e-9  # m or rad


@dataclasses.dataclass
class Budgets:
    """Budgets of docs/safety.md at this control period, s."""

    control_period: float
    period: float  # of the drive side
    minimum_age: float = 0.030
    reference: float = 0.250
    operator: float = 0.100
    lease: float = 1.0

    @property
    def age(self):
        return max(self.minimum_age, 3 * self.control_period)

    @property
    def reference_age(self):
        return max(self.reference, 2.5 * self.control_period)

    @property
    def operator_age(self):
        return max(self.operator, 2.5 * self.control_period)


class Windows:
    """What an operator asked for, and when: nothing else may enable, move or clear an arm."""

    def __init__(self):
        self._windows = collections.defaultdict(list)

    def add(self, what, begin, end):
        self._windows[what].append((begin, end))

    def covers(self, what, begin, end):
        """Whether a window overlaps the time from `begin` to `end`."""
        return any(begin <= last and first <= end for first, last in self._windows[what])


def distance(before, after, translations):
    """Longest way of a translation, m."""
    return max(abs(b - a) for a, b, translation in zip(before, after, translations) if translation)


def numbers(cells):
    return [int(cell) if cell else None for cell in cells]


class Log:
    """Lines of one file as dictionaries of the columns that are needed. A last line without its end is left out: its process was killed."""

    def __init__(self, path):
        self.path = pathlib.Path(path)
        lines = self.path.read_text().split("\n")
        rows = csv.reader(lines[:-1])
        self.header = next(rows)
        self._index = {name: number for number, name in enumerate(self.header)}
        self.arms = [name[:-len(".faults")] for name in self.header if name.endswith(".faults")]
        self.rows = [row for row in rows if len(row) == len(self.header)]
        self.now = [1e-9 * int(row[self._index["now_ns"]]) for row in self.rows]
        self.late = [now - 1e-9 * int(row[self._index["scheduled_ns"]]) for now, row in zip(self.now, self.rows)]
        self.lost = int(self.rows[-1][self._index["lost"]]) if self.rows else 0

    def column(self, name):
        return numbers(row[self._index[name]] for row in self.rows)

    def joints(self, arm, what):
        """Lists of values per cycle, over the joints of an arm."""
        of_arm = [number for number, name in enumerate(self.header) if name.startswith(f"{arm}.") and name.endswith(f".{what}")]
        return [[float(row[number]) for number in of_arm] for row in self.rows]

    def translations(self, arm):
        names = [name for name in self.header if name.startswith(f"{arm}.") and name.endswith((".setpoint", ".velocity"))]
        joints = list(dict.fromkeys(name.rsplit(".", 1)[0] for name in names))
        return [not joint.rsplit(".", 1)[1].startswith("alpha") for joint in joints]


class Judge:
    """Violations and measurements of a log."""

    # Changes of an arm's state, and the request that they need.
    ALLOWED = {(DISABLED, ENABLED): "enable", (PAUSED, ENABLED): "resume", (FAULT, DISABLED): "disable"}

    def __init__(self, log, budgets, windows):
        self.log, self.budgets, self.windows = log, budgets, windows
        self.violations = []  # (time, text)
        self.latches = []  # (time, arm, faults): each latch of a fault
        self.stops = []    # (ramp, distance): of each stop of a moving arm, s and m
        if log.lost:
            self.violations.append((log.now[-1], f"{log.path.name}: {log.lost} cycles are missing in the log"))
        self.states = {arm: log.column(f"{arm}.state") for arm in log.arms}
        self.faults = {arm: log.column(f"{arm}.faults") for arm in log.arms}

    def wrong(self, cycle, text):
        self.violations.append((self.log.now[cycle], f"{self.log.path.name}, cycle {self.log.rows[cycle][0]} "
                                                     f"({1e3 * self.log.late[cycle]:.1f} ms late): {text}"))

    def judge_states(self):
        """Only an operator enables, resumes and clears; causes stay until then."""
        for arm in self.log.arms:
            for i in range(1, len(self.log.rows)):
                self._judge_change(arm, i)

    def _judge_change(self, arm, i):
        before, after = self.states[arm][i - 1], self.states[arm][i]
        old, new = self.faults[arm][i - 1], self.faults[arm][i]
        begin, end = self.log.now[i - 1], self.log.now[i]
        if before != after and after == FAULT:
            self.latches.append((end, arm, new))
        if before == FAULT and after not in (FAULT, DISABLED):
            self.wrong(i, f"{arm} left FAULT to state {after}")
        needed = self.ALLOWED.get((before, after))
        if needed and not self.windows.covers(needed, begin, end):
            self.wrong(i, f"{arm} went from state {before} to {after}, and nobody asked for `{needed}`")
        if old & ~new and not self.windows.covers("disable", begin, end):
            self.wrong(i, f"{arm} lost the fault bits {old & ~new}, and nobody asked for `disable`")
        if after == FAULT and new == 0 and not self.windows.covers("disable", begin, end):  # the drives clear theirs after control
            self.wrong(i, f"{arm} is in FAULT without a cause")

    def stops_now(self, i, arms, bit, age, budget, what):
        """An age above its budget stops each of the arms in this cycle, and is the cause unless another one is."""
        for arm in arms:
            if self.states[arm][i] != FAULT:
                self.wrong(i, f"{what} is {1e3 * age:.1f} ms old, allowed {1e3 * budget:.1f} ms, and {arm} did not stop")
            elif self.states[arm][i - 1] != FAULT and not self.faults[arm][i]:
                self.wrong(i, f"{what} is {1e3 * age:.1f} ms old and {arm} stopped without a cause")
            elif not self.faults[arm][i] & bit and not self.faults[arm][i] & ~self.faults[arm][i - 1]:
                self.wrong(i, f"{what} is {1e3 * age:.1f} ms old, and it is not among the causes of {arm}")

    def with_power(self, i, *states):
        return [arm for arm in self.log.arms if self.states[arm][i - 1] in states]


class DriveJudge(Judge):
    """sim or hal."""

    STOP_DECELERATION = (0.1, 20.0)  # default of robot files, m/s^2 and rad/s^2

    def __init__(self, log, budgets, windows, speed=5e-3):
        super().__init__(log, budgets, windows)
        self._speed = speed  # of translations, m/s
        self._sent = dict(zip(log.column("state"), log.now))
        self._fed = None           # when the last command was accepted
        self._last = {}            # number of the last command by session of control
        self._accepted = []        # whether a command was accepted, per cycle
        self._judge_commands()
        self.judge_states()
        if not log.path.name.startswith("hal-"):  # drives move by themselves, too: they keep their own records
            for arm in log.arms:
                self._judge_motion(arm)

    def _judge_commands(self):
        names = ("control_session", "command", "answers_session", "answers_state", "session", "stop")
        columns = zip(*(self.log.column(name) for name in names))
        numbers_seen = collections.deque(maxlen=100)
        session = None
        for i, (control, number, answers_session, answered, own, stop) in enumerate(columns):
            accepted = False
            powered = self.with_power(i, ENABLED, PAUSED) if i else []
            before = [arm for arm in powered if self.states[arm][i - 1] == ENABLED]
            if number is not None:
                age = self.log.now[i] - self._sent.get(answered, -INFINITE) if answers_session == own else INFINITE
                repeated = number <= self._last.get(control, 0)
                accepted = age <= self.budgets.age and not repeated
                if i and powered and age > self.budgets.age:
                    self.stops_now(i, powered, STALE_COMMAND, age, self.budgets.age, "the state that a command answers")
                elif i and powered and repeated:
                    self.stops_now(i, powered, OUT_OF_SEQUENCE, age, self.budgets.age, f"command {number} is repeated; its state")
                elif i and powered and control != session:
                    for arm in powered:
                        if self.states[arm][i] not in (DISABLED, FAULT):
                            self.wrong(i, f"{arm} keeps its power for a command of another control")
                if accepted and (control == session or not any(self.states[arm][i] == FAULT for arm in powered)):
                    session = control
                self._last[control] = max(number, self._last.get(control, 0))
                numbers_seen.append((control, number))
            if i and before:
                self._judge_silence(i, before, accepted, numbers_seen)
            if i and stop:
                self.stops_now(i, powered, STOP_REQUESTED, 0.0, 0.0, "`stop`")
            if accepted:
                self._fed = self.log.now[i]
            self._accepted.append(accepted)

    def _judge_silence(self, i, arms, accepted, numbers_seen):
        """Periods that were missed come before the command that was taken in this cycle."""
        period = self.budgets.period
        # With a missed period, the arms were stepped at this time before the command was taken.
        last = self.log.now[i] - period if accepted else self.log.now[i]
        missed = self.log.now[i] - self.log.now[i - 1] >= 2 * period
        silence = last - self._fed if self._fed is not None and (missed or not accepted) else 0.0
        if silence > self.budgets.age + 2 * period:
            self.stops_now(i, arms, COMMAND_TIMEOUT, silence, self.budgets.age, "the last command")
        for arm in arms:
            timed_out = self.faults[arm][i] & ~self.faults[arm][i - 1] & COMMAND_TIMEOUT
            if timed_out and silence <= self.budgets.age - period and not self._lost(numbers_seen):
                self.wrong(i, f"{arm} reports a silence, but the last command is {1e3 * silence:.1f} ms old and none is lost")

    @staticmethod
    def _lost(numbers_seen):
        return any(b[1] - a[1] > 1 for a, b in zip(numbers_seen, list(numbers_seen)[1:]) if a[0] == b[0])

    def _ramp(self, speeds, translations):
        """Time and distance (of the translations) of a stop ramp from these speeds."""
        limits = [self.STOP_DECELERATION[0 if translation else 1] for translation in translations]
        time = max((abs(speed) / limit for speed, limit in zip(speeds, limits)), default=0.0)
        return time, max((abs(v) for v, translation in zip(speeds, translations) if translation), default=0.0) * time / 2

    def _judge_motion(self, arm):
        positions, translations = self.log.joints(arm, "position"), self.log.translations(arm)
        now, period = self.log.now, self.budgets.period
        until = -INFINITE       # the arm may move until then
        speeds = [0.0] * len(translations)
        stopping = None         # cycle in which a stop began, joints before it, and the permitted distance
        for i in range(1, len(positions)):
            step = [b - a for a, b in zip(positions[i - 1], positions[i])]
            elapsed = min(now[i] - now[i - 1], 1.0) + period
            moved = distance(positions[i - 1], positions[i], translations)
            moves = any(abs(x) > STILL for x in step)
            enabled = self.states[arm][i] == ENABLED
            if moved > self._speed * (elapsed + period) + STILL:
                self.wrong(i, f"{arm} jumps by {1e3 * moved:.4f} mm in {1e3 * elapsed:.1f} ms")
            if moves and not self.windows.covers("motion", now[i - 1], now[i]):
                self.wrong(i, f"{arm} moves by {1e3 * moved:.6f} mm, and nobody asked for a motion")
            left = max(0.0, until - now[i - 1])
            if i > 1 and moves and moved > self._speed * (left + 2 * period):
                self.wrong(i, f"{arm} moves by {1e3 * moved:.6f} mm {1e3 * (now[i] - until):.1f} ms after it should stand")
            if moves:
                # An arm advances by whole periods, however late the cycle is.
                time = max(1, int((now[i] - now[i - 1]) / period)) * period
                speeds = [max(abs(x) / time, 0.5 * v) for x, v in zip(step, speeds)]
            ramp, way = self._ramp(speeds, translations)
            if enabled and self._accepted[i]:
                until = now[i] + self.budgets.control_period + ramp + 2 * period
            elif not enabled:
                until = min(until, now[i] + ramp + 2 * period)
            if self.states[arm][i - 1] == ENABLED and not enabled:
                stopping = (i, positions[i - 1], way + self._speed * (elapsed + self.budgets.control_period))
            if stopping:
                stopping = self._judge_stop(i, arm, stopping, distance(stopping[1], positions[i], translations), moves)

    def _judge_stop(self, i, arm, stopping, way, moves):
        """@return as `stopping`; None when the arm stands."""
        begin, _, permitted = stopping
        if way > permitted + STILL:
            self.wrong(i, f"{arm} has moved by {1e3 * way:.4f} mm since it stopped, permitted {1e3 * permitted:.4f} mm")
            return None
        if moves:
            return stopping
        if i > begin:
            self.stops.append((self.log.now[i] - self.log.now[begin], way))
        return None


class ControlJudge(Judge):
    """control. It also shows the power of arms that another control has enabled: what enables an arm is its request to the drives."""

    ALLOWED = {(FAULT, DISABLED): "disable"}

    def __init__(self, log, budgets, windows):
        super().__init__(log, budgets, windows)
        self._commands = dict(zip(log.column("command"), log.now))
        self._statuses = dict(zip(log.column("status"), log.now))
        self._judged = None  # the last reference judged
        self._enabled = {arm: self._enabled_here(arm) for arm in log.arms}
        self.judge_states()
        self._judge_requests()
        self._judge_ages()

    def _enabled_here(self, arm):
        """Per cycle whether this process has enabled the arm, and no other control."""
        here, answer = False, []
        for request, state in zip(self.log.column(f"{arm}.request"), self.states[arm]):
            here = request == ENABLE or (here and state in (ENABLED, PAUSED))
            answer.append(here)
        return answer

    def _judge_requests(self):
        for arm in self.log.arms:
            for i, request in enumerate(self.log.column(f"{arm}.request")):
                begin, end = self.log.now[i - 1 if i else 0], self.log.now[i]
                asked = any(self.windows.covers(what, begin, end) for what in ("enable", "motion"))  # `run` enables, too
                if request == ENABLE and not asked:
                    self.wrong(i, f"the drives of {arm} are asked for power, and nobody asked for `enable`")

    def _judge_ages(self):
        names = ("state_session", "state", "answers_command", "reference", "answers_status", "lease_client", "lease_answers",
                 "input", "input_answers", "lease", "source")
        moving = {arm: self.log.column(f"{arm}.moving") for arm in self.log.arms}
        answered = reference = given = None
        session = fed = owner = source_before = None
        for i, (state_session, _, command, _, status, client, lease_status, _, input_status, lease, source) in enumerate(
                zip(*(self.log.column(name) for name in names))):
            now = self.log.now[i]
            if state_session is not None:
                restarted, session, answered = session not in (None, state_session), state_session, command
            else:
                restarted = False
            reference = status if status is not None else reference
            given = input_status if input_status is not None else given
            if i:
                self._judge_cycle(i, now, answered, restarted, reference, given, source_before, moving, fed, owner)
            if client is not None and now - self._statuses.get(lease_status, -INFINITE) <= self.budgets.lease:
                fed = self._statuses[lease_status]
            owner, source_before = lease, source

    def _judge_cycle(self, i, now, answered, restarted, reference, given, source, moving, fed, owner):
        enabled = [arm for arm in self.with_power(i, ENABLED) if self._enabled[arm][i - 1]]
        if not enabled:
            return
        state_age = now - self._commands.get(answered, -INFINITE)
        if state_age > self.budgets.age and not restarted:
            self.stops_now(i, enabled, STATE_TIMEOUT, state_age, self.budgets.age, "the command that the last state answers")
        age = now - self._statuses.get(reference, -INFINITE)
        silent = reference == self._judged or any(moving[arm][i] for arm in enabled)  # a new reference may end the motion instead
        self._judged = reference
        if source == PLANNING and age > self.budgets.reference_age and silent:
            self.stops_now(i, enabled, REFERENCE_TIMEOUT, age, self.budgets.reference_age, "the status that the last reference answers")
        age = now - self._statuses.get(given, -INFINITE)
        if source == TELEOPERATION and age > self.budgets.operator_age and any(moving[arm][i] for arm in enabled):
            allowed = 1e3 * self.budgets.operator_age
            self.wrong(i, f"an operator's input is {1e3 * age:.1f} ms old, allowed {allowed:.1f} ms, and moves an arm")
        was_moving = any(moving[arm][i - 1] for arm in enabled)
        if owner and fed is not None and was_moving and now - fed > self.budgets.lease:
            self.stops_now(i, enabled, LEASE_LOST, now - fed, self.budgets.lease, "the last heartbeat of the lease owner")


def judged(folder, budgets, windows):
    """Judges of all logs of a folder, ordered by the beginning of the log."""
    judges = []
    for path in sorted(pathlib.Path(folder).glob("*.csv")):
        log = Log(path)
        if len(log.rows) > 1:
            judges.append((ControlJudge if path.name.startswith("control-") else DriveJudge)(log, budgets, windows))
    return sorted(judges, key=lambda judge: judge.log.now[0])


def latched_between(judges, begin, end):
    """Fault bits that drives or control latched in that time."""
    bits = 0
    for judge in judges:
        for at, _, faults in judge.latches:
            if begin <= at <= end:
                bits |= faults
    return bits
