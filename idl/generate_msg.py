#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Generates the ROS 2 .msg twins of idl/*.idl, so that they are never kept by hand.

    generate_msg.py           writes idl/msg/PACKAGE/*.msg
    generate_msg.py --check   writes nothing; fails where a twin is missing, differs or has no IDL any more

Understands what the IDL file uses: comments, include guards, modules, @final structs, basic types, strings,
arrays with literal bounds, unbounded sequences, and structs of this or of another module. Anything else is an error.
"""

import argparse
import difflib
import pathlib
import re
import sys

BASIC = {
    "octet": "uint8",
    "boolean": "bool",
    "short": "int16",
    "unsigned short": "uint16",
    "long": "int32",
    "unsigned long": "uint32",
    "long long": "int64",
    "unsigned long long": "uint64",
    "float": "float32",
    "double": "float64",
    "string": "string",
}
HERE = pathlib.Path(__file__).resolve().parent
MEMBER = re.compile(r"(?P<type>[^;\[\]]+?)\s+(?P<name>\w+)\s*(?:\[(?P<bound>\d+)\])?\s*;$")
FIELD_NAME = re.compile(r"[a-z](_?[a-z0-9]+)*$")  # what ROS 2 allows


class IdlError(Exception):
    """What the generator does not understand, with file and line."""


class Parser:
    """Reads one IDL file, line by line, into {(package, struct name): .msg text}; notes what it uses of others."""

    def __init__(self, path):
        self.path = path
        self.number = 0
        self.modules = []
        self.structs = {}
        self.uses = []
        self.struct = None
        self.final = False
        self.comment = []

    def fail(self, message):
        raise IdlError(f"{self.path}:{self.number}: {message}")

    def ros_type(self, idl_type):
        idl_type = " ".join(idl_type.split())
        if idl_type in BASIC:
            return BASIC[idl_type]
        sequence = re.fullmatch(r"sequence<\s*([^<>,]+?)\s*>", idl_type)
        if sequence:
            return self.ros_type(sequence[1]) + "[]"
        name = idl_type.removeprefix("::".join(self.modules) + "::")
        if (self.modules[0], name) in self.structs:
            return name
        other = re.fullmatch(r"(\w+)::msg::(\w+)", idl_type)
        if other and other[1] != self.modules[0]:
            self.uses.append((self.number, other.groups()))
            return f"{other[1]}/{other[2]}"
        return self.fail(f"type '{idl_type}' is neither basic nor a struct defined above")

    def member(self, code, remark):
        match = MEMBER.match(code)
        if not match:
            self.fail(f"not understood: {code}")
        name = match["name"].removeprefix("_")  # the escape of IDL keywords
        if not FIELD_NAME.match(name):
            self.fail(f"member '{name}' is no field name in ROS 2 (lower case, digits, single underscores)")
        ros = self.ros_type(match["type"])
        if match["bound"]:
            if ros.endswith("]"):
                self.fail("an array of sequences has no .msg twin")
            ros += f"[{match['bound']}]"
        self.struct.append(f"{ros} {name}" + (f"  # {remark}" if remark else ""))

    def line(self, text):
        code, _, remark = (part.strip() for part in text.partition("//"))
        if not code:
            # Comments right above a struct describe it; a blank line ends them.
            self.comment = self.comment + ["# " + remark] if remark else []
            return
        module = re.fullmatch(r"module (\w+) \{", code)
        struct = re.fullmatch(r"struct (\w+) \{", code)
        if code.startswith(("#ifndef ", "#define ", "#endif", "#include ")):
            pass
        elif module and self.struct is None:
            self.modules.append(module[1])
        elif code == "@final":
            self.final = True
        elif struct and self.struct is None:
            if not self.final:
                self.fail("every struct is @final")
            self.struct_name, self.struct = struct[1], list(self.comment)
        elif code == "};" and self.struct is not None:
            header = f"# Generated from idl/{self.path.name} by idl/generate_msg.py.\n"
            self.structs[self.modules[0], self.struct_name] = header + "\n".join(self.struct) + "\n"
            self.struct, self.final, self.comment = None, False, []
        elif code == "};" and self.modules:
            self.modules.pop()
        elif self.struct is not None:
            self.member(code, remark)
        else:
            self.fail(f"not understood: {code}")

    def parse(self):
        for self.number, text in enumerate(self.path.read_text(encoding="utf-8").splitlines(), 1):
            self.line(text)
        if self.struct is not None or self.modules:
            self.fail("a module or struct is not closed")
        return self.structs


def differences(folder, expected):
    """One text per file that is not as it should be."""
    present = {str(file.relative_to(folder)): file.read_text(encoding="utf-8") for file in folder.glob("*/*.msg")}
    for name in sorted(present.keys() | expected.keys()):
        if present.get(name) != expected.get(name):
            old = present.get(name, "").splitlines()
            new = expected.get(name, "").splitlines()
            yield "\n".join(difflib.unified_diff(old, new, f"{folder / name}", "from the IDL", lineterm=""))


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--check", action="store_true", help="compare only; exit 1 where something differs")
    options.add_argument("--idl", type=pathlib.Path, nargs="+", default=sorted(HERE.glob("*.idl")))
    options.add_argument("--out", type=pathlib.Path, default=HERE / "msg")
    arguments = options.parse_args()
    structs, parsers = {}, [Parser(file) for file in arguments.idl]
    try:
        for parser in parsers:
            found = parser.parse()
            if not found or found.keys() & structs.keys():
                raise IdlError(f"{parser.path}: no struct, or one of another file")
            structs.update(found)
        for parser in parsers:
            for parser.number, used in parser.uses:
                if used not in structs:
                    parser.fail(f"{'::msg::'.join(used)} is in none of the files")
    except IdlError as error:
        print(error, file=sys.stderr)
        return 2
    expected = {f"{package}/{name}.msg": text for (package, name), text in structs.items()}
    if arguments.check:
        found = list(differences(arguments.out, expected))
        print("\n".join(found) if found else f"{len(expected)} .msg files agree with the IDL")
        return 1 if found else 0
    for stale in arguments.out.glob("*/*.msg"):
        if str(stale.relative_to(arguments.out)) not in expected:
            stale.unlink()
    for name, text in expected.items():
        (arguments.out / name).parent.mkdir(parents=True, exist_ok=True)
        (arguments.out / name).write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
