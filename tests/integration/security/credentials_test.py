# SPDX-License-Identifier: Apache-2.0
"""Credentials: permissions of each role, and error messages for invalid ones."""
import fnmatch
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from credentials import Authority, day, system  # noqa: E402

ROLES = ["planning", "control", "hal", "tracker", "console-operator", "console-viewer", "recorder", "console"]


class Credentials(system.SystemTest):
    def setUp(self):
        super().setUp()
        self.authority = Authority(self.folder / "credentials")
        self.good = self.authority.issue()

    def verify(self, *words, folder=None):
        return system.run("security", "verify", folder or self.good, *words)

    def allowed(self, role, kind):
        """Topics in the signed permissions of a role."""
        text = (self.good / role / "permissions.p7s").read_text()
        part = re.search(f"<{kind}>(.*?)</{kind}>", text, re.DOTALL)
        return re.findall("<topic>(.*?)</topic>", part.group(1)) if part else []

    def publishers(self, topic):
        return {role for role in ROLES if any(fnmatch.fnmatch(topic, rule) for rule in self.allowed(role, "publish"))}

    def test_each_role_may_publish_what_is_its_own(self):
        topics = json.loads(self.assert_ok(system.run("topics", "laptop", "--json")).stdout)
        every = {topic["dds_topic"] for topic in topics}
        self.assertIn("rt/rosout", every)
        named = {topic.removeprefix("rt/tandem/") for topic in every if topic.startswith("rt/tandem/")}
        only = {"actuation/command": {"control"}, "planning/reference": {"planning"}, "stop": set(ROLES)}
        everyone = {"clock/request", "identity"}
        for topic in named:
            if topic in everyone:
                only[topic] = set(ROLES)
            elif topic.endswith("/request") or topic.endswith(("/state_command", "/servo_cp", "/servo_jp", "planning/compute")):
                only[topic] = {"console-operator", "console"}
        self.assertLessEqual({"control/request", "planning/request", "planning/compute", "sim/request", "hal/request",
                              "arm_a/state_command", "arm_b/state_command"}, set(only))
        for topic, roles in only.items():
            self.assertEqual(self.publishers(f"rt/tandem/{topic}"), roles, topic)
        for topic in every:
            self.assertTrue(self.publishers(topic), f"nobody may publish {topic}")
        for topic in named:
            self.assertEqual(self.publishers(f"rt/other/{topic}"), set(), "another robot's topics")
        self.assertEqual(self.allowed("console-viewer", "publish"), ["rt/tandem/stop", "rt/tandem/identity", "rt/tandem/clock/request"])
        readers = {role for role in ROLES if "rt/tandem/actuation/command" in self.allowed(role, "subscribe")}
        self.assertEqual(readers, {"hal", "recorder", "console"})

    def test_good_credentials_are_accepted(self):
        answer = self.assert_ok(self.verify())
        for role in ROLES:
            self.assertIn(f"CN={role},OU={role},O=tandem", answer.stdout)
        self.assertNotIn("bad ", answer.stdout)

    def test_keys_and_folders_are_for_their_owner_alone(self):
        for path in [*self.good.rglob("key.pem")]:
            self.assertEqual(path.stat().st_mode & 0o777, 0o600, path)
            self.assertEqual(path.parent.stat().st_mode & 0o777, 0o700, path)

    def damaged(self, damage):
        folder = self.folder / "damaged"
        if folder.exists():
            shutil.rmtree(folder)
        shutil.copytree(self.good, folder)
        damage(folder)
        return folder

    def test_bad_credentials_are_refused_with_file_and_reason(self):
        stranger = Authority(self.folder / "stranger")
        stranger.issue("control", "planning")
        self.authority.issue("control", to=self.folder / "expired", **{"from": day(40), "days": 30})
        self.authority.issue("control", to=self.folder / "future", **{"from": day(-3)})
        self.authority.issue("control", prefix="other", to=self.folder / "other")
        self.authority.issue("control", to=self.folder / "soon", **{"from": day(10), "days": 20})

        def widen(folder):
            """More than the role has, signed by the authority itself, as the DDS Security standard says to (9.4.1.3)."""
            text = (folder / "control/permissions.p7s").read_text()
            document = text[text.index("<?xml"):text.index("</dds>") + len("</dds>")]
            more = document.replace("<publish>", "<publish><topics><topic>rt/tandem/planning/request</topic></topics>", 1)
            (folder / "permissions.xml").write_text(more)
            subprocess.run(["openssl", "smime", "-sign", "-text", "-in", folder / "permissions.xml",
                            "-out", folder / "control/permissions.p7s", "-signer", folder / "ca.pem", "-inkey", folder / "ca/key.pem"],
                           check=True, capture_output=True)

        def take(source, *names):
            return lambda folder: [shutil.copy(source / name, folder / name) for name in names]

        control = ("control/certificate.pem", "control/key.pem", "control/permissions.p7s")
        cases = [
            (take(stranger.folder, *control), "control/certificate.pem: not issued by the authority in ca.pem"),
            (take(self.folder / "expired", *control), "control/certificate.pem: expired"),
            (take(self.folder / "future", *control), "the clock of this host shows"),
            (take(self.folder / "other", *control), "no permission to publish rt/tandem/"),
            (widen, "permission to publish rt/tandem/planning/request exceeds this role"),
            (take(self.good, "planning/key.pem"), None),
            (lambda f: shutil.copy(f / "planning/key.pem", f / "control/key.pem"), "not the key of the certificate"),
            (lambda f: shutil.copy(f / "planning/permissions.p7s", f / "control/permissions.p7s"), "subject_name: found"),
            (lambda f: (f / "control/permissions.p7s").write_text(
                (f / "control/permissions.p7s").read_text().replace("rt/tandem/stop", "rt/tandem/quit")),
             "control/permissions.p7s: not signed by the authority"),
            (lambda f: (f / "control/permissions.p7s").write_text("nothing"), "found no signed document"),
            (lambda f: (f / "control/key.pem").unlink(), "control/key.pem: found nothing"),
            (lambda f: os.chmod(f / "control/key.pem", 0o640), "control/key.pem: found mode 0640"),
            (lambda f: os.chmod(f / "control", 0o755), "control: found mode 0755"),
            (lambda f: shutil.copy(stranger.folder / "governance.p7s", f / "governance.p7s"),
             "governance.p7s: not signed by the authority"),
            (lambda f: shutil.copy(stranger.folder / "crl.pem", f / "crl.pem"),
             "crl.pem: the list of revoked certificates is not signed by the authority"),
            (lambda f: (f / "ca.pem").write_text("x"), "ca.pem: found no certificate"),
        ]
        for damage, words in cases:
            with self.subTest(words=words):
                answer = self.verify(folder=self.damaged(damage))
                self.assertEqual(answer.returncode, 1 if words else 0, answer.stdout)
                self.assertIn(words or "", answer.stdout)
        answer = self.verify("--role", "control", folder=self.folder / "soon")
        self.assert_ok(answer)
        self.assertRegex(answer.stdout, "warning .*expires")
        two = system.run("security", "verify", self.good, stranger.folder, "--role", "control")
        self.assertIn("another authority or governance", two.stdout)

    def test_revoked_credentials_are_refused(self):
        eve = self.authority.issue("console-operator", name="eve", to=self.folder / "eve")
        self.assert_ok(self.verify(folder=eve))
        self.assertIn("1 certificates", self.authority.run("revoke", self.good, "eve"))
        self.assertIn("0 certificates", self.authority.run("revoke", self.good, "eve"))
        shutil.copy(self.good / "crl.pem", eve / "crl.pem")
        answer = self.verify(folder=eve)
        self.assertEqual(answer.returncode, 1)
        self.assertIn("revoked", answer.stdout)
        self.assert_ok(self.verify())

    def test_wrong_command_lines_are_refused(self):
        for words, reason in [(("init", self.good), "found a certificate authority"),
                              (("issue", self.folder / "none"), "found no authority"),
                              (("issue", self.good, "king"), "role: found 'king'"),
                              (("issue", self.good, "control", "--name", "a,b"), "name: found 'a,b'"),
                              (("issue", self.good, "control", "--days", "0"), "days: found 0"),
                              (("issue", self.good, "control", "--from", "soon"), "--from: found 'soon'"),
                              (("revoke", self.good, "nobody"), "issued to 'nobody'"),
                              (("verify", "-d", "laptop"), "key `security` is missing")]:
            answer = system.run("security", *words)
            self.assertEqual(answer.returncode, 2, words)
            self.assertIn(reason, answer.stderr)

    def test_a_process_names_the_reason_to_refuse_its_credentials(self):
        (self.good / "control" / "key.pem").unlink()
        path = system.deployment(self.folder, "laptop", security=self.good, domain=0, prefix="tandem")
        answer = system.run("--deployment", path, program="tandem-control")
        self.assertEqual(answer.returncode, 1)
        self.assertRegex(answer.stdout + answer.stderr, "security, role control: .*control/key.pem: found nothing")
        path.write_text(path.read_text() + "discovery: {server: 127.0.0.1}\n")
        answer = system.run("validate", path)
        self.assertRegex(answer.stdout + answer.stderr, "discovery: found both `security` and `discovery`")


if __name__ == "__main__":
    unittest.TestCase.maxDiff = None
    system.main()
