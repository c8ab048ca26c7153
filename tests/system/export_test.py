"""`weft export`: every format, read by other readers than our own; stopped, resumed and refused exports."""

import json
import os
import shutil
import signal
import subprocess
import time
import unittest

import numpy as np
from export_readers import Glb, Usda, meshes_of, read_mdd, read_obj, read_pc2, read_ply, xyz
from studio import BIN, LONG_S, StudioTest, read, tiny_studio, weft, write

Y_UP = np.diag([1.0, -1.0, -1.0])
Z_UP = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
FLOAT_STEPS = 2.0**-23  # of positions, which are single precision
CHECK_IN_BLENDER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "import_in_blender.py")


class Export(StudioTest):
    """One result for all tests."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.result = os.path.join(tiny_studio(), "result")
        cls.names = sorted(name for name in os.listdir(cls.result) if name.isdigit())
        cls.meshes = meshes_of(cls.result, cls.names)
        cls.world_mm = np.array([xyz(mesh["vertex"]) for mesh in cls.meshes])

    def setUp(self):
        super().setUp()
        self.to = self.path("export")

    def export(self, form, *more, result=None, check=0):
        return weft("export", result or self.result, "--format", form, "--out", self.to, *more, check=check)

    def manifest(self):
        return json.loads(read(os.path.join(self.to, "export.json")))

    def changed_result(self):
        folder = self.path("result")
        shutil.copytree(self.result, folder)
        return folder

    def assert_positions(self, exported, rotation, unit_per_mm=1e-3, steps=2):
        expected = unit_per_mm * self.world_mm @ rotation.T
        self.assertEqual(exported.shape, expected.shape)
        self.assertLessEqual(np.abs(exported - expected).max(), steps * FLOAT_STEPS * np.abs(expected).max())

    def files(self):
        return {name: read(os.path.join(self.to, name), "rb") for name in sorted(os.listdir(self.to))}


class Formats(Export):
    def test_ply_carries_everything(self):
        self.export("ply", "--fps", "50")
        tables = [read_ply(os.path.join(self.to, f"{name}.ply")) for name in self.names]
        self.assert_positions(np.array([xyz(table["vertex"]) for table in tables]), Z_UP)
        velocity = xyz(tables[1]["vertex"], ["vx", "vy", "vz"])
        expected = (self.world_mm[2] - self.world_mm[0]) / 2 * 50 * 1e-3 @ Z_UP.T
        np.testing.assert_allclose(velocity, expected, atol=1e-4)
        for table, mesh in zip(tables, self.meshes):
            np.testing.assert_array_equal(table["vertex"]["state"], mesh["vertex"]["state"])
            np.testing.assert_array_equal(table["vertex"]["views"], mesh["vertex"]["views"])
            np.testing.assert_allclose(table["vertex"]["sigma"], 1e-3 * mesh["vertex"]["sigma_mm"], rtol=1e-6)
            np.testing.assert_array_equal(table["face"]["vertex_indices"], mesh["face"]["vertex_indices"])
            np.testing.assert_array_equal(table["vertex"]["s"], mesh["vertex"]["s"])
        seen = np.mean([(mesh["vertex"]["state"] == 1) | (mesh["vertex"]["state"] == 2) for mesh in self.meshes], axis=0)
        np.testing.assert_allclose(tables[0]["vertex"]["coverage"], seen, rtol=1e-6)

    def test_obj_has_texture_coordinates(self):
        self.export("obj", "--unit", "cm")
        positions, faces, uv = zip(*[read_obj(os.path.join(self.to, f"{name}.obj")) for name in self.names])
        self.assert_positions(np.array(positions), Y_UP, 0.1)
        np.testing.assert_array_equal(faces[0], self.meshes[0]["face"]["vertex_indices"])
        self.assert_uv(uv[0])

    def assert_uv(self, corners):
        mesh = self.meshes[0]
        of_vertex = np.column_stack([mesh["vertex"]["s"], mesh["vertex"]["t"]])[mesh["face"]["vertex_indices"]]
        expected = mesh["face"]["texcoord"].reshape(-1, 3, 2) if "texcoord" in mesh["face"].dtype.names else of_vertex
        np.testing.assert_allclose(corners, expected, atol=1e-7)

    def test_glb_moves_by_morph_targets(self):
        self.export("glb", "--fps", "50")
        glb = Glb(os.path.join(self.to, "garment.glb"))
        vertices = self.world_mm.shape[1]
        self.assert_positions(glb.frames()[:, :vertices], Y_UP)
        np.testing.assert_allclose(glb.times_s(), np.arange(3) / 50, rtol=1e-6)
        self.assertEqual(glb.json["meshes"][0]["extras"]["targetNames"], self.names[1:])
        faces = glb.array(glb.primitive["indices"]).reshape(-1, 3)
        uv = glb.attribute("TEXCOORD_0") * [1, -1] + [0, 1]
        self.assert_uv(uv[faces])
        if "_VERTEX" in glb.primitive["attributes"]:
            origin = glb.attribute("_VERTEX").astype(int)
            np.testing.assert_array_equal(origin[:vertices], np.arange(vertices))
            np.testing.assert_array_equal(origin[faces], self.meshes[0]["face"]["vertex_indices"])
            self.assertEqual(self.manifest()["vertices_in_file"], len(origin))
        for target in [glb.primitive["attributes"], *glb.primitive["targets"]]:
            accessor = glb.json["accessors"][target["POSITION"]]
            values = glb.array(target["POSITION"])
            np.testing.assert_array_equal(accessor["min"], values.min(axis=0).astype(np.float64))
            np.testing.assert_array_equal(accessor["max"], values.max(axis=0).astype(np.float64))

    def test_point_caches_move_the_mesh_beside_them(self):
        self.export("mdd", "--fps", "50")
        times, positions = read_mdd(os.path.join(self.to, "garment.mdd"))
        self.assert_positions(positions, Y_UP)
        np.testing.assert_allclose(times, np.arange(3) / 50, rtol=1e-6)
        base, faces, _ = read_obj(os.path.join(self.to, "garment.obj"))
        np.testing.assert_allclose(base, positions[0], rtol=1e-6)
        np.testing.assert_array_equal(faces, self.meshes[0]["face"]["vertex_indices"])
        shutil.rmtree(self.to)
        self.export("pc2", "--unit", "mm", "--up", "z")
        self.assert_positions(read_pc2(os.path.join(self.to, "garment.pc2")), Z_UP, 1)

    def test_usda_has_time_samples(self):
        self.export("usda", "--fps", "50", "--unit", "cm", "--up", "z")
        usd = Usda(os.path.join(self.to, "garment.usda"))
        self.assertEqual((float(usd.setting("metersPerUnit")), usd.setting("upAxis"), float(usd.setting("timeCodesPerSecond"))),
                         (0.01, "Z", 50))
        points = usd.samples("points", 3)
        self.assertEqual(sorted(points), [0, 1, 2])
        self.assert_positions(np.array([points[time] for time in sorted(points)]), Z_UP, 0.1)
        self.assertEqual(len(usd.samples("velocities", 3)[1]), self.world_mm.shape[1])
        np.testing.assert_array_equal(usd.samples("primvars:state", 1)[2].ravel(), self.meshes[2]["vertex"]["state"])
        np.testing.assert_allclose(usd.samples("primvars:sigma", 1)[0].ravel(), 0.1 * self.meshes[0]["vertex"]["sigma_mm"],
                                   rtol=1e-6)
        np.testing.assert_array_equal(usd.values(r"faceVertexIndices").reshape(-1, 3), self.meshes[0]["face"]["vertex_indices"])
        self.assert_uv(usd.values("primvars:st").reshape(-1, 3, 2))

    def test_npz_is_read_by_numpy(self):
        self.export("npz", "--fps", "50", "--unit", "mm", "--world-up", "y")
        with np.load(os.path.join(self.to, "garment.npz")) as arrays:
            self.assert_positions(arrays["positions"].astype(np.float64), np.eye(3), 1)
            self.assertEqual(list(arrays["frames"]), self.names)
            np.testing.assert_allclose(arrays["times_s"], np.arange(3) / 50)
            np.testing.assert_allclose(arrays["export_from_world"], np.eye(4))
            for name, column in (("state", "state"), ("sigma", "sigma_mm"), ("views", "views")):
                np.testing.assert_array_equal(arrays[name], [mesh["vertex"][column] for mesh in self.meshes])
            np.testing.assert_array_equal(arrays["faces"], self.meshes[0]["face"]["vertex_indices"])
            self.assert_uv(arrays["uv"])
            self.assertEqual(arrays["velocities"].shape, self.world_mm.shape)
            self.assertFalse(arrays["bridged"].any())

    def test_assimp_reads_what_it_knows(self):
        if not shutil.which("assimp"):
            self.skipTest("assimp is not installed")
        for form, name in (("ply", f"{self.names[0]}.ply"), ("obj", f"{self.names[0]}.obj"), ("glb", "garment.glb")):
            self.to = self.path(form)
            self.export(form, "--fps", "50")
            told = subprocess.run(["assimp", "info", os.path.join(self.to, name)], capture_output=True, text=True,
                                  timeout=LONG_S, check=True).stdout
            self.assertRegex(told, rf"Faces: +{len(self.meshes[0]['face'])}\n", form)

    def test_blender_shows_the_same_positions(self):
        if not shutil.which("blender"):
            self.skipTest("blender is not installed")
        for form in ("ply", "obj", "glb", "mdd", "pc2"):
            self.to = self.path(form)
            self.export(form, "--fps", "50")
        done = subprocess.run(["blender", "--background", "--factory-startup", "--python-exit-code", "1", "--python",
                               CHECK_IN_BLENDER, "--", self.folder, *self.names], capture_output=True, text=True,
                              timeout=LONG_S, check=False)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        expected = 1e-3 * self.world_mm @ Z_UP.T
        extent = np.ptp(expected, axis=(0, 1)).max()
        for form in ("ply", "obj", "glb", "mdd", "pc2"):
            shown = np.load(self.path(f"{form}.npy"))
            self.assertLess(np.abs(shown[:, :expected.shape[1]] - expected).max(), 1e-6 * extent, form)


class Manifest(Export):
    def test_tells_transform_frames_and_states(self):
        self.export("glb", "--fps", "25")
        manifest = self.manifest()
        self.assertEqual((manifest["transform"]["up"], manifest["transform"]["unit"], manifest["fps"]), ("y", "m", 25))
        matrix = np.array(manifest["transform"]["export_from_world"]).reshape(4, 4)
        np.testing.assert_allclose(matrix[:3, :3], 1e-3 * Y_UP)
        self.assertEqual([frame["frame"] for frame in manifest["frames"]], self.names)
        self.assertTrue(all(frame["state"] == "FRAME_STATE_DONE" and frame["coverage"] > 0.5 for frame in manifest["frames"]))
        self.assertEqual(manifest["files"], ["garment.glb"])

    def test_rate_is_that_of_the_take(self):
        self.export("mdd")
        self.assertIn("pictures.csv", self.manifest()["fps_source"])
        folder = self.changed_result()
        job = json.loads(read(f"{folder}/job.json"))
        job["spec"]["dump"] = "/nowhere"
        write(f"{folder}/job.json", json.dumps(job))
        self.to = self.path("other")
        refused = self.export("mdd", result=folder, check=2)
        self.assertIn("--fps", refused.stderr)
        without = self.export("npz", result=folder)
        self.assertIn("Velocities are left out", without.stderr)
        self.assertNotIn("velocity", self.manifest()["attributes"])

    def test_gaps_and_bridged_frames_are_marked(self):
        folder = self.changed_result()
        for name, bridged in ((self.names[1], False), (self.names[2], True)):
            report = json.loads(read(f"{folder}/{name}/report.json"))
            report["state"], report["reason"] = "FRAME_STATE_FAILED", "too dark"
            report["temporal"]["bridged"] = bridged
            write(f"{folder}/{name}/report.json", json.dumps(report))
        told = self.export("mdd", "--fps", "50", result=folder)
        self.assertIn("too dark", told.stderr)
        self.assertIn("1 bridged, 1 without a mesh", told.stdout)
        _, positions = read_mdd(os.path.join(self.to, "garment.mdd"))
        np.testing.assert_array_equal(positions[1], positions[0])
        frames = self.manifest()["frames"]
        self.assertEqual(frames[1]["repeats"], self.names[0])
        self.assertTrue(frames[2]["bridged"])
        self.to = self.path("glb")
        self.export("glb", "--fps", "50", result=folder)
        np.testing.assert_allclose(Glb(os.path.join(self.to, "garment.glb")).times_s(), [0, 2 / 50], rtol=1e-6)


class Refusals(Export):
    def test_unfinished_jobs(self):
        folder = self.changed_result()
        job = json.loads(read(f"{folder}/job.json"))
        job["state"] = "JOB_STATE_RUNNING"
        write(f"{folder}/job.json", json.dumps(job))
        refused = self.export("ply", result=folder, check=2)
        self.assertIn("has not ended", refused.stderr)
        self.assertIn("--allow-unfinished", refused.stderr)
        self.assertFalse(os.path.exists(self.to))
        self.export("ply", "--allow-unfinished", result=folder)
        self.assertIn("has not ended", self.manifest()["notes"][0])

    def test_meshes_that_changed(self):
        folder = self.changed_result()
        path = f"{folder}/{self.names[1]}/mesh.ply"
        write(path, read(path, "rb")[:-1] + b"\1")
        self.assertIn("is not as report.json lists it", self.export("ply", result=folder, check=1).stderr)

    def test_folders_of_other_exports(self):
        self.export("ply")
        again = self.export("ply")
        self.assertIn("complete already", again.stdout)
        self.assertIn("another export", self.export("ply", "--unit", "mm", check=2).stderr)

    def test_words_that_say_what_is_wrong(self):
        self.assertIn("no such file", self.export("ply", result=self.path("nothing"), check=2).stderr)
        self.assertIn("does not carry velocity", self.export("obj", "--attributes", "velocity", check=2).stderr)
        self.assertIn("by its specification", self.export("glb", "--up", "z", check=2).stderr)
        self.assertIn("frames 9:12", self.export("ply", "--frames", "9:12", check=2).stderr)

    def test_small_disks(self):
        if os.geteuid() != 0:
            self.skipTest("not root, who alone can mount a small disk")
        os.mkdir(self.to)
        if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "weft-export", self.to], capture_output=True,
                          check=False).returncode:
            self.skipTest("no small disk can be mounted here")
        self.addCleanup(subprocess.run, ["umount", self.to], check=True)
        refused = self.export("npz", "--fps", "50", check=1)
        self.assertRegex(refused.stderr, r"needs up to [\d.]+ MB, [\d.]+ MB are free")
        self.assertEqual(os.listdir(self.to), [])


class Interrupted(Export):
    """A long result: the frames of the short one again and again."""

    def setUp(self):
        super().setUp()
        self.long = self.changed_result()
        job = json.loads(read(f"{self.long}/job.json"))
        job["last_frame"] = "0299"
        write(f"{self.long}/job.json", json.dumps(job))
        self.pictures = self.path("pictures")
        os.mkdir(self.pictures)
        for i in range(300):
            os.symlink(f"{self.original}/{self.names[i % 3]}", f"{self.pictures}/{i:04}")
            if i > 2:
                shutil.copytree(f"{self.long}/{self.names[i % 3]}", f"{self.long}/{i:04}")

    def test_export_goes_on_with_the_same_bytes(self):
        texture = ("--texture", "256", "--texture-frames", "2", "--take", self.pictures)
        for form, *more in (("ply",), ("glb",), ("glb", *texture), ("usda",), ("npz",), ("mdd",)):
            self.to = self.path(f"{form}_whole" + "".join(more[:1]))
            self.export(form, "--fps", "50", *more, result=self.long)
            whole = self.files()
            self.to = self.path(f"{form}_parts" + "".join(more[:1]))
            stopped = 0
            for number in (signal.SIGTERM, signal.SIGKILL, signal.SIGTERM):
                process = subprocess.Popen([os.path.join(BIN, "weft"), "export", self.long, "--format", form, "--fps", "50",
                                            *more, "--out", self.to], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
                deadline = time.monotonic() + LONG_S
                while process.poll() is None and not os.path.exists(self.to) and time.monotonic() < deadline:
                    time.sleep(0.005)
                time.sleep(0.1)
                process.send_signal(number)
                stopped += process.wait(LONG_S) != 0
            self.assertGreater(stopped, 0, form)
            self.export(form, "--fps", "50", *more, result=self.long)
            self.assertEqual(self.files(), whole, form)


if __name__ == "__main__":
    unittest.main()
