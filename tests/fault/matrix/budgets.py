# SPDX-License-Identifier: Apache-2.0
"""Time budgets of the fault matrix, in ms after the fault."""
import dataclasses

PERIOD_MS = 4
RAMP_MM_PER_S2 = 100     # stop_deceleration of a translation
STAND_MS = 80            # from FAULT to standstill: 4 mm/s over the ramp is 40 ms, then the drives' position loops converge, with torque
COAST_MS = 50            # additional time of a coasting motor, whose drive cannot brake, or has lost its position
FOLLOWING_MM, FOLLOWING_MS, TOLERANCE_MM, SPEED_MM_PER_S = 0.5, 20, 0.2, 4
FOLLOWING_DEG, SPEED_DEG_PER_S = 2.865, 17.19
MARGIN_MS = 3 * PERIOD_MS  # frames of one cycle are evaluated in the next; the motor's own lag


@dataclasses.dataclass
class Device:
    noticed: object  # None: tolerated
    reason: str
    lag_mm: float = 0.1   # additional distance of a lost axis from its commanded position
    coasts: bool = False  # one motor has lost its brake
    everywhere: bool = False  # the other arm also stops
    late_ms: float = 0.0  # additional time to standstill of slowly stopping motors

    def standing(self):
        """Time from the fault to the standstill of the last axis, ms."""
        return self.noticed + STAND_MS + (COAST_MS if self.coasts else 0) + self.late_ms

    def travel(self, speed_mm_per_s):
        """Greatest travel of a joint, mm: full speed until the detection, then the ramp."""
        seconds = 1e-3 * (self.noticed + MARGIN_MS)
        return speed_mm_per_s * seconds + speed_mm_per_s**2 / (2 * RAMP_MM_PER_S2) + self.lag_mm


def at_once(coasts=False):
    return Device(MARGIN_MS, "2 periods: statusword, emergency or reading", coasts=coasts)


def silent(coasts=False):
    return Device(30 + MARGIN_MS, "silent for 30 ms, 3 SYNCs at least", coasts=coasts)


def mismatch():
    return Device(1e3 * TOLERANCE_MM / SPEED_MM_PER_S + MARGIN_MS, "`tolerance` at this speed")


def following(error=FOLLOWING_MM, speed=SPEED_MM_PER_S):
    return Device(1e3 * error / speed + FOLLOWING_MS + MARGIN_MS + 20,
                  "`following_error` at this speed, `following_time`, lag", lag_mm=0.5)


def lossy():
    return Device(1000, "8 of the last 100 frames: `lost_samples`, or what 30 ms hold")


def foreign(reason="1 period: a frame that is not ours", coasts=False):
    return Device(PERIOD_MS, reason, coasts=coasts)


def slow(device):
    """In velocity mode the HAL closes the position loop, with a gain of 20 1/s."""
    return dataclasses.replace(device, late_ms=40)


def falls(device):
    """Without torque the axis falls, 0.5 m/s^2, until its brake engages after 50 ms: 0.63 mm."""
    return dataclasses.replace(device, lag_mm=0.7)


def fast(device):
    """Homing runs at twice the speed of the other rows."""
    return dataclasses.replace(device, lag_mm=0.35)


def ridden(reason):
    return Device(None, reason)


