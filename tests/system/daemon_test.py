"""weftd and its workers as real processes: submit, watch, cancel, survive."""

import json
import os
import resource
import shutil
import signal
import subprocess
import tempfile
import unittest

from studio import BIN, LONG_S, StudioTest, processes_of, read, results, temporary_files, wait_for, weft


class Daemon(StudioTest):
    def setUp(self):
        super().setUp()
        self.daemon = None
        self.address = ""
        self.addCleanup(self.kill_daemon)

    def start_daemon(self, *more):
        address_file = self.path("address")
        if os.path.exists(address_file):
            os.remove(address_file)
        self.log = open(self.path("weftd.log"), "a")
        self.addCleanup(self.log.close)
        self.daemon = subprocess.Popen(
            [os.path.join(BIN, "weftd"), "--listen", "127.0.0.1:0", "--address-file", address_file, "--state",
             self.path("state"), "--allow-path", self.folder, *more], stdout=self.log, stderr=self.log)

        def listening():
            self.assertIsNone(self.daemon.poll(), read(self.path("weftd.log")))
            return os.path.exists(address_file) and read(address_file).strip()
        self.address = wait_for(listening, "weftd to listen")

    def kill_daemon(self):
        if self.daemon and self.daemon.poll() is None:
            self.daemon.kill()
            self.daemon.wait()

    def register_remotely(self, *more, **options):
        return self.register("--server", self.address, *more, **options)

    def only_job(self):
        jobs = json.loads(weft("job", "list", "--server", self.address, "--json", check=0).stdout)["jobs"]
        self.assertEqual(len(jobs), 1)
        return jobs[0]

    def test_gives_the_same_files_as_a_registration_without_it(self):
        self.start_daemon("--workers", "2")
        done = self.register_remotely("--observations", check=0)
        self.assertTrue(done.stdout.startswith("good: 3 of 3 frames registered"), done.stdout)
        self.assertEqual(json.loads(read(f"{self.out}/job.json"))["verdict"]["grade"], "GRADE_GOOD")
        local = self.path("local")
        self.register("--observations", check=0, out=local)
        self.assertEqual(results(self.out), results(local))
        self.assertTrue(read(f"{self.out}/report.html").lstrip().lower().startswith("<!doctype html"))
        self.assertEqual(temporary_files(self.out), [])

    def test_ends_as_a_registration_without_it_when_frames_fail(self):
        self.start_daemon("--workers", "2")
        for name, dark in (("bridged", [1]), ("all", [0, 2])):  # frame 1 is dark by then
            for frame in dark:
                for camera in range(2, len(self.images)):
                    os.remove(self.image(frame, camera))
            ended = []
            for out, more in ((self.path(f"{name} remote"), ["--server", self.address]), (self.path(f"{name} local"), [])):
                done = self.register("--json", *more, out=out)
                job = json.loads(done.stdout)
                self.assertEqual(json.loads(read(f"{out}/job.json"))["message"], job["message"])
                ended.append([done.returncode, *(job[key] for key in ("state", "message", "frames", "verdict"))])
            self.assertEqual(ended[0], ended[1])
            status, state, message, frames, _ = ended[0]
            if name == "all":
                self.assertEqual((status, state, frames["failed"]), (1, "JOB_STATE_FAILED", 3))
                self.assertIn(f"no frame could be registered; the first, frame {self.frames[0]}: only 2 of", message)
            else:
                self.assertEqual((state, message), ("JOB_STATE_DONE", ""))
                self.assertEqual((frames["done"], frames["failed"], frames["bridged"]), (2, 1, 1))

    def test_takes_scans_as_a_registration_without_it_does(self):
        scans = self.path("scans")
        os.mkdir(scans)
        frame = self.frames[0]
        shutil.copy(f"{self.take}/truth/{frame}/mesh.ply", f"{scans}/{frame}.ply")
        self.start_daemon("--workers", "1")
        first = ["--frames", "0:1", "--scans", scans]
        self.register_remotely(*first, check=0)
        local, without = self.path("local"), self.path("without")
        self.register(*first, check=0, out=local)
        self.assertEqual(results(self.out), results(local))
        self.register(*first[:2], check=0, out=without)
        self.assertNotEqual(results(local)[f"{frame}/mesh.ply"], results(without)[f"{frame}/mesh.ply"])
        with tempfile.TemporaryDirectory() as outside:
            other = self.path("other")
            self.assert_refused(self.register_remotely("--scans", outside, out=other), outside, "--allow-path",
                                out=other)

    def test_worker_that_takes_too_much_memory_costs_its_frame(self):
        self.start_daemon("--workers", "1", "--worker-memory-mib", "64")
        done = self.register_remotely("--frames", "0:1")
        self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
        self.assertIn("out of memory; a worker may take 64 MiB", done.stdout + done.stderr)
        self.assertIsNone(self.daemon.poll())

    def test_a_limit_on_files_is_as_a_full_disk(self):
        self.start_daemon("--workers", "1")
        self.lengthen_take(6)
        job = self.register_remotely("--detach", check=0).stdout.split()[0]

        def limit(bytes_):
            for process in [self.daemon.pid, *processes_of(self.folder, "weft-worker")]:
                most = resource.prlimit(process, resource.RLIMIT_FSIZE)[1]
                resource.prlimit(process, resource.RLIMIT_FSIZE, (most if bytes_ is None else bytes_, most))
        wait_for(lambda: processes_of(self.folder, "weft-worker"), "a worker")
        limit(100)
        refused = self.register_remotely("--detach", out=self.path("other"))
        self.assertNotEqual(refused.returncode, 0, refused.stdout)
        self.assertIsNone(self.daemon.poll(), read(self.path("weftd.log")))
        limit(None)
        self.assertEqual(weft("job", "watch", job, "--server", self.address).returncode, 0, read(self.path("weftd.log")))
        self.assertIsNone(self.daemon.poll())

    def test_refuses_what_it_may_not_touch_and_what_does_not_fit(self):
        self.start_daemon()
        with tempfile.TemporaryDirectory() as outside:
            self.assert_refused(self.register_remotely(dump=outside), outside, "--allow-path")
        self.assert_refused(self.register_remotely(dump=self.path("nowhere")), self.path("nowhere"))

    def test_says_how_to_start_a_daemon_that_is_not_reachable(self):
        done = self.register("--server", "127.0.0.1:1")
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("127.0.0.1:1", done.stderr)
        self.assertIn("weftd --listen", done.stderr)

    def lengthen_take(self, frames):
        """Repeats the frames, for a job that lasts a while."""
        for frame in range(len(self.frames), frames):
            name = f"{frame:04}"
            shutil.copytree(os.path.join(self.take, self.frames[frame % 3]), os.path.join(self.take, name))
            self.frames.append(name)

    def test_cancelled_job_leaves_whole_frames_only(self):
        self.lengthen_take(60)
        self.start_daemon("--workers", "1")
        client = subprocess.Popen([os.path.join(BIN, "weft"), *self.register_arguments(), "--server", self.address],
                                  stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        wait_for(lambda: os.path.exists(os.path.join(self.out, self.frames[0], "report.json")), "the first frame")
        weft("job", "cancel", self.only_job()["id"], "--server", self.address, check=0)
        _, errors = client.communicate(timeout=LONG_S)
        self.assertEqual(client.returncode, 1, errors)
        self.assertIn("cancelled", errors)
        self.assertEqual(self.only_job()["state"], "JOB_STATE_CANCELLED")
        wait_for(lambda: not processes_of(self.folder, "weft-worker"), "the worker to end")
        self.assertEqual(temporary_files(self.out), [])
        for name in self.frames:
            if os.path.exists(os.path.join(self.out, name)):
                self.assertTrue(os.path.exists(os.path.join(self.out, name, "report.json")), name)

    def test_goes_on_with_its_jobs_after_it_was_killed(self):
        self.lengthen_take(20)
        self.start_daemon("--workers", "1")
        client = subprocess.Popen([os.path.join(BIN, "weft"), *self.register_arguments(), "--observations", "--server",
                                   self.address], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        wait_for(lambda: os.path.exists(os.path.join(self.out, self.frames[0], "report.json")), "the first frame")
        first = os.path.join(self.out, self.frames[0], "cloud.ply")  # its mesh still changes with its neighbours'
        written_ns = os.stat(first).st_mtime_ns
        self.daemon.send_signal(signal.SIGKILL)
        self.daemon.wait()
        client.communicate(timeout=LONG_S)
        self.assertEqual(client.returncode, 1)
        wait_for(lambda: not processes_of(self.folder, "weft-worker"), "the workers to end with their daemon")

        self.start_daemon("--workers", "1")
        job = wait_for(lambda: (lambda j: j if j["state"] == "JOB_STATE_DONE" else None)(self.only_job()),
                       "the job to end")
        self.assertEqual(job["frames"]["done"], len(self.frames))
        self.assertEqual(os.stat(first).st_mtime_ns, written_ns, "the finished frame was computed again")
        local = self.path("local")
        self.register("--observations", check=0, out=local)
        self.assertEqual(results(self.out), results(local))

    def test_killed_worker_is_replaced(self):
        self.start_daemon("--workers", "1")
        client = subprocess.Popen([os.path.join(BIN, "weft"), *self.register_arguments(), "--server", self.address],
                                  stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        worker = wait_for(lambda: processes_of(self.folder, "weft-worker"), "a worker")[0]
        own = os.getpriority(os.PRIO_PROCESS, self.daemon.pid)
        wait_for(lambda: os.getpriority(os.PRIO_PROCESS, worker) == min(own + 4, 19), "the worker to stand behind the daemon")
        os.kill(worker, signal.SIGKILL)
        out, errors = client.communicate(timeout=LONG_S)
        self.assertEqual(client.returncode, 0, errors)
        self.assertIn("3 of 3 frames registered", out)


if __name__ == "__main__":
    unittest.main()
