"""Results of jobs that are killed, robbed and shared: what says DONE is whole, and nothing else is touched."""

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest

import job_campaign
from job_campaign import Studio, differing, make_take, run_trial, undisturbed
from studio import BIN, LONG_S, read, results, temporary_files, wait_for, weft, write

# Between weftd and weft-worker: kills the worker as soon as it has told of the last frame, once.
DEADLY_WORKER = """#!{python}
import os, signal, subprocess, sys
worker = subprocess.Popen([{worker!r}, sys.argv[1], "--parent", str(os.getpid())], stdout=subprocess.PIPE)
for line in worker.stdout:
    sys.stdout.buffer.write(line)
    sys.stdout.buffer.flush()
    if b'"finished"' in line:
        with open({count!r}, "a") as told:
            told.write("x")
        if os.path.getsize({count!r}) == {frames}:
            worker.send_signal(signal.SIGKILL)
            os.kill(os.getpid(), signal.SIGKILL)
sys.exit(worker.wait())
"""


class JobResults(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        shared = tempfile.TemporaryDirectory(prefix="weft results ")
        cls.addClassCleanup(shared.cleanup)
        cls.take = make_take(shared.name)
        cls.expected, _ = undisturbed(cls.take)

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="weft test ")
        self.addCleanup(folder.cleanup)
        self.studio = Studio(folder.name, self.take)
        self.out = self.studio.out
        self.addCleanup(self.end_daemon)

    def end_daemon(self):
        if self.studio.daemon and self.studio.daemon.poll() is None:
            self.studio.kill_daemon()

    def path(self, *names):
        return os.path.join(self.studio.folder, *names)

    def frame_file(self, frame, name):
        return os.path.join(self.out, self.studio.frames[frame], name)

    def assert_whole(self):
        self.assertEqual(differing(results(self.out), self.expected), [])
        self.assertEqual(temporary_files(self.out), [])

    def assert_done(self, job_id):
        job = self.studio.wait_for_end(job_id)
        self.assertEqual(job["state"], "JOB_STATE_DONE", job)
        self.assertEqual(job["frames"]["done"], len(self.studio.frames))
        self.assert_whole()

    def holder(self):
        try:
            return read(os.path.join(self.out, ".weft-lock"))
        except FileNotFoundError:
            return ""

    def start_local(self):
        return subprocess.Popen([os.path.join(BIN, "weft"), *self.studio.register_arguments()], stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, text=True)

    def wait_for_reports(self, count):
        wait_for(lambda: self.studio.reported() >= count, f"{count} reports", pause_s=0.001)

    def test_some_trials_of_the_campaign(self):
        for number in (0, 100, 200):
            record = run_trial(number, job_campaign.TRIALS[number], self.take, self.expected)
            self.assertEqual((record["state"], record["wrong"], record["left"]), ("DONE", [], []), record)

    def test_a_worker_killed_as_it_tells_of_the_last_frame_has_refined_it(self):
        deadly = self.path("deadly-worker")
        write(deadly, DEADLY_WORKER.format(python=sys.executable, worker=os.path.join(BIN, "weft-worker"),
                                           count=self.path("told"), frames=len(self.studio.frames)))
        os.chmod(deadly, 0o755)
        self.studio.start_daemon("--worker", deadly, workers=1)
        self.assert_done(self.studio.submit())

    def test_a_local_run_killed_at_the_last_report_goes_on_to_whole_results(self):
        local = self.start_local()
        self.wait_for_reports(len(self.studio.frames))
        local.kill()
        local.communicate(timeout=LONG_S)
        weft(*self.studio.register_arguments(), check=0)
        self.assert_whole()

    def test_results_that_vanish_or_change_midway_are_made_again(self):
        self.studio.start_daemon(workers=1)
        job = self.studio.submit()
        self.wait_for_reports(2)
        os.remove(self.frame_file(0, "mesh.ply"))
        cloud = bytearray(read(self.frame_file(1, "cloud.ply"), "rb"))
        cloud[-1] ^= 1
        write(self.frame_file(1, "cloud.ply"), bytes(cloud))
        self.assert_done(job)

    def test_a_local_run_makes_again_what_vanishes(self):
        local = self.start_local()
        self.wait_for_reports(2)
        # In one step: the run may be writing into the folder.
        os.rename(os.path.join(self.out, self.studio.frames[0]), os.path.join(self.studio.folder, "vanished"))
        _, errors = local.communicate(timeout=LONG_S)
        self.assertEqual(local.returncode, 0, errors)
        self.assert_whole()

    def test_a_resumed_job_makes_again_what_vanished_while_no_daemon_ran(self):
        self.studio.start_daemon(workers=1)
        job = self.studio.submit()
        self.wait_for_reports(2)
        self.studio.kill_daemon()
        os.remove(self.frame_file(0, "unrefined.ply"))
        self.studio.start_daemon(workers=1)
        self.assert_done(job)

    def test_images_that_are_exchanged_midway_are_read_again(self):
        take = shutil.copytree(self.take, self.path("take"))
        self.studio.take = take
        self.studio.start_daemon(workers=1)
        job_id = self.studio.submit()
        self.wait_for_reports(2)
        first, last = (os.path.join(take, self.studio.frames[at]) for at in (0, -1))
        for image in os.listdir(first):
            shutil.copy(os.path.join(last, image), os.path.join(first, image))
        job = self.studio.wait_for_end(job_id)
        self.assertEqual(job["state"], "JOB_STATE_DONE", job)
        self.assertIn(f"images, scan or start of {self.studio.frames[0]} changed while the job ran", " ".join(job["warnings"]))
        expected, _ = undisturbed(take)
        self.assertEqual(differing(results(self.out), expected), [])

    def test_a_folder_has_one_writer(self):
        self.studio.start_daemon(workers=1)
        job = self.studio.submit()
        self.wait_for_reports(1)
        os.kill(self.studio.daemon.pid, signal.SIGSTOP)
        try:
            refused = weft(*self.studio.register_arguments("--preset", "paper"))
        finally:
            os.kill(self.studio.daemon.pid, signal.SIGCONT)
        self.assertEqual(refused.returncode, 2, refused.stdout + refused.stderr)
        for fact in (self.out, job, "writes to this folder", "wait until it has ended"):
            self.assertIn(fact, refused.stderr)
        self.assert_done(job)

        local = self.start_local()
        wait_for(lambda: f"process {local.pid}" in self.holder(), "the local run to hold the folder", pause_s=0.001)
        os.kill(local.pid, signal.SIGSTOP)
        try:
            refused = weft(*self.studio.register_arguments("--server", self.studio.address, "--preset", "paper"))
        finally:
            os.kill(local.pid, signal.SIGCONT)
        self.assertEqual(refused.returncode, 2, refused.stdout + refused.stderr)
        self.assertIn(f"weft register, process {local.pid}", refused.stderr)
        local.communicate(timeout=LONG_S)
        self.assert_whole()

    def test_a_link_in_the_results_leads_nowhere(self):
        elsewhere = self.path("elsewhere")
        os.makedirs(os.path.join(elsewhere, "0"))
        for name in ("mesh.ply", "cloud.ply", "report.json"):
            write(os.path.join(elsewhere, name), "kept")
        os.mkdir(self.out)
        os.symlink(elsewhere, os.path.join(self.out, self.studio.frames[1]))
        refused = weft(*self.studio.register_arguments())
        self.assertEqual(refused.returncode, 2, refused.stdout + refused.stderr)
        self.assertIn(os.path.join(self.out, self.studio.frames[1]), refused.stderr)
        self.assertIn("remove the link", refused.stderr)
        self.studio.start_daemon(workers=1)
        job = self.studio.wait_for_end(self.studio.submit())
        self.assertEqual(job["state"], "JOB_STATE_FAILED")
        self.assertIn("remove the link", job["message"])
        self.assertEqual(read(os.path.join(elsewhere, "mesh.ply")), "kept")
        self.assertEqual(sorted(os.listdir(elsewhere)), ["0", "cloud.ply", "mesh.ply", "report.json"])
        os.remove(os.path.join(self.out, self.studio.frames[1]))
        self.assert_done(self.studio.submit())

    def test_an_out_that_becomes_a_link_after_submission_is_not_followed(self):
        elsewhere = self.path("elsewhere")
        os.makedirs(os.path.join(elsewhere, self.studio.frames[0]))
        kept = [os.path.join(elsewhere, name) for name in
                ("job.json", "report.html", os.path.join(self.studio.frames[0], "mesh.ply"))]
        for path in kept:
            write(path, "kept")
        self.studio.start_daemon(workers=1)
        first = self.studio.submit()
        waits = self.studio.submit(out=self.path("swapped"))
        os.rmdir(self.path("swapped"))
        os.symlink(elsewhere, self.path("swapped"))
        self.assert_done(first)
        job = self.studio.wait_for_end(waits)
        self.assertEqual(job["state"], "JOB_STATE_FAILED")
        self.assertIn(self.path("swapped"), job["message"])
        self.assertEqual([read(path) for path in kept], ["kept"] * len(kept))

    def test_refuses_to_write_into_what_it_reads(self):
        self.studio.start_daemon(workers=1)
        for more in ([], ["--server", self.studio.address]):
            for out in (os.path.join(self.take, "result"), os.path.join(self.take, "template")):
                refused = weft(*self.studio.register_arguments(*more, out=out))
                self.assertEqual(refused.returncode, 2, refused.stdout + refused.stderr)
                self.assertIn("which is only read", refused.stderr)
        refused = weft(*self.studio.register_arguments("--server", self.studio.address, out=self.path("state", "mine")))
        self.assertEqual(refused.returncode, 2, refused.stdout + refused.stderr)
        self.assertIn("the daemon's own folder", refused.stderr)
        self.assertFalse(os.path.exists(os.path.join(self.take, "result")))

    def test_temporary_files_of_killed_writers_go(self):
        os.makedirs(os.path.join(self.out, self.studio.frames[1]))
        for path in (self.frame_file(1, "mesh.ply.tmp.4000000.7"), os.path.join(self.out, "job.json.tmp.4000000.0")):
            write(path, "half")
        weft(*self.studio.register_arguments(), check=0)
        self.assert_whole()
        write(self.frame_file(0, "cloud.ply.tmp.4000000.7"), "half")
        self.studio.start_daemon(workers=1)
        self.assert_done(self.studio.submit())

    def test_results_of_the_format_before_this_one_are_computed_again(self):
        weft(*self.studio.register_arguments(), check=0)
        for frame in range(len(self.studio.frames)):
            report = json.loads(read(self.frame_file(frame, "report.json")))
            report.pop("format_version", None)
            report.pop("files", None)
            write(self.frame_file(frame, "report.json"), json.dumps(report))
        write(self.frame_file(2, "mesh.ply"), read(self.frame_file(1, "mesh.ply"), "rb"))
        weft(*self.studio.register_arguments(), check=0)
        self.assert_whole()


if __name__ == "__main__":
    unittest.main()
