# SPDX-License-Identifier: Apache-2.0
"""The skeleton of docs/own-hardware.md, built against an installation only, passes `tandem conformance hal` and moves under the complete
system; each test of the command fails for a wrong variant of the skeleton."""
import os
import pathlib
import sys
import tempfile

FOLDER = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(FOLDER), str(FOLDER.parents[1] / "consumer")]
from conformance_test import assert_all_pass, assert_moves_and_stops, conformance, start, system  # noqa: E402
import installation  # noqa: E402

# Where the skeleton is changed: its text, and what replaces it (wrong_hal.h).
CHANGES = {
    "safety::ArmSupervisor(arm.limits,": "safety::ArmSupervisor(wrong::limits(arm.limits),",
    "monitor_.check(command.header, standing)": 'monitor_.check(wrong::header(command.header), standing || wrong::is("any_session"))',
    "= command.forArm(a, jointCount(a), checked);":
        "= wrong::request(command.forArm(a, jointCount(a), checked), arm.supervisor.state());",
    "arm.supervisor.command(request, arm.position,": "arm.supervisor.command(request, wrong::measured(arm.position),",
    "arm.supervisor.step(dt, now);": 'arm.supervisor.step(wrong::is("slow") ? 0.6 * dt : dt, now);',
    "arm.velocity.setZero();": "arm.velocity.setConstant(wrong::idle(arm.supervisor.state()));",
    "return monitor_.sequence();": 'return monitor_.sequence() / (wrong::is("late_answers") ? 2 : 1);',
    "void stop() noexcept {": 'void stop() noexcept {\n    if (wrong::is("no_stop"))\n      return;',
    "show(now, now, state);":
        'show(now, wrong::is("slow_stamps") ? 1 + now / 2 : now, state);\n'
        '    if (wrong::is("few_joints"))\n      state.joint_count[0] = 5;',
    "shell.refuseMismatches(": 'if (!wrong::is("any_robot"))\n    shell.refuseMismatches(',
}
# Variant: the tests that fail.
WRONG = {
    "few_joints": ["identity"], "slow_stamps": ["states"], "creeps": ["start"], "late_answers": ["answers"], "jumps": ["enable"],
    "slow": ["follow"], "no_hold": ["hold"], "no_pause": ["pause"], "no_disable": ["disable"], "goes_on": ["silence"],
    "no_latch": ["latch"], "no_stop": ["stop"], "any_age": ["age", "unknown", "state-session"], "any_sequence": ["repeated"],
    "any_number": ["not-finite"], "any_arms": ["arms"], "any_session": ["session"], "any_robot": ["fingerprint"],
    "no_limits": ["speed", "limit", "coupled"],
}


def wrong_source(text):
    """The skeleton with all wrong variants, of which the environment chooses one."""
    for found, replaced in CHANGES.items():
        if text.count(found) != 1:
            raise AssertionError(f"the skeleton has '{found}' {text.count(found)} times, expected once")
        text = text.replace(found, replaced)
    return '#include "wrong_hal.h"\n' + text


class OwnHardware(system.SystemTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        folder = cls.enterClassContext(tempfile.TemporaryDirectory(prefix="tandem-own-hardware-"))
        installed = installation.Installation(os.environ["TANDEM_CMAKE"], os.environ["TANDEM_CXX"], os.environ["TANDEM_BUILD"],
                                              folder, "dev")
        page = installation.project_of("own-hardware.md", cmake="CMakeLists.txt", cpp="my_hal.cpp")
        page["CMakeLists.txt"] += "add_executable(wrong-hal wrong_hal.cpp)\ntarget_link_libraries(wrong-hal PRIVATE tandem::runtime)\n"
        page["wrong_hal.h"] = (FOLDER / "wrong_hal.h").read_text()
        page["wrong_hal.cpp"] = wrong_source(page["my_hal.cpp"])
        cls.build, _ = installed.configure("own", page, "-O1")
        installed.build(cls.build)

    def deployment(self, **changes):
        return system.deployment(self.folder, "laptop", **{**system.real_time(), **changes})

    def own_deployment(self):
        """A deployment with the skeleton in the place of the simulator."""
        # This test is not about time: a client on a loaded host keeps its lease late.
        path = self.deployment(budgets="{minimum_age_ms: 500, planning_reference_ms: 2000, lease_ms: 10000}")
        path.write_text(path.read_text().replace("name: sim, executable: tandem-sim", f"name: hal, executable: {self.build}/my-hal"))
        return path

    def test_the_skeleton_passes(self):
        path = self.deployment()
        start(self, path, self.build / "my-hal")
        refused = conformance(path)
        self.assertEqual(refused.returncode, 2)
        self.assertRegex(refused.stderr, r"The robot will move: .* Nothing has moved yet; --yes starts the test")
        assert_all_pass(self, path, "--yes")

    def test_the_skeleton_moves_under_the_complete_system(self):
        robot = system.System(self.own_deployment())
        self.addCleanup(robot.close)
        assert_moves_and_stops(self, robot)

    def test_a_second_process_of_the_role_is_not_started(self):
        path = self.own_deployment()
        start(self, path, self.build / "my-hal")
        conformance(path, "--yes", "--only", "identity")  # it runs
        answer = system.run("up", path, "--for", "1")
        self.assert_refused(answer, "in use by hal (pid")
        (self.folder / "deployments").mkdir()
        path.rename(self.folder / "deployments" / "own.yaml")
        answer = system.run("units", "own", environment={"TANDEM_CONFIG_PATH": str(self.folder)})
        self.assertEqual(answer.returncode, 2, answer.stderr)
        self.assertIn("found 'hal' with the executable", answer.stderr)

    def test_each_test_fails_for_a_wrong_variant(self):
        names = system.run("__complete", "conformance", "hal", "--only", "").stdout.split()
        self.assertEqual(names, sorted(test for tests in WRONG.values() for test in tests))
        for name, tests in WRONG.items():
            with self.subTest(name):
                path = self.deployment()
                process = start(self, path, self.build / "wrong-hal", {**os.environ, "WRONG": name})
                answer = conformance(path, "--yes", "--only", ",".join(tests))
                process.terminate()
                process.wait(10)
                print(name, answer.stdout, answer.stderr, flush=True)
                self.assertEqual(answer.returncode, 1, answer.stdout + answer.stderr)
                failed = [line.split()[1] for line in answer.stdout.splitlines() if line.startswith("FAIL")]
                self.assertEqual(failed, tests)
                self.assertEqual(answer.stdout.count(", expected "), len(tests), "found and expected in each line")


if __name__ == "__main__":
    system.main()