DEVICES = {
    ("drive", "off", 0): silent(coasts=True),
    ("drive", "stuck", 0): following(),
    ("drive, rotation", "stuck", 0): following(FOLLOWING_DEG, SPEED_DEG_PER_S),
    ("drive", "garbage", 0): at_once(coasts=True),
    ("drive", "wrong", 0): at_once(),
    ("drive", "slow", 0.2): ridden("the joint is fast enough for this speed"),
    ("drive", "slow", 0.001): following(),
    ("drive", "delayed", 20): ridden("20 ms are 0.08 mm here, less than any window"),
    ("drive", "delayed", 300): silent(),
    ("drive", "intermittent", 200): silent(),
    ("drive", "over_current", 0): at_once(coasts=True),
    ("drive", "over_temperature", 0): at_once(),
    ("drive", "encoder_alarm", 0): at_once(coasts=True),
    ("drive", "frame_loss", 0.1): lossy(),
    ("drive", "frame_loss", 1): silent(),
    ("drive", "byte_flips", 0.1): Device(500, "the first flip that matters"),
    ("drive", "babbling", 2000): ridden("11 % of 1 Mbit/s"),
    ("drive", "emergency_stop", 0): at_once(coasts=True),
    ("drive", "overload", 900): ridden("torque is not watched by default"),
    ("drive, torque_limit", "overload", 900): Device(50 + MARGIN_MS, "`time` of `torque_limit`"),
    ("encoder", "off", 0): silent(),
    ("encoder", "stuck", 0): mismatch(),
    ("encoder", "garbage", 0): at_once(),
    ("encoder", "wrong", 50000): at_once(),
    ("encoder", "delayed", 20): ridden("20 ms are 0.08 mm here, less than `tolerance`"),
    ("encoder", "delayed", 300): silent(),
    ("encoder", "intermittent", 200): silent(),
    ("encoder", "encoder_alarm", 0): at_once(),
    ("encoder", "frame_loss", 0.1): lossy(),
    ("encoder", "frame_loss", 1): silent(),
    ("encoder", "byte_flips", 0.1): Device(500, "the first flip that matters"),
    ("encoder", "babbling", 2000): ridden("11 % of 1 Mbit/s"),
    ("drive", "runaway", 0): Device(40, "3 samples above 1.5 times the axis' velocity; torque goes 20 ms later",
                                    lag_mm=2.0, coasts=True, late_ms=60),
    ("one axis moves", "off", 0): silent(coasts=True),
    ("one axis moves", "over_temperature", 0): at_once(),
    ("one axis moves", "encoder_alarm", 0): at_once(),
    ("one axis moves", "wrong", 50000): at_once(),
    ("velocity mode", "off", 0): slow(silent(coasts=True)),
    ("velocity mode", "over_temperature", 0): slow(at_once()),
    ("velocity mode", "encoder_alarm", 0): slow(at_once()),
    ("profile velocity", "off", 0): slow(silent(coasts=True)),
    ("profile velocity", "over_temperature", 0): slow(at_once()),
    ("profile velocity", "encoder_alarm", 0): slow(at_once()),
    ("braked, falls without", "off", 0): falls(silent(coasts=True)),
    ("braked, falls without", "over_temperature", 0): falls(at_once(coasts=True)),
    ("braked, falls without", "encoder_alarm", 0): at_once(),
    ("homing", "over_temperature", 0): fast(at_once()),
    ("homing", "off", 0): fast(silent(coasts=True)),
    ("withdrawal", "off", 0): silent(coasts=True),
    ("withdrawal", "encoder_alarm", 0): at_once(),
    ("bus", "off", 0): silent(coasts=True),
    ("bus", "frame_loss", 0.1): lossy(),
    ("bus", "frame_loss", 1): silent(),
    ("bus", "bus_off", 0): at_once(),
    ("foreign master", "sync", 0): foreign(),
    ("foreign master", "heartbeat", 0): foreign(),
    ("foreign master", "reset_all", 0): foreign("1 period; drives that are reset coast", coasts=True),
    ("foreign master", "command_pdo", 0): foreign(),
    ("bus", "emergency_stop", 0): Device(MARGIN_MS, "2 periods: digital inputs of a drive", coasts=True, everywhere=True),
}


@dataclasses.dataclass
class Process:
    reason: str
    periods: float = 0.0  # of control
    least_ms: float = 0.0
    heartbeats: float = 0.0  # share of drive_heartbeat

    def noticed_ms(self, control_period, drive_heartbeat_ms):
        return max(1e3 * self.periods * control_period, self.least_ms) + self.heartbeats * drive_heartbeat_ms


PROCESSES = {
    "control": Process("age of a command: 3 control periods", periods=3),
    "planning": Process("age of a reference: 250 ms, then 2 control periods", least_ms=350),
    "hal": Process("deadline of the command PDO: half of `drive_heartbeat`", heartbeats=0.5),
}
