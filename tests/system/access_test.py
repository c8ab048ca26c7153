"""Whom a daemon on this machine lets in: its own user, and whoever has a token."""

import json
import os
import re
import shutil
import stat
import subprocess
import sys
import tempfile
import unittest
import zlib

import http2
from studio import BIN, read, wait_for, weft, write

STRANGER = "nobody"


def can_be_a_stranger():
    """Another user may run the programs, so that the kernel names another user."""
    try:
        return subprocess.run([os.path.join(BIN, "weft"), "--version"], user=STRANGER, capture_output=True, check=False).returncode == 0
    except (PermissionError, LookupError, ValueError):
        return False


def python_of_all():
    """A Python that every user may run; the one that runs this may be its owner's alone."""
    return shutil.which("python3", path="/usr/bin:/usr/local/bin") or sys.executable


class Access(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="weft access ")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        os.chmod(self.folder, 0o755)
        os.mkdir(self.path("data"))
        os.mkdir(self.path("state"))
        log = open(self.path("weftd.log"), "w")
        self.addCleanup(log.close)
        self.daemon = subprocess.Popen([os.path.join(BIN, "weftd"), "--listen", f"unix:{self.path('state')}/weftd.sock", "--listen",
                                        "127.0.0.1:0", "--address-file", self.path("address"), "--state", self.path("state"),
                                        "--allow-path", self.path("data"), "--workers", "1"], stdout=log, stderr=log)
        self.addCleanup(self.daemon.wait)
        self.addCleanup(self.daemon.kill)
        self.socket, self.address = wait_for(
            lambda: os.path.exists(self.path("address")) and read(self.path("address")).split("\n")[:2], "weftd to listen")

    def path(self, *names):
        return os.path.join(self.folder, *names)

    def access(self, *words, check=0):
        return weft("access", *words, "--state", self.path("state"), check=check)

    def list_jobs(self, server, token=None, **options):
        environment = {**os.environ, **({"WEFT_TOKEN_FILE": token} if token else {})}
        return subprocess.run([os.path.join(BIN, "weft"), "job", "list", "--server", server], env=environment,
                              capture_output=True, text=True, check=False, **options)

    def test_lets_its_own_user_in(self):
        for server in (self.socket, self.address):
            done = self.list_jobs(server)
            self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(stat.S_IMODE(os.stat(self.path("state")).st_mode), 0o700)
        self.assertEqual(stat.S_IMODE(os.stat(self.path("state", "weftd.sock")).st_mode), 0o600)

    def test_lets_another_user_in_by_token_alone(self):
        if not can_be_a_stranger():
            self.skipTest(f"{STRANGER} cannot run the programs here")
        refused = self.list_jobs(self.address, user=STRANGER)
        self.assertEqual(refused.returncode, 2)
        self.assertIn("asks for a token or a certificate", refused.stderr)
        self.assertEqual(self.list_jobs(self.socket, user=STRANGER).returncode, 1)
        write(self.path("token"), self.access("token", "anna", "--role", "viewer").stdout)

        def listed():
            return self.list_jobs(self.address, self.path("token"), user=STRANGER).returncode == 0
        wait_for(listed, "the daemon to know the token")
        token = json.loads(self.access("list", "--json").stdout)["tokens"][0]
        self.access("revoke", token["id"])
        wait_for(lambda: not listed(), "the daemon to forget the token")
        self.assertIn(f"of user {STRANGER}", read(self.path("weftd.log")))

    def test_keeps_an_offender_out_and_serves_the_others(self):
        if not can_be_a_stranger():
            self.skipTest(f"{STRANGER} cannot run the programs here")
        write(self.path("token"), self.access("token", "anna", "--role", "viewer").stdout)
        wait_for(lambda: self.list_jobs(self.address, self.path("token"), user=STRANGER).returncode == 0, "the daemon to know the token")
        # Blocks of headers that never end, one after the other.
        offend = ("import sys, http2\n"
                  "try:\n"
                  "    connection = http2.connect(sys.argv[1])\n"
                  "    connection.sendall(http2.frame(http2.HEADERS, 0, 1, http2.header_block('/weft.v1.Jobs/ListJobs')))\n"
                  "    while True:\n"
                  "        connection.sendall(http2.frame(http2.CONTINUATION, 0, 1, b'\\0\\1a\\x7f\\x81\\x7f' + b'b' * 16000))\n"
                  "except OSError:\n"
                  "    pass\n")

        def kept_out():
            subprocess.run([python_of_all(), "-c", offend, self.address], user=STRANGER, check=True, timeout=60,
                           cwd=os.path.dirname(os.path.abspath(__file__)), env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"})
            return "kept out for 30 s" in self.access("log").stdout
        wait_for(kept_out, "the offender to be kept out")
        self.assertRegex(self.access("log").stdout, f"user {STRANGER}.*sent more than was heard of it")
        self.assertNotEqual(self.list_jobs(self.address, self.path("token"), user=STRANGER).returncode, 0)
        self.assertEqual(self.list_jobs(self.address).returncode, 0)

    def test_unpacks_no_message(self):
        """Each of these is 58 kB on the wire, and 60 MB where it is unpacked before its size is looked at."""
        write(self.path("token"), self.access("token", "anna", "--role", "viewer").stdout)
        token = read(self.path("token")).strip()
        wait_for(lambda: self.list_jobs(self.address, self.path("token")).returncode == 0, "the daemon to know the token")
        before = self.peak_mib()
        for encoding, window in (("gzip", 31), ("deflate", 15)):
            packer = zlib.compressobj(9, zlib.DEFLATED, window)
            data = packer.compress(bytes(60 << 20)) + packer.flush()
            self.assertLess(len(data), 65000)  # what a client may send before it is answered
            for credentials in (None, "weft_" + "0" * 64, token):
                for method in ("/weft.v1.Jobs/GetJob", "/grpc.health.v1.Health/Check"):
                    said = http2.send_packed(self.address, method, credentials, encoding, data)
                    self.assertIn(b"identity", said)
        self.assertLess(self.peak_mib() - before, 30)
        self.assertEqual(self.list_jobs(self.address, self.path("token")).returncode, 0)
        # A message that does not say how it is packed is no request.
        http2.send_packed(self.address, "/weft.v1.Jobs/GetJob", token, "identity", data)
        self.assertLess(self.peak_mib() - before, 30)

    def peak_mib(self):
        return int(re.search(r"VmHWM:\s+(\d+)", read(f"/proc/{self.daemon.pid}/status")).group(1)) >> 10

    def test_shows_tokens_once(self):
        text = self.access("token", "anna", "--role", "operator", "--days", "90").stdout.strip()
        self.assertRegex(text, "^weft_[0-9a-f]{64}$")
        listed = self.access("list").stdout
        self.assertRegex(listed, r"token +anna +operator +id [0-9a-f]{12}, made \S+, expires 2\S+")
        for where in (listed, read(self.path("state", "access.json")), read(self.path("weftd.log"))):
            self.assertNotIn(text[5:25], where)

    def test_says_what_is_wrong(self):
        self.assertIn('"boss" is none of viewer', self.access("token", "anna", "--role", "boss", check=2).stderr)
        self.assertIn("no token of id", self.access("revoke", "0123", check=2).stderr)
        write(self.path("token"), "weft_0123")
        done = self.list_jobs(self.socket, self.path("token"))
        self.assertIn("this token is unknown or was revoked", done.stderr)
        done = self.list_jobs(self.socket, self.path("no token"))
        self.assertIn("WEFT_TOKEN_FILE", done.stderr)


if __name__ == "__main__":
    unittest.main()
