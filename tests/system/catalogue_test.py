"""What weftd remembers: hostile file names, full disks, damaged files and kills lose no job."""

import json
import os
import random
import shutil
import signal
import subprocess
import tempfile
import threading
import time
import unittest

from studio import BIN, LONG_S, StudioTest, read, results, wait_for, weft

ENDED = ("JOB_STATE_DONE", "JOB_STATE_FAILED", "JOB_STATE_CANCELLED")


class Catalogue(StudioTest):
    def setUp(self):
        super().setUp()
        self.daemon = None
        self.namespace = []  # how to start a program where the state folder is
        self.state = self.path("state")
        self.addCleanup(self.kill_daemon)

    def start_daemon(self):
        address_file = self.path("address")
        if os.path.exists(address_file):
            os.remove(address_file)
        with open(self.path("weftd.log"), "a") as log:
            self.daemon = subprocess.Popen(
                [*self.namespace, os.path.join(BIN, "weftd"), "--listen", "127.0.0.1:0", "--address-file", address_file,
                 "--state", self.state, "--allow-path", self.folder, "--workers", "1"], stdout=log, stderr=log)

        def listening():
            self.assertIsNone(self.daemon.poll(), self.log())
            return os.path.exists(address_file) and read(address_file).strip()
        self.server = ["--server", wait_for(listening, "weftd to listen", pause_s=0.2)]

    def kill_daemon(self, how=signal.SIGKILL):
        if self.daemon and self.daemon.poll() is None:
            self.daemon.send_signal(how)
            self.daemon.wait(LONG_S)

    def log(self):
        return read(self.path("weftd.log"))

    def submit(self, **options):
        return self.register(*self.server, "--detach", check=0, **options).stdout.split()[0]

    def jobs(self):
        return json.loads(weft("job", "list", *self.server, "--json", check=0).stdout)

    def job(self, job_id):
        return next(job for job in self.jobs()["jobs"] if job["id"] == job_id)

    def end_of(self, job_id):
        return wait_for(lambda: (lambda job: job if job["state"] in ENDED else None)(self.job(job_id)), "the job's end",
                        pause_s=0.2)

    def assert_done(self, job_id):
        job = self.end_of(job_id)
        self.assertEqual((job["state"], job["frames"]["done"]), ("JOB_STATE_DONE", len(self.frames)), job)
        return job

    def catalogue(self):
        return os.path.join(self.state, "catalogue.sqlite")

    def set_aside(self):
        return [name for name in os.listdir(self.state) if ".damaged-" in name]


class HostileNames(Catalogue):
    def test_a_file_name_that_is_no_text_spoils_no_job_and_no_start(self):
        frame = os.path.join(self.take, self.frames[0]).encode()
        shutil.copy(self.image(0, 0), frame + b"/c\xff\xfe.png")
        self.start_daemon()
        job = self.submit()
        shown = weft("job", "show", job, *self.server, check=0).stdout
        self.assertIn("/c\\xff\\xfe.png: the name is not UTF-8 text", shown)
        self.assertIn("rename it", shown)
        self.kill_daemon()
        self.start_daemon()
        self.assert_done(job)


