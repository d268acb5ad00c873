# SPDX-License-Identifier: Apache-2.0
"""Test of the rule check: for each rule a tree that violates it once, and one that does not."""

import pathlib
import subprocess
import sys
import tempfile
import unittest

import check_rules

SPDX = "// SPDX-License-Identifier: Apache-2.0\n"
HEADER = SPDX + "#pragma once\n"

# path, content, and part of the only violation; None: no violation.
CASES = [
    ("control/a.h", HEADER + '#include "safety/limits.h"\n', None),
    ("control/a.h", HEADER + '#include "kinematics/arm_model.h"\n', "control may use safety"),
    ("safety/a.cpp", SPDX + '#include "control/resolver.h"\n', "safety may use no other room"),
    ("safety/a.cpp", SPDX + '#include "safety/limits.h"\n#include "idl/enumerations.h"\n', None),
    ("safety/a.cpp", SPDX + '#include "idl/messages.h"\n', "safety may use no other room"),
    ("planning/a.cpp", SPDX + '#include "kinematics/a.h"\n#include "control/a.h"\n', None),
    ("sim/a.cpp", SPDX + '#include "hal/can/frame.h"\n', "sim may use"),
    ("sim/drives/a.cpp", SPDX + '#include "hal/can/frame.h"\n', None),
    ("sim/drives/a.cpp", SPDX + '#include "hal/drive.h"\n', "sim/drives may use"),
    ("experiments/a.cpp", SPDX + '#include "services/dds/bus.h"\n', "experiments may use"),
    ("recording/a.cpp", SPDX + '#include "safety/limits.h"\n', "recording may use no other room"),
    ("python/a.cpp", SPDX + '#include "services/client/client.h"\n', None),
    ("python/a.cpp", SPDX + '#include "services/control/orders.h"\n', "python may use"),
    ("bench/a.cpp", SPDX + '#include "services/dds/bus.h"\n', None),
    ("bench/a.cpp", SPDX + '#include "tests/support.h"\n', "bench may use"),
    ("config/a.cpp", SPDX + '  #  include "experiments/csv.h"\n', "config may use"),
    ("config/a.cpp", SPDX + '// #include "experiments/csv.h"\n/* #include "services/x.h" */\n', None),
    ("services/cli/a.cpp", SPDX + '#include "tests/unit/a.h"\n', "services/cli may use"),
    ("services/cli/robot/a.cpp", SPDX + '#include "services/cli/plan/a.h"\n#include "experiments/csv.h"\n', None),
    ("services/cli/a.cpp", SPDX + '#include "services/sim/sim_core.h"\n', "services/cli may use"),
    ("control/a.cpp", SPDX + '#include "control/detail/a.h"\n', None),
    ("control/a.h", HEADER + '#include "control/detail/a.h"\n', "a public header may not"),
    ("control/detail/b.h", HEADER + '#include "control/detail/a.h"\n', None),
    ("planning/a.cpp", SPDX + '#include "control/detail/a.h"\n', "it is internal to control"),
    ("tests/unit/control/a.cpp", SPDX + '#include "control/detail/a.h"\n', None),
    ("services/hal/a.cpp", SPDX + "namespace tandem::hal_service {\n", None),
    ("services/hal/a.cpp", SPDX + "namespace tandem::hal {\n", "not in tandem::hal_service"),
    ("services/runtime/a.cpp", SPDX + "namespace tandem::service {\n", "not in tandem::runtime"),
    ("services/cli/plan/a.cpp", SPDX + "namespace tandem::cli {\n", None),
    ("hal/can/detail/a.h", HEADER + "namespace tandem::hal::can {\n", None),
    ("kinematics/a.cpp", SPDX + "namespace tandem::control {\n\nclass A;\n}\nnamespace tandem::kinematics::b {\n", None),
    ("services/sim/a.cpp", SPDX + '#include "experiments/run_record.h"\n', "services may use"),
    ("services/sim/a.cpp", SPDX + '#include "services/control/control_core.h"\n', "services may use"),
    ("services/sim/a.cpp", SPDX + '#include "services/runtime/log.h"\n#include "services/sim/b.h"\n', None),
    ("services/runtime/a.cpp", SPDX + '#include "services/hal/hal_core.h"\n', "services may use"),
    ("operation/a.cpp", SPDX + '#include "idl/messages.h"\n#include "robots/robot_model.h"\n', None),
    ("operation/a.cpp", SPDX + '#include "services/dds/bus.h"\n', "operation may use"),
    ("services/cli/a.cpp", SPDX + "#include <fastdds/dds/core/status/StatusMask.hpp>\n", "see Fast DDS"),
    ("services/cli/a.cpp", SPDX + '#include "tandem_msgsPubSubTypes.h"\n', "see Fast DDS"),
    ("services/dds/a.cpp", SPDX + "#include <fastdds/dds/core/status/StatusMask.hpp>\n", None),
    ("tests/unit/dds/a.cpp", SPDX + '#include "tandem_msgsPubSubTypes.h"\n', None),
    ("tests/unit/sim/a.cpp", SPDX + "#include <fastcdr/Cdr.h>\n", "see Fast DDS"),
    ("sim/a.cpp", SPDX + "void f() { std::cout << 1; }\n", "std::cout"),
    ("hal/axis.h", SPDX + '#pragma once\n#include "hal/canopen/network.h"\n', "nothing knows a bus"),
    ("hal/drives/a.cpp", SPDX + '#include "hal/cia402/sdo_jobs.h"\n', "nothing knows a bus"),
    ("hal/arm_hardware.cpp", SPDX + '#include "hal/can/bus.h"\n', "nothing knows a bus"),
    ("hal/cia402/a.cpp", SPDX + '#include "hal/canopen/network.h"\n#include "hal/axis_driver.h"\n', None),
    ("services/hal/a.cpp", SPDX + '#include "hal/can/bus.h"\n', None),
    ("planning/a.cpp", SPDX + "void f() { std::this_thread::sleep_for(s); }\n", "std::this_thread"),
    ("control/a.cpp", SPDX + "std::mutex m;\n", "std::mutex"),
    ("kinematics/a.cpp", SPDX + "// std::cout would be wrong here\n/* sleep_for\n too */\nint i;\n", None),
    ("services/cli/a.cpp", SPDX + "void f() { std::cout << 1; }\n", None),
    ("services/cli/a.cpp", SPDX + "int port = 7410 + 250 * domain;\n", "services/dds/ports.h"),
    ("services/cli/a.cpp", SPDX + "int nodes = 74100;  // 7400\n", None),
    ("services/dds/a.cpp", SPDX + "int port = 7400 + 250 * domain;\n", None),
    ("tests/network/a.cpp", SPDX + "int port = 7400;\n", None),
    ("operation/a.cpp", SPDX + "bool b = site.robot.type == tubes;\n", "ask for what the robot can do"),
    ("services/control/a.cpp", SPDX + "bool b = robot->data && b;\n", "ask for what the robot can do"),
    ("services/cli/a.cpp", SPDX + 'bool b = config::kindOf(file) == "cooperative";\n', "ask for what the robot can do"),
    ("services/cli/a.cpp", SPDX + 'bool b = "planar" != kind;\n', "ask for what the robot can do"),
    ("services/cli/a.cpp", SPDX + "auto robot = config::loadRobot(deployment.robot);\n", "ask for what the robot can do"),
    ("services/cli/a.cpp", SPDX + 'auto robot = config::loadAnyRobot(file);\nbool b = kind == "trajectory";\n', None),
    ("services/control/a.cpp", SPDX + "int type = 2;\nint all = type_;\n", None),
    ("robots/a.cpp", SPDX + "bool b = robot.type == tubes;\n", None),
    ("safety/a.cpp", SPDX + "// The drive is told.\n", "docs/glossary.md has the term"),
    ("safety/a.cpp", SPDX + "int noteWish = 0;\n", "docs/glossary.md has the term"),
    ("services/a.py", "# SPDX-License-Identifier: Apache-2.0\n# Who hears it\n", "docs/glossary.md has the term"),
    ("tests/a.py", "# SPDX-License-Identifier: Apache-2.0\ndef test_a_fault_is_told_and_stays(): pass\n", "docs/glossary.md has the term"),
    ("tests/a.py", "# SPDX-License-Identifier: Apache-2.0\nCALM = 1\n", "docs/glossary.md has the term"),
    ("safety/a.cpp", SPDX + "int settling_time = 1;\n", None),
    ("safety/a.cpp", "int i;\n", "does not begin with SPDX"),
    ("safety/a.cpp", "\n" + SPDX, "does not begin with SPDX"),
    ("safety/a.cpp", "", "does not begin with SPDX"),
    ("deploy/a.sh", "#!/bin/sh\n# SPDX-License-Identifier: Apache-2.0\n", None),
    ("deploy/a.sh", "#!/bin/sh\n", "does not begin with SPDX"),
    ("safety/a.h", SPDX, "has no #pragma once"),
    ("safety/a.cpp", SPDX + "int i;\n" * 398, None),
    ("safety/a.cpp", SPDX + "int i;\n" * 399, "has 400 lines"),
    ("attic/a.cpp", SPDX, "lies in no room"),
    ("build/release/a.cpp", "int i;\n", None),
]


