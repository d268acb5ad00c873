# SPDX-License-Identifier: Apache-2.0
"""The tables of third-party components and their check, with synthetic programs, packages and entries."""

import contextlib
import copy
import datetime
import io
import json
import pathlib
import sys
import tempfile
import unittest
from unittest import mock

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "deploy"))

import build_log  # noqa: E402
import components  # noqa: E402
import linked  # noqa: E402
from linked import Linked  # noqa: E402

FOUND = {
    "wire": Linked("2.9.1", ("Python module", "tandem", "tandem-hal"), ("services/dds",), (), "2.9.1+ds-1+deb12u2"),
    "json": Linked("3.11.2", (), ("services/console",), (), "3.11.2-2"),
    "xml": Linked("9.0.0", (), (), ("wire",), "9.0.0-1"),
    "libc": Linked("2.36", ("Python module", "tandem", "tandem-hal", "tandem-sim"), (), ("wire",), "2.36-9"),
    "sql": Linked("3.40.1", (), (), ("wire",), "3.40.1-2"),
    "npm:plot": Linked("1.6.32", (), ("console",)),
}
DATA = {
    "looked_up": datetime.date(2026, 1, 31),
    "mitigations": {"loopback": "Sockets are bound to\nthis host.", "sandbox": "It protects the PC."},
    "components": {
        "wire": {"name": "Wire", "version": "2.9", "reads": "packets | bytes", "mitigations": ["loopback", "sandbox"], "cves": [
            {"id": ["CVE-2025-0001", "CVE-2025-0002"], "effect": "a crash", "upstream": "2.10", "debian": "no", "mitigations": ["loopback"],
             "note": "nothing else"},
            {"id": "CVE-2024-12345", "effect": "a leak", "upstream": "2.9.1", "debian": "not found"},
            {"id": "GHSA-8g7x-c9fg-g6mh", "effect": "a leak", "upstream": "2.9.1", "debian": "yes, 2.9.1+ds-1+deb12u3"}]},
        "json": {"name": "JSON", "version": "3.11.2", "reads": "texts", "mitigations": []},
        "xml": {"name": "XML", "version": "9.0.0", "reads": "files", "mitigations": ["sandbox"]},
        "npm:plot": {"name": "plot", "version": "1.6.32", "reads": "numbers", "mitigations": []},
    },
    "without": {"libc": "of every program"},
    "through": [{"why": "a database that is off", "packages": ["sql", "not-there"]}],
}
PAGE = f"# Security\n\n{components.BEGIN}\nold\n{components.END}\n\nmore\n"


class Reading(unittest.TestCase):
    def test_ldd(self):
        text = ("bin/a:\n\tlinux-vdso.so.1 (0x00007ffe)\n\tlibz.so.1 => /lib/x/libz.so.1 (0x00007f)\n"
                "\t/lib64/ld-linux-x86-64.so.2 (0x00007f)\nbin/b:\n\tstatically linked\n")
        self.assertEqual(linked.read_ldd(text), {"libz.so.1": "/lib/x/libz.so.1", "ld-linux-x86-64.so.2": "/lib64/ld-linux-x86-64.so.2"})
        with self.assertRaisesRegex(build_log.Problem, "libq.so.2: the loader does not find it"):
            linked.read_ldd("\tlibq.so.2 => not found\n")

    def test_readelf_and_what_is_reached(self):
        text = ("\nFile: bin/a\n 0x1 (NEEDED)  Shared library: [libz.so.1]\n 0xe (SONAME)  Library soname: [a]\n"
                "\nFile: /l/libz.so.1\n 0x1 (NEEDED)  Shared library: [libc.so.6]\n")
        needed = linked.read_needed(text)
        self.assertEqual(needed["bin/a"], ["libz.so.1"])
        files = {"libz.so.1": "/l/libz.so.1", "libc.so.6": "/l/libc.so.6"}
        self.assertEqual(linked.reach(["libz.so.1"], needed, files), {"libz.so.1", "libc.so.6"})

    def test_owners_and_versions(self):
        text = ("diversion by dash from: /bin/sh\nlibc6:amd64: /lib/libc.so.6\na:amd64, b:amd64: /usr/lib/libx.so.1\n"
                "dpkg-query: no path found matching pattern /x\n")
        self.assertEqual(linked.read_owners(text), {"/lib/libc.so.6": "libc6:amd64", "/usr/lib/libx.so.1": "a:amd64"})
        for version, wanted in [("2.9.1+ds-1+deb12u2", "2.9.1"), ("1:1.2.13.dfsg-1", "1.2.13"), ("3.0.19-1~deb12u2", "3.0.19"),
                                ("1.0-1", "1.0")]:
            self.assertEqual(linked.upstream(version), wanted)
        self.assertLessEqual({"/usr/lib/x.so", "/lib/x.so"}, linked.spellings("/lib/x.so"))

    def test_programs_and_headers(self):
        self.assertEqual(linked.programs_of("foreach(program tandem tandem-hal)\n"), ["tandem", "tandem-hal"])
        with self.assertRaisesRegex(build_log.Problem, "list of installed programs"):
            linked.programs_of("")
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for path in ["services/dds/a.cpp", "services/console/a.h", "tests/a.cpp", "build/a.cpp", ".git/a.cpp", "hal/can/a.cpp"]:
                (root / path).parent.mkdir(parents=True)
                (root / path).write_text('#include <json.hpp>\n#include "own.h"\n', encoding="utf-8")
            self.assertEqual(linked.included(root), {"json.hpp": {"services/dds", "services/console", "hal"}})
            with self.assertRaisesRegex(build_log.Problem, "cmake --preset release"):
                linked.include_folders(root, root / "release")

    def test_packages_of_the_page_without_those_of_development(self):
        lock = {"packages": {"": {"version": "1"}, "node_modules/plot": {"version": "1.6.32"},
                             "node_modules/vite": {"version": "6", "dev": True},
                             "node_modules/plot/node_modules/@a/b": {"version": "2.0.0"}}}
        self.assertEqual(linked.page_packages(json.dumps(lock)),
                         {"npm:plot": Linked("1.6.32", (), ("console",)), "npm:@a/b": Linked("2.0.0", (), ("console",))})


