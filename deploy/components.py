#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The tables of third-party components and their CVEs in docs/security.md; see --help."""

import argparse
import collections
import datetime
import os
import pathlib
import re
import signal
import sys

import yaml

from build_log import Problem
from linked import find, older

ROOT = pathlib.Path(__file__).resolve().parent.parent
DATA = "deploy/components.yaml"
PAGE = "docs/security.md"
BEGIN = f"<!-- `deploy/components.py --write` makes what follows of {DATA}. -->"
END = "<!-- End of what `deploy/components.py` makes. -->"
TRACKER = "https://security-tracker.debian.org/tracker/"
ADVISORY = "https://github.com/advisories/"
MODULE = "Python module"

HELP = f"""\
Finds the third-party components that Tandem is linked with: shared libraries of every program and of the Python module (ldd, readelf),
packages whose headers the sources include, and npm packages that reach the browser. dpkg gives the Debian source package and version
of each. {DATA}, written by hand, lists for each of them which external data it reads, which CVEs of its version are
known, whether Debian has the fix, and what protects Tandem. The tables of {PAGE} are made from both.

Without an option the script prints the linked components, and the fixes of Debian that this PC lacks. It needs a built tree and no network.

--check ends with exit code 1 and names the component if
  - a linked component has no entry in {DATA},
  - an entry is not linked any more,
  - the linked version is another one than the entry describes (`version: "3.0"` describes all of 3.0.x),
  - the tables in {PAGE} differ from what --write would write.
Debian's part of a version does not count, so that a PC with other point releases passes.
"""
EXAMPLES = f"""\
examples:
  deploy/components.py                    linked components, with versions
  deploy/components.py --check            check that all entries exist and that the tables are up to date
  deploy/components.py --write            write the tables again
  deploy/components.py --preset debug     another preset

to renew the facts:
  1. apt-get update, apt-get upgrade, build, deploy/components.py
  2. For each component, read {TRACKER}source-package/NAME
     and the release notes of the project; correct the entry. What you cannot find is "not found".
  3. Set `looked_up` to today, run --write, and read the difference.
"""

COMPONENT = {"name", "version", "reads", "mitigations"}
CVE = {"id", "effect", "upstream", "debian"}
STATE = re.compile(r"(yes|no|not found)\b")  # start of a CVE's `debian`: whether Debian 12 has the fix


# ---- data


def keys_of(entry, needed, more, where):
    """A Problem unless an entry is a mapping with all keys of `needed` and no others than those and `more`."""
    if not isinstance(entry, dict):
        raise Problem(f"{DATA}: {where}: expected a mapping")
    missing, unknown = needed - entry.keys(), entry.keys() - needed - more
    if missing or unknown:
        raise Problem(f"{DATA}: {where}: " + "; ".join(f"{what} {', '.join(sorted(map(str, names)))}"
                                                       for what, names in (("missing", missing), ("unknown", unknown)) if names))
    for key, value in entry.items():
        if isinstance(value, (bool, float)):
            raise Problem(f"{DATA}: {where}: {key}: found {value}, expected text; put it between quotes")


def mitigations_of(entry, data, where):
    unknown = [name for name in entry.get("mitigations", []) if name not in data["mitigations"]]
    if unknown:
        raise Problem(f"{DATA}: {where}: unknown mitigation {', '.join(unknown)}; there are {', '.join(data['mitigations'])}")


def ids_of(cve):
    return cve["id"] if isinstance(cve["id"], list) else [cve["id"]]


def checked(data):
    """The data, or a Problem with the place of the first error."""
    keys_of(data, {"looked_up", "mitigations", "components", "without", "through"}, set(), "the file")
    if not isinstance(data["looked_up"], datetime.date):
        raise Problem(f"{DATA}: looked_up: expected a date, e.g. 2026-01-31")
    for source, entry in data["components"].items():
        keys_of(entry, COMPONENT, {"cves", "note"}, source)
        mitigations_of(entry, data, source)
        for cve in entry.get("cves", []):
            where = f"{source}, {cve.get('id') if isinstance(cve, dict) else cve}"
            keys_of(cve, CVE, {"mitigations", "note"}, where)
            mitigations_of(cve, data, where)
            odd = [name for name in ids_of(cve) if not re.fullmatch(r"CVE-\d{4}-\d{4,}|GHSA(-\w{4}){3}", str(name))]
            if odd:
                raise Problem(f"{DATA}: {where}: {odd[0]}: neither a CVE nor a GHSA")
            if not STATE.match(cve["debian"]):
                raise Problem(f"{DATA}: {where}: debian: found '{cve['debian']}', expected it to begin with yes, no or not found")
    for group in data["through"]:
        keys_of(group, {"why", "packages"}, set(), "through")
    return data