class CheckRulesTest(unittest.TestCase):
    def test_each_rule(self):
        for path, content, wanted in CASES:
            with self.subTest(path=path, wanted=wanted), tempfile.TemporaryDirectory() as folder:
                tree = pathlib.Path(folder)
                (tree / path).parent.mkdir(parents=True)
                (tree / path).write_text(content, encoding="utf-8")
                found, _ = check_rules.check(tree)
                if wanted is None:
                    self.assertEqual(found, [])
                else:
                    self.assertEqual(len(found), 1, found)
                    self.assertTrue(found[0].startswith(path + ":"), found)
                    self.assertIn(wanted, found[0])

    def test_line_numbers_survive_comments(self):
        with tempfile.TemporaryDirectory() as folder:
            tree = pathlib.Path(folder)
            (tree / "sim").mkdir()
            (tree / "sim/a.cpp").write_text(SPDX + '/* a\n b */\nauto s = "// no comment";  // one\nstd::mutex m;\n')
            found, count = check_rules.check(tree)
            self.assertEqual(count, 1)
            self.assertEqual(len(found), 1)
            self.assertTrue(found[0].startswith("sim/a.cpp:5:"), found)

    def test_exit_codes(self):
        """Exit code 0 for a valid tree, 1 for an invalid one and for one without sources."""
        for content, wanted in [(SPDX, 0), ("int i;\n", 1), (None, 1)]:
            with self.subTest(content=content), tempfile.TemporaryDirectory() as folder:
                if content is not None:
                    (pathlib.Path(folder) / "sim").mkdir()
                    (pathlib.Path(folder) / "sim/a.cpp").write_text(content)
                command = [sys.executable, check_rules.__file__, folder]
                done = subprocess.run(command, stdout=subprocess.DEVNULL, check=False)
                self.assertEqual(done.returncode, wanted)


if __name__ == "__main__":
    unittest.main()
