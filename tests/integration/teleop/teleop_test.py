# SPDX-License-Identifier: Apache-2.0
"""Operators and CRTK clients with the real processes: `tandem up`, `tandem teleop` with recorded motion, and a client on Cyclone DDS."""
import json
import math
import os
import pathlib
import signal
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "harness"))
import system  # noqa: E402
import tubes  # noqa: E402

CYCLONE = """<CycloneDDS><Domain><General><Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces>
<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>
<MaxAutoParticipantIndex>31</MaxAutoParticipantIndex><Peers><Peer Address="127.0.0.1"/></Peers></Discovery>
<Internal><GenerateKeyhash>true</GenerateKeyhash></Internal></Domain></CycloneDDS>"""


def rotation(vector):
    """3 x 3, by a rotation vector in degrees."""
    x, y, z = (math.radians(v) for v in vector)
    return tubes.exponential([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def rotation_vector(matrix):
    """In degrees; below 180."""
    r = matrix
    twice_sine = [r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]]
    length = tubes.norm(twice_sine)
    angle = math.degrees(math.atan2(length, r[0][0] + r[1][1] + r[2][2] - 1))
    return [angle * v / length for v in twice_sine] if length > 0 else [0, 0, 0]


class Teleoperation(system.SystemTest):
    def begin(self, teleoperation="{leash_mm: 1}"):
        self.system = self.start("teleop", teleoperation=teleoperation, **system.real_time())

    def trace(self, name, *phases, columns="vx_mm_per_s,vy_mm_per_s,vz_mm_per_s"):
        """A CSV file: each phase is (seconds, present, velocity in mm/s, or the values of other columns)."""
        lines, at = ["time_s,present," + columns], 0.0
        for seconds, present, velocity in phases:
            lines.append(",".join(map(str, [at, present, *velocity])))
            at += seconds
            lines.append(",".join(map(str, [at - 1e-3, present, *velocity])))
        path = self.folder / f"{name}.csv"
        path.write_text("\n".join(lines) + "\n")
        return path

    def teleop(self, trace, *words):
        process = subprocess.Popen([system.executable(), "teleop", "--deployment", str(self.system.path), "--trace",
                                    str(trace), "--enable", *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                   text=True, start_new_session=True)
        self.addCleanup(system.reap, process)
        return process

    def poses(self):
        """Of the tips; their frames turn with tube 1, those of the backbone do not."""
        poses = []
        for q, arm in zip(self.system.joints(), "ab"):
            c, s = math.cos(q[3]), math.sin(q[3])
            poses.append(tubes.multiply(tubes.transform(q, arm), [[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]))
        return poses

    def tips(self):
        return [tubes.position(tubes.transform(q, arm)) for q, arm in zip(self.system.joints(), "ab")]

    def until_moving(self, process):
        first = self.system.joints()

        def moving():
            if process.poll() is not None:
                raise AssertionError(f"teleop ended early: {process.communicate()}")
            return self.system.joints() != first

        system.until(moving, 20, "the arms move")

    def standstill(self, since_ns):
        """s from `since_ns` to the first state after which no joint has moved; stamps are of the same clock."""
        last, at = self.system.status(), None
        still = 0
        while still < 10:
            now = self.system.status()
            if [a["joints"] for a in now["arms"]] == [a["joints"] for a in last["arms"]]:
                still += 1
                at = at or last["stamps_ns"]["state"]
            else:
                still, at = 0, None
            last = now
            self.assertLess(time.monotonic_ns() - since_ns, 20e9, "it does not stop")
        return max(0.0, 1e-9 * (at - since_ns))

    def test_a_recorded_hand_drives_the_pair(self):
        self.begin()
        before = self.tips()
        process = self.teleop(self.trace("pair", (0.3, 0, (0, 0, 0)), (2.0, 1, (0, 8, 0)), (0.5, 1, (0, 0, 0))),
                              "--mode", "pair", "--scale", "0.5")
        worst = 0.0
        while process.poll() is None:
            tips = self.tips()
            relative = tubes.minus(tubes.minus(tips[0], tips[1]), tubes.minus(before[0], before[1]))
            worst = max(worst, tubes.norm(relative))
        reported = process.communicate()
        self.assertEqual(process.returncode, 0, reported)
        self.assertIn("following: pair of arm_a", reported[0])
        moved = tubes.minus(self.tips()[0], before[0])
        # 8 mm/s minus the deadband, halved, for 2 s.
        self.assertAlmostEqual(moved[1], 7.5e-3, delta=1.2e-3)
        self.assertLess(tubes.norm([moved[0], moved[2]]), 0.5e-3)
        self.assertLess(worst, 0.5e-3, "the relative position is kept")
        self.assertEqual(self.system.states(), ["DISABLED", "DISABLED"])
        # Planning continues from the new position.
        self.assert_ok(self.system.robot("run", self.trajectory("after", [0, -2, 0], points=3, max_iterations=500)))

    def test_the_rotation_of_a_handle_turns_the_tip_and_its_position_is_held(self):
        self.begin("{leash_mm: 1, orientation: full}")
        before = self.poses()
        # The handle is gripped turned by 40 degrees about z; then it turns by 10 degrees about an axis of the base frame, about which the
        # joints at home turn the tip fast.
        grip, turn = [0, 0, 40], [0.73, 2.71, 9.60]
        turned = rotation_vector(tubes.multiply(rotation(turn), rotation(grip)))
        process = self.teleop(self.trace("handle", (0.3, 0, [0, 0, 0, *grip]), (0.5, 1, [0, 0, 0, *grip]), (4.0, 1, [0, 0, 0, *turned]),
                                         columns="x_mm,y_mm,z_mm,rx_deg,ry_deg,rz_deg"), "--mode", "pair")
        farthest = 0.0
        while process.poll() is None:
            farthest = max(farthest, *(tubes.norm(tubes.minus(tubes.position(now), tubes.position(then)))
                                       for now, then in zip(self.poses(), before)))
        reported = process.communicate()
        self.assertEqual(process.returncode, 0, reported)
        self.assertIn("max_angular_speed", reported[0])
        start, end = ([row[:3] for row in pose[:3]] for pose in (before[0], self.poses()[0]))
        error = rotation_vector(tubes.multiply(end, tubes.transposed(tubes.multiply(rotation(turn), start))))
        print(f"  the tip turned by 10 degrees, within {tubes.norm(error):.2f}; the tips moved by {1e3 * farthest:.3f} mm", flush=True)
        self.assertLess(tubes.norm(error), 1.0)
        self.assertLess(farthest, 0.5e-3, "the positions of both tips are held")

    def test_an_orientation_that_the_arms_cannot_follow_is_refused_before_the_start(self):
        path = system.deployment(self.folder, "planar-pair", robot=system.PRESETS / "planar" / "planar-pair.yaml",
                                 teleoperation="{orientation: axis}")
        answer = system.run("validate", path)
        self.assertEqual(answer.returncode, 2, answer.stdout + answer.stderr)
        self.assertIn("teleoperation.orientation: found axis with arm_a", answer.stderr)
        self.assertIn("expected rank 2", answer.stderr)

    def test_a_device_that_dies_or_hangs_stops_the_robot(self):
        self.begin()
        long = self.trace("long", (0.3, 0, (0, 0, 0)), (3.0, 1, (0, 6, 0)), (3.0, 1, (0, -6, 0)), (3.0, 1, (0, 6, 0)),
                          (3.0, 1, (0, -6, 0)))
        for how in (signal.SIGSTOP, signal.SIGKILL):
            process = self.teleop(long, "--rate", "100")
            self.until_moving(process)
            sent = time.monotonic_ns()
            os.killpg(process.pid, how)
            seconds = self.standstill(sent)
            print(f"  {how.name}: the robot stood {1e3 * seconds:.0f} ms after it", flush=True)
            # 100 ms, two control periods, the ramp of 50 ms, a polling period of 50 ms, and a margin for a shared machine.
            self.assertLess(seconds, 0.1 + 0.04 + 0.05 + 0.05 + 0.25)
            if how == signal.SIGSTOP:
                os.killpg(process.pid, signal.SIGCONT)  # it resumes: nothing moves without the lease or a new press of the dead-man switch
                self.system.assert_still(self, looks=5)
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            system.until(self.lease_free, 10, "the lease is lost")

    def lease_free(self):
        return self.system.status()["lease_owner"] == 0

    def test_one_commander_at_a_time(self):
        self.begin()
        long = self.trace("long", (0.3, 0, (0, 0, 0)), (6.0, 1, (0, 2, 0)))
        first = self.teleop(long)
        self.until_moving(first)
        self.assertEqual(self.system.status()["source"], "teleoperation")
        second = self.teleop(long)
        reported = second.communicate(timeout=60)
        self.assertEqual(second.returncode, 1, reported)
        self.assertIn("another client has the control lease", reported[1])
        self.assert_refused(self.system.robot("run", self.long_line()), "lease")

    def test_a_fault_is_reported_and_stays(self):
        self.begin()
        process = self.teleop(self.trace("long", (0.3, 0, (0, 0, 0)), (20.0, 1, (0, 1, 0))))
        self.until_moving(process)
        self.assert_ok(self.system.robot("stop"))
        reported = process.communicate(timeout=30)
        self.assertEqual(process.returncode, 1, reported)
        self.assertIn("the trace was not followed to its end: arm_a is in FAULT", reported[1])
        self.assertEqual(self.system.states(), ["FAULT", "FAULT"])

    def test_a_forbidden_region_is_not_entered(self):
        self.begin()
        before = self.tips()
        wall = before[0][1] + 0.004
        self.system.close()
        self.begin("{scale: 1, leash_mm: 1, forbidden: [{name: wall, half_space: {point_m: [0, %.9f, 0], normal: [0, -1, 0]}}]}" % wall)
        process = self.teleop(self.trace("push", (0.3, 0, (0, 0, 0)), (3.0, 1, (0, 15, 0))), "--mode", "tip")
        farthest = -1.0
        while process.poll() is None:
            farthest = max(farthest, self.tips()[0][1])
        reported = process.communicate()
        self.assertEqual(process.returncode, 0, reported)
        self.assertIn("forbidden region wall", reported[0])
        self.assertLess(farthest, wall)
        self.assertGreater(farthest, wall - 0.0025, "it was tried")

    def crtk_peer(self):
        text = self.system.path.read_text()
        keys = dict(line.split(": ", 1) for line in text.splitlines() if line.startswith(("domain:", "prefix:")))
        peer = pathlib.Path(system.executable()).parents[1] / "tests" / "crtk_peer"
        return subprocess.run([peer, keys["domain"], keys["prefix"], "100", "0.05", "3.5"], capture_output=True, text=True,
                              timeout=90, check=False, env={**os.environ, "CYCLONEDDS_URI": CYCLONE})

    def test_a_client_on_cyclone_that_is_not_admitted_is_not_obeyed(self):
        self.begin("{crtk: {clients: [somebody, crtk_peers]}}")
        answer = self.crtk_peer()
        self.assertIn("'enable' did not lead to ENABLED but to 'DISABLED'", answer.stderr)
        system.until(lambda: "pair/state_command" in " ".join(self.system.status()["dropped"].get("tandem-control", {})), 10,
                     "control says what it dropped")

    def test_a_client_on_cyclone_reads_and_is_obeyed(self):
        self.begin("{scale: 0.5, max_speed_mm_per_s: 10, leash_mm: 1, crtk: {clients: [crtk_peer]}}")
        before = self.tips()
        answer = self.crtk_peer()
        self.assertEqual(answer.returncode, 0, answer.stdout + answer.stderr)  # it verifies that stale commands give no power
        reported = json.loads(answer.stdout)
        self.assertAlmostEqual(reported["asked"], 5e-3, delta=1e-9)
        self.assertAlmostEqual(reported["moved"], 5e-3, delta=0.6e-3)
        self.assertEqual(reported["joint_count"], 6)
        # Stamps are ROS time: ages by the peer's wall clock, with room for a slow machine.
        self.assertGreaterEqual(reported["newest"], -0.01)
        self.assertLess(reported["oldest"], 60.0)
        self.assertGreater(reported["cycles_by_crtk"], 50)
        self.assertGreater(reported["status"], 0)
        # measured_cp equals the tip of an independent model at the joints.
        self.assertAlmostEqual(self.tips()[0][1] - before[0][1], reported["moved"], delta=0.3e-3)
        self.assertEqual(self.system.status()["lease_owner"], 0)


if __name__ == "__main__":
    system.main()
