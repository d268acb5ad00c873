# SPDX-License-Identifier: Apache-2.0
"""Checks a source tree against the project's rules: permitted includes, constructs forbidden in the periodic path, and first and last
lines of files.

    check_rules.py TREE    prints a line `FILE:LINE: what is wrong` for each violation; ends with 1 if there is any
"""

import pathlib
import re
import sys

LIBRARIES = ["safety", "kinematics", "control", "planning", "hal", "sim", "config", "robots", "operation", "recording", "idl"]

# Libraries among the services; the other folders contain programs, which nothing includes.
SHARED = ["services/" + name for name in
          ["dds", "security", "runtime", "client", "computation", "recordings", "simulation"]]

# Permitted includes of a room's files besides its own. The longest prefix of a file's path counts.
MAY_USE = {
    "safety": [],
    "kinematics": ["safety"],
    "control": ["safety"],
    "planning": ["safety", "kinematics", "control"],
    "hal": ["safety"],
    "sim": ["safety", "kinematics"],
    "sim/drives": ["safety", "kinematics", "hal/can", "hal/canopen"],
    "config": ["safety", "kinematics", "control", "planning", "hal", "sim"],
    "robots": ["safety", "kinematics", "control", "planning", "config"],
    "robots/plant": ["safety", "kinematics", "control", "planning", "config", "sim"],
    "operation": ["safety", "kinematics", "control", "planning", "config", "robots", "idl"],
    "experiments": ["safety", "kinematics", "control", "planning", "hal", "sim", "config", "robots"],
    "recording": [],
    "idl": [],
    "services": LIBRARIES + SHARED,
    "services/cli": LIBRARIES + SHARED + ["experiments"],
    "python": LIBRARIES + ["experiments"] + SHARED,
    # Benchmarks and tests may include what they measure and test, including parts of services.
    "bench": LIBRARIES + ["experiments", "services"],
    "tests": LIBRARIES + ["experiments", "services"],
    "deploy": [],
    "docs": [],
    "console": [],
}

# Axes, arms and guards know AxisDriver and Fieldbus, not a bus: in hal, only these folders include each other's files.
BUSES = ["hal/can", "hal/canopen", "hal/cia402"]

# Permitted for every room: enumerations generated from idl/, without dependencies.
EVERYONE = ["idl/enumerations.h"]

# Ports of a domain are computed in one place; tests have a separate copy of the rule.
RTPS_PORT = re.compile(r"\b74[01]0\b")
KNOWS_PORTS = ["services/dds", "tests"]

FAST_DDS = re.compile(r"fastdds/|fastrtps/|fastcdr/|\w+PubSubTypes\.h")
SEES_FAST_DDS = ["idl", "services/dds", "bench", "tests/integration/wire", "tests/unit/dds"]

# Folders with code of the periodic path; they print nothing, do not wait and contain no threads.
PERIODIC = ["safety", "control", "kinematics", "planning", "operation", "hal", "sim"]
FORBIDDEN = re.compile(r"std::(?:cout|cerr|clog|printf|this_thread|thread|jthread|mutex|condition_variable)\b"
                       r"|\bsleep_(?:for|until)\b|\b(?:u|nano)?sleep\s*\(|\bf?printf\s*\(|<iostream>"
                       r"|\bsystem_clock\b")

# Types of robots and their loaders, as the table of config/ lists them. Other code checks capabilities (robots/capability.h) and calls
# loadAnyRobot(). "robot" is also a kind of `tandem new`.
TYPES = re.findall(r'\{"(\w+)", "\w+", \w+, (load\w+),',
                   (pathlib.Path(__file__).resolve().parents[3] / "config/robot_files.cpp").read_text(encoding="utf-8"))
