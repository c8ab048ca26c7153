"""weft daemon drain: no work is lost, new work is refused, and the next daemon goes on."""

import json
import os
import shutil
import signal
import subprocess
import unittest

from daemon_process import DaemonProcess
from studio import BIN, LONG_S, StudioTest, processes_of, read, results, temporary_files, wait_for, weft, write


class Drain(DaemonProcess, StudioTest):
    def begin_job(self, frames):
        """A job of so many frames of which some have not begun."""
        for frame in range(len(self.frames), frames):
            name = f"{frame:04}"
            shutil.copytree(os.path.join(self.take, self.frames[frame % 3]), os.path.join(self.take, name))
            self.frames.append(name)
        self.start_plainly("--workers", 1)
        self.register("--server", self.addresses[0], "--detach", check=0)
        wait_for(lambda: self.finished(), "the first frame")

    def finished(self):
        return [name for name in self.frames if os.path.exists(os.path.join(self.out, name, "report.json"))]

    def only_job(self):
        return json.loads(weft("job", "list", "--server", self.addresses[0], "--json", check=0).stdout)["jobs"][0]

    def drain(self, *more):
        return subprocess.Popen([os.path.join(BIN, "weft"), "daemon", "drain", "--server", self.addresses[0], *more],
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def end_of(self, drain):
        """What it printed, once the daemon has ended as it should."""
        out, told = drain.communicate(timeout=LONG_S)
        self.assertEqual(drain.returncode, 0, told)
        self.assertIn("has stopped; its next start goes on", out)
        self.assertEqual(self.daemon.wait(timeout=LONG_S), 0)
        return told

    def test_frames_that_run_end_and_the_next_daemon_goes_on(self):
        self.begin_job(30)
        told = self.end_of(self.drain())
        self.assertRegex(told, r"draining: \d+ frames run, 1 jobs have not ended")
        self.assertIn("drained", self.log())
        finished = self.finished()
        self.assertLess(len(finished), len(self.frames), "the job was to be interrupted")
        self.assertEqual(temporary_files(self.out), [])
        written_ns = {name: os.stat(os.path.join(self.out, name, "cloud.ply")).st_mtime_ns for name in finished}
        self.start_plainly("--workers", 2)
        job = wait_for(lambda: (lambda j: j if j["state"] == "JOB_STATE_DONE" else None)(self.only_job()), "the job to end")
        self.assertEqual(job["frames"]["done"], len(self.frames))
        for name, then_ns in written_ns.items():
            self.assertEqual(os.stat(os.path.join(self.out, name, "cloud.ply")).st_mtime_ns, then_ns, "computed again")
        local = self.path("local")
        self.register(check=0, out=local)
        self.assertEqual(results(self.out), results(local))

    def test_jobs_end_first_if_asked_and_new_work_is_refused(self):
        self.begin_job(12)
        worker = processes_of(self.folder, "weft-worker")[0]
        os.kill(worker, signal.SIGSTOP)  # so that the job lasts
        drain = self.drain("--jobs")
        self.addCleanup(drain.stdout.close)
        self.addCleanup(drain.stderr.close)
        self.wait_for_log("draining")
        write(self.path("session.json"), json.dumps({"cameras": [{"id": "c01", "v4l2": {"device": "/dev/video99"}}]}))
        for refused in (self.register("--server", self.addresses[0], out=self.path("other")),
                        weft("take", "start", "--session", self.path("session.json"), "--server", self.addresses[0]),
                        weft("take", "info", self.take, "--server", self.addresses[0])):
            self.assertEqual(refused.returncode, 1, refused.stderr)
            self.assertIn("takes no new work", refused.stderr)
            self.assertIn("try again", refused.stderr)
            self.assertNotIn("no daemon answers", refused.stderr)
        os.kill(worker, signal.SIGCONT)
        self.end_of(drain)
        self.assertEqual(json.loads(read(f"{self.out}/job.json"))["state"], "JOB_STATE_DONE")
        self.assertEqual(len(self.finished()), len(self.frames))

    def test_idle_daemon_stops_at_once(self):
        self.start_plainly()
        self.end_of(self.drain())
        done = weft("daemon", "drain", "--server", self.addresses[0])
        self.assertEqual(done.returncode, 1)
        self.assertIn("no daemon answers", done.stderr)


if __name__ == "__main__":
    unittest.main()
