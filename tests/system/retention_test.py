"""What a daemon removes by itself: slowly, by time that it has seen, and after it has said so."""

import json
import os
import subprocess
import tempfile
import time
import unittest

from daemon_process import DaemonProcess
from live_studio import enter_network, set_up_network
from studio import StudioTest, read, wait_for, weft, write

DAY_S = 24 * 3600
MIB = 1 << 20


def setUpModule():
    set_up_network([])


class Retention(DaemonProcess, StudioTest):
    def begin(self, *more):
        """A daemon whose clock is ahead by what stands in self.clock."""
        self.clock = self.path("clock")
        if not os.path.exists(self.clock):
            write(self.clock, "0")
        # LD_PRELOAD takes no path with a space.
        self.start_plainly("--workers", 1, *more,
                           environment={"LD_PRELOAD": os.environ["WEFT_WRONG_CLOCK"], "WEFT_CLOCK_FILE": self.clock})
        self.server = self.addresses[0]

    def set_clock_ahead(self, days):
        write(self.clock + ".new", str(days * DAY_S))
        os.replace(self.clock + ".new", self.clock)

    def run_job(self):
        """A job whose results lie with the daemon."""
        with tempfile.TemporaryDirectory() as elsewhere:
            self.register("--frames", f"{self.frames[0]}:{self.frames[1]}", "--upload", "--server", self.server,
                          out=f"{elsewhere}/result", check=0)
        return self.jobs()[0]

    def jobs(self):
        return [job["id"] for job in json.loads(weft("job", "list", "--json", "--server", self.server, check=0).stdout)["jobs"]]

    def audit(self):
        return [json.loads(line) for line in read(self.path("state", "audit.log")).splitlines() if '"Retention"' in line]

    def film(self):
        """A take that the daemon recorded."""
        session = self.path("session.json")
        if not os.path.exists(session):
            cameras = subprocess.Popen([os.path.join(os.environ["WEFT_BIN"], "weft"), "camera", "fake", "--pictures", self.take,
                                        "--fps", "5", "--session", session], stdout=subprocess.PIPE, text=True)
            self.addCleanup(cameras.communicate)
            self.addCleanup(cameras.kill)
            cameras.stdout.readline()
            write(session, json.dumps({**json.loads(read(session)), "max_wait_ms": 5000, "low_disk_gib": 0.001}))
        take = weft("take", "start", "--session", session, "--no-disk-test", "--seconds", 1, "--server", self.server, check=0).stdout.strip()
        wait_for(lambda: "ENDED" in weft("take", "list", "--json", "--server", self.server, check=0).stdout and
                 not self.taken(take).get("recorder_lives"), "the take to end", 0.2)
        return take

    def takes(self, *more):
        return json.loads(weft("take", "list", "--json", *more, "--server", self.server, check=0).stdout).get("takes", [])

    def taken(self, take):
        return next(one for one in self.takes() if one["id"] == take)

    def rehearse(self, *more):
        return json.loads(weft("daemon", "retention", "--dry-run", "--json", *more, "--server", self.server, check=0).stdout)

    def test_a_wrong_clock_destroys_nothing(self):
        # 86 s, so that the daemon looks every 8.6 s.
        rules = ["--keep-jobs-days", 1e-3, "--keep-trash-days", 1e-3, "--keep-takes-days", 1e-3]
        self.begin("--keep-jobs-days", 30)
        job, deleted, take = self.run_job(), self.film(), self.film()
        self.assertTrue(os.path.exists(self.path("state", "results", job)))
        weft("take", "delete", deleted, "--server", self.server, check=0)
        self.stop()

        def all_is_there():
            self.assertEqual(self.jobs(), [job])
            self.assertTrue(os.path.exists(self.path("state", "results", job)))
            self.assertEqual([one["id"] for one in self.takes()], [take])
            self.assertEqual([one["id"] for one in self.takes("--trash")], [deleted])

        for days in (400, -400):
            self.set_clock_ahead(days)
            self.begin(*rules)
            time.sleep(11)  # two looks
            all_is_there()
            self.stop()
        self.set_clock_ahead(0)
        self.begin(*rules)
        self.set_clock_ahead(8)
        self.wait_for_log("the clock went forward by 8.00 days")
        all_is_there()
        self.assertIn("POSTPONED", [entry["outcome"] for entry in self.audit()])
        self.stop()

    def test_what_is_old_is_named_before_it_goes(self):
        self.begin("--keep-trash-days", 100)
        job = self.run_job()
        self.assertTrue(os.path.exists(self.path("state", "results", job)))
        self.assertEqual(self.rehearse().get("steps", []), [])
        self.assertEqual(self.rehearse("--keep-jobs-days", 1).get("steps", []), [])
        steps = self.rehearse("--keep-jobs-days", 1, "--ahead-days", 2)["steps"]
        self.assertEqual([(step["kind"], step["id"]) for step in steps], [("HOLDING_KIND_JOB", job)])
        self.assertAlmostEqual(float(steps[0]["due_in_s"]) / DAY_S, 1, 1)
        self.assertEqual(self.jobs(), [job])
        words = weft("daemon", "retention", "--dry-run", "--keep-jobs-days", 1, "--ahead-days", 2, "--server", self.server, check=0).stdout
        self.assertIn(f"job {job} is removed for good", words)
        refused = weft("daemon", "retention", "--keep-jobs-days", 1, "--server", self.server)
        self.assertNotEqual(refused.returncode, 0)
        self.stop()

        self.begin("--keep-jobs-days", 1e-5, "--keep-trash-days", 100)
        wait_for(lambda: not self.jobs(), "the job to be forgotten", 0.2)
        self.assertFalse(os.path.exists(self.path("state", "results", job)))
        entry = self.audit()[-1]
        self.assertEqual((entry["caller"], entry["about"]["job"], entry["outcome"]), ("weftd", job, "OK"))
        said = weft("daemon", "retention", "--server", self.server, check=0).stdout
        self.assertIn(job, said)

    def test_room_that_others_take_costs_no_take(self):
        state = self.path("state")
        os.mkdir(state)
        subprocess.run(["mount", "-t", "tmpfs", "-o", "size=512m,mode=700", "tmpfs", state], check=True)
        self.addCleanup(subprocess.run, ["umount", "--lazy", state], check=True)
        # 128 MiB stay free. Looks every 5 s, as of a trash of 50 s.
        self.begin("--least-free-gib", 1 / 8, "--keep-trash-days", 50 / DAY_S, "--least-trash-hours", 0)
        first, second = self.film(), self.film()
        time.sleep(6)
        free = os.statvfs(state).f_bavail * os.statvfs(state).f_frsize
        junk = os.path.join(state, "junk")
        write(junk, b"j" * (free - 20 * MIB))  # another program's
        self.wait_for_log("takes did not take")
        time.sleep(11)
        self.assertEqual(sorted(one["id"] for one in self.takes()), sorted([first, second]))
        upload = weft("library", "upload", "rig", f"{self.take}/rig.json", "--server", self.server)
        self.assertEqual(upload.returncode, 1, upload.stdout + upload.stderr)
        self.assertIn("--least-free-gib", upload.stderr)
        os.remove(junk)
        time.sleep(6)
        # A take that grows.
        free = os.statvfs(state).f_bavail * os.statvfs(state).f_frsize
        write(os.path.join(state, "takes", second, "take", "grown"), b"g" * (free - 127 * MIB))
        wait_for(lambda: [one["id"] for one in self.takes()] == [second], "the oldest to go", 0.2)
        entry = next(entry for entry in self.audit() if entry["about"].get("take") == first)
        self.assertEqual(entry["about"]["to"], "the trash")
        self.assertIn("less than", entry["message"])


if __name__ == "__main__":
    enter_network()
    unittest.main()