class Entries(unittest.TestCase):
    def setUp(self):
        self.found, self.data = dict(FOUND), copy.deepcopy(DATA)

    def wrong(self, *texts):
        """There is one problem, and its text contains all of these."""
        found = components.problems(self.found, self.data)
        self.assertEqual(len(found), 1, found)
        for text in texts:
            self.assertIn(text, found[0])

    def test_all_is_known(self):
        self.assertEqual(components.problems(self.found, self.data), [])

    def test_a_linked_component_without_entry(self):
        self.found["zip"] = Linked("1.2", ("tandem-hal",))
        self.wrong("zip 1.2", "linked into tandem-hal", "has no entry")

    def test_an_included_component_without_entry(self):
        del self.data["components"]["json"]
        self.wrong("json 3.11.2", "included by services/console", "has no entry")

    def test_a_component_without_entry_behind_another_one(self):
        self.found["zip"] = Linked("1.2", (), (), ("wire",))
        self.wrong("zip 1.2", "linked through wire", "has no entry")

    def test_an_entry_that_nothing_links(self):
        for kind, source in [("components", "npm:plot"), ("without", "libc")]:
            with self.subTest(kind=kind):
                self.found = {name: one for name, one in FOUND.items() if name != source}
                self.wrong(source, "nothing links it any more")

    def test_two_entries(self):
        self.data["without"]["json"] = "no"
        self.wrong("json", "two entries")

    def test_what_is_linked_itself_now(self):
        self.found["sql"] = Linked("3.40.1", ("tandem",))
        self.wrong("sql", "linked into tandem", "through")

    def test_versions(self):
        for version, passes in [("2.9.1", True), ("2.9", True), ("2.9.10", True), ("2.10.0", False), ("2.90", False)]:
            with self.subTest(version=version):
                self.found["wire"] = FOUND["wire"]._replace(version=version)
                if passes:
                    self.assertEqual(components.problems(self.found, self.data), [])
                else:
                    self.wrong(f"wire: {version} is linked", "describes 2.9")

    def test_fixes_that_this_pc_lacks(self):
        self.assertEqual(list(components.lacking(FOUND, DATA)),
                         ["wire 2.9.1+ds-1+deb12u2: lacks GHSA-8g7x-c9fg-g6mh, fixed in 2.9.1+ds-1+deb12u3"])


class Data(unittest.TestCase):
    def fails(self, wanted, change):
        data = copy.deepcopy(DATA)
        change(data, data["components"]["wire"], data["components"]["wire"]["cves"][0])
        with self.assertRaises(build_log.Problem) as caught:
            components.checked(data)
        self.assertIn(wanted, str(caught.exception))

    def test_good_data(self):
        self.assertIs(components.checked(DATA), DATA)

    def test_errors_name_the_entry(self):
        self.fails("wire: missing reads", lambda data, wire, cve: wire.pop("reads"))
        self.fails("wire: unknown nots", lambda data, wire, cve: wire.update(nots="x"))
        self.fails("wire, ['CVE-2025-0001', 'CVE-2025-0002']: missing effect",
                   lambda data, wire, cve: cve.pop("effect"))
        self.fails("unknown mitigation armour; there are loopback, sandbox", lambda data, wire, cve: cve.update(mitigations=["armour"]))
        self.fails("debian: found False, expected text; put it between quotes", lambda data, wire, cve: cve.update(debian=False))
        self.fails("version: found 3.0, expected text", lambda data, wire, cve: wire.update(version=3.0))
        self.fails("debian: found 'never'", lambda data, wire, cve: cve.update(debian="never"))
        self.fails("CVE-25-1: neither a CVE nor a GHSA", lambda data, wire, cve: cve.update(id="CVE-25-1"))
        self.fails("looked_up: expected a date", lambda data, wire, cve: data.update(looked_up="soon"))
        self.fails("the file: missing through", lambda data, wire, cve: data.pop("through"))

    def test_the_projects_file_is_valid(self):
        components.load(components.ROOT / components.DATA)


