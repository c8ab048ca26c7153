"""Jobs on a Slurm cluster of virtual nodes: the same bytes as on this machine, whatever happens to tasks, nodes and daemons.

Each class has a cluster of its own, and all run at once, since they mostly wait."""

import importlib.util
import json
import os
import signal
import subprocess
import sys
import tempfile
import unittest

from job_campaign import Studio, differing
from slurm_cluster import CLUSTER, why_no_cluster
from studio import LONG_S, processes_of, read, results, wait_for, weft, write

NODES = 4
ENDED = ("JOB_STATE_DONE", "JOB_STATE_FAILED", "JOB_STATE_CANCELLED")
# A worker that begins each task when it may, so that something can happen before, however slow the machine is.
HELD_WORKER = "#!/bin/sh\nuntil [ -e '{sign}' ]; do sleep 0.1; done\nexec {worker} \"$@\"\n"


def slurm(*command):
    return subprocess.run(command, capture_output=True, text=True, timeout=LONG_S, check=True).stdout


class SlurmStudio(Studio):
    """A daemon whose tasks run on the cluster of this namespace."""

    def start(self, *more, shared=None, frames_per_task=2):
        self.start_daemon("--slurm-folder", shared or os.path.join(self.folder, "shared"),
                          "--slurm-frames-per-task", str(frames_per_task), "--slurm-memory-mib", "1000", "--slurm-query-s", "1", *more)

    def kill_daemon(self):
        self.daemon.kill()
        self.daemon.wait()

    def job(self, job_id):
        return next(job for job in self.jobs() if job["id"] == job_id)

    def wait_for_end(self, job_id):
        return wait_for(lambda: (job := self.job(job_id))["state"] in ENDED and job, "the job to end", pause_s=0.5)

    def wait_for_message(self, job_id, words):
        wait_for(lambda: words in self.job(job_id).get("message", ""), f'"{words}" at the job', pause_s=0.5)

    def workers(self):
        return processes_of(self.folder, "weft-worker")

    def held_worker(self):
        path = os.path.join(self.folder, "held-worker")
        write(path, HELD_WORKER.format(sign=self.sign(), worker=os.path.join(os.environ["WEFT_BIN"], "weft-worker")))
        os.chmod(path, 0o755)
        return "--slurm-worker", path

    def sign(self):
        return os.path.join(self.folder, "go on")

    def let_go(self):
        write(self.sign(), "")

    def held_on(self, node):
        """Process ids of held workers there."""
        return [one for one in processes_of(self.folder, "sh") if f"\0SLURMD_NODENAME={node}\0" in read(f"/proc/{one}/environ")]


def make_take(folder):
    """A take, and what becomes of it without a cluster."""
    take = os.path.join(folder, "take")
    weft("simulate", "--preset", "tiny", "--frames", 16, "--cameras", 6, "--width-px", 128, "--height-px", 170,
         "--out", take, check=0)
    weft(*Studio(folder, take).register_arguments(), check=0)


class SlurmTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = os.environ["WEFT_SLURM_TAKE"]
        cls.take = os.path.join(folder, "take")
        cls.expected = results(Studio(folder, cls.take).out)

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="weft slurm ", ignore_cleanup_errors=True)
        self.addCleanup(folder.cleanup)
        self.studio = SlurmStudio(folder.name, self.take)
        self.addCleanup(self.leave)

    def leave(self):
        if self.studio.daemon and self.studio.daemon.poll() is None:
            self.studio.kill_daemon()
        subprocess.run(["scancel", "--user=root"], check=False, timeout=60)
        for node in range(1, NODES + 1):
            subprocess.run(["scontrol", "update", f"NodeName=w{node}", "State=resume"], check=False, timeout=60,
                           capture_output=True)
        self.wait_for_empty_cluster()

    def wait_for_empty_cluster(self):
        def empty():
            # A controller that has just been started may not answer yet.
            asked = subprocess.run(["squeue", "--noheader"], capture_output=True, text=True, check=False, timeout=60)
            return asked.returncode == 0 and not asked.stdout.strip()
        wait_for(empty, "an empty cluster", pause_s=0.5)

    def assert_done(self, job_id):
        job = self.studio.wait_for_end(job_id)
        self.assertEqual(job["state"], "JOB_STATE_DONE", json.dumps(job, indent=1))
        self.assertEqual(job["frames"]["done"], len(self.studio.frames))
        self.assertEqual(differing(results(self.studio.out), self.expected), [])
        return job

    def running(self):
        return slurm("squeue", "--noheader", "--states=running", "--format=%i").split()


