# SPDX-License-Identifier: Apache-2.0
"""`tandem can import`: data sheets as vendors write them, and the axes that come of them."""
import json
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "integration" / "harness"))
import system  # noqa: E402

SHEETS = system.SOURCE / "tests" / "sheets"
PRESET = system.PRESETS / "hardware" / "ark2024-two-buses.yaml"
# Exit code, lost protections, words of the reasons, and words of the warnings, in order.
EXPECTED = {
    "epos4-like": (0, ["command_deadline", "following_error"], [],
                   ["SubNumber: found 6, expected 5", "a simulated device starts with 16", "'; rpm' counts as a comment"]),
    "mc3-like": (3, ["command_deadline", "quick_stop_ramp"], ["without quick_stop_ramp"],
                 ["read as octal (CiA 306): 8, not 10", "Latin-1", "'DataType' is in this section already"]),
    "gold-like": (0, ["command_deadline"], [], ["SupportedObjects: found 58, expected 56", "control Z"]),
    # CompactPDO instead of sections of PDOs.
    "c5e-like": (0, ["command_deadline"], [], []),
    # Neither cyclic synchronous modes nor units.
    "accelnet-like": (0, ["command_deadline", "fault_reaction", "speed_limit"], [], []),
    "ipos-like": (3, ["command_deadline", "connection_reaction", "quick_stop_ramp", "fault_reaction", "speed_limit"],
                  ["without connection_reaction", "without quick_stop_ramp"],
                  ["byte order mark", "0x6510 is listed and has no section", "[100D] is in none of the lists",
                   "data type 0x0040 is unknown", "found 'end of list'", "found the value 5 outside its limits", "NUL bytes"]),
}


def sheet(name):
    return SHEETS / f"{name}.eds"


def filled(block):
    """The axis with units where the sheet, the file and the profile state none."""
    return block.replace("velocity_unit: FILL_IN", "velocity_unit: counts_per_s").replace(
        "acceleration_unit: FILL_IN", "acceleration_unit: counts_per_s2")


