"""Commands that a daemon runs for its clients: the same as here, on its files, also across its death."""

import glob
import json
import os
import shutil
import subprocess
import unittest

from studio import BIN, LONG_S, StudioTest, processes_of, read, wait_for, weft


def files_of(folder):
    return {os.path.relpath(os.path.join(base, name), folder): read(os.path.join(base, name), "rb")
            for base, _, names in os.walk(folder) for name in names}


class Operations(StudioTest):
    def setUp(self):
        super().setUp()
        self.address, self.state = self.path("address"), self.path("state")
        self.start_daemon()

    def start_daemon(self):
        if os.path.exists(self.address):
            os.remove(self.address)
        self.daemon = subprocess.Popen([os.path.join(BIN, "weftd"), "--listen", "127.0.0.1:0", "--address-file", self.address,
                                        "--state", self.state, "--allow-path", self.folder, "--workers", "1"],
                                       stderr=subprocess.DEVNULL)
        self.addCleanup(self.kill_daemon, self.daemon)
        self.server = wait_for(lambda: os.path.exists(self.address) and read(self.address).strip(), "weftd to listen")

    @staticmethod
    def kill_daemon(daemon):
        daemon.kill()
        daemon.wait()

    def there(self, *words, check=0):
        return weft(*words, "--server", self.server, check=check)

    def make_take(self):
        take = self.path("recorded")
        weft("take", "import", self.take, "--out", take, "--fps", 30, check=0)
        return take

    def test_takes_are_checked_trimmed_and_exported(self):
        take = self.make_take()
        here = json.loads(weft("take", "verify", take, "--json", check=0).stdout)
        self.assertEqual(json.loads(self.there("take", "verify", take, "--json").stdout), here)
        self.assertIn("frame sets", self.there("take", "info", take).stdout)
        trimmed = self.there("take", "trim", take, "--frames", "1:3").stdout.splitlines()[-1]
        self.assertRegex(trimmed, r"^take:\d{8}-\d{6}-[0-9a-f]{8}$")
        listed = json.loads(self.there("take", "list", "--json").stdout)["takes"]
        self.assertEqual([f"take:{one['id']}" for one in listed], [trimmed])
        self.assertEqual(int(listed[0]["state"]["sets_recorded"]), 2)
        weft("take", "trim", take, "--frames", "1:3", "--out", self.path("local trim"), check=0)
        weft("take", "export", self.path("local trim"), "--out", self.path("local"), check=0)
        self.there("take", "export", trimmed, "--out", self.path("exported"))
        self.assertEqual(files_of(self.path("exported")), files_of(self.path("local")))
        # A take that is damaged: its verdict is bad, and the command has done its work.
        with open(f"{take}/streams/{sorted(os.listdir(take + '/streams'))[-1]}", "r+b") as stream:
            stream.seek(10000)
            stream.write(b"damaged")
        damaged = self.there("take", "verify", take, check=1)
        self.assertIn("bad", damaged.stdout)

    def test_templates_are_built_and_results_evaluated(self):
        inputs = ["--rig", f"{self.take}/rig.json", "--board", f"{self.take}/board.json", "--openings", -1]
        built = self.there("template", "build", self.take, *inputs, "--out", self.path("there"), check=None)
        here = weft("template", "build", self.take, *inputs, "--out", self.path("here"), check=None)
        self.assertEqual(built.returncode, here.returncode, built.stderr + here.stderr)
        if here.returncode == 0:
            self.assertEqual(read(self.path("there/mesh.ply"), "rb"), read(self.path("here/mesh.ply"), "rb"))
        self.there(*self.register_arguments(), "--frames", "0:2")
        job = json.loads(self.there("job", "list", "--json").stdout)["jobs"][0]["id"]
        there = self.there("evaluate", f"job:{job}", "--quick", "--json", "--out", self.path("evaluation"), check=None)
        here = weft("evaluate", self.out, "--quick", "--json", check=None)
        self.assertEqual(there.returncode, here.returncode, there.stderr)
        self.assertEqual(json.loads(there.stdout)["verdict"], json.loads(here.stdout)["verdict"])
        self.assertIn("report.html", os.listdir(self.path("evaluation")))
        self.assert_exports_are_the_same(job)

    def assert_exports_are_the_same(self, job):
        """Of every format, here and by the daemon, which finds the recording of overlays by itself."""
        overlays = ["--camera", json.loads(read(f"{self.take}/rig.json"))["cameras"][0]["id"]]
        for number, export in enumerate([["ply"], ["obj"], ["glb", "--meshopt"], ["mdd"], ["pc2"], ["usda"], ["npz"],
                                         ["jpg", "--overlay", "state", *overlays], ["png", "--texture", 256],
                                         ["glb", "--texture", 128],
                                         ["png", "--normal-map", 64, "--max-vertices", 50], ["mp4", "--overlay", "wireframe", *overlays]]):
            if "mp4" in export and not shutil.which("ffmpeg"):
                continue
            there, here = self.path(f"export {number}"), self.path(f"export here {number}")
            self.there("export", f"job:{job}", "--fps", 50, "--format", *export, "--out", there)
            weft("export", self.out, "--fps", 50, "--format", *export, "--out", here, check=0)
            self.assertEqual(files_of(there), files_of(here), export)

    def test_bad_requests_are_refused_by_the_field(self):
        outside = self.there("take", "verify", "/etc", check=2)
        self.assertIn("spec.inputs.take: /etc lies outside the folders", outside.stderr)
        self.assertIn("no such take", self.there("take", "verify", "take:20260101-000000-00000000", check=2).stderr)
        self.assertIn("--config: a daemon does not take it",
                      self.there("template", "build", self.take, "--board", f"{self.take}/board.json", "--config", "x",
                                 "--out", self.path("no"), check=2).stderr)
        not_a_take = self.there("take", "verify", self.take, check=2)
        here = weft("take", "verify", self.take, check=2)
        self.assertEqual(not_a_take.stderr, here.stderr, "the same error as here")

    def test_calibration_says_the_same_as_here(self):
        weft("rig", "target", "--out", self.path("target"), check=0)
        calibrate = ["rig", "calibrate", self.take, "--target", self.path("target/target.json"), "--min-views", 3,
                     "--out", self.path("rig.json")]
        there, here = self.there(*calibrate, check=None), weft(*calibrate, check=None)
        self.assertEqual((there.returncode, there.stderr), (here.returncode, here.stderr))
        self.assertNotEqual(here.returncode, 0, "no board is seen")

    def test_end_when_their_client_is_stopped(self):
        process = subprocess.Popen([os.path.join(BIN, "weft"), "template", "build", self.take, "--rig", f"{self.take}/rig.json",
                                    "--board", f"{self.take}/board.json", "--out", self.path("never"), "--server", self.server],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        wait_for(lambda: [one for one in processes_of(self.folder, "weft") if one != process.pid], "the operation to run")
        process.terminate()
        process.communicate(timeout=LONG_S)
        self.assertEqual(process.returncode, 1)
        operations = json.loads(self.there("operation", "list", "--json").stdout)["operations"]
        self.assertEqual([one["state"] for one in operations], ["JOB_STATE_CANCELLED"])
        self.assertIn("cancelled  weft template build", self.there("operation", "list").stdout)
        self.assertFalse(os.path.exists(self.path("never")))
        # Lists tell what it is about; it is removed with its files.
        self.assertIn(self.take, self.there("operation", "list").stdout)
        self.assertIn("is deleted", self.there("operation", "delete", operations[0]["id"]).stdout)
        self.assertEqual(os.listdir(os.path.join(self.state, "operations")), [])
        self.assertIn("no operation", self.there("operation", "delete", operations[0]["id"], check=2).stderr)

    def test_begin_anew_when_the_daemon_was_killed(self):
        take = self.make_take()
        for number in range(3):
            weft("take", "import", self.take, "--out", f"{take}{number}", "--fps", 30, check=0)
        watchers = [subprocess.Popen([os.path.join(BIN, "weft"), "take", "trim", f"{take}{number}", "--server", self.server],
                                     stdout=subprocess.PIPE, stderr=subprocess.PIPE) for number in range(3)]
        operations = f"{self.state}/operations"
        wait_for(lambda: len(glob.glob(f"{operations}/*/operation.json")) == 3, "three operations")
        self.kill_daemon(self.daemon)
        for watcher in watchers:
            watcher.communicate(timeout=LONG_S)
        wait_for(lambda: not processes_of(self.folder, "weft"), "the command to end with the daemon")
        self.start_daemon()

        def ended():
            takes = json.loads(self.there("take", "list", "--json").stdout).get("takes", [])
            return takes if len(takes) == 3 else None

        for one in wait_for(ended, "all three", 0.2):
            weft("take", "verify", one["folder"], check=0)


if __name__ == "__main__":
    unittest.main()
