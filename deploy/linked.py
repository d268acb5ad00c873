# SPDX-License-Identifier: Apache-2.0
"""Third-party components that the programs, the Python module and the page are linked with; used by components.py.

A component is a Debian source package, or a package of the page as `npm:NAME`."""

import collections
import json
import os
import pathlib
import re
import subprocess
import sysconfig

from build_log import Problem

# Folders whose sources are not part of any program.
NOT_PRODUCT = {"tests", "bench", "build"}
CODE = {".h", ".hpp", ".c", ".cc", ".cpp"}

# One linked component. `version` is the upstream version, `debian` the complete version of the source package. `programs` link one of its
# libraries directly, `rooms` include its headers, `through` are the components that link one of its libraries; a component with neither
# programs nor rooms is linked indirectly.
Linked = collections.namedtuple("Linked", "version programs rooms through debian", defaults=((), (), (), ""))


def run(command, bad=()):
    """Standard output of a command; a Problem for an exit code above 0 that is not in `bad`."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, env={**os.environ, "LC_ALL": "C"})
    except OSError as error:
        raise Problem(f"{command[0]}: {error.strerror}; the script needs Debian's packages dpkg, binutils and libc-bin") from None
    if done.returncode and done.returncode not in bad:
        raise Problem(f"{' '.join(command[:2])} ...: {done.stderr.strip()}")
    return done.stdout


# ---- programs and libraries


def programs_of(cmake):
    """Names of the installed programs, from the list in the top CMakeLists.txt."""
    match = re.search(r"foreach\(program ([\w\s-]+)\)", cmake)
    if not match:
        raise Problem("CMakeLists.txt: found no `foreach(program ...)`, the list of installed programs")
    return match.group(1).split()


def binaries_of(root, build):
    """name -> file of every program, and of the Python module if it is built."""
    binaries = {name: build / "bin" / name for name in programs_of((root / "CMakeLists.txt").read_text(encoding="utf-8"))}
    missing = [name for name, path in binaries.items() if not path.is_file()]
    if missing:
        raise Problem(f"{build}/bin: not built: {', '.join(missing)}. Build first: cmake --build --preset {build.name}")
    binaries.update({"Python module": path for path in sorted((build / "python/tandem").glob("_tandem*.so"))})
    return binaries


def read_ldd(text):
    """library name -> file, from the output of ldd."""
    files = {}
    for line in text.splitlines():
        match = re.match(r"\s+(\S+) => (not found|/\S+)", line) or re.match(r"\s+((/\S+)) \(0x", line)
        if match:
            name, path = match.groups()
            if path == "not found":
                raise Problem(f"{name}: the loader does not find it")
            files[os.path.basename(name)] = path
    return files


def read_needed(text):
    """file -> names of the libraries that it needs, from the output of `readelf -d` for several files."""
    needed, path = collections.defaultdict(list), None
    for line in text.splitlines():
        if line.startswith("File: "):
            path = line.removeprefix("File: ")
        elif match := re.search(r"\(NEEDED\).*\[(.+)\]", line):
            needed[path].append(match.group(1))
    return needed


def reach(names, needed, files):
    """All library names reachable from the given ones."""
    seen, open_ = set(names), list(names)
    for name in open_:
        for other in needed.get(files.get(name), ()):
            if other not in seen:
                seen.add(other)
                open_.append(other)
    return seen


# ---- packages


def spellings(path):
    """Paths under which dpkg may list a file: /usr/lib is also /lib, and symbolic links point elsewhere."""
    names = {str(path), os.path.realpath(path)}
    return names | {name.removeprefix("/usr") for name in names} | {f"/usr{name}" for name in names if not name.startswith("/usr")}


def read_owners(text):
    """file -> package, from the output of `dpkg -S`."""
    owners = {}
    for line in text.splitlines():
        packages, _, path = line.partition(": ")
        if path.startswith("/") and not packages.startswith("diversion "):
            owners[path] = packages.split(",")[0].strip()
    return owners


def upstream(version):
    """The upstream version in a Debian version: 2.9.1 of 1:2.9.1+ds-1."""
    match = re.match(r"(?:\d+:)?(\d+(?:\.\d+)*)", version)
    return match.group(1) if match else version


def older(one, other):
    """Whether a Debian version comes before another one."""
    return subprocess.run(["dpkg", "--compare-versions", one, "lt", other], check=False).returncode == 0


def sources_of(paths):
    """file -> (source package, its version); a Problem for a file without a package."""
    asked = sorted(set().union(*(spellings(path) for path in paths)))
    owners = read_owners(run(["dpkg", "-S", *asked], bad=(1,)))
    packages = sorted(set(owners.values()))
    shown = run(["dpkg-query", "-W", "-f=${binary:Package}\\t${Package}\\t${source:Package}\\t${source:Version}\\n", *packages])
    known = {}
    for line in shown.splitlines():
        full, short, source, version = line.split("\t")
        known[full] = known[short] = (source, version)
    found = {}
    for path in paths:
        owner = next((owners[name] for name in sorted(spellings(path)) if name in owners), None)
        if owner is None:
            raise Problem(f"{path}: of no Debian package, so its version and its CVEs are unknown")
        found[path] = known[owner]
    return found


def libraries(binaries):
    """component -> Linked, of shared libraries."""
    files = read_ldd(run(["ldd", *map(str, binaries.values())]))
    needed = read_needed(run(["readelf", "-d", *map(str, binaries.values()), *files.values()]))
    asked_by = collections.defaultdict(set)
    for program, path in binaries.items():
        for name in needed[str(path)]:
            asked_by[name].add(program)
    sources = sources_of(sorted(set(files.values())))
    component = {name: sources[path][0] for name, path in files.items()}
    versions = {source: version for source, version in sources.values()}
    programs, through = collections.defaultdict(set), collections.defaultdict(set)
    for name, by in asked_by.items():
        programs[component[name]] |= by
        for other in reach([name], needed, files) & component.keys():
            through[component[other]].add(component[name])
    return {source: Linked(upstream(version), tuple(sorted(programs[source])), (), tuple(sorted(through[source] - {source})), version)
            for source, version in versions.items()}


# ---- headers


def included(root):
    """header -> rooms that include it as <header>, in the sources of the product."""
    found = collections.defaultdict(set)
    for top in sorted(root.iterdir()):
        if not top.is_dir() or top.name in NOT_PRODUCT or top.name.startswith("."):
            continue
        for path in top.rglob("*"):
            if path.suffix in CODE:
                parts = path.relative_to(root).parts
                room = "/".join(parts[:2]) if parts[0] == "services" else parts[0]
                for header in re.findall(r"^\s*#\s*include\s*<([^>]+)>", path.read_text(encoding="utf-8"), re.MULTILINE):
                    found[header].add(room)
    return found


def include_folders(root, build):
    """Folders outside the tree in which the compiler searches for headers, without the compiler's own."""
    try:
        commands = (build / "compile_commands.json").read_text(encoding="utf-8")
    except OSError as error:
        raise Problem(f"{build}/compile_commands.json: {error.strerror}. Configure first: cmake --preset {build.name}") from None
    given = {folder for folder in re.findall(r"(?:-isystem\s*|-I)(/[^\s\"\\]+)", commands) if not pathlib.Path(folder).is_relative_to(root)}
    machine = sysconfig.get_config_var("MULTIARCH")  # x86_64-linux-gnu; only Debian's Python defines it
    return [*sorted(given), "/usr/include", *([f"/usr/include/{machine}"] if machine else [])]


def headers(root, build):
    """component -> Linked, of included headers."""
    folders = include_folders(root, build)
    rooms = {}
    for header, by in included(root).items():
        place = next((os.path.join(folder, header) for folder in folders if os.path.isfile(os.path.join(folder, header))), None)
        if place:
            rooms[place] = by
    found = {}
    for place, (source, version) in sources_of(sorted(rooms)).items():
        before = found.get(source, Linked(version)).rooms
        found[source] = Linked(upstream(version), (), tuple(sorted({*before, *rooms[place]})), (), version)
    return found


# ---- page


def page_packages(lock):
    """component -> Linked, of the packages that reach the browser: dependencies without development dependencies."""
    found = {}
    for place, entry in json.loads(lock)["packages"].items():
        if place and not entry.get("dev"):
            found["npm:" + place.split("node_modules/")[-1]] = Linked(entry["version"], (), ("console",))
    return found


def find(root, build):
    """component -> Linked, of all kinds."""
    found = libraries(binaries_of(root, build))
    for source, linked in headers(root, build).items():
        before = found.get(source, linked)
        found[source] = before._replace(rooms=linked.rooms)
    found.update(page_packages((root / "console/package-lock.json").read_text(encoding="utf-8")))
    return found