class Import(system.SystemTest):
    def report(self, *words, code):
        answer = system.run("can", "import", *words, "--json")
        self.assertEqual(answer.returncode, code, answer.stdout + answer.stderr)
        return json.loads(answer.stdout)

    def hardware_with(self, block):
        """The preset with its first axis replaced by a block."""
        # A period with room for a drive that needs more PDOs.
        text = PRESET.read_text().replace("../robots/", str(system.PRESETS / "robots") + "/").replace("period_ms: 4", "period_ms: 5")
        text, count = re.subn(r"      - \{arm: arm_a, tube: 1, bus: bus_a, node: 1,.*?\}\n", "", text, count=1, flags=re.S)
        self.assertEqual(count, 1)
        text = text.replace("{bus: bus_a, node: 1, input_bit: 16", "{bus: bus_a, node: 2, input_bit: 16")
        head, rest = text.split("translations:\n")
        path = self.folder / "hardware.yaml"
        path.write_text(head + block + rest)
        return path

    def test_each_sheet_has_its_verdict_and_warnings(self):
        self.assertEqual(sorted(EXPECTED), sorted(path.stem for path in SHEETS.glob("*.eds")))
        for name, (code, lost, reasons, warnings) in EXPECTED.items():
            with self.subTest(name):
                report = self.report(sheet(name), code=code)
                self.assertEqual(report["lost"], lost)
                self.assertEqual(len(report["warnings"]), len(warnings), report["warnings"])
                lines = [warning["line"] for warning in report["warnings"]]
                self.assertEqual(lines, sorted(lines))
                for warning, words in zip(report["warnings"], warnings):
                    self.assertIn(words, warning["text"])
                for words in reasons:
                    self.assertTrue(any(words in reason for reason in report["reasons"]), report["reasons"])
                self.assertEqual(report["boots"], code == 0)
                self.assertIn("yaml", report)
                for key in ("pdo_objects: 1\n", "watch: node_guarding\n"):
                    self.assertEqual(key in report["yaml"], name == "ipos-like")

    def test_the_axis_is_valid_in_a_hardware_file(self):
        for name in EXPECTED:
            with self.subTest(name):
                report = self.report(sheet(name), "--node", "9", code=EXPECTED[name][0])
                report["yaml"] = filled(report["yaml"])
                path = self.hardware_with(report["yaml"])
                self.assert_ok(system.run("validate", path))
                self.assertIn("node: 9", report["yaml"])
                self.assertIn(f"vendor: 0x{report['vendor']:08X}", report["yaml"])
                # The axis is in the file: without it, the robot lacks a joint.
                path.write_text(path.read_text().replace(report["yaml"], "translations:\n"))
                self.assertEqual(system.run("validate", path).returncode, 2)

    def test_profiles_say_what_their_sheets_lack(self):
        lost = {}
        for profile, mode, code in (("epos4", "csp", 0), ("epos4", "pv", 0), ("gold", "csp", 0), ("gold", "csv", 0), ("mc3", "csp", 0),
                                    ("mc3", "pv", 0), ("ipos", "pv", 3)):
            with self.subTest(profile, mode=mode):
                path = self.folder / "hardware.yaml"
                path.write_text(PRESET.read_text().replace("../robots/", str(system.PRESETS / "robots") + "/")
                                .replace("  - drive:\n", f"  - drive:\n      profile: {profile}\n      mode: {mode}\n", 1))
                report = self.report(sheet(f"{profile}-like"), "--hardware", path, "--mode", mode, code=code)
                lost.setdefault(profile, set()).update(report["lost"])
                if code == 0:
                    self.assertIn(f"profile: {profile}", report["yaml"])
                self.assertFalse([note for note in report["notes"] if "does not say that the drive lacks" in note])
        # A profile that knows less than the sheet.
        text = path.read_text().replace("profile: ipos", "profile: generic", 1)
        path.write_text(text)
        notes = self.report(sheet("ipos-like"), "--hardware", path, "--mode", "pv", code=3)["notes"]
        self.assertTrue(any("the profile of arm_a translation 1 does not say that the drive lacks command_deadline (1400:05)" in note
                            for note in notes), notes)
        for profile, all_modes in lost.items():
            lacks = re.search(r"^lacks: \[(.*)\]$", (system.PRESETS / "drives" / f"{profile}.yaml").read_text(), re.M)[1]
            self.assertEqual(set(lacks.split(", ")), all_modes, profile)

    def test_an_accepted_loss_makes_the_axis_bootable(self):
        block = self.report(sheet("mc3-like"), code=3)["yaml"]
        accepted = filled(block).replace('        # accept:', '        accept:').replace('        #   - {prot', '          - {prot')
        self.assertNotEqual(filled(block), accepted)
        path = self.hardware_with(accepted.replace('reason: ""', 'reason: "tried with power off"'))
        self.assert_ok(system.run("validate", path))
        self.assertEqual(self.report(sheet("mc3-like"), "--hardware", path, code=0)["reasons"], [])

    def test_the_report_names_needs_ranges_and_access(self):
        setup = {row["object"]: row for row in reversed(self.report(sheet("mc3-like"), code=3)["setup"])}
        ramp = setup["6085:00"]
        self.assertEqual((ramp["need"], ramp["verdict"]), ("quick_stop_ramp", "lost"))
        self.assertIn("range 0 to 32767, the HAL writes 4096000", ramp["reason"])
        self.assertEqual(setup["60C2:01"]["verdict"], "left out")
        self.assertEqual(setup["1400:05"]["reason"], "absent")
        self.assertEqual(setup["1017:00"]["need"], "required")
        self.assertEqual(setup["607D:01"]["verdict"], "fits")
        text = self.assert_ok(system.run("can", "import", sheet("epos4-like"))).stdout
        for words in ("velocities: rpm (60A9 = 0xB44700)", "accelerations: rpm_per_s (60AA = 0xC00300)",
                      "velocity_unit: rpm\n", "acceleration_unit: rpm_per_s\n",
                      "temperature object 2001:00 of the axis is absent",
                      "modes: profile position, profile velocity, homing, cyclic synchronous position, cyclic synchronous velocity",
                      "6502 = 0x3A5", "PDO mapping: the PDOs of the HAL fit", "lost protections: command_deadline (1400:05)",
                      "tandem-hal boots this drive\n", "translations:"):
            self.assertIn(words, text)

    def test_modes_axes_and_files_of_the_caller(self):
        self.assertEqual(self.report(sheet("gold-like"), "--mode", "csv", code=0)["mode"], "csv")
        self.assertTrue(any("6502" in reason for reason in self.report(sheet("mc3-like"), "--mode", "csv", code=1)["reasons"]))
        rotation = self.report(sheet("gold-like"), "--axis", "arm_b rotation 2", code=0)
        self.assertEqual((rotation["axis"], rotation["node"]), ("arm_b rotation 2", 5))
        self.assertIn("rotations:", rotation["yaml"])
        out = self.folder / "axis.yaml"
        self.assert_ok(system.run("can", "import", sheet("gold-like"), "-o", out))
        self.assertIn("translations:", out.read_text())

    def with_profile(self, profile, mode):
        """The preset whose linear stages name a profile."""
        path = self.folder / f"{profile}.yaml"
        path.write_text(PRESET.read_text().replace("../robots/", str(system.PRESETS / "robots") + "/")
                        .replace("  - drive:\n", f"  - drive:\n      profile: {profile}\n      mode: {mode}\n", 1))
        return path

    def test_a_unit_that_nobody_states_is_to_be_filled_in(self):
        report = self.report(sheet("gold-like"), code=0)
        self.assertEqual(report["fill_in"], ["velocity_unit", "acceleration_unit"])
        for words in ("velocity_unit: FILL_IN", "acceleration_unit: FILL_IN", "# Replace FILL_IN of velocity_unit"):
            self.assertIn(words, report["yaml"])
        self.assertTrue(any("velocities: neither the data sheet" in note for note in report["notes"]), report["notes"])
        answer = system.run("validate", self.hardware_with(report["yaml"]))
        self.assertEqual(answer.returncode, 2)
        for words in ('drive.velocity_unit: found the text "FILL_IN"', 'drive.acceleration_unit: found the text "FILL_IN"', "rpm"):
            self.assertIn(words, answer.stdout + answer.stderr)
        # The profile states them, or the sheet does (60A9, 60AA).
        report = self.report(sheet("mc3-like"), "--hardware", self.with_profile("mc3", "pv"), code=0)
        self.assertEqual(report["fill_in"], [])
        for words in ("velocity_unit: rpm\n", "acceleration_unit: rev_per_s2\n"):
            self.assertIn(words, report["yaml"])
        self.assertTrue(any("velocities: rpm, of the hardware file or its profile" in note for note in report["notes"]), report["notes"])
        self.assertEqual(self.report(sheet("epos4-like"), code=0)["fill_in"], [])

    def test_default_counts_that_the_hardware_file_does_not_have_are_named(self):
        counts = [note for note in self.report(sheet("c5e-like"), code=0)["notes"] if "608F" in note]
        self.assertEqual(counts, [])
        path = self.folder / "coarse.eds"
        text, count = re.subn(r"(\[608Fsub1\][^[]*?DefaultValue=)4096", r"\g<1>2000", sheet("c5e-like").read_bytes().decode("latin-1"))
        self.assertEqual(count, 1)
        path.write_bytes(text.encode("latin-1"))
        counts = [note for note in self.report(path, code=0)["notes"] if "608F" in note]
        self.assertEqual(len(counts), 1)
        self.assertIn("by default the drive states 2000 counts per revolution of its motor (608F, 6091, 6092), the hardware file "
                      "says 4096: tandem-hal refuses to boot it", counts[0])

    def test_a_sheet_of_another_maker_than_the_profile_warns_by_line(self):
        lines = sheet("gold-like").read_bytes().decode("latin-1").splitlines()
        line = {key: next(k for k, text in enumerate(lines, 1) if text.upper().startswith(key))
                for key in ("VENDORNUMBER", "VENDORNAME", "PRODUCTNAME", "[1018SUB1]")}
        hardware = self.with_profile("epos4", "csp")
        report = self.report(sheet("gold-like"), "--hardware", hardware, code=0)
        of_profile = {warning["line"]: warning["text"] for warning in report["warnings"] if "of profile epos4" in warning["text"]}
        self.assertEqual(sorted(of_profile), sorted(line.values()))
        self.assertIn("found vendor 0x9A, expected that of profile epos4 (maxon EPOS4, firmware 0x0170): 0xFB",
                      of_profile[line["[1018SUB1]"]])
        self.assertIn("found 'Elmo (like)'", of_profile[line["VENDORNAME"]])
        self.assertIn("found 'Gold-like'", of_profile[line["PRODUCTNAME"]])
        text = self.assert_ok(system.run("can", "import", sheet("gold-like"), "--hardware", hardware)).stdout
        self.assertRegex(text, rf"warning: .*gold-like.eds:{line['VENDORNUMBER']}: VendorNumber: found 0x9A, expected")
        # Each profile is that of its own sheet.
        for profile, mode in (("epos4", "csp"), ("gold", "csp"), ("mc3", "csp"), ("ipos", "pv")):
            report = json.loads(system.run("can", "import", sheet(f"{profile}-like"), "--json", "--hardware",
                                           self.with_profile(profile, mode)).stdout)
            self.assertEqual([warning for warning in report["warnings"] if "of profile" in warning["text"]], [])

    def test_an_existing_file_is_replaced_with_force_only(self):
        out = self.folder / "axis.yaml"
        out.write_text("mine\n")
        answer = system.run("can", "import", sheet("gold-like"), "--out", out)
        self.assertEqual(answer.returncode, 2)
        self.assertIn(f"--out: '{out}' exists", answer.stderr)
        self.assertEqual(out.read_text(), "mine\n")
        self.assert_ok(system.run("can", "import", sheet("gold-like"), "--out", out, "--force"))
        self.assertIn("translations:", out.read_text())

    def test_pdos_that_a_sheet_states_in_short(self):
        """CompactPDO of [DeviceInfo] instead of the sections of the PDOs (CiA 306-1): the same verdict."""
        text = sheet("gold-like").read_bytes().decode("latin-1")
        short, count = re.subn(r"(?is)\[1[468A]0[0-3](sub[0-9A-F]+)?\]\r\n.*?(?=\r\n\[|\Z)", "", text)
        self.assertGreater(count, 20)
        path = self.folder / "short.eds"
        for key in ("GRANULARITY", "NROFRXPDO", "NROFTXPDO", "COMPACTPDO"):
            short = re.sub(rf"(?im)^{key} *=.*\r\n", "", short)
        path.write_bytes(short.encode("latin-1"))
        refused = self.report(path, code=1)["setup"]
        self.assertIn(("1600:00", "absent"), {(row["object"], row["reason"]) for row in refused})
        # Bit 4 is the event timer: that of a receive PDO is the deadline of commands.
        for mask, lost in (("0x07", ["command_deadline"]), ("0x17", [])):
            path.write_bytes(re.sub(r"(?i)\[DeviceInfo\]\r\n", "[DeviceInfo]\r\nGranularity=8\r\nNrOfRXPDO=4\r\nNrOfTXPDO=4\r\n"
                                    f"CompactPDO={mask}\r\n", short).encode("latin-1"))
            report = self.report(path, code=0)
            self.assertEqual(report["pdo_mapping"], "the PDOs of the HAL fit")
            self.assertEqual(report["lost"], lost)

    def test_what_a_sheet_leaves_out(self):
        text = sheet("gold-like").read_bytes()
        changed = self.folder / "changed.eds"
        cases = [(rb"\[1017\]\r\n(?:[^\[]*)", b"", 1, "1017:00", "refused", "absent"),
                 (rb"DEFAULTVALUE=0X000001A1\r\n", b"", 0, "6502:00", "unknown", "no value in the data sheet"),
                 (rb"(\[6064\]\r\n(?:.*\r\n){4}PDOMAPPING)=1", rb"\1=0", 1, "1A00:02", "refused", "6064:00 cannot be mapped into a PDO")]
        for pattern, by, code, name, verdict, reason in cases:
            with self.subTest(name):
                content, count = re.subn(pattern, by, text)
                self.assertEqual(count, 1)
                changed.write_bytes(content)
                row = next(row for row in self.report(changed, code=code)["setup"] if row["object"] == name)
                self.assertEqual((row["verdict"], row["reason"]), (verdict, reason))

    def test_a_dcf_brings_its_node(self):
        dcf = self.folder / "drive.dcf"
        dcf.write_bytes(sheet("gold-like").read_bytes().rstrip(b"\x1a") + b"[DeviceComissioning]\r\nNodeID=12\r\n")
        report = self.report(dcf, code=0)
        self.assertEqual(report["node"], 12)

    def test_what_is_no_data_sheet_is_refused(self):
        cases = {"pdf": (b"%PDF-1.4\n", "found no [section]"), "empty": (b"", "found no [section]"),
                 "head": (b"[DeviceInfo]\nProductName=X\n", "found no object"),
                 "wide": (b"\xff\xfe[\0D\0", "UTF-16")}
        for name, (content, words) in cases.items():
            path = self.folder / name
            path.write_bytes(content)
            answer = system.run("can", "import", path)
            self.assertEqual(answer.returncode, 2)
            self.assertIn(f"{path}:1: ", answer.stderr)
            self.assertIn(words, answer.stderr)
        answer = system.run("can", "import", self.folder / "nothing.eds")
        self.assertEqual(answer.returncode, 2)
        self.assertIn("cannot be opened", answer.stderr)
        answer = system.run("can", "import", sheet("gold-like"), "--axis", "arm_c translation 1")
        self.assertEqual(answer.returncode, 2)
        self.assertIn("expected one of 'arm_a translation 1'", answer.stderr)


if __name__ == "__main__":
    system.main()