TYPE_NAME = '"(?:' + "|".join(name for name, _ in TYPES if name != "robot") + ')"'
ROBOT_TYPE = re.compile(r"\brobot\w*(?:\.|->)(?:type|data)\b"
                        rf"|[=!]= *{TYPE_NAME}|{TYPE_NAME} *[=!]="
                        rf"|\b(?:loadCooperative|{'|'.join(loader for _, loader in TYPES)})\(")
KNOWS_TYPES = ["robots", "config", "tests", "bench", "services/cli/models/cooperative.cpp"]

# Namespace of a folder below `tandem`; the others have the name of their folder, or of a folder above it. Services whose folder is named
# like a library have a suffix: inside tandem::control no other namespace of that name would be found.
NAMESPACES = {f"services/{name}": f"{name}_service" for name in ["control", "hal", "planning", "sim"]}

# Words that docs/glossary.md replaces in every sense, comments included.
REPLACED = re.compile(r"(?<![^\W_])(?i:hears?|heard|hearing|deaf|told|desks?|settle[sd]?|placements?|wish(?:es|ed)?|patience"
                      r"|calm|askers?)(?![^\W_])"
                      r"|(?<=[a-z])(?:Desk|Wish|Heard|Patience|LeaseHolder)(?![a-z])")
# Names of members in recordings of before, and the check itself.
HAVE_THEM = ["tests/unit/rules", "recording/conversion.cpp", "tests/unit/recording/conversion_test.cpp", "tests/archive/archive_test.py"]

# Tests may define names in the namespaces of the code that they test; message conversions are found by the type of the message.
FREE = ["tests", "idl", "operation/convert.h", "operation/convert.cpp"]

MOST_LINES = 400
CODE = {".h", ".hpp", ".c", ".cc", ".cpp"}
SOURCE = CODE | {".py", ".sh", ".ts", ".tsx", ".idl"}
LICENSE = "SPDX-License-Identifier: Apache-2.0"
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')
COMMENT = re.compile(r'//[^\n]*|/\*.*?\*/|("(?:\\.|[^"\\\n])*")', re.DOTALL)


def within(path, folders):
    """Whether a path is in one of the folders, or is one."""
    return any(path == folder or path.startswith(folder + "/") for folder in folders)


def home(path):
    """Key of MAY_USE for a file, None outside all rooms."""
    keys = [key for key in MAY_USE if within(path, [key])]
    return max(keys, key=len) if keys else None


def own_folder(path):
    """Folder whose files a file may always include: its room, or for services its service."""
    parts = path.split("/")
    return "/".join(parts[:2]) if parts[0] == "services" else parts[0]


def namespaces_of(path):
    """Namespaces below `tandem` in which, or in parts of which, a file may define its names: of its folder, and of those above."""
    folders = path.split("/")[:-1]
    if folders[0] == "services":
        folders = NAMESPACES.get("/".join(folders[:2]), folders[1]).split("/") + folders[2:]
    folders = [name for name in folders if name not in ("detail", "bindings")]
    return {"/".join(folders[:count]) for count in range(1, len(folders) + 1)}


def without_comments(text):
    """The code with comments blanked out; lines keep their numbers, string literals stay."""
    return COMMENT.sub(lambda m: m.group(1) or "\n" * m.group(0).count("\n"), text)


def check_includes(path, lines):
    """Violations of the dependency rule, as (line number, text)."""
    key = home(path)
    own = own_folder(path)
    for number, line in enumerate(lines, 1):
        match = INCLUDE.match(line)
        if not match:
            continue
        target = match.group(2)
        if FAST_DDS.match(target) and not within(path, SEES_FAST_DDS):
            yield number, f"includes {target}: only {', '.join(SEES_FAST_DDS)} see Fast DDS and its generated types"
        if key == "hal" and within(target, BUSES) and not within(path, BUSES):
            yield number, f"includes {target}: above hal/axis_driver.h and hal/fieldbus.h nothing knows a bus"
        used = target.split("/")[0]
        if "/" not in target or used not in MAY_USE or within(target, [own]):
            continue
        if not within(target, MAY_USE[key] + EVERYONE):
            yield number, f"includes {target}: {key} may use {', '.join(MAY_USE[key]) or 'no other room'}"