def load(path):
    try:
        return checked(yaml.safe_load(path.read_text(encoding="utf-8")))
    except OSError as error:
        raise Problem(f"{path}: {error.strerror}") from None
    except yaml.YAMLError as error:
        raise Problem(f"{path}: {error}") from None


# ---- linked components compared with the data


def describes(described, version):
    """Whether an entry for a version or a series describes this version: 3.0 describes 3.0.19 and not 3.01."""
    return f"{version}.".startswith(f"{described}.")


def where_linked(linked):
    if linked.programs:
        return f"linked into {', '.join(linked.programs)}"
    if linked.rooms:
        return f"included by {', '.join(linked.rooms)}"
    return f"linked through {', '.join(linked.through)}"


def problems(found, data):
    """Errors, one text per component."""
    entries, without = data["components"], data["without"]
    through = {source for group in data["through"] for source in group["packages"]}
    wrong = []
    for source, linked in sorted(found.items()):
        if source in entries:
            if not describes(entries[source]["version"], linked.version):
                wrong.append(f"{source}: {linked.version} is linked, the entry describes {entries[source]['version']}: "
                             "look its CVEs up anew")
        elif source in without:
            continue
        elif source not in through:
            wrong.append(f"{source} {linked.version}: {where_linked(linked)}, and has no entry. Add one to `components` if it reads "
                         "bytes of others, or the reason why not to `without` (`through`, if no program links it itself)")
        elif linked.programs or linked.rooms:
            wrong.append(f"{source}: {where_linked(linked)}, and listed under `through` only: say what it reads")
    for source in {**entries, **without}:
        if source not in found:
            wrong.append(f"{source}: has an entry, and nothing links it any more: remove the entry")
        if source in without and source in entries:
            wrong.append(f"{source}: has two entries, in `components` and in `without`")
    return wrong


# ---- tables


def cell(text):
    return re.sub(r"\s+", " ", str(text)).strip().replace("|", "\\|")


def sentence(text):
    """A cell in the form of a sentence (capital letter, full stop), for joining with others."""
    text = cell(text)
    return text[:1].upper() + text[1:] + ("" if text.endswith((".", "?")) else ".")


def table(head, rows):
    return [f"| {' | '.join(head)} |", "|" + "---|" * len(head), *(f"| {' | '.join(row)} |" for row in rows)]


def place_of(source, linked, programs):
    """Short description of where a component is linked. The Python module links the same as `tandem`, and is not built everywhere."""
    if source.startswith("npm:"):
        return "the page"
    by = [name for name in linked.programs if name != MODULE]
    if by:
        others = [name for name in programs if name not in by]
        if not others:
            return "all programs"
        return f"all but `{'`, `'.join(others)}`" if len(others) <= 2 else f"`{'`, `'.join(by)}`"
    if linked.rooms:
        return f"headers in {', '.join(f'`{room}`' for room in linked.rooms)}"
    return f"through `{'`, `'.join(linked.through)}`"


def count_of(entry):
    ids = collections.Counter(STATE.match(cve["debian"]).group(1) for cve in entry.get("cves", []) for _ in ids_of(cve))
    parts = [text.format(ids[state]) for state, text in
             (("no", "**{} without a fix**"), ("not found", "{} unclear"), ("yes", "{} fixed")) if ids[state]]
    return ", ".join(parts) or "none found"


def mitigation_names(entry):
    return " ".join(filter(None, [sentence(", ".join(entry["mitigations"])) if entry.get("mitigations") else "",
                                  sentence(entry["note"]) if entry.get("note") else ""]))


def link_of(name):
    return f"[{name}]({TRACKER if name.startswith('CVE') else ADVISORY}{name})"