class FullDisk(Catalogue):
    """The state folder is a small file system of its own."""

    def setUp(self):
        super().setUp()
        os.mkdir(self.state)
        self.holder = subprocess.Popen(
            ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c",
             'mount -t tmpfs -o size=4m tmpfs "$0" && echo ready && exec sleep 100000', self.state],
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.addCleanup(self.end_holder)
        if self.holder.stdout.readline() != "ready\n":
            self.skipTest("no mount namespaces for this user")
        self.namespace = ["nsenter", "--target", str(self.holder.pid), "--user", "--mount", "--preserve-credentials"]
        self.inside = f"/proc/{self.holder.pid}/root{self.state}"

    def end_holder(self):
        self.kill_daemon()
        self.holder.kill()
        self.holder.communicate()

    def fill(self):
        """What is given back is taken again, until make_room."""
        self.is_full, filled = True, threading.Event()

        def take_all():
            with open(f"{self.inside}/filler", "wb", buffering=0) as file:
                while self.is_full:
                    for size in (65536, 4096):
                        try:
                            while True:
                                file.write(bytes(size))
                        except OSError:
                            pass
                    filled.set()
                    time.sleep(0.001)
        self.filler = threading.Thread(target=take_all)
        self.filler.start()
        self.addCleanup(self.stop_filling)
        filled.wait()

    def stop_filling(self):
        self.is_full = False
        self.filler.join()

    def make_room(self):
        self.stop_filling()
        os.remove(f"{self.inside}/filler")

    def test_a_job_that_ends_while_the_disk_is_full_is_done_once_there_is_room(self):
        self.start_daemon()
        job = self.submit()
        wait_for(lambda: self.job(job)["frames"]["running"], "a frame to run", pause_s=0.2)
        self.fill()
        wait_for(lambda: f"{job}: JOB_STATE_DONE" in self.log(), "the job's end", pause_s=0.2)
        time.sleep(1)  # in which it is written down, or not
        self.assertNotIn(self.job(job)["state"], ENDED)
        self.make_room()
        self.assert_done(job)
        # Also for a daemon that remembers nothing but what is on the disk.
        self.kill_daemon()
        self.start_daemon()
        self.assert_done(job)

    def test_a_restart_while_the_disk_is_full_is_not_held_against_the_job(self):
        self.start_daemon()
        job = self.submit()
        wait_for(lambda: self.job(job)["frames"]["running"], "a frame to run", pause_s=0.2)
        self.fill()
        self.kill_daemon()
        self.start_daemon()
        time.sleep(3)  # in which nothing may go wrong for good; the restart may have found some room itself
        self.assertNotEqual(self.job(job)["state"], "JOB_STATE_FAILED")
        self.make_room()
        self.assert_done(job)
        local = self.path("local")
        self.register(check=0, out=local)
        self.assertEqual(results(self.out), results(local))


class Damage(Catalogue):
    def finish_a_job(self):
        self.start_daemon()
        job = self.submit()
        self.assert_done(job)
        return job

    def test_an_emptied_catalogue_is_restored_and_said_so(self):
        job = self.finish_a_job()
        self.kill_daemon()
        os.truncate(self.catalogue(), 0)
        self.start_daemon()
        self.assert_done(job)
        listed = weft("job", "list", *self.server, check=0)
        self.assertIn(job, listed.stdout)
        self.assertIn("weft: warning: the list of jobs was damaged and is restored", listed.stderr)
        self.assertIn("the list of jobs was damaged and is restored", "".join(self.jobs()["warnings"]))
        self.assertIn(".damaged-", self.log())
        self.assertTrue(self.set_aside())

    def test_an_emptied_catalogue_without_log_is_restored_from_its_records(self):
        job = self.finish_a_job()
        self.kill_daemon(signal.SIGTERM)
        for name in (self.catalogue(), self.catalogue() + "-wal"):
            if os.path.exists(name):
                os.truncate(name, 0)
        self.start_daemon()
        self.assert_done(job)
        self.assertIn("from their records", "".join(self.jobs()["warnings"]))

    def test_random_damage_is_noticed_or_harmless(self):
        job = self.finish_a_job()
        self.kill_daemon(signal.SIGTERM)
        whole = read(self.catalogue(), "rb")
        chance = random.Random(1)
        for _ in range(6):
            bytes_of_it = bytearray(whole)
            for _ in range(20):
                bytes_of_it[chance.randrange(len(bytes_of_it))] ^= chance.randrange(1, 256)
            with open(self.catalogue(), "wb") as file:
                file.write(bytes_of_it)
            self.start_daemon()
            self.assert_done(job)
            shown = json.loads(weft("job", "show", job, *self.server, "--json", check=0).stdout)
            self.assertEqual([frame["frame"] for frame in shown["frames"]], self.frames)
            self.kill_daemon(signal.SIGTERM)

    def test_results_that_the_list_lacks_are_taken_up_again(self):
        self.start_daemon()
        # The daemon may not write to the client's folder, so the results lie in its own.
        with tempfile.TemporaryDirectory() as elsewhere:
            job = self.submit(out=elsewhere)
        self.assert_done(job)
        self.kill_daemon()
        for name in os.listdir(self.state):
            path = os.path.join(self.state, name)
            if name.startswith("catalogue.sqlite"):
                shutil.rmtree(path) if os.path.isdir(path) else os.remove(path)
        self.start_daemon()
        self.assert_done(job)
        self.assertIn("restored from their job.json", "".join(self.jobs()["warnings"]))


class Kills(Catalogue):
    def test_kills_of_the_daemon_count_against_no_frame(self):
        self.start_daemon()
        job = self.submit()
        for _ in range(4):
            wait_for(lambda: self.job(job)["frames"]["running"] or self.job(job)["state"] in ENDED, "a frame to run",
                     pause_s=0.2)
            self.kill_daemon()
            self.start_daemon()
        self.assert_done(job)


if __name__ == "__main__":
    unittest.main()