def check_details(path, lines):
    """Includes of `detail` headers, which are not installed, outside their folder, the tests and the benchmarks, as (line number, text)."""
    for number, line in enumerate(lines, 1):
        target = INCLUDE.match(line).group(2) if INCLUDE.match(line) else ""
        if "/detail/" not in target or within(path, ["tests", "bench"]):
            continue
        if own_folder(target) != own_folder(path):
            yield number, f"includes {target}: it is internal to {own_folder(target)}"
        elif path.endswith(".h") and "/detail/" not in path:
            yield number, f"includes {target}: a public header may not"


def check_file(tree, path):
    """All violations in one file, as (line number, text)."""
    text = (tree / path).read_text(encoding="utf-8")
    lines = text.splitlines()
    suffix = pathlib.PurePosixPath(path).suffix
    first = 1 if lines and lines[0].startswith("#!") else 0
    if len(lines) <= first or LICENSE not in lines[first]:
        yield first + 1, f"does not begin with {LICENSE}"
    if len(lines) >= MOST_LINES:
        yield len(lines), f"has {len(lines)} lines, expected fewer than {MOST_LINES}: move one concern of it into a file of its own"
    for number, line in enumerate(lines, 1):
        word = REPLACED.search(line)
        if word and not within(path, HAVE_THEM):
            yield number, f"says '{word.group(0)}': docs/glossary.md has the term"
    if suffix not in CODE:
        return
    if suffix in {".h", ".hpp"} and "#pragma once" not in text:
        yield 1, "has no #pragma once"
    code = without_comments(text).splitlines()
    yield from check_includes(path, code)
    yield from check_details(path, code)
    defined = [(number, line[len("namespace tandem::"):].split(" ")[0])
               for number, line in enumerate(code, 1) if line.startswith("namespace tandem::")]
    allowed = namespaces_of(path)
    inside = any(within(name.replace("::", "/"), [folder]) for _, name in defined for folder in allowed)
    if defined and not inside and not within(path, FREE):
        wanted = max(allowed, key=len).replace("/", "::")
        yield defined[0][0], f"defines names in tandem::{defined[0][1]}, not in tandem::{wanted}"
    for number, line in enumerate(code, 1):
        if RTPS_PORT.search(line) and not within(path, KNOWS_PORTS):
            yield number, f"{RTPS_PORT.search(line).group(0)}: ports of a domain come from services/dds/ports.h"
        if ROBOT_TYPE.search(line) and not within(path, KNOWS_TYPES):
            yield number, "asks for a type of robot: ask for what the robot can do (robots/capability.h)"
        match = FORBIDDEN.search(line)
        if match and within(path, PERIODIC):
            yield number, f"{match.group(0).strip()} has no place in the periodic path"


def sources(tree):
    """Source files of a tree as relative posix paths, sorted; hidden, built and installed ones excepted."""
    skipped = {"build", "results", "node_modules", "dist", "__pycache__"}
    for file in sorted(tree.rglob("*")):
        path = file.relative_to(tree)
        hidden = any(part.startswith(".") or part in skipped for part in path.parts)
        if not hidden and file.suffix in SOURCE and file.is_file():
            yield path.as_posix()


def check(tree):
    """All violations in a tree, as lines of text, and the number of checked files."""
    found, count = [], 0
    for path in sources(tree):
        count += 1
        if home(path) is None:
            found.append(f"{path}:1: lies in no room; there are {', '.join(MAY_USE)}")
            continue
        found += [f"{path}:{number}: {text}" for number, text in check_file(tree, path)]
    return found, count


def main():
    tree = pathlib.Path(sys.argv[1])
    found, count = check(tree)
    for line in found:
        print(line)
    print(f"{count} files, {len(found)} violations")
    return 1 if found or count == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
