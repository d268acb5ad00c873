#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Generator of all files that follow from idl/*.idl.

    generate.py msg              writes idl/msg/PACKAGE/*.msg, the equal definitions for ROS 2, for use in other projects
    generate.py msg --check      writes nothing; fails if a .msg file is missing, differs or has no IDL any more
    generate.py build --out DIR  writes plain C++ (idl/*.h), the page's types (messages.ts), Python's constants (wire.py)
"""

import argparse
import difflib
import pathlib
import sys

import generate_cpp
import generate_scripts
from model import HERE, IdlError, Wire


def twin(wire, struct):
    """Text of the .msg twin: constants of its enumerations, then its members."""
    lines = [f"# Generated from idl/{struct.file} by idl/generate.py."] + [f"# {line}" for line in struct.comment]
    for name in wire.within(struct):
        enumeration = wire.enumerations[name]
        prefix = generate_scripts.snake(name).upper()
        lines += [
            f"{enumeration.ros} {prefix}_{c.name}={c.value}" + (f"  # {c.remark}" if c.remark else "") for c in enumeration.values
        ]
    for m in struct.members:
        count = "[]" if m.sequence else f"[{m.size}]" if m.size else ""
        remark = ": ".join(part for part in (m.enumeration, m.remark) if part)
        lines.append(f"{m.ros}{count} {m.name}" + (f"  # {remark}" if remark else ""))
    return "\n".join(lines) + "\n"


def differences(folder, expected):
    """One text per file that is not as it should be."""
    present = {str(file.relative_to(folder)): file.read_text(encoding="utf-8") for file in folder.glob("*/*.msg")}
    for name in sorted(present.keys() | expected.keys()):
        if present.get(name) != expected.get(name):
            old = present.get(name, "").splitlines()
            new = expected.get(name, "").splitlines()
            yield "\n".join(difflib.unified_diff(old, new, f"{folder / name}", "from the IDL", lineterm=""))


def write(folder, files):
    """Writes what differs, so that nothing is built again that need not be."""
    for name, text in files.items():
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        if not file.exists() or file.read_text(encoding="utf-8") != text:
            file.write_text(text, encoding="utf-8")


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("what", choices=["msg", "build"])
    options.add_argument("--check", action="store_true", help="only compare .msg; exit code 1 if they differ")
    options.add_argument("--idl", type=pathlib.Path, nargs="+", default=sorted(HERE.glob("*.idl")))
    options.add_argument("--out", type=pathlib.Path, default=HERE / "msg")
    arguments = options.parse_args()
    try:
        wire = Wire(arguments.idl)
    except IdlError as error:
        print(error, file=sys.stderr)
        return 2
    if arguments.what == "build":
        scripts = {"messages.ts": generate_scripts.typescript(wire), "wire.py": generate_scripts.python(wire)}
        scripts["descriptions.json"] = generate_scripts.descriptions(wire)
        write(arguments.out, generate_cpp.files(wire) | scripts)
    else:
        expected = {f"{package}/{name}.msg": twin(wire, struct) for (package, name), struct in wire.structs.items()}
        if arguments.check:
            found = list(differences(arguments.out, expected))
            print("\n".join(found + ["run idl/generate.py msg"]) if found else f"{len(expected)} .msg files agree with the IDL")
            return 1 if found else 0
        for stale in arguments.out.glob("*/*.msg"):
            if str(stale.relative_to(arguments.out)) not in expected:
                stale.unlink()
        write(arguments.out, expected)
    return 0


if __name__ == "__main__":
    sys.exit(main())
