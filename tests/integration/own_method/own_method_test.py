# SPDX-License-Identifier: Apache-2.0
"""A method outside the tree: the library of docs/own-method.md, built against an installation only, gives the same numbers as the
built-in method and moves a running system; invalid libraries are refused with the values found and expected."""
import os
import pathlib
import subprocess
import sys
import tempfile

FOLDER = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(FOLDER.parent / "harness"), str(FOLDER.parents[1] / "consumer")]
import installation  # noqa: E402
import system  # noqa: E402

WRONG = ("throws", "not_finite", "allocates", "slow", "ignores_jacobian", "crashes", "other_layout", "beyond_bounds")
WRONG_PROJECT = """\
cmake_minimum_required(VERSION 3.25)
project(wrong LANGUAGES CXX)
find_package(tandem REQUIRED)
set(number 0)
foreach(name {names})
  add_library(${{name}} MODULE wrong.cpp)
  target_link_libraries(${{name}} PRIVATE tandem::control)
  target_compile_definitions(${{name}} PRIVATE WRONG=${{number}})
  set_target_properties(${{name}} PROPERTIES PREFIX "")
  math(EXPR number "${{number}} + 1")
endforeach()
add_library(wide MODULE wrong.cpp)
target_link_libraries(wide PRIVATE tandem::control)
target_compile_definitions(wide PRIVATE WRONG=0 EIGEN_MAX_ALIGN_BYTES=64)  # as -mavx512f does
set_target_properties(wide PROPERTIES PREFIX "")
add_library(other MODULE other.cpp)
set_target_properties(other PROPERTIES PREFIX "")
"""
# q_a, q_b, v_ab, v_a of the first start of Table 3
ROW = "-0.15,-0.1,-0.05,3.14,1.57,0.78,-0.13,-0.12,-0.1,1.57,-1.04,-4.7,0,0,1e-3,1e-3,0,0\n"


class OwnMethod(system.SystemTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        folder = tempfile.TemporaryDirectory(prefix="tandem-own-method-")
        cls.addClassCleanup(folder.cleanup)
        installed = installation.Installation(os.environ["TANDEM_CMAKE"], os.environ["TANDEM_CXX"], os.environ["TANDEM_BUILD"],
                                              folder.name, "dev")
        page = installation.project_of("own-method.md", cmake="CMakeLists.txt", cpp="own_method.cpp")
        build, _ = installed.configure("own", page, "")
        installed.build(build)
        cls.library = build / "own_method.so"
        files = {"CMakeLists.txt": WRONG_PROJECT.format(names=" ".join(WRONG)), "wrong.cpp": (FOLDER / "wrong.cpp").read_text(),
                 "other.cpp": "extern const int answer;\nconst int answer = 42;\n"}
        cls.wrong, _ = installed.configure("wrong", files, "-O1")
        installed.build(cls.wrong)

    def deployment(self, library, preset="laptop", **changes):
        return system.deployment(self.folder, preset, method_library=library, **{"method": "foreign", **changes})

    def test_results_are_those_of_the_built_in_method(self):
        file = system.short_experiment(self.folder, "nspwln-joint", "foreign")
        with open(file, "a", encoding="utf-8") as out:
            out.write(f"method_library: {self.library}\n")
        self.assert_ok(system.run("experiment", file, "--offline", "--csv", self.folder / "csv"))
        for run in ("rectangle-2", "lissajous-2"):
            own = (self.folder / "csv" / f"{run}-foreign.csv").read_bytes()
            self.assertEqual(own, (self.folder / "csv" / f"{run}-nspwln-joint.csv").read_bytes())
            self.assertGreater(own.count(b"\n"), 8)
        own, built_in = (self.assert_ok(system.run("solve", "--method", *words, text=ROW)).stdout
                         for words in (("foreign", "--method-library", self.library), ("nspwln-joint",)))
        self.assertEqual(own, built_in)
        self.assertIn(",ok", own)

    def test_a_running_system(self):
        robot = self.start("laptop", **system.real_time(), method="foreign", method_library=self.library)
        self.assert_ok(robot.robot("enable"))
        system.until(lambda: f"method foreign: own-nspwln of {self.library}" in system.run("status", robot.path).stdout, 10,
                     "status names method and library, which come with control's diagnostics")
        before = robot.joints()
        trajectory = self.trajectory("short", [0, 1, 0], points=5)
        answer = self.assert_ok(robot.robot("run", trajectory, "--check", timeout=120))
        self.assertIn("finished", answer.stdout)
        self.assertNotEqual(robot.joints(), before)
        self.assert_ok(robot.robot("method", "nspqp"))
        self.assertEqual(robot.status()["method"], "nspqp")
        self.assert_ok(robot.robot("method", "foreign"))
        system.until(lambda: robot.status()["method"].startswith("foreign: own-nspwln"), 10, "status names the method")

    def refusal(self, library):
        answer = system.run("solve", "--method", "foreign", "--method-library", library, text=ROW)
        self.assertNotEqual(answer.returncode, 0)
        self.assertIn(str(library), answer.stderr)
        self.assertEqual(answer.stdout, "")
        return answer.stderr

    def test_wrong_files(self):
        self.assertIn("found no such file, expected a shared library", self.refusal(self.folder / "nothing.so"))
        text = self.folder / "text.so"
        text.write_text("no library\n")
        self.assertIn("found a file that cannot be loaded", self.refusal(text))
        self.assertIn("found no symbol tandem_method, expected", self.refusal(self.wrong / "other.so"))

    def test_other_binary_interfaces(self):
        self.assertRegex(self.refusal(self.wrong / "wide.so"), r"Eigen alignment 64, expected 16")
        self.assertRegex(self.refusal(self.wrong / "other_layout.so"), r"layout hash 1, expected \d+")

    def test_wrong_methods(self):
        for name, found in (("throws", "found an exception, 'no inverse', expected resolve() to throw nothing"),
                            ("not_finite", "expected a finite velocity of every joint"),
                            ("allocates", "allocations in"),
                            ("ignores_jacobian", "the velocity has to follow from the Jacobian"),
                            ("crashes", "the method ended the process of the check (Aborted)"),
                            ("beyond_bounds", "beyond the bounds of the joints")):
            self.assertIn(found, self.refusal(self.wrong / f"{name}.so"), name)

    def test_control_refuses_before_anything_can_be_enabled(self):
        path = self.deployment(self.wrong / "slow.so", control_period_s=0.01)
        answer = system.run("--deployment", path, program="tandem-control", timeout=30)
        self.assertEqual(answer.returncode, 1)
        self.assertRegex(answer.stderr, r"laptop.yaml: method_library: \S+slow.so: found that 95 of 100 calls take up to [\d.]+ ms, "
                                        r"expected at most 5 ms")
        path = self.deployment(self.wrong / "allocates.so")
        up = subprocess.run([system.executable(), "up", path], capture_output=True, text=True, timeout=60, check=False)
        self.assertNotEqual(up.returncode, 0)
        self.assertRegex(up.stderr + up.stdout, r"found \d+ allocations in \d+ calls, expected none")

    def test_foreign_without_a_library(self):
        answer = system.run("validate", system.deployment(self.folder, "laptop", method="foreign"))
        self.assertEqual(answer.returncode, 2)
        self.assertIn("method: found foreign without a method_library", answer.stderr)
        answer = system.run("solve", "--method", "foreign", text=ROW)
        self.assertIn("method foreign: found no library, expected one", answer.stderr)


if __name__ == "__main__":
    system.main()
