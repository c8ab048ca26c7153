"""weft doctor and weft support, for an administrator whose daemon has something wrong."""

import hashlib
import json
import os
import shutil
import subprocess
import unittest

from daemon_process import DaemonProcess
from studio import BIN, LONG_S, StudioTest, read, wait_for, weft, write

SECRET = "5ec2e70123456789abcdef0123456789"


class InstallationTest(DaemonProcess, StudioTest):
    def write_config(self, more=""):
        write(self.path("weftd.txtpb"), f'listen: "127.0.0.1:{self.port()}"\nstate: "{self.path("state")}"\n'
              f'allow_path: "{self.folder}"\nworkers: 1\n{more}')

    def port(self):
        return self.addresses[0].rsplit(":", 1)[1] if self.daemon else 0

    def start_by_config(self, more=""):
        """The file then has the address that was chosen."""
        self.write_config(more)
        self.start("--config", self.path("weftd.txtpb"))
        self.write_config(more)

    def make_certificate(self, days):
        key, certificate = self.path("key.pem"), self.path("cert.pem")
        subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-keyout",
                        key, "-out", certificate, "-days", str(days), "-subj", "/CN=studio"], check=True, capture_output=True,
                       timeout=LONG_S)
        os.chmod(key, 0o600)
        return f'tls_cert: "{certificate}"\ntls_key: "{key}"\n'


class Doctor(InstallationTest):
    def examine(self, *more, program=None, environment=None):
        """Findings by subject."""
        command = [program or os.path.join(BIN, "weft"), "doctor", "--config", self.path("weftd.txtpb"), "--no-cameras",
                   "--disk-test-gib", "0", "--json", *more]
        self.done = subprocess.run(command, capture_output=True, text=True, timeout=LONG_S, check=False,
                                   env={**os.environ, **(environment or {})})
        self.assertIn(self.done.returncode, (0, 1), self.done.stderr)
        found = json.loads(self.done.stdout)["findings"]
        return {one["subject"]: (one["verdict"].removeprefix("DOCTOR_VERDICT_"), one["found"], one["remedy"]) for one in found}

    def test_sound_installation_is_called_so(self):
        self.start_by_config(self.make_certificate(400))
        weft("access", "token", "anna", "--role", "viewer", "--days", "300", "--state", self.path("state"), check=0)
        found = self.examine()
        for subject in ("program weftd", "program weft-worker", "program weft-recorder", "program weft-video", "kernel openat2", "configuration",
                        "daemon", f"state {self.path('state')}", "certificate CN = studio"):
            self.assertIn(found[subject][0], ("GOOD",) if "state" not in subject else ("GOOD", "WARNING"), (subject, found))
        self.assertIn("valid for 399 days", found["certificate CN = studio"][1])
        token = next(subject for subject in found if subject.startswith("token "))
        self.assertRegex(token, "of anna$")
        self.assertEqual(found[token][0], "GOOD")

    def test_what_is_wrong_has_a_remedy(self):
        self.start_by_config(self.make_certificate(10))
        weft("access", "token", "anna", "--role", "viewer", "--days", "20", "--state", self.path("state"), check=0)
        weft("access", "token", "bert", "--role", "viewer", "--days", "0.000001", "--state", self.path("state"), check=0)
        os.chmod(self.path("state"), 0o755)
        found = self.examine(environment={"PATH": self.folder})
        self.assertEqual(self.done.returncode, 1)
        for subject, verdict, words, remedy in (
                ("certificate CN = studio", "WARNING", "expires in 9 days", "without a restart"),
                ("ffmpeg", "WARNING", "not installed", "apt install ffmpeg")):
            self.assertEqual(found[subject][0], verdict)
            self.assertIn(words, found[subject][1])
            self.assertIn(remedy, found[subject][2])
        tokens = {subject.split()[-1]: finding for subject, finding in found.items() if subject.startswith("token ")}
        self.assertEqual(tokens["anna"][:2], ("WARNING", "expires in 19 days"))
        self.assertEqual(tokens["bert"][:2], ("WARNING", "has expired"))
        self.assertIn("weft access revoke", tokens["bert"][2])
        text = weft("doctor", "--config", self.path("weftd.txtpb"), "--no-cameras", "--disk-test-gib", "0")
        self.assertIn("mode 755: other users get at takes", text.stdout)
        self.assertIn(f"`chmod 700 {self.path('state')}`", text.stdout)

    def test_daemon_that_is_away_and_configuration_that_is_wrong(self):
        self.start_by_config()
        self.kill_daemon()
        found = self.examine()
        self.assertEqual((found["daemon"][0], self.done.returncode), ("BAD", 1))
        self.assertIn("systemctl status weftd", found["daemon"][2])
        write(self.path("weftd.txtpb"), "wokers: 1\n")
        found = self.examine()
        self.assertEqual(found["configuration"][0], "BAD")
        self.assertIn("weftd.txtpb:1: wokers: no such option", found["configuration"][1])

    def test_programs_of_other_versions(self):
        self.write_config()
        os.mkdir(self.path("bin"))
        for name in ("weft", "weftd"):
            shutil.copy(os.path.join(BIN, name), self.path("bin"))
        write(self.path("bin", "weft-worker"), "#!/bin/sh\necho weft-worker 0.0.1\n")
        os.chmod(self.path("bin", "weft-worker"), 0o755)
        found = self.examine(program=self.path("bin", "weft"))
        self.assertEqual(found["program weftd"][0], "GOOD")
        self.assertEqual(found["program weft-worker"][0], "BAD")
        self.assertIn("weft-worker 0.0.1", found["program weft-worker"][1])
        self.assertEqual(found["program weft-recorder"][0], "BAD")
        self.assertIn("install", found["program weft-recorder"][2])


