# SPDX-License-Identifier: Apache-2.0
"""The report of build times and its check, with synthetic logs, builds and measurements; no compiler runs."""

import contextlib
import io
import json
import pathlib
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "deploy"))

import build_log  # noqa: E402
import build_times  # noqa: E402

HEAD = "# ninja log v5\n"
OBJECT = "sim/CMakeFiles/tandem_sim.dir/Unity/unity_0_cxx.cxx.o"
SECOND = "sim/CMakeFiles/tandem_sim.dir/Unity/unity_1_cxx.cxx.o"
RULES = f"""\
# a comment
rule CXX_COMPILER__tandem_sim_Release
  command = c++
build {OBJECT}: CXX_COMPILER__tandem_sim_Release a.cxx || order
build {SECOND}: CXX_COMPILER__tandem_sim_Release b.cxx || order
build bin/tandem-sim bin/tests$:1 | ${{cmake_ninja_workdir}}list.txt: CXX_EXECUTABLE_LINKER__tandem-sim_Release {OBJECT} | x.a
build idl/a.h idl/b.h: CUSTOM_COMMAND idl/a.idl
build all: phony bin/tandem-sim
"""


def line(start, end, output, digest):
    return f"{start}\t{end}\t1700000000000000000\t{output}\t{digest}\n"


LOG = HEAD + "".join([
    line(0, 9000, OBJECT, "a1"),
    line(0, 700, "idl/a.h", "c1"),
    line(0, 700, "idl/b.h", "c1"),
    line(10, 2510, OBJECT, "a1"),
    line(10, 2510, SECOND, "a2"),
    line(0, 5000, "sim/CMakeFiles/tandem_sim.dir/Unity/unity_9_cxx.cxx.o", "a3"),
    line(2510, 3010, "bin/tandem-sim", "b1"),
    line(2510, 3010, "bin/tests:1", "b1"),
])


class Folder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def file(self, name, text):
        (self.folder / name).write_text(text, encoding="utf-8")
        return self.folder / name

    def fails(self, wanted, function, *arguments):
        with self.assertRaises(build_log.Problem) as caught:
            function(*arguments)
        for text in wanted:
            self.assertIn(text, str(caught.exception))


class NinjaLog(Folder):
    def runs(self, text=LOG):
        return build_log.runs_of(build_log.read_log(self.file(".ninja_log", text), "release"), build_log.read_rules(RULES))

    def test_the_newest_entry_of_an_output_counts(self):
        entries = build_log.read_log(self.file(".ninja_log", LOG), "release")
        self.assertEqual(entries[OBJECT], (10, 2510, "a1"))

    def test_a_rule_with_several_outputs_counts_once(self):
        runs = {run.output: run for run in self.runs()}
        self.assertEqual(sorted(runs), ["bin/tandem-sim", "idl/a.h", OBJECT, SECOND])
        self.assertEqual(runs["bin/tandem-sim"], ("bin/tandem-sim", "link", "tandem-sim", 0.5))
        self.assertEqual(runs["idl/a.h"], ("idl/a.h", "other", "", 0.7))

    def test_two_rules_of_the_same_time_count_twice(self):
        compilations = build_log.of_kind(self.runs(), "compile")
        self.assertEqual([run.output for run in compilations], [OBJECT, SECOND])
        self.assertEqual(build_log.seconds_of(compilations), 5.0)

    def test_what_is_no_longer_built_does_not_count(self):
        self.assertFalse([run for run in self.runs() if "unity_9" in run.output])

    def test_grouping_by_target(self):
        self.assertEqual(build_log.by_target(self.runs()), [("tandem_sim", 5.0, 0.0, 2), ("tandem-sim", 0.0, 0.5, 0)])

    def test_rules_with_escapes(self):
        rules = build_log.read_rules(RULES)
        self.assertEqual(rules["bin/tests:1"], ("CXX_EXECUTABLE_LINKER__tandem-sim_Release", "bin/tandem-sim"))
        self.assertEqual(build_log.kind_and_target("x.so", "CXX_MODULE_LIBRARY_LINKER___tandem_Release"), ("link", "_tandem"))

    def test_half_a_line_at_the_end_is_left_by_a_killed_ninja(self):
        self.assertEqual(self.runs(LOG + "12\t14"), self.runs())

    def test_missing_and_broken_logs_name_the_next_step(self):
        self.fails(["deploy/run.sh"], build_log.read_log, self.folder / "none", "release")
        self.fails(["cmake --preset debug"], build_log.read_log, self.folder / "none", "debug")
        for text, wanted in [("", "not a log"), ("# ninja log v4\n", "version 5"), (HEAD, "nothing has been built"),
                             (HEAD + "1\t2\t3\n", ":2: broken line"), (LOG + "x\t2\t3\ta.o\tf\n", "broken line")]:
            with self.subTest(text=text):
                self.fails([wanted], build_log.read_log, self.file("log", text), "release")
        self.fails(["CCACHE_DISABLE=1"], build_log.read_log, self.file("log", "garbage\n"), "release")

    def test_objects_from_ccache(self):
        slow = [build_log.Run(f"{i}.cxx.o", "compile", "t", 2.0) for i in range(8)]
        quick = [build_log.Run(f"q{i}.cxx.o", "compile", "t", 0.02) for i in range(9)]
        plain_c = [build_log.Run(f"{i}.c.o", "compile", "t", 0.02) for i in range(9)]
        self.assertEqual(build_log.note_of_cache(slow + plain_c, "release"), "")
        self.assertIn("2 of 10", build_log.note_of_cache(slow + quick[:2], "release"))
        self.fails(["9 of 17", "CCACHE_DISABLE=1"], build_log.note_of_cache, slow + quick, "release")

    def test_the_report(self):
        unity = self.folder / "sim/CMakeFiles/tandem_sim.dir/Unity/unity_0_cxx.cxx"
        unity.parent.mkdir(parents=True)
        unity.write_text('/* generated */\n\n#include "/a/sim/world.cpp"\n\n#include "/a/sim/plant.cpp"\n', encoding="utf-8")
        self.file(".ninja_log", LOG)
        self.file("build.ninja", RULES)
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            build_log.print_times(self.folder, "release")
        for wanted in ["5.0 s     2 compilations", "0.5 s     1 links", "0.7 s     1 all else", "world.cpp plant.cpp",
                       "5.0      0.0        2  tandem_sim", "1 targets under a second"]:
            self.assertIn(wanted, printed.getvalue())


