# SPDX-License-Identifier: Apache-2.0
"""`import tandem` where it cannot work: the error names what was found, what was expected and the cure. The version.

The first argument is the folder of the executables of a build tree; the module lies in PARENT/python."""
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

BIN = pathlib.Path(sys.argv.pop(1)).resolve()
PACKAGE = BIN.parent / "python" / "tandem"


class ImportTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        (self.folder / "tandem").mkdir()
        for file in PACKAGE.glob("*.py"):
            shutil.copy(file, self.folder / "tandem")
        self.extension, = PACKAGE.glob("_tandem*.so")

    def message(self, numpy=None):
        """Text of the error of an import from the folder, where `numpy` replaces the installed one."""
        if numpy is not None:
            (self.folder / "numpy.py").write_text(numpy)
        code = f"import sys; sys.path.insert(0, {str(self.folder)!r}); import tandem"
        answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        self.assertEqual(answer.returncode, 1, answer.stderr)
        last = answer.stderr.strip().splitlines()[-1]
        self.assertTrue(last.startswith("ImportError: tandem: found "), answer.stderr)
        return last

    def test_another_interpreter_is_named(self):
        (self.folder / "tandem" / "_tandem.cpython-399-none.so").symlink_to(self.extension)
        text = self.message()
        for part in (sys.version.split()[0], sys.executable, ".cpython-399-none.so", "-DPython3_EXECUTABLE="):
            self.assertIn(part, text)

    def test_a_missing_extension_is_named(self):
        text = self.message()
        self.assertIn(f"a compiled module _tandem in {self.folder / 'tandem'}", text)

    def test_a_missing_numpy_is_named(self):
        text = self.message(numpy="raise ImportError('no numpy here')")
        for part in ("found no numpy", sys.executable, "python3-numpy", "no numpy here"):
            self.assertIn(part, text)

    def test_numpy_of_another_binary_interface_is_refused(self):
        sys.path.insert(0, str(PACKAGE.parent))
        from tandem import _requirements
        with self.assertRaisesRegex(ImportError, r"found numpy 2\.1\.0 .*expected numpy 1\.x"):
            _requirements.require_numpy("2.1.0", False)
        _requirements.require_numpy("2.1.0", True)
        _requirements.require_numpy("1.24.2", False)

    def test_the_version_is_that_of_the_program(self):
        sys.path.insert(0, str(PACKAGE.parent))
        import tandem
        printed = subprocess.run([BIN / "tandem", "--version"], capture_output=True, text=True, check=True).stdout
        self.assertEqual(printed.split(",")[0], f"tandem {tandem.__version__}")


if __name__ == "__main__":
    unittest.main()
