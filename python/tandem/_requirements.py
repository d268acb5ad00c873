# SPDX-License-Identifier: Apache-2.0
"""Requirements of the compiled part of the package on the interpreter and on numpy, and the errors of an import without them."""
import pathlib
import sys
import sysconfig

PACKAGE = pathlib.Path(__file__).parent
CURE = ("Start the interpreter of the build (Debian's: /usr/bin/python3), or build Tandem for this one: "
        "cmake build/release -DTANDEM_PYTHON=ON -DPython3_EXECUTABLE={executable} && ninja -C build/release _tandem.")


def interpreter():
    """The running interpreter: version, extension suffix and path."""
    return f"Python {sys.version.split()[0]} ({sysconfig.get_config_var('EXT_SUFFIX')}) at {sys.executable}"


def extension_missing(error):
    """The ImportError for a compiled module that this interpreter does not find or cannot load."""
    built = sorted(file.name.removeprefix("_tandem") for file in PACKAGE.glob("_tandem*.so"))
    expected = f"one whose extension suffix is {' or '.join(built)}" if built else f"a compiled module _tandem in {PACKAGE}, found none"
    return ImportError(f"tandem: found {interpreter()}, expected {expected}. {CURE.format(executable=sys.executable)} ({error})",
                       name="tandem._tandem")


def numpy_missing(error):
    """The ImportError for an interpreter that cannot import numpy."""
    return ImportError(f"tandem: found no numpy that {interpreter()} can import, expected one. Install it for this interpreter "
                       f"(Debian: apt-get install python3-numpy, used by /usr/bin/python3). ({error})", name="numpy")


def require_numpy(version, supports_numpy_2):
    """Refuses numpy 2 where pybind11 of the build (before 2.12) knows only the binary interface of numpy 1."""
    if int(version.split(".")[0]) >= 2 and not supports_numpy_2:
        raise ImportError(f"tandem: found numpy {version} in {interpreter()}, expected numpy 1.x: the module was built with a "
                          "pybind11 before 2.12. Install numpy 1.x for this interpreter, or build Tandem with pybind11 2.12.", name="numpy")
