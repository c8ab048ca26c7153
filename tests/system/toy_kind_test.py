"""A kind of work that no file of the product names, tests/services/work/kinds/toy: what one file gives it."""

import base64
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest

from browser import why_no_browser
from console_studio import ConsoleDaemon
from slurm_cluster import run_in_cluster, why_no_cluster
from studio import page_data, processes_of, read, wait_for, weft, write

FRAMES = [f"{number:04}" for number in range(6)]
MESH = """ply
format ascii 1.0
element vertex 3
property double x
property double y
property double z
element face 1
property list uchar int vertex_indices
end_header
0 0 0
{} 0 0
0 9 0
3 0 1 2
"""


def make_result(folder):
    for number, frame in enumerate(FRAMES, 1):
        os.makedirs(os.path.join(folder, frame))
        write(os.path.join(folder, frame, "mesh.ply"), MESH.format(number))


def copies(folder):
    return [frame for frame in sorted(os.listdir(folder)) if os.path.exists(os.path.join(folder, frame, "mesh.ply"))]


def report_of(folder, frame):
    return json.loads(read(os.path.join(folder, frame, "report.json")))


def state_of(folder, frame):
    """What the copying knew after a unit: how many meshes it had copied."""
    return base64.b64decode(report_of(folder, frame)["unit"]["state"]).decode()


class KindTest(ConsoleDaemon, unittest.TestCase):
    def setUp(self):
        super().setUp()
        self.source, self.out = self.path("from"), self.path("out")
        make_result(self.source)

    def begin(self, *more):
        super().begin(*more)
        self.server = ["--server", self.addresses[0]]

    def copy(self, *more, check=0):
        return weft("copy-meshes", self.source, "--out", self.out, *more, check=check)

    def job(self, job_id):
        return json.loads(weft("job", "show", job_id, "--json", *self.server, check=0).stdout)["job"]

    def wait_for_copies(self, count):
        wait_for(lambda: os.path.isdir(self.out) and len(copies(self.out)) >= count, f"{count} copies", pause_s=0.05)


class Command(KindTest):
    def test_copies_and_resumes(self):
        said = self.copy("--every", "2")
        self.assertIn("3 of 3 frames done", said.stdout)
        self.assertEqual(copies(self.out), FRAMES[::2])
        self.assertEqual(state_of(self.out, "0004"), "3")
        self.assertNotIn("kept", self.copy().stderr)  # an option has another value
        self.assertEqual(copies(self.out), FRAMES)
        os.remove(os.path.join(self.out, "0003", "mesh.ply"))
        said = self.copy().stderr
        self.assertEqual(said.count("kept from an earlier run"), len(FRAMES) - 1)
        self.assertEqual(copies(self.out), FRAMES)

    def test_makes_two_meshes_that_export_finds_by_name(self):
        self.copy("--mirror")
        meshes = report_of(self.out, "0002")["meshes"]
        self.assertEqual([(mesh["name"], mesh["file"], mesh["vertices"]) for mesh in meshes],
                         [("garment", "mesh.ply", 3), ("mirror", "mirror.ply", 3)])
        self.assertNotEqual(*(mesh["topology_hash"] for mesh in meshes))  # its faces are turned

        def export(*more, check=0):
            shutil.rmtree(self.path("obj"), ignore_errors=True)
            return weft("export", self.out, "--format", "obj", "--unit", "mm", "--world-up", "y", "--out", self.path("obj"), *more,
                        check=check).stderr

        self.assertIn('no frame has a mesh "hat"; there are garment, mirror', export("--mesh", "hat", check=2))
        export("--mesh", "mirror", "--frames", "0002")
        manifest = json.loads(read(self.path("obj/export.json")))
        self.assertEqual((manifest["mesh"], manifest["vertices"]), ("mirror", 3))
        changed = report_of(self.out, "0003")
        changed["meshes"][1]["topology_hash"] = "0" * 16
        write(os.path.join(self.out, "0003", "report.json"), json.dumps(changed))
        self.assertIn("frame 0003: its mesh mirror has other vertices or faces than that of frame 0002",
                      export("--mesh", "mirror", check=2))
        os.remove(os.path.join(self.out, "0001", "mirror.ply"))
        self.assertEqual(self.copy("--mirror").stderr.count("kept from an earlier run"), len(FRAMES) - 1)

    def test_goes_on_after_a_kill(self):
        program = os.path.join(os.environ["WEFT_BIN"], "weft")
        running = subprocess.Popen([program, "copy-meshes", self.source, "--out", self.out, "--pause-ms", "300"],
                                   stderr=subprocess.DEVNULL)
        self.addCleanup(running.kill)
        self.wait_for_copies(2)
        running.kill()
        running.wait()
        said = self.copy("--pause-ms", "300").stderr
        self.assertGreaterEqual(said.count("kept from an earlier run"), 1)
        self.assertEqual(state_of(self.out, FRAMES[-1]), str(len(FRAMES)))

    def test_explains_itself_and_its_faults(self):
        said = weft("copy-meshes", "--help", check=0).stdout
        for words in ("Folder of meshes, or a job (job:ID)", "--every", "One mesh in so many", "weft copy-meshes result --out result"):
            self.assertIn(words, said)
        self.assertIn("copy-meshes", weft("--help", check=0).stdout)
        self.assertIn("give a whole number from 1 to 1000", self.copy("--every", "0", check=2).stderr)
        self.assertIn("result is required", weft("copy-meshes", "--out", self.out, check=2).stderr)
        self.assertIn("holds no <frame>/mesh.ply", weft("copy-meshes", self.path(), "--out", "/tmp/weft-none", check=2).stderr)

    def test_other_programs_do_not_know_it(self):
        plain = os.path.join(os.environ["WEFT_PRODUCT_BIN"], "weft")
        done = subprocess.run([plain, "copy-meshes", self.source], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 2)


