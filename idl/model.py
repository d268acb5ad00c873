# SPDX-License-Identifier: Apache-2.0
"""Reads idl/*.idl into structs, enumerations and constants, for the generators beside it.

Understands what the IDL files use: comments, include guards, modules, @final structs, basic types, strings, arrays with
literal bounds, unbounded sequences, structs and typedefs of this or of another module, constants, and modules NAME_Constants
with the values of typedef NAME. A remark that begins with [0, N] is the range of the values, or of the length of a text or a
list; `or M` behind it allows M as well. @default(X) is what a new message holds. Anything else is an error.
"""

import dataclasses
import pathlib
import re

HERE = pathlib.Path(__file__).resolve().parent
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
TYPE = r"(?P<type>[^;\[\]=]+?)"
MEMBER = re.compile(rf"(?:@default\((?P<default>[^)]+)\) )?{TYPE}\s+(?P<name>\w+)\s*(?:\[(?P<size>\d+)\])?\s*;$")
CONSTANT = re.compile(rf"const {TYPE}\s+(?P<name>\w+)\s*=\s*(?P<value>\d+)\s*;$")
RANGE = re.compile(r"\[0, (\d+)\](?: or (\d+))?")
FIELD_NAME = re.compile(r"[a-z](_?[a-z0-9]+)*$")  # what ROS 2 allows
CONSTANT_NAME = re.compile(r"[A-Z](_?[A-Z0-9]+)*$")


class IdlError(Exception):
    """What is not understood, with file and line."""


@dataclasses.dataclass
class Constant:
    name: str
    ros: str  # type in .msg
    value: int
    remark: str

    @property
    def label(self):
        """Name for people and files: what stands in quotes, or the name in lower case."""
        quoted = re.match(r'"([^"]*)"', self.remark)
        return quoted[1] if quoted else self.name.lower()

    @property
    def meaning(self):
        """The rest of the remark."""
        return re.sub(r'^"[^"]*"(: )?', "", self.remark)


@dataclasses.dataclass
class Enumeration:
    name: str
    ros: str
    comment: list
    values: list = dataclasses.field(default_factory=list)

    @property
    def bits(self):
        """Whether its values are bits of a mask."""
        return self.ros == "uint32" and all(c.value & (c.value - 1) == 0 < c.value for c in self.values)


@dataclasses.dataclass
class Member:
    name: str
    ros: str  # type in .msg without array: "uint8", "string", "Stop", "std_msgs/Header"
    struct: tuple  # (package, name) of a struct; None for basic types
    enumeration: str  # name of the typedef, or empty
    size: int  # of an array; 0: none
    sequence: bool
    default: str
    remark: str

    @property
    def range(self):
        """(N, M or None) of "[0, N] or M", or None."""
        found = RANGE.match(self.remark)
        return (int(found[1]), int(found[2]) if found[2] else None) if found else None


@dataclasses.dataclass
class Struct:
    package: str
    name: str
    file: str
    comment: list
    members: list = dataclasses.field(default_factory=list)


class Wire:
    """All files: structs by (package, name), enumerations and constants by name, each in the order of its definition."""

    def __init__(self, files):
        self.structs, self.enumerations, self.constants = {}, {}, {}
        parsers = [Parser(file, self) for file in files]
        # Typedefs first: files may use those of others.
        for parser in sorted(parsers, key=lambda p: "enumerations" not in p.path.name):
            parser.parse()
        for parser in parsers:
            for parser.number, used in parser.uses:
                if used not in self.structs:
                    parser.fail(f"{'::msg::'.join(used)} is in none of the files")

    def within(self, struct):
        """Enumerations of a struct's members, in order, once."""
        return list(dict.fromkeys(m.enumeration for m in struct.members if m.enumeration))

    def canonical(self):
        """All that other processes have to agree with: types, names and order of members, names and values of constants."""
        for (package, name), struct in sorted(self.structs.items()):
            members = (f"{m.ros}{'[]' if m.sequence else ''}{m.size or ''} {m.name} {m.enumeration}" for m in struct.members)
            yield f"{package}/{name}: " + ", ".join(members)
        for name, enumeration in sorted(self.enumerations.items()):
            yield f"{name}: " + ", ".join(f"{c.name}={c.value}" for c in enumeration.values)
        for name, constant in sorted(self.constants.items()):
            yield f"{name}={constant.value}"


