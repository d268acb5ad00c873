# SPDX-License-Identifier: Apache-2.0
"""Objects compiled for other processors do not link with the libraries: alignment_test.py SOURCE COMPILER LIBRARY EIGEN"""
import pathlib
import subprocess
import sys
import tempfile

SOURCE, COMPILER, LIBRARY, EIGEN = sys.argv[1:]


def link(folder, *flags):
    source = pathlib.Path(folder, "main.cpp")
    source.write_text('#include "safety/dimensions.h"\nint main() { return 0; }\n', encoding="utf-8")
    program = pathlib.Path(folder, "program")
    includes = ["-include", f"{SOURCE}/safety/alignment.h", f"-I{SOURCE}", f"-isystem{EIGEN}"]
    return subprocess.run([COMPILER, "-std=c++20", *flags, *includes, str(source), LIBRARY, "-o", str(program)],
                          check=False, capture_output=True, text=True)


with tempfile.TemporaryDirectory(prefix="tandem-alignment-") as scratch:
    same, other = link(scratch), link(scratch, "-march=x86-64-v3")
assert same.returncode == 0, same.stderr
assert other.returncode != 0, "an object with another alignment was linked"
assert "EigenAlignedTo<32>" in other.stderr, other.stderr
print("an object for x86-64-v3 does not link: it refers to EigenAlignedTo<32>")
