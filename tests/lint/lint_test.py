# SPDX-License-Identifier: Apache-2.0
"""deploy/lint.sh on a small tree: each linter accepts what is right, and names the file and the rule of what is wrong."""
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[2]
PACKAGES = SOURCE / "build/release/console/node_modules"
COPIED = ["deploy/lint.sh", "deploy/lib.sh", "deploy/packages.txt", "deploy/tidy.py", "deploy/build_log.py", "deploy/build_times.py",
          "tests/integration/harness/npm.sh", "console/package.json", "console/package-lock.json", "console/eslint.config.js",
          "console/tsconfig.json", ".clang-format", ".clang-tidy", ".flake8", ".prettierrc", ".gitignore"]


class Lint(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.tree = pathlib.Path(folder.name)
        for name in COPIED:
            (self.tree / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(SOURCE / name, self.tree / name)
        self.git("init", "-q")
        self.commit()

    def git(self, *words):
        subprocess.run(["git", "-c", "user.name=t", "-c", "user.email=t@t", *words], cwd=self.tree, check=True, capture_output=True)

    def commit(self, **files):
        self.write(**files)
        self.git("add", "-A")
        self.git("commit", "-q", "--allow-empty", "-m", "x")

    def write(self, **files):
        for name, text in files.items():
            path = self.tree / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")

    def lint(self, *words):
        # Prettier colours its words where CI is set.
        done = subprocess.run([self.tree / "deploy/lint.sh", "--no-install", *words], env={**os.environ, "NO_COLOR": "1"},
                              capture_output=True, text=True, check=False)
        return done.returncode, done.stdout + done.stderr

    def accepts(self, *words):
        code, text = self.lint(*words)
        self.assertEqual(code, 0, text)
        return text

    def refuses(self, *words, wanted):
        code, text = self.lint(*words)
        self.assertEqual(code, 1, text)
        for one in wanted:
            self.assertIn(one, text)

    def test_format_shell_python(self):
        cases = [("format", "sim/a.cpp", "int i = 1;\n", "int  i = 1;\n", ["sim/a.cpp:1:", "clang-format"]),
                 ("shell", "deploy/a.sh", '#!/bin/sh\nrm "$1"\n', "#!/bin/sh\nrm $1\n", ["deploy/a.sh:2:", "SC2086"]),
                 ("shell", "deploy/prerm", '#!/bin/sh\nrm "$1"\n', "#!/bin/sh\nrm $1\n", ["deploy/prerm:2:", "SC2086"]),
                 ("python", "sim/a.py", "print(1)\n", "import os\n", ["sim/a.py:1:", "F401"])]
        for what, name, right, wrong, wanted in cases:
            with self.subTest(name=name):
                self.write(**{name: right})
                self.accepts(what)
                self.write(**{name: wrong})
                self.refuses(what, wanted=[*wanted, "deploy/lint.sh --fix"])
                self.write(**{name: right})

    def test_fix(self):
        self.write(**{"sim/a.cpp": "int  i = 1;\n"})
        self.accepts("--fix", "format")
        self.assertEqual((self.tree / "sim/a.cpp").read_text(), "int i = 1;\n")

    @unittest.skipUnless(PACKAGES.is_dir(), "the page is not built")
    def test_page(self):
        folder = self.tree / "build/release/console"
        folder.mkdir(parents=True)
        (folder / "node_modules").symlink_to(PACKAGES)
        for name in ("package.json", "package-lock.json"):
            shutil.copy(SOURCE / "console" / name, folder)
        self.write(**{"console/src/a.ts": "export const a = 1;\n", "console/test/a.test.ts": 'export const b = "";\n'})
        self.accepts("page")
        self.write(**{"console/src/a.ts": "export async function a(): Promise<void> {\n  await a();\n  a();\n}\n",
                      "console/test/a.test.ts": "export const b = '';\n"})
        self.refuses("page", wanted=["console/src/a.ts", "3:3", "no-floating-promises", "[warn] console/test/a.test.ts"])

    def test_tidy(self):
        build = self.tree / "build/release"
        unity = build / "Unity/unity_0_cxx.cxx"
        entry = {"directory": str(build), "file": str(unity), "command": f"c++ -I{self.tree} -std=c++20 -o a.o -c {unity}"}
        self.write(**{"build/release/idl/generated/a.h": "\n", "build/release/compile_commands.json": json.dumps([entry]),
                      "build/release/Unity/unity_0_cxx.cxx": "".join(f'#include "{self.tree}/sim/{n}.cpp"\n' for n in "ab")})
        code, text = self.lint("tidy")
        self.assertEqual(code, 77, text)
        self.assertIn("--all tidy", text)
        self.commit(**{"sim/a.h": "int size();\n", "sim/a.cpp": '#include "sim/a.h"\nint Old;\n', "sim/b.cpp": "int Old_;\n"})
        self.commit()
        # What did not change does not count, the header's source included.
        self.write(**{"sim/a.h": "int size(int first);\n"})
        self.assertIn("1 files changed, 1 checked", self.accepts("tidy"))
        for text, name in (("int size(int First);", "parameter 'First'"), ("struct S {\n  int Size;\n};", "public member 'Size'"),
                           ("class C {\n  int size = 0;\n};", "private member 'size'"), ("const int size = 1;", "global constant 'size'"),
                           ("int Size();", "function 'Size'"), ("#define SIZE 1", "macro definition 'SIZE'"),
                           ("inline int f(double x) {\n  return static_cast<int>(x + 0.5);\n}", "bugprone-incorrect-roundings")):
            with self.subTest(text=text):
                self.write(**{"sim/a.h": text + "\n"})
                self.refuses("tidy", wanted=["sim/a.h:", name])
        self.write(**{"sim/a.h": "int size(int first);\n"})
        self.refuses("tidy", "--all", wanted=["sim/a.cpp:2:5", "sim/b.cpp:1:5", "3 files"])
        self.assertIn("more than --most; not checked: sim/b.cpp", self.lint("tidy", "--all", "--most", "1")[1])
        self.refuses("tidy", "--since", "nothing", wanted=["--since nothing: no revision"])
        self.write(**{"sim/c.cpp": "int c;\n"})
        self.assertIn("compiled by no target; not checked: sim/c.cpp", self.accepts("tidy"))


if __name__ == "__main__":
    unittest.main()