class Parser:
    """Reads one file, line by line."""

    def __init__(self, path, wire):
        self.path, self.wire = path, wire
        self.number = 0
        self.modules, self.comment, self.uses = [], [], []
        self.struct = self.enumeration = None
        self.final = False

    def fail(self, message):
        raise IdlError(f"{self.path}:{self.number}: {message}")

    def member(self, code, remark):
        match = MEMBER.match(code)
        if not match:
            self.fail(f"not understood: {code}")
        name = match["name"].removeprefix("_")  # the escape of IDL keywords
        if not FIELD_NAME.match(name):
            self.fail(f"member '{name}' is no field name in ROS 2 (lower case, digits, single underscores)")
        idl_type = " ".join(match["type"].split())
        sequence = re.fullmatch(r"sequence<\s*([^<>,]+?)\s*>", idl_type)
        if sequence and match["size"]:
            self.fail("an array of sequences has no .msg twin")
        ros, struct, enumeration = self.resolve(sequence[1] if sequence else idl_type)
        self.struct.members.append(
            Member(name, ros, struct, enumeration, int(match["size"] or 0), bool(sequence), match["default"] or "", remark)
        )

    def resolve(self, idl_type):
        """(type in .msg, struct or None, enumeration or "")."""
        if idl_type in BASIC:
            return BASIC[idl_type], None, ""
        package = self.modules[0]
        name = idl_type.removeprefix("::".join(self.modules) + "::")
        if name in self.wire.enumerations:
            return self.wire.enumerations[name].ros, None, name
        if (package, name) in self.wire.structs:
            return name, (package, name), ""
        other = re.fullmatch(r"(\w+)::msg::(\w+)", idl_type)
        if other and other[1] != package:
            self.uses.append((self.number, other.groups()))
            return f"{other[1]}/{other[2]}", other.groups(), ""
        return self.fail(f"type '{idl_type}' is neither basic nor defined above")

    def constant(self, code, remark):
        match = CONSTANT.match(code)
        if not match or match["type"] not in BASIC or not CONSTANT_NAME.match(match["name"]):
            self.fail(f"not understood: {code}; expected const TYPE NAME = NUMBER; with the name in upper case")
        constant = Constant(match["name"], BASIC[match["type"]], int(match["value"]), remark)
        if self.enumeration is None:
            self.wire.constants[constant.name] = constant
            return
        taken = {c.value: c.name for c in self.enumeration.values}
        if constant.ros != self.enumeration.ros or constant.value in taken or constant.name in taken.values():
            self.fail(f"{constant.name}: another type than the enumeration, or a name or value for the second time")
        self.enumeration.values.append(constant)

    def open(self, code):
        """A line that opens a module or a struct, or defines an enumeration. @return whether it is one."""
        module = re.fullmatch(r"module (\w+) \{", code)
        struct = re.fullmatch(r"struct (\w+) \{", code)
        typedef = re.fullmatch(r"typedef ([\w ]+?) (\w+);", code)
        if module and module[1].endswith("_Constants"):
            name = module[1].removesuffix("_Constants")
            self.enumeration = self.wire.enumerations.get(name) or self.fail(f"there is no typedef {name} above")
        elif module:
            self.modules.append(module[1])
        elif struct:
            key = (self.modules[0], struct[1])
            if not self.final or key in self.wire.structs:
                self.fail("every struct is @final, and defined once")
            self.struct = self.wire.structs[key] = Struct(*key, self.path.name, list(self.comment))
        elif typedef and typedef[1] in BASIC and typedef[2] not in self.wire.enumerations:
            self.wire.enumerations[typedef[2]] = Enumeration(typedef[2], BASIC[typedef[1]], list(self.comment))
        else:
            return False
        return True

    def line(self, text):
        code, _, remark = (part.strip() for part in text.partition("//"))
        if not code:
            # Comments right above a definition describe it; a blank line ends them.
            self.comment = self.comment + [remark] if remark else []
        elif code == "};":
            if self.struct is not None or self.enumeration is not None:
                self.struct = self.enumeration = None
            elif self.modules:
                self.modules.pop()
            else:
                self.fail("closes nothing")
            self.final, self.comment = False, []
        elif code == "@final":
            self.final = True
        elif self.struct is not None:
            self.member(code, remark)
        elif code.startswith("const "):
            self.constant(code, remark)
        elif not code.startswith(("#ifndef ", "#define ", "#endif", "#include ")) and not self.open(code):
            self.fail(f"not understood: {code}")

    def parse(self):
        for self.number, text in enumerate(self.path.read_text(encoding="utf-8").splitlines(), 1):
            self.line(text)
        if self.struct is not None or self.modules:
            self.fail("a module or struct is not closed")