class Headers(unittest.TestCase):
    TEXT = b"""\
# 0 "a.cpp"
# 0 "<built-in>"
# 1 "a.cpp"
# 1 "one.h" 1
int one;
# 1 "two.h" 1 3 4
int two;

int three;
# 3 "one.h" 2
int four;
# 2 "a.cpp" 2
int main() {}
"""

    def test_lines_alone_and_with_what_is_included(self):
        own, inclusive = build_times.lines_by_file(self.TEXT)
        self.assertEqual((own["one.h"], own["two.h"], own["a.cpp"]), (2, 2, 1))
        self.assertEqual((inclusive["one.h"], inclusive["two.h"], inclusive["a.cpp"]), (4, 2, 5))

    def test_sum_over_objects_leaves_sources_out(self):
        rows = build_times.sum_of_headers([build_times.lines_by_file(self.TEXT)] * 3)
        self.assertEqual(rows, {"one.h": [12, 6, 3], "two.h": [6, 6, 3]})


class Check(Folder):
    def test_over_twice_fails_and_less_passes(self):
        self.assertTrue(build_times.verdict(1.9 * 2.5, 2.5)[0])
        passes, text = build_times.verdict(2.1 * 2.5, 2.5)
        self.assertFalse(passes)
        for wanted in ["5.25", "2.50", "deploy/build-times.sh ", "--record"]:
            self.assertIn(wanted, text)

    def test_a_much_lower_cost_is_to_be_recorded(self):
        passes, text = build_times.verdict(1.0, 2.5)
        self.assertTrue(passes)
        self.assertIn("--record", text)

    def test_a_slow_machine_and_one_odd_run_make_no_difference(self):
        self.assertAlmostEqual(build_times.figure_of(40.0, 5.0, [4.0, 4.0, 9.0]), 2.0)
        self.assertAlmostEqual(build_times.figure_of(120.0, 5.0, [12.0, 12.0, 2.0]), 2.0)

    def test_the_sample_is_of_the_product_and_stays(self):
        def made(name):
            return build_times.Object(name, pathlib.Path(name), ["c++"], "/")

        objects = [made(f"{room}/CMakeFiles/t.dir/{i}.cpp.o") for room in ("sim", "control", "tests", "bench", "idl") for i in range(20)]
        sample = build_times.pick_sample(objects)
        self.assertEqual(len(sample), build_times.SAMPLE)
        self.assertLessEqual({entry.output.split("/")[0] for entry in sample}, {"sim", "control"})
        for newcomer in range(20):
            other = build_times.pick_sample(objects + [made(f"hal/CMakeFiles/t.dir/{newcomer}.cpp.o")])
            self.assertGreaterEqual(len(set(map(str, sample)) & set(map(str, other))), build_times.SAMPLE - 1)

    def test_lines_of_sources_compiled_together(self):
        parts = [self.file("a.cpp", "1\n2\n3\n"), self.file("b.cpp", "1\n2\n")]
        unity = self.file("unity_0_cxx.cxx", "".join(f'#include "{part}"\n' for part in parts))
        sample = [build_times.Object("x.o", source, ["c++"], "/") for source in (unity, parts[1])]
        self.assertAlmostEqual(build_times.thousand_lines(sample), 0.007)

    def test_commands_without_launcher_and_output(self):
        words = "/usr/bin/ccache /usr/bin/c++ -I/a -O3 -MD -MT a.o -MF a.d -o a.o -c /s/a.cpp".split()
        self.assertEqual(build_times.bare(words), ("/usr/bin/c++ -I/a -O3 /s/a.cpp".split(), "a.o"))

    def test_broken_compile_commands_name_the_next_step(self):
        for text in ["", "{}x", "[1]", '[{"directory": "/"}]', '[{"directory": "/", "file": "a.cpp", "command": ""}]']:
            with self.subTest(text=text):
                self.fails(["cmake --preset release"], build_times.read_objects, self.file("c.json", text), "release")

    def test_a_record_comes_back_and_has_no_date(self):
        path = self.folder / "record.json"
        build_times.write_record(path, "release", 2.3456, "c++ 12.2.0")
        self.assertEqual(build_times.read_record(path, "release"), 2.346)
        self.assertEqual(json.loads(path.read_text()).keys(), {"preset", "compiler", "yardsticks_per_thousand_lines"})
        self.fails(["--preset release"], build_times.read_record, path, "debug")

    def test_missing_and_broken_records_name_the_next_step(self):
        self.fails(["--record"], build_times.read_record, self.folder / "none", "release")
        for text in ["", "[]", "{}", '{"preset": "release", "yardsticks_per_thousand_lines": "x"}',
                     '{"preset": "release", "yardsticks_per_thousand_lines": 0}']:
            with self.subTest(text=text):
                self.fails(["--record"], build_times.read_record, self.file("r.json", text), "release")


if __name__ == "__main__":
    unittest.main()