def render(found, data):
    """The lines of the page between the markers."""
    entries = {source: entry for source, entry in data["components"].items() if source in found}
    programs = sorted({name for linked in found.values() for name in linked.programs} - {MODULE})
    day = data["looked_up"]
    lines = [f"Facts of {day.day} {day:%B %Y}.", "", "**Components that read bytes of others**", ""]
    lines += table(["component", "version", "linked into", "reads", "CVEs in Debian 12", "mitigations"],
                   [[cell(entry["name"]), cell(entry["version"]), place_of(source, found[source], programs), cell(entry["reads"]),
                     count_of(entry), mitigation_names(entry)] for source, entry in entries.items()])
    lines += ["", "**CVEs**", ""]
    lines += table(["component", "CVE", "effect", "fixed by the project in", "fixed in Debian 12", "mitigations"],
                   [[cell(entry["name"]), ", ".join(map(link_of, ids_of(cve))), sentence(cve["effect"]), cell(cve["upstream"]),
                     cell(cve["debian"]), mitigation_names(cve) or "the update"]
                    for entry in entries.values() for cve in entry.get("cves", [])])
    lines += ["", "**Mitigations**", ""]
    lines += [f"- *{name}*: {cell(text)}" for name, text in data["mitigations"].items()]
    lines += ["", "**Linked, without a row**", ""]
    lines += [f"- `{source}`: {cell(why)}" for source, why in data["without"].items()]
    lines += [f"- {cell(group['why'])}: " + ", ".join(f"`{source}`" for source in group["packages"]) for group in data["through"]]
    return lines


def split(page):
    """(before, between, after) the markers of the page."""
    match = re.fullmatch(rf"(.*{re.escape(BEGIN)}\n)(.*?)({re.escape(END)}\n.*)", page, re.DOTALL)
    if not match:
        raise Problem(f"{PAGE}: found no lines `{BEGIN}` and `{END}`, between which the tables belong")
    return match.groups()


def written(page, found, data):
    before, _, after = split(page)
    return before + "\n" + "\n".join(render(found, data)) + "\n\n" + after


def difference(page, wanted):
    """The first line in which the page differs from the wanted one; empty if there is none."""
    have, want = page.splitlines(), wanted.splitlines()
    for number, (one, other) in enumerate(zip(have, want), 1):
        if one != other:
            start = max(0, len(os.path.commonprefix([one, other])) - 40)
            one, other = one[start:start + 100], other[start:start + 100]
            return f"{PAGE}:{number}: the tables are out of date: found `{one}`, expected `{other}`"
    return "" if len(have) == len(want) else f"{PAGE}: the tables are out of date: found {len(have)} lines, expected {len(want)}"


# ---- command line


def lacking(found, data):
    """Debian's fixes that this PC lacks: its version of a component is older than the one in an entry."""
    for source, entry in data["components"].items():
        for cve in entry.get("cves", []):
            fixed = re.match(r"yes, (\d\S*)$", cve["debian"])
            have = found[source].debian if source in found else ""
            if fixed and have and older(have, fixed.group(1)):
                yield f"{source} {have}: lacks {', '.join(ids_of(cve))}, fixed in {fixed.group(1)}"


def print_found(found, data):
    programs = sorted({name for linked in found.values() for name in linked.programs} - {MODULE})
    for indirect in (False, True):
        print("\nlinked by others" if indirect else "linked by Tandem")
        for source, linked in sorted(found.items()):
            if bool(linked.programs or linked.rooms) != indirect:
                entry = data["components"].get(source)
                print(f"  {source:36}{linked.version:12}{count_of(entry).replace('**', '') if entry else '-':42}"
                      f"{place_of(source, linked, programs).replace('`', '')}")
    missing = list(lacking(found, data))
    if missing:
        print("\nfixes of Debian that this PC lacks; apt-get update, apt-get upgrade", *missing, sep="\n  ")


def arguments_of(words):
    parser = argparse.ArgumentParser(prog="deploy/components.py", description=HELP, epilog=EXAMPLES,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--preset", default="release", metavar="NAME", help="build/NAME is read (default: release)")
    parser.add_argument("--build", type=pathlib.Path, metavar="FOLDER", help="another build tree")
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--check", action="store_true", help="fail if entries or tables are out of date")
    which.add_argument("--write", action="store_true", help=f"write the tables into {PAGE}")
    return parser.parse_args(words)


def main(words):
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    asked = arguments_of(words)
    try:
        data = load(ROOT / DATA)
        found = find(ROOT, (asked.build or ROOT / "build" / asked.preset).resolve())
        wrong = [f"{DATA}: {text}" for text in problems(found, data)]
        page = (ROOT / PAGE).read_text(encoding="utf-8")
        wanted = written(page, found, data)
        if asked.write and not wrong:
            (ROOT / PAGE).write_text(wanted, encoding="utf-8")
        elif asked.check and page != wanted:
            wrong.append(difference(page, wanted) + ". Make them anew: deploy/components.py --write")
        elif not asked.check and not asked.write:
            print_found(found, data)
        if wrong:
            print("\n".join(wrong), file=sys.stderr)
            return 1
        print(f"{len(data['components'])} components that read bytes of others, {len(found)} linked in all")
        return 0
    except Problem as problem:
        print(f"components.py: {problem}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
