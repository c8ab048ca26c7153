"""The Python client as its users install it: registrations by a daemon, results as arrays, the examples."""

import importlib.metadata
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import unittest

import numpy as np

import studio
from library_test import CuttingProxy
from python_client import EXAMPLES, PACKAGE, PYTHON, ClientTest, example, install, weft
from studio import read, results, write


class Package(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="weft package ")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def set_up(self, *words, **options):
        return subprocess.run([sys.executable, "setup.py", "--quiet", *words], cwd=PACKAGE, capture_output=True, text=True,
                              check=False, **options)

    def test_source_distribution_needs_nothing_else(self):
        done = self.set_up("sdist", "--dist-dir", self.folder)
        self.assertEqual(done.returncode, 0, done.stderr)
        archive, = os.listdir(self.folder)
        python = install(os.path.join(self.folder, archive), os.path.join(self.folder, "environment"))
        done = subprocess.run([python, "-c", "import weft; print(weft.v1.Job(id='a'))"], capture_output=True, text=True,
                              check=True)
        self.assertEqual(done.stdout, 'id: "a"\n\n')

    def test_says_what_generates_the_stubs_where_it_is_missing(self):
        done = self.set_up("build", "--build-base", self.folder, env={"PATH": self.folder})
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("protoc is missing", done.stderr)
        self.assertIn("protobuf-compiler-grpc", done.stderr)

    def test_has_types(self):
        done = subprocess.run(["/usr/bin/mypy", "--config-file", os.path.join(PACKAGE, "pyproject.toml"), "--python-executable",
                               PYTHON, "--cache-dir", self.folder, "-p", "weft"], cwd=self.folder, capture_output=True,
                              text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_examples_explain_themselves(self):
        names = sorted(name for name in os.listdir(EXAMPLES) if name.endswith(".py"))
        self.assertEqual(len(names), 4)
        for name in names:
            said = example(name, "--help").stdout
            self.assertIn("usage: " + name, said)
            self.assertIn("For example:", said)


class Registration(ClientTest):
    def test_by_upload_gives_what_weft_register_gives(self):
        self.start_daemon()
        client = self.client()
        self.assertEqual(client.server_info().version, importlib.metadata.version("weft"))
        self.assertEqual(list(client.rehearse_retention(ahead_days=1.0).steps), [])
        shares = []
        spec = client.jobs.upload_inputs(self.spec(), progress=lambda done, total: shares.append(done / total))
        self.assertEqual(max(shares), 1)
        self.assertTrue(spec.dump.startswith("library:sha256:"))
        spec.options.write_observations = True
        job = client.jobs.wait(client.jobs.submit(spec, priority=3).id)
        self.assertEqual((job.state, job.frames.done, job.priority), (weft.v1.JOB_STATE_DONE, 3, 3))
        client.jobs.fetch(job.id, self.out)
        local = self.path("local")
        self.register("--observations", check=0, out=local)
        expected = {name: data for name, data in results(local).items() if not name.endswith("unrefined.ply")}
        self.assertEqual(len(expected), 9)
        self.assertEqual(results(self.out), expected)
        self.assertEqual(studio.temporary_files(self.out), [])
        self.assertEqual(weft.read_job(f"{self.out}/job.json").verdict.grade, weft.v1.GRADE_GOOD)
        self.check_arrays(client, job.id)
        self.check_exports(client, job.id)
        self.check_damaged_files()

    def test_driven_by_an_uploaded_avatar_gives_meshes_one_after_another(self):
        motion, avatar = self.path("motion"), self.path("tube.avatar")
        studio.weft("simulate", "--preset", "tiny", "--frames", 12, "--no-pictures", "--out", motion, check=0)
        studio.weft("avatar", "train", motion, "--components", 2, "--out", avatar, check=0)
        self.start_daemon()
        client = self.client()
        cameras = [camera["id"] for camera in json.loads(read(f"{self.take}/rig.json"))["cameras"]][:4]
        driving = weft.v1.DrivingSpec(avatar=avatar, cameras=cameras)
        spec = client.jobs.upload_inputs(self.spec(driving=driving))
        self.assertEqual(spec.driving.avatar, f"library:sha256:{client.library.get('avatar', 'tube.avatar').id}")
        job = client.jobs.wait(client.jobs.submit(spec).id)
        self.assertEqual((job.state, list(job.driven.cameras)), (weft.v1.JOB_STATE_DONE, cameras))
        frames = []
        for frame, mesh in client.jobs.meshes(job.id):
            frames.append(frame.frame)
            truth = weft.read_mesh(f"{self.take}/truth/{frame.frame}/mesh.ply")
            self.assertLess(np.median(np.linalg.norm(mesh.vertices_mm - truth.vertices_mm, axis=1)), 2)
        self.assertEqual(frames, self.frames)
        with self.assertRaisesRegex(weft.InvalidArgument, "give the folder of the avatar"):
            client.library.upload("avatar", f"{avatar}/avatar.json")
        with self.assertRaises(weft.InvalidArgument) as refused:
            client.jobs.submit(self.spec(driving=weft.v1.DrivingSpec(cameras=cameras)))
        self.assertEqual(refused.exception.field, "spec.driving.avatar")

    def check_exports(self, client, job_id):
        """In every format, and over the pictures of the recording that was uploaded."""
        cameras = [camera["id"] for camera in json.loads(read(f"{self.take}/rig.json"))["cameras"]][:2]
        for options in ([{"format": name} for name in ("ply", "obj", "glb", "mdd", "pc2", "usda", "npz")] +
                        [{"format": "jpg", "overlay": "state", "camera": cameras}, {"format": "png", "texture": "128"}]):
            spec = weft.operation_spec("export", {"result": f"job:{job_id}"}, {**options, "fps": "50"}, "garment")
            operation = client.operations.wait(client.operations.start(spec).id)
            self.assertEqual((operation.state, operation.exit_status), (weft.v1.JOB_STATE_DONE, 0), operation)
            paths = client.operations.fetch(operation.id, self.path("exports", operation.id))
            manifest, = [weft.read_export(path) for path in paths if path.endswith("export.json")]
            self.assertEqual((manifest.format, manifest.fps, manifest.job_id), (options["format"], 50, job_id))
            self.assertEqual([frame.frame for frame in manifest.frames], self.frames)
            pictures = [path for path in paths if path.endswith(".jpg")]
            self.assertEqual(len(pictures), len(cameras) * len(self.frames) if "overlay" in options else 0)

    def check_arrays(self, client, job_id):
        frame = self.frames[0]
        mesh = client.jobs.mesh(job_id, frame)
        np.testing.assert_array_equal(mesh.vertices_mm, weft.read_mesh(f"{self.out}/{frame}/mesh.ply").vertices_mm)
        truth = weft.read_mesh(f"{self.take}/truth/{frame}/mesh.ply")
        np.testing.assert_array_equal(mesh.faces, truth.faces)
        error_mm = np.linalg.norm(mesh.vertices_mm - truth.vertices_mm, axis=1)
        self.assertLess(np.median(error_mm[mesh.observed]), 0.2)
        self.assertEqual(set(np.unique(mesh.state)), studio.vertex_states(f"{self.out}/{frame}/mesh.ply"))
        report, cloud = client.jobs.report(job_id, frame), client.jobs.cloud(job_id, frame)
        self.assertEqual(report.mesh.observed, mesh.observed.sum())
        self.assertEqual(report.cloud.centers + report.cloud.corners, len(cloud.positions_mm))
        np.testing.assert_allclose(np.trace(cloud.covariance_mm2, axis1=1, axis2=2), 3 * cloud.sigma_mm**2, rtol=1e-3)
        seen = client.jobs.observations(job_id, frame)
        self.assertEqual(sorted(seen.cameras), sorted(view.camera for view in report.views))
        self.assertEqual(len(seen.camera), sum(view.centers + view.corners for view in report.views))
        with self.assertRaises(weft.NotFound):
            client.jobs.mesh(job_id, "9999")

    def check_damaged_files(self):
        """Results that were cut are refused by name."""
        frame = os.path.join(self.out, self.frames[0])
        for name, reader in (("mesh.ply", weft.read_mesh), ("cloud.ply", weft.read_cloud), ("report.json", weft.read_report),
                             ("observations.csv", weft.read_observations)):
            data = read(f"{frame}/{name}", "rb")
            for size in range(0, len(data) - 40, len(data) // 20):
                cut = self.path(name)
                # A cut at the end of a line of CSV cannot be seen.
                write(cut, data[:size] + (b",," if name.endswith(".csv") else b""))
                with self.assertRaises(weft.FormatError, msg=(name, size)) as caught:
                    reader(cut)
                self.assertIn(name, str(caught.exception))

    def test_is_submitted_once_per_key(self):
        self.start_daemon("--allow-path", self.folder)
        client = self.client()
        first = client.jobs.submit(self.spec(), idempotency_key="one-and-the-same")
        again = client.jobs.submit(self.spec(), idempotency_key="one-and-the-same")
        self.assertEqual((first.id, again.id), ("one-and-the-same",) * 2)
        with self.assertRaises(weft.AlreadyExists) as caught:
            client.jobs.submit(self.spec(frames=self.frames[0]), idempotency_key="one-and-the-same")
        self.assertEqual(caught.exception.field, "idempotency_key")
        self.assertEqual(len(client.jobs.list().jobs), 1)
        client.jobs.cancel(first.id)
        self.assertEqual(client.jobs.wait(first.id).state, weft.v1.JOB_STATE_CANCELLED)
        client.jobs.retry(first.id)
        self.assertEqual(client.jobs.wait(first.id).state, weft.v1.JOB_STATE_DONE)

    def test_errors_have_category_field_and_remedy(self):
        self.start_daemon()
        client = self.client()
        for error, field, call in (
                (weft.PermissionDenied, "spec.dump", lambda: client.jobs.submit(self.spec())),
                (weft.InvalidArgument, "priority", lambda: client.jobs.submit(self.spec(), priority=1000)),
                (weft.InvalidArgument, "idempotency_key", lambda: client.jobs.submit(self.spec(), idempotency_key="A")),
                (weft.NotFound, "", lambda: client.jobs.get("nothing-here")),
                (weft.NotFound, "", lambda: list(client.jobs.watch("nothing-here"))),
                (weft.NotFound, "", lambda: client.takes.get("nothing-here")),
                (weft.PermissionDenied, "lease", lambda: client.sessions.renew("no-lease")),
                (weft.InvalidArgument, "spec.command", lambda: client.operations.start(weft.v1.OperationSpec(command="rm"))),
                (weft.NotFound, "", lambda: client.library.get("rig", "nobody")),
                (weft.NotFound, "", lambda: client.library.upload("rig", self.path("no rig.json")))):
            with self.assertRaises(error) as caught:
                call()
            self.assertEqual(caught.exception.field, field, caught.exception)
            if field and field != "spec.command":
                self.assertIn(caught.exception.remedy, str(caught.exception))
                self.assertTrue(caught.exception.remedy)
        write(self.path("rig.json"), '{"cameras": 3}')
        with self.assertRaisesRegex(weft.InvalidArgument, "rig.json.*cameras"):
            client.library.upload("rig", self.path("rig.json"))
        with self.assertRaises(weft.DeadlineExceeded):
            client.jobs.wait(self.long_job(client), timeout_s=0.2)

    def long_job(self, client):
        self.lengthen_take(30)
        return client.jobs.submit(client.jobs.upload_inputs(self.spec())).id

    def test_is_watched_across_restarts_of_the_daemon(self):
        self.start_daemon("--allow-path", self.folder)
        self.lengthen_take(12)
        client = self.client()
        job_id = client.jobs.submit(self.spec()).id
        watch = client.jobs.watch(job_id)
        done = {}

        def follow(until):
            for update in watch:
                done.update({frame.frame: frame.state for frame in update.frames})
                self.last = update.job
                if update.job.frames.done >= until:
                    return
        follow(1)
        self.end_daemon(signal.SIGKILL)
        self.start_daemon("--allow-path", self.folder)
        follow(3)
        self.end_daemon(signal.SIGTERM)
        restart = threading.Timer(1, self.start_daemon, ["--allow-path", self.folder])
        restart.start()
        self.addCleanup(restart.join)
        follow(12)
        follow(13)
        self.assertEqual(self.last.frames.done, 12)
        self.assertEqual(client.jobs.wait(job_id).state, weft.v1.JOB_STATE_DONE)
        self.assertEqual(set(done.values()), {weft.v1.FRAME_STATE_DONE})
        self.assertEqual(len(done), 12)

    def test_transfers_go_on_over_a_network_that_breaks(self):
        server = self.start_daemon(listen="127.0.0.1:0")
        rig, size = self.path("rig.json"), 12 << 20
        text = read(f"{self.take}/rig.json")
        write(rig, text + " " * (size - len(text)))
        proxy = CuttingProxy(server, 4 << 20)  # no connection carries all of it
        self.addCleanup(proxy.close)
        item = self.client(proxy.address).library.upload("rig", rig, name="studio")
        self.assertEqual((item.bytes, item.names[0].name), (size, "studio"))
        self.assertGreaterEqual(proxy.connections, 4)
        client = self.client(server)
        client.library.fetch("rig", "studio@1", self.path("back"))
        self.assertEqual(read(self.path("back", "rig.json")), read(rig))
        self.assertEqual(os.listdir(self.path("back")), ["rig.json"])
        self.assertEqual([len(client.library.list(kind).items) for kind in ("", "rig", "dump")], [1, 1, 0])
        self.assertTrue(client.library.delete("rig", "studio@1").content_deleted)


class Examples(ClientTest):
    def test_register_evaluate_and_plot(self):
        self.start_daemon()
        inputs = [self.take, "--rig", f"{self.take}/rig.json", "--board", f"{self.take}/board.json", "--template",
                  f"{self.take}/template", "--out", self.out, "--server", self.socket]
        self.assertIn("spec.dump", example("submit_and_fetch.py", *inputs, check=1).stderr)
        said = example("submit_and_fetch.py", *inputs, "--upload", "--evaluate").stdout
        self.assertIn("3 of 3 frames", said)
        self.assertRegex(said, f"frame {self.frames[2]}: [0-9]+ vertices, [89][0-9].[0-9]% of them measured")
        picture = self.path("coverage.png")
        evaluation = f"{self.out}/evaluation/evaluation.json"
        said = example("plot_coverage.py", self.out, "--evaluation", evaluation, "--out", picture).stdout
        self.assertRegex(said, r"coverage.png: 3 frames, coverage 9\d\.\d% to 9\d\.\d%")
        self.assertEqual(read(picture, "rb")[:8], b"\x89PNG\r\n\x1a\n")
        # The same meshes beside their truth, as `weft evaluate --avatar --meshes` writes them.
        for frame in self.frames[:2]:
            os.makedirs(self.path(f"meshes/{frame}"))
            shutil.copy(f"{self.out}/{frame}/mesh.ply", self.path(f"meshes/{frame}/mesh.ply"))
            shutil.copy(f"{self.take}/truth/{frame}/mesh.ply", self.path(f"meshes/{frame}/truth.ply"))
        picture = self.path("driving.png")
        self.assertIn("driving.png: 2 frames", example("watch_driving.py", self.path("meshes"), "--out", picture).stdout)
        self.assertEqual(read(picture, "rb")[:8], b"\x89PNG\r\n\x1a\n")
        os.mkdir(self.path("empty"))
        self.assertIn("no frame has a truth.ply", example("watch_driving.py", self.path("empty"), check=1).stderr)
        self.assertIn("no frame has a report.json", example("plot_coverage.py", self.path("empty"), check=1).stderr)
        shutil.copy(f"{self.take}/rig.json", f"{self.out}/{self.frames[0]}/report.json")
        self.assertIn("report.json", example("plot_coverage.py", self.out, check=1).stderr)

    def test_first_script_of_the_readme_works(self):
        self.start_daemon()
        script = read(os.path.join(PACKAGE, "README.md")).split("```python\n")[1].split("```")[0]
        place = "unix:/var/lib/weft/weftd.sock"
        self.assertIn(place, script)
        os.rename(self.take, self.path("recording"))
        done = subprocess.run([PYTHON, "-c", script.replace(place, self.socket)], cwd=self.folder, capture_output=True, text=True,
                              timeout=studio.LONG_S, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("3 of 3", done.stdout)
        self.assertRegex(done.stdout, r"\(\d+, 3\) 0\.[89]")


if __name__ == "__main__":
    unittest.main()
