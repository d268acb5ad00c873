# SPDX-License-Identifier: Apache-2.0
"""Drives that tandem-drive-sim plays by data sheets as vendors write them, on a bus, and `tandem can` with the sheets."""
import json
import pathlib
import re
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "harness"))
import system  # noqa: E402

SHEETS = system.SOURCE / "tests" / "sheets"


class Sheets(system.SystemTest):
    def play(self, sheet):
        """A drive with this data sheet as node 1; the address of its bus, and what the simulation has logged."""
        address = f"unix:{self.folder / sheet.stem}"
        log = self.folder / f"{sheet.stem}.log"
        with log.open("w") as out:
            process = subprocess.Popen([system.executable("tandem-drive-sim"), "--bus", address, "--drive", "1", "--drive-eds",
                                        str(sheet)], stdout=out, stderr=out, start_new_session=True)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        system.until(lambda: "ready: 1 drives" in log.read_text(), 20, f"the drive of {sheet.name} runs")
        return address, log.read_text()

    def can(self, command, address, *words):
        return system.run("can", command, "--bus", address, *words, timeout=120)

    def test_a_drive_that_is_played_by_a_sheet_is_as_the_sheet_says(self):
        sheets = sorted(SHEETS.glob("*.eds"))
        self.assertEqual(len(sheets), 6)
        for sheet in sheets:
            with self.subTest(sheet.name):
                address, log = self.play(sheet)
                imported = json.loads(system.run("can", "import", sheet, "--json").stdout)
                for warning in imported["warnings"]:
                    self.assertIn(f"{sheet.name}:{warning['line']}: ", log)
                answer = self.can("compare", address, sheet, "1", "--json")
                self.assertEqual(answer.returncode, 0, answer.stdout + answer.stderr)
                compared = json.loads(answer.stdout)
                self.assertEqual(compared["differences"], [])
                self.assertEqual(compared["objects"], imported["objects"])
                # What the sheet lacks, the drive lacks: the simulation has the object, nobody can access it.
                answer = self.can("od", address, "1", "1400:5")
                self.assertEqual(answer.returncode, 1)
                self.assertIn("subindex does not exist", answer.stderr.lower().replace("sub-index", "subindex"))
                protections = self.can("od", address, "1", "--protections", "--json")
                found = json.loads(protections.stdout)
                self.assertFalse(found["command_deadline"])
                self.assertEqual(protections.returncode, 0 if sheet.stem != "ipos-like" else 1)

    def test_a_file_that_is_no_data_sheet_is_refused(self):
        broken = self.folder / "broken.eds"
        broken.write_text("no data sheet")
        answer = system.run("--bus", f"unix:{self.folder / 'bus'}", "--drive-eds", broken, program="tandem-drive-sim")
        self.assertEqual(answer.returncode, 2)
        self.assertIn(f"{broken}:1: found no [section]", answer.stdout + answer.stderr)

    def test_compare_finds_what_differs(self):
        address, _ = self.play(SHEETS / "gold-like.eds")
        other = self.folder / "other.eds"
        text = (SHEETS / "gold-like.eds").read_bytes().decode()
        text = text.replace("VENDORNUMBER=0X0000009A", "VENDORNUMBER=0X0000009B")
        text = re.sub(r"(\[60FF\]\r\nPARAMETERNAME=Target velocity\r\nOBJECTTYPE=0x7\r\nDATATYPE)=0X04", r"\1=0X03", text)
        text = re.sub(r"(\[606C\]\r\n(?:.*\r\n){3}ACCESSTYPE)=ro", r"\1=wo", text)
        text += "[6079]\r\nPARAMETERNAME=Voltage\r\nDATATYPE=7\r\nACCESSTYPE=ro\r\n"
        other.write_bytes(text.replace("\x1a", "").encode())
        answer = self.can("compare", address, other, "1", "--json")
        self.assertEqual(answer.returncode, 1)
        found = {(entry["object"], entry["kind"]) for entry in json.loads(answer.stdout)["differences"]}
        self.assertEqual(found, {("1018:01", "identity"), ("60FF:00", "size"), ("606C:00", "access"), ("6079:00", "missing")})
        self.assert_ok(self.can("od", address, "1", "6065", "77"))
        answer = self.can("compare", address, SHEETS / "gold-like.eds", "1")
        self.assert_ok(answer)
        self.assertIn("value: 6065:00 Following error window: 77, 0x0000004D (4 bytes), default 2000", answer.stdout)
        self.assertIn("0 differences", answer.stdout)

    def test_compare_finds_another_product_by_what_the_sheet_fixes(self):
        """[DeviceInfo] has the node's numbers, object 1018 of the sheet has others."""
        address, _ = self.play(SHEETS / "gold-like.eds")
        text = (SHEETS / "gold-like.eds").read_bytes().decode().replace("\x1a", "")
        for sub, value in (("1", "0X000000FB"), ("2", "0X61500000"), ("3", "0X01700000")):
            with self.subTest(sub=sub):
                other = self.folder / f"other{sub}.eds"
                changed, count = re.subn(rf"(?i)(\[1018sub{sub}\]\r\n(?:.*\r\n){{1,5}}?DEFAULTVALUE)=.*\r\n", rf"\1={value}\r\n", text)
                self.assertEqual(count, 1)
                other.write_bytes(changed.encode())
                answer = self.can("compare", address, other, "1", "--json")
                self.assertEqual(answer.returncode, 1, answer.stdout)
                found = json.loads(answer.stdout)["differences"]
                self.assertEqual([(entry["object"], entry["kind"]) for entry in found], [(f"1018:0{sub}", "identity")])

    def test_signed_objects_keep_their_sign(self):
        sheet = SHEETS / "mc3-like.eds"
        address, _ = self.play(sheet)
        for words in ([], ["--eds", sheet]):
            answer = self.assert_ok(self.can("od", address, "1", "607C", "-3", *words))
            self.assertRegex(answer.stdout, r"^607C:00 .*= -3, 0xFFFFFFFD \(4 bytes\)\n$")
            self.assertEqual(json.loads(self.can("od", address, "1", "607C", "-0x3", "--json", *words).stdout)["value"], -3)
        self.assertRegex(self.can("dump", address, "1", "--eds", sheet).stdout, r"607C:00 .* = -3, 0xFFFFFFFD")
        self.assertIn("607C:00 = -3, 0xFFFFFFFD", self.can("dump", address, "1", "--first", "607C", "--last", "607C").stdout)
        self.assertRegex(self.can("compare", address, sheet, "1").stdout, r"value: 607C:00 .*: -3, 0xFFFFFFFD \(4 bytes\), default 0")
        answer = self.can("od", address, "1", "6098", "-200")
        self.assertEqual((answer.returncode, answer.stderr), (2, "tandem: value '-200', expected a number of 1 bytes\n"))

    def test_dump_reads_every_object(self):
        sheet = SHEETS / "epos4-like.eds"
        address, _ = self.play(sheet)
        answer = self.assert_ok(self.can("dump", address, "1", "--eds", sheet, "--json"))
        objects = {entry["object"]: entry for entry in json.loads(answer.stdout)}
        self.assertEqual(len(objects), json.loads(system.run("can", "import", sheet, "--json").stdout)["objects"])
        self.assertEqual((objects["6502:00"]["name"], objects["6502:00"]["unsigned"]), ("Supported drive modes", 0x3A5))
        self.assertRegex(answer.stderr, r"50 %, object [0-9A-F]{4}:")
        # Without a sheet, by trying: the same objects.
        answer = self.assert_ok(self.can("dump", address, "1", "--first", "1000", "--last", "1020", "--json"))
        tried = {entry["object"] for entry in json.loads(answer.stdout)}
        self.assertEqual(tried, {name for name in objects if name < "1021"})
        answer = self.assert_ok(self.can("dump", address, "1", "--first", "6060", "--last", "6067"))
        self.assertIn("6065:00 = 2000, 0x000007D0 (4 bytes)", answer.stdout)
        self.assertIn("objects read", answer.stderr)
        self.assertEqual(self.can("dump", address, "1", "--first", "2000", "--last", "1000").returncode, 2)
        answer = self.can("dump", address, "99", "--first", "1000", "--last", "1001")
        self.assert_refused(answer, "node 99 does not answer")

    def test_od_names_objects(self):
        sheet = SHEETS / "mc3-like.eds"
        address, _ = self.play(sheet)
        self.assertIn("6041:00 Statusword = ", self.assert_ok(self.can("od", address, "1", "6041", "--eds", sheet)).stdout)
        named = json.loads(self.assert_ok(self.can("od", address, "1", "6041", "--eds", sheet, "--json")).stdout)
        self.assertEqual(named["name"], "Statusword")
        self.assertEqual(self.can("od", address, "1").returncode, 2)
        self.assertEqual(self.can("od", address, "1", "6041", "--protections").returncode, 2)
        text = self.can("od", address, "1", "--protections").stdout
        self.assertIn("lacks: command_deadline (1400:05)", text)


if __name__ == "__main__":
    system.main()