class Results(SlurmTest):
    def test_one_node(self):
        self.studio.start("--slurm-option=--nodelist=w1")
        job = self.assert_done(self.studio.submit())
        usage = job["usage"]
        self.assertEqual(usage["tasks"], len(self.studio.frames) // 2)
        self.assertEqual(usage.get("tasks_lost", 0), 0)
        self.assertGreater(usage["core_s"], 0.1)
        self.assertGreater(usage["peak_memory_mib"], 10)
        self.assertIn("/shared/jobs/", job["task_logs"])

    def test_four_nodes(self):
        self.studio.start()
        self.assert_done(self.studio.submit())
        self.wait_for_empty_cluster()

    def test_logs_go_with_their_job(self):
        setup = os.path.join(self.studio.folder, "setup")
        write(setup, "echo a line of the log\n")
        self.studio.start("--slurm-setup", setup)
        job = self.assert_done(self.studio.submit())
        logs = [os.path.join(base, name) for base, _, names in os.walk(job["task_logs"]) for name in names]
        self.assertEqual(len(logs), len(self.studio.frames) // 2)
        self.assertEqual(read(logs[0]), "a line of the log\n")
        self.studio.kill_daemon()
        self.studio.start("--keep-jobs-days", "1e-7")
        wait_for(lambda: os.listdir(os.path.dirname(job["task_logs"])) == [], "the logs to go", pause_s=0.2)
        self.assertEqual(self.studio.jobs(), [])

    def test_nodes_see_other_paths(self):
        elsewhere = tempfile.mkdtemp(prefix="weft elsewhere ")
        self.addCleanup(os.rmdir, elsewhere)
        slurm("mount", "--bind", self.studio.folder, elsewhere)
        self.addCleanup(subprocess.run, ["umount", "--lazy", elsewhere], check=False)
        self.studio.start("--slurm-map-path", f"{self.studio.folder}={elsewhere}")
        job = self.assert_done(self.studio.submit())
        self.assertEqual(job["spec"]["out"], self.studio.out)

    def test_file_system_shows_files_late(self):
        if not importlib.util.find_spec("fusepy"):
            self.skipTest("python3-fusepy is not installed")
        nodes, here = os.path.join(self.studio.folder, "nodes"), os.path.join(self.studio.folder, "here")
        os.mkdir(nodes)
        os.mkdir(here)
        mirror = subprocess.Popen([sys.executable, os.path.join(os.path.dirname(__file__), "lagging_files.py"), nodes, here, "4"])
        self.addCleanup(mirror.wait)
        self.addCleanup(subprocess.run, ["umount", "--lazy", here], check=False)
        wait_for(lambda: os.path.ismount(here), "the mirror")
        self.studio.out = os.path.join(here, "out")
        self.studio.start("--slurm-map-path", f"{here}={nodes}", shared=os.path.join(here, "shared"))
        self.assert_done(self.studio.submit())


class Losses(SlurmTest):
    def test_tasks_killed_nodes_drained_and_downed_and_preempted(self):
        self.studio.start(*self.studio.held_worker())
        job_id = self.studio.submit()
        wait_for(lambda: len(self.running()) == NODES, "all nodes to work")
        os.kill(wait_for(lambda: self.studio.held_on("w4"), "a worker")[0], signal.SIGKILL)
        slurm("scontrol", "update", "NodeName=w1", "State=drain", "Reason=test")
        slurm("scontrol", "update", "NodeName=w2", "State=down", "Reason=test")
        wait_for(lambda: len(self.running()) >= 1, "the rest to go on")
        slurm("sbatch", "--partition=urgent", "--nodelist=w3", "--output=/dev/null", "--wrap", "sleep 1")
        self.studio.let_go()
        job = self.assert_done(job_id)
        told = "\n".join(job["warnings"])
        self.assertIn("node w2 failed", told)
        self.assertGreaterEqual(job["usage"]["tasks_lost"], 1)
        log = read(os.path.join(self.studio.folder, "weftd.log"))
        self.assertIn("killed by signal 9", log)

    def test_controller_restarted_and_daemon_killed(self):
        self.studio.start(*self.studio.held_worker())
        job_id = self.studio.submit()
        wait_for(lambda: len(self.running()) == NODES, "all nodes to work")
        state = os.environ["WEFT_SLURM_STATE"]
        os.kill(int(read(os.path.join(state, "slurmctld.pid"))), signal.SIGTERM)
        wait_for(lambda: subprocess.run(["scontrol", "ping"], capture_output=True, check=False, timeout=60).returncode
                 or b"DOWN" in subprocess.run(["scontrol", "ping"], capture_output=True, check=False, timeout=60).stdout,
                 "the controller to be away")
        self.studio.kill_daemon()
        self.studio.let_go()
        self.studio.start(*self.studio.held_worker())
        self.studio.wait_for_message(job_id, "Slurm does not answer")
        subprocess.run(["slurmctld", "-f", os.environ["SLURM_CONF"]], check=True, timeout=60)
        self.assert_done(job_id)
        self.wait_for_empty_cluster()

    def test_the_next_daemon_takes_up_running_tasks(self):
        self.studio.start(*self.studio.held_worker())
        job_id = self.studio.submit()
        wait_for(lambda: len(self.running()) == NODES, "all nodes to work")
        before = self.running()
        self.studio.kill_daemon()
        self.studio.start(*self.studio.held_worker())
        wait_for(lambda: "runs on" in read(os.path.join(self.studio.folder, "weftd.log")), "tasks to be taken up")
        self.assertEqual(self.running(), before)
        self.studio.let_go()
        job = self.assert_done(job_id)
        # One array, and each of its tasks once.
        self.assertEqual(job["usage"]["tasks"], len(self.studio.frames) // 2)
        arrays = slurm("squeue", "--noheader", "--states=all", f"--name=weft-{job_id}", "--array-unique", "--format=%F").split()
        self.assertEqual(len(set(arrays)), 1)

    def test_preempted_tasks_are_done_again(self):
        self.studio.start(*self.studio.held_worker())
        job_id = self.studio.submit()
        wait_for(lambda: len(self.running()) == NODES, "all nodes to work")
        slurm("sbatch", "--wait", "--partition=urgent", "--nodelist=w3", "--output=/dev/null", "--wrap", "sleep 1")
        self.studio.let_go()
        job = self.assert_done(job_id)
        self.assertIn("a job of higher priority took node w3", "\n".join(job["warnings"]))
        self.assertEqual(job["usage"]["tasks_lost"], 1)


class Limits(SlurmTest):
    def test_a_time_limit_before_the_first_frame_ends_the_job_and_retry_goes_on(self):
        self.studio.start(*self.studio.held_worker(), "--slurm-time-limit-min", "1")
        job_id = self.studio.submit()
        job = self.studio.wait_for_end(job_id)
        self.assertEqual(job["state"], "JOB_STATE_FAILED")
        self.assertIn("reached its time limit of 1 min before its first frame was done; raise --slurm-time-limit-min",
                      job["message"])
        self.studio.kill_daemon()
        self.studio.start()
        weft("job", "retry", "--server", self.studio.address, job_id, check=0)
        self.assert_done(job_id)

    def test_cancel_is_confirmed(self):
        self.studio.start(*self.studio.held_worker())
        job_id = self.studio.submit()
        wait_for(lambda: len(self.running()) == NODES, "all nodes to work")
        weft("job", "cancel", "--server", self.studio.address, job_id, check=0)
        self.assertEqual(self.studio.job(job_id)["state"], "JOB_STATE_CANCELLED")
        self.assertEqual(self.running(), [])


class Refusals(SlurmTest):
    def test_says_what_slurm_refuses(self):
        for options, words in ((["--slurm-partition", "closed"], "partition closed is down"),
                               (["--slurm-partition", "short", "--slurm-time-limit-min", "5"],
                                "lower --slurm-time-limit-min")):
            with self.subTest(words):
                self.studio.start(*options)
                job_id = self.studio.submit()
                self.studio.wait_for_message(job_id, words)
                weft("job", "cancel", "--server", self.studio.address, job_id, check=0)
                self.studio.kill_daemon()

    def test_an_unknown_partition_ends_the_job_and_retry_goes_on(self):
        self.studio.start("--slurm-partition", "nowhere")
        job_id = self.studio.submit()
        job = self.studio.wait_for_end(job_id)
        self.assertEqual(job["state"], "JOB_STATE_FAILED")
        self.assertIn("Invalid partition", job["message"])
        self.studio.kill_daemon()
        self.studio.start()
        weft("job", "retry", "--server", self.studio.address, job_id, check=0)
        self.assert_done(job_id)

    def test_waits_while_its_folder_is_full(self):
        shared = os.path.join(self.studio.folder, "shared")
        os.mkdir(shared)
        slurm("mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", shared)
        self.addCleanup(subprocess.run, ["umount", "--lazy", shared], check=False)
        write(os.path.join(shared, "ballast"), b"x" * 48000)
        self.studio.start()
        job_id = self.studio.submit()
        self.studio.wait_for_message(job_id, "waits until there is room")
        slurm("mount", "-o", "remount,size=64m", shared)
        self.assert_done(job_id)

    def test_copies_images_to_a_disk_of_the_node_and_waits_while_that_is_full(self):
        disk = tempfile.mkdtemp(prefix="weft scratch ")
        self.addCleanup(os.rmdir, disk)
        slurm("mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", disk)
        self.addCleanup(subprocess.run, ["umount", "--lazy", disk], check=False)
        copies = os.path.join(disk, "copies")
        # One long task, whose worker can be met at work.
        self.studio.start("--slurm-scratch", copies, "--slurm-scratch-mib", "1", frames_per_task=len(self.studio.frames))
        job_id = self.studio.submit()
        self.studio.wait_for_message(job_id, "make room on the disk (on node")
        self.assertIn(copies, self.studio.job(job_id)["message"])
        slurm("mount", "-o", "remount,size=16m", disk)

        def at_work():
            folders = [name for name in os.listdir(copies) if name.startswith("weft-scratch-")]
            return folders and self.studio.workers()
        # A worker that is killed leaves its copies, and a later one removes them.
        try:
            os.kill(wait_for(at_work, "a worker with copies", pause_s=0.005)[0], signal.SIGKILL)
        except ProcessLookupError:
            pass
        self.assert_done(job_id)
        self.wait_for_empty_cluster()
        self.assertEqual([name for name in os.listdir(copies) if name != "weft-scratch.lock"], [])


def run_in_clusters():
    """All tests, or those that the command line names; the worst exit status."""
    with tempfile.TemporaryDirectory(prefix="weft slurm ") as folder:
        make_take(folder)
        named = [[name] for name in sys.argv[1:] if not name.startswith("-")]
        flags = [name for name in sys.argv[1:] if name.startswith("-")]
        running = [subprocess.Popen([CLUSTER, "--nodes", str(NODES), "--cpus", "1", sys.executable, sys.argv[0], *flags, *names],
                                    env={**os.environ, "WEFT_SLURM_TAKE": folder})
                   for names in named or [[one.__name__] for one in SlurmTest.__subclasses__()]]
        return max(abs(one.wait()) for one in running)


if __name__ == "__main__":
    if why_no_cluster():
        print(f"skipped 'no cluster: {why_no_cluster()}'", file=sys.stderr)
    elif "WEFT_SLURM_STATE" in os.environ:
        unittest.main()
    else:
        sys.exit(run_in_clusters())