class Daemon(KindTest):
    def test_is_asked_for_watched_and_fetched(self):
        self.begin()
        said = self.copy("--every", "3", *self.server)
        self.assertIn("2 of 2 frames done", said.stdout)
        self.assertEqual(copies(self.out), FRAMES[::3])
        job_id = self.copy("--detach", *self.server).stdout.strip()
        watched = weft("job", "watch", job_id, *self.server, check=0)
        self.assertIn("6 of 6 frames copied", watched.stdout + watched.stderr)
        again = self.path("fetched")
        weft("job", "fetch", job_id, "--out", again, *self.server, check=0)
        self.assertEqual(copies(again), FRAMES)
        self.assertFalse(os.path.exists(os.path.join(again, FRAMES[0], "mirror.ply")))
        job_of_two = self.copy("--detach", "--mirror", *self.server).stdout.strip()
        weft("job", "watch", job_of_two, *self.server, check=0)
        weft("job", "fetch", job_of_two, "--out", self.path("both"), *self.server, check=0)
        for frame in FRAMES:
            for name in ("mesh.ply", "mirror.ply"):
                self.assertEqual(read(os.path.join(self.path("both"), frame, name), "rb"), read(os.path.join(self.out, frame, name), "rb"))
        # Its results are what the next one reads.
        weft("copy-meshes", f"job:{job_id}", "--out", self.path("second"), *self.server, check=0)
        self.assertEqual(copies(self.path("second")), FRAMES)
        page = page_data(os.path.join(self.path("second"), "report.html"))["job"]
        self.assertEqual(page["job"]["spec"]["work"]["kind"], "copy meshes")

    def test_is_cancelled_and_retried(self):
        self.begin()
        job_id = self.copy("--detach", "--pause-ms", "1500", *self.server).stdout.strip()
        self.wait_for_copies(2)
        weft("job", "cancel", job_id, *self.server, check=0)
        self.assertEqual(self.job(job_id)["state"], "JOB_STATE_CANCELLED")
        self.assertLess(len(copies(self.out)), len(FRAMES))
        weft("job", "retry", job_id, *self.server, check=0)
        weft("job", "watch", job_id, *self.server, check=0)
        self.assertEqual(state_of(self.out, FRAMES[-1]), str(len(FRAMES)))

    def test_goes_on_after_kills_of_the_daemon_and_of_a_worker(self):
        self.begin()
        job_id = self.copy("--detach", "--pause-ms", "300", *self.server).stdout.strip()
        self.wait_for_copies(1)
        self.kill_daemon()
        self.begin()
        self.wait_for_copies(3)
        for worker in processes_of(self.folder, "weft-worker"):
            os.kill(worker, signal.SIGKILL)
        weft("job", "watch", job_id, *self.server, check=0)
        job = self.job(job_id)
        self.assertEqual(job["state"], "JOB_STATE_DONE", job)
        self.assertEqual(job["frames"]["done"], len(FRAMES))
        self.assertEqual(state_of(self.out, FRAMES[-1]), str(len(FRAMES)))

    def test_refuses_what_is_wrong_and_what_is_closed(self):
        self.begin()
        self.assertIn("lies outside the folders", weft("copy-meshes", "/etc", "--out", self.out, *self.server, check=2).stderr)
        self.assertIn("state", weft("copy-meshes", self.path("state"), "--out", self.out, *self.server, check=2).stderr)

    def test_a_program_that_knows_the_kind_no_more_says_so(self):
        self.begin()
        job_id = self.copy("--detach", "--pause-ms", "3000", *self.server).stdout.strip()
        self.wait_for_copies(1)
        self.kill_daemon()
        log = open(self.path("plain.log"), "w")
        self.addCleanup(log.close)
        address = self.path("plain-address")
        plain = subprocess.Popen([os.path.join(os.environ["WEFT_PRODUCT_BIN"], "weftd"), "--listen", "127.0.0.1:0", "--state",
                                  self.path("state"), "--allow-path", self.folder, "--address-file", address], stderr=log)
        self.addCleanup(plain.wait)
        self.addCleanup(plain.kill)
        self.server = ["--server", wait_for(lambda: os.path.exists(address) and read(address).strip(), "an address")]
        ended = wait_for(lambda: (job := self.job(job_id))["state"] == "JOB_STATE_FAILED" and job, "the end")
        self.assertIn('"copy meshes" is none that this version of Weft does', ended["message"])