class Support(InstallationTest):
    def secrets(self):
        """Words that must be nowhere in a bundle."""
        token = weft("access", "token", "anna", "--role", "client", "--state", self.path("state"), check=0).stdout.strip()
        write(self.path("secret"), SECRET)
        os.chmod(self.path("secret"), 0o600)
        key = read(self.path("key.pem"))
        return {"token": token, "its hash": hashlib.sha256(token.encode()).hexdigest(), "secret": SECRET, "query": "sesame",
                "path of a hook": "T0AAAA/B0BBBB/SECRETPATH",
                "bearer": "abcdefgh12345678", **{f"key {line}": line for line in key.splitlines() if not line.startswith("--")}}

    def test_bundle_has_the_facts_and_no_secret(self):
        tls = self.make_certificate(400)
        self.start_by_config(tls)
        self.register("--server", self.addresses[0], "--frames", "0:1", check=0)
        secrets = self.secrets()
        self.write_config(f'{tls}on_end_url: "https://studio.example/T0AAAA/B0BBBB/SECRETPATH?open=sesame"\non_end_secret: "{self.path("secret")}"\n')
        os.mkdir(self.path("bin"))
        write(self.path("log"), "refused: authorization Bearer abcdefgh12345678\n" + "\n".join(known for what, known in secrets.items() if what not in ("query", "bearer", "path of a hook")) + "\n" +
              "notice: https://studio.example/T0AAAA/B0BBBB/SECRETPATH: answers 500\n" + read(self.path("key.pem")) + "job is done\n")
        write(self.path("bin", "journalctl"), f'#!/bin/sh\ncat "{self.path("log")}"\n')
        os.chmod(self.path("bin", "journalctl"), 0o755)
        for ending in ("tar.zst", "tar.gz"):
            bundle = self.path(f"bundle.{ending}")
            done = weft("support", "--out", bundle, "--config", self.path("weftd.txtpb"), check=0,
                        env={**os.environ, "PATH": f"{self.path('bin')}:{os.environ['PATH']}"})
            self.assertIn("journal.txt", done.stdout)
            self.assertEqual(os.stat(bundle).st_mode & 0o777, 0o600)
            os.mkdir(self.path(ending))
            subprocess.run(["tar", "-xf", bundle, "-C", self.path(ending)], check=True, timeout=LONG_S)
            files = {name: read(self.path(ending, "weft-support", name))
                     for name in os.listdir(self.path(ending, "weft-support"))}
            for name, text in files.items():
                for what, secret in secrets.items():
                    self.assertNotIn(secret, text, f"{what} in {name}")
            self.assertIn("job is done", files["journal.txt"])
            self.assertIn("[redacted]", files["journal.txt"])
            self.assertEqual(json.loads(files["jobs.json"])["jobs"][0]["state"], "JOB_STATE_DONE")
            self.assertEqual(json.loads(files["takes.json"])["takes"], [])
            self.assertIn("workers: 1\n", files["config.txtpb"])
            self.assertIn("https://studio.example/[redacted]", files["config.txtpb"])
            self.assertIn("1 records of jobs, all whole", files["catalogue.txt"])
            self.assertIn("access.json", files["state.txt"])
            for name, words in (("versions.txt", "weft-recorder "), ("doctor.txt", "kernel openat2"), ("machine.txt", "Linux"),
                                ("server.json", "started_unix_ns")):
                self.assertIn(words, files[name])

    def test_bundle_of_a_daemon_that_is_away_and_a_bad_name(self):
        self.start_by_config()
        self.kill_daemon()
        bundle = self.path("bundle.tar.gz")
        weft("support", "--out", bundle, "--config", self.path("weftd.txtpb"), check=0)
        listed = subprocess.run(["tar", "-xOf", bundle, "weft-support/server.json"], check=True, capture_output=True, text=True,
                                timeout=LONG_S).stdout
        self.assertIn("not there: no daemon answers", listed)
        done = weft("support", "--out", self.path("bundle.zip"))
        self.assertEqual(done.returncode, 2)
        self.assertIn(".tar.zst", done.stderr)


if __name__ == "__main__":
    unittest.main()