class Tables(unittest.TestCase):
    def test_rows(self):
        text = "\n".join(components.render(FOUND, DATA))
        for wanted in ["Facts of 31 January 2026.",
                       "| Wire | 2.9 | all but `tandem-sim` | packets \\| bytes | **2 without a fix**, 1 unclear, 1 fixed | Loopback, ",
                       "| JSON | 3.11.2 | headers in `services/console` | texts | none found |  |",
                       "| XML | 9.0.0 | through `wire` |", "| plot | 1.6.32 | the page |",
                       "| A crash. | 2.10 | no | Loopback. Nothing else. |", "tracker/CVE-2025-0002)", "advisories/GHSA-8g7x-c9fg-g6mh)",
                       "- *loopback*: Sockets are bound to this host.", "- `libc`: of every program", "- a database that is off: `sql`"]:
            self.assertIn(wanted, text)

    def test_versions_of_this_machine_and_the_python_module_make_no_difference(self):
        other = {name: one._replace(version=one.version + ".7", debian="x", programs=tuple(set(one.programs) - {"Python module"}))
                 for name, one in FOUND.items()}
        self.assertEqual(components.render(other, DATA), components.render(FOUND, DATA))

    def test_the_page_is_written_between_its_marks(self):
        page = components.written(PAGE, FOUND, DATA)
        self.assertTrue(page.startswith(f"# Security\n\n{components.BEGIN}\n"))
        self.assertTrue(page.endswith(f"{components.END}\n\nmore\n"))
        self.assertNotIn("old", page)
        self.assertEqual(components.written(page, FOUND, DATA), page)
        with self.assertRaisesRegex(build_log.Problem, "found no lines"):
            components.written("# Security\n", FOUND, DATA)

    def test_a_changed_page(self):
        page = components.written(PAGE, FOUND, DATA)
        self.assertEqual(components.difference(page, page), "")
        text = components.difference(page.replace("**2 without", "**0 without"), page)
        for wanted in ["docs/security.md:11: the tables are out of date: found", "**0 without a fix", "expected", "**2 without a fix"]:
            self.assertIn(wanted, text)
        self.assertRegex(components.difference(page + "more\n", page), r"found \d+ lines, expected \d+")


class Program(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        (self.root / "docs").mkdir()
        self.page = self.root / components.PAGE
        self.page.write_text(PAGE, encoding="utf-8")
        self.found, self.data = dict(FOUND), copy.deepcopy(DATA)

    def run_it(self, *words):
        """(exit code, output)"""
        with mock.patch.multiple(components, ROOT=self.root, load=lambda path: self.data, find=lambda root, build: self.found), \
                contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(out):
            return components.main(list(words)), out.getvalue()

    def test_check_write_check(self):
        code, text = self.run_it("--check")
        self.assertEqual(code, 1)
        self.assertIn("deploy/components.py --write", text)
        self.assertEqual(self.run_it("--write")[0], 0)
        self.assertEqual(self.run_it("--check")[0], 0)
        self.data["components"]["wire"]["cves"].pop()
        self.assertEqual(self.run_it("--check")[0], 1)

    def test_what_is_unknown_is_not_written(self):
        self.found["zip"] = Linked("1.2", ("tandem",))
        for option in ("--write", "--check"):
            code, text = self.run_it(option)
            self.assertEqual(code, 1)
            self.assertIn("deploy/components.yaml: zip 1.2", text)
        self.assertEqual(self.page.read_text(encoding="utf-8"), PAGE)

    def test_the_list(self):
        code, text = self.run_it()
        self.assertEqual(code, 0)
        for wanted in ["linked by Tandem", "wire", "2 without a fix, 1 unclear, 1 fixed", "linked by others", "lacks GHSA-8g7x-c9fg-g6mh"]:
            self.assertIn(wanted, text)

    def test_a_tree_that_is_not_built(self):
        (self.root / "CMakeLists.txt").write_text("foreach(program tandem tandem-hal)\n", encoding="utf-8")
        with self.assertRaisesRegex(build_log.Problem, "not built: tandem, tandem-hal. Build first: cmake --build --preset debug"):
            linked.find(self.root, self.root / "build/debug")


if __name__ == "__main__":
    unittest.main()
