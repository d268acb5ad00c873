# SPDX-License-Identifier: Apache-2.0
"""The project of docs/cpp.md, built against an installation alone, answers as the installed command line does.

Arguments: cmake, the C++ compiler, the build tree, its version."""
import sys
import tempfile
import unittest

from installation import Installation, project_of, run

CMAKE, COMPILER, BUILD, VERSION = sys.argv[1:5]
del sys.argv[1:5]


def numbers(line):
    return [float(word) for word in line.split(",")]


class Consumer(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="tandem-consumer-")
        cls.addClassCleanup(folder.cleanup)
        cls.installation = Installation(CMAKE, COMPILER, BUILD, folder.name, "dev", "robot")
        cls.prefix = cls.installation.prefix
        cls.project = project_of("cpp.md", cmake="CMakeLists.txt", cpp="main.cpp")

    def configure(self, name, fails=False, **files):
        """Configures a copy of the page's project, for this machine, which has vector instructions that the libraries were not built
        for."""
        return self.installation.configure(name, {**self.project, **files}, "-O1 -march=native", fails)

    def tandem(self, *words, row):
        answer = run(self.prefix / "bin/tandem", *words, "--csv", "-", input=",".join(map(repr, row)) + "\n")
        names, values = (line.split(",") for line in answer.splitlines())
        return dict(zip(names, values))

    def assert_close(self, found, expected):
        self.assertEqual(len(found), len(expected))
        for x, y in zip(found, expected):
            self.assertAlmostEqual(x, y, delta=1e-9 * max(1.0, abs(y)))

    def test_project_of_the_page(self):
        build, _ = self.configure("example")
        self.installation.build(build)
        joints, place, jacobian, velocity = (numbers(line) for line in run(build / "example").splitlines())
        fk = self.tandem("fk", "--arm", "a", "--jacobian", row=joints[:6])
        self.assertEqual(fk["status"], "ok")
        self.assert_close(place, [float(fk[name]) for name in "xyz"])
        self.assert_close(jacobian, [float(fk[f"j{i}{j}"]) for i in range(1, 7) for j in range(1, 7)])
        # 5 mm ahead at a gain of 3 / s; what lies between the tips stays.
        solve = self.tandem("solve", "--method", "nspqp", row=joints + [0.0, 0.0, 0.0, 0.0, 0.0, 0.015])
        self.assertEqual(solve["status"], "ok")
        self.assert_close(velocity, [float(solve[f"qd_{j}"]) for j in range(1, 13)])
        self.assertGreater(max(map(abs, velocity)), 1e-3)

    def test_versions(self):
        major, minor, _ = VERSION.split(".")
        other = f"{major}.{int(minor) + 1}"
        wanted = self.project["CMakeLists.txt"].replace(f"tandem {major}.{minor}", f"tandem {other}")
        self.assertIn(other, wanted)
        _, output = self.configure("other", fails=True, **{"CMakeLists.txt": wanted})
        self.assertIn(f"version: {VERSION}", output)


if __name__ == "__main__":
    unittest.main(verbosity=2)