class Python(KindTest):
    def test_finds_the_kind_and_runs_it(self):
        self.begin()
        from python_client import PYTHON
        script = self.path("script.py")
        write(script, """
import os, sys, weft
server, source, folder = sys.argv[1:]
with weft.Client(server) as client:
    kind, = [kind for kind in client.jobs.kinds() if kind.name == "copy meshes"]
    assert [option.name for option in kind.options] == ["every", "mirror", "pause-ms"], kind
    job = client.jobs.submit(weft.work_spec(kind.name, {"result": source}, {"every": "2", "mirror": ""}))
    assert client.jobs.wait(job.id, 60).state == weft.v1.JOB_STATE_DONE
    print([(frame.frame, float(mesh.vertices_mm[1, 0])) for frame, mesh in client.jobs.meshes(job.id)])
    print([float(mesh.vertices_mm[1, 0]) for _, mesh in client.jobs.meshes(job.id, "mirror")])
    client.jobs.fetch(job.id, folder)
    print(sorted(os.listdir(os.path.join(folder, "0002"))))
    try:
        client.jobs.mesh(job.id, "0000", "hat")
    except weft.NotFound as error:
        print(error)
    try:
        client.jobs.submit(weft.work_spec("knit", {}))
    except weft.InvalidArgument as error:
        print(error)
""")
        said = subprocess.run([PYTHON, script, self.addresses[0], self.source, self.path("both")], capture_output=True, text=True, check=False)
        self.assertEqual(said.returncode, 0, said.stderr)
        meshes, mirrored, fetched, no_hat, refused = said.stdout.splitlines()
        self.assertEqual(fetched, "['mesh.ply', 'mirror.ply', 'report.json']")
        self.assertEqual(mirrored, "[-1.0, -3.0, -5.0]")
        self.assertIn('no frame has a mesh "hat"; there are garment, mirror', no_hat)
        self.assertEqual(meshes, "[('0000', 1.0), ('0002', 3.0), ('0004', 5.0)]")
        self.assertIn('spec.work.kind: "knit"', refused)
        self.assertIn("copy meshes", refused)


@unittest.skipIf(why_no_browser(), "no browser")
class Console(KindTest):
    def test_has_a_form(self):
        self.begin()
        page = self.browser(expected=["401"])
        self.log_in(page, self.token("anna", "operator"))
        page.press("g", "j")
        page.role("button", "Copy meshes")
        page.fill("Folder of meshes, or a job (job:ID)", self.source)
        page.fill("One mesh in so many", "2")
        self.look(page, "kind-form")
        page.role("button", "Copy")
        page.see("3 of 3 done")
        page.see("copy meshes: ", "h1")
        self.look(page, "kind-job")
        page.press("g", "j")
        page.see("copy meshes: ", "a.row")


@unittest.skipIf(why_no_cluster(), "no cluster")
class Slurm(KindTest):
    def test_runs_on_a_cluster(self):
        if "WEFT_SLURM_STATE" not in os.environ:
            done = run_in_cluster([sys.executable, __file__, "Slurm"], nodes=2, env={**os.environ, "TMPDIR": tempfile.gettempdir()})
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            return
        self.begin("--slurm-folder", self.path("shared"), "--slurm-frames-per-task", "2", "--slurm-memory-mib", "500",
                   "--slurm-query-s", "1")
        job_id = self.copy("--detach", *self.server).stdout.strip()
        weft("job", "watch", job_id, *self.server, check=0)
        job = self.job(job_id)
        self.assertEqual(job["state"], "JOB_STATE_DONE", job)
        self.assertEqual(job["usage"]["tasks"], 1)  # units follow each other
        self.assertEqual(state_of(self.out, FRAMES[-1]), str(len(FRAMES)))


if __name__ == "__main__":
    unittest.main()
