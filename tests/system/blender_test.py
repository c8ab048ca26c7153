"""The Blender add-on: the garment and the cameras that it shows, against the files of the result."""

import json
import os
import shutil
import subprocess
import unittest

import numpy as np
from export_readers import meshes_of, xyz
from studio import LONG_S, StudioTest, read, weft, write

ADD_ON = os.path.join(os.environ["WEFT_SOURCE"], "clients", "blender", "weft_blender.py")
Z_UP = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
LOOK = """
import importlib.util, sys
import bpy, numpy as np
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Vector
spec = importlib.util.spec_from_file_location("weft_blender", ADD_ON)
weft_blender = importlib.util.module_from_spec(spec)
spec.loader.exec_module(weft_blender)
weft_blender.register()
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.weft_result(filepath=RESULT + "/job.json", fps=50, bake=BAKE, color="sigma_mm")
garment, scene = bpy.data.objects["garment"], bpy.context.scene
found = {}
for i, frame in enumerate(range(scene.frame_start, scene.frame_end + 1)):
    scene.frame_set(frame)
    mesh = garment.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    values = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    mesh.vertices.foreach_get("co", values)
    found[f"positions{i}"] = values.reshape(-1, 3)
    for name in ("state", "sigma_mm", "views", "coverage"):
        attribute = garment.data.attributes[name]
        values = np.empty(len(mesh.vertices), dtype=np.float32 if attribute.data_type == "FLOAT" else np.int32)
        attribute.data.foreach_get("value", values)
        found[f"{name}{i}"] = values
    if not BAKE:
        values = np.empty(3 * len(mesh.vertices), dtype=np.float32)
        garment.data.attributes["velocity"].data.foreach_get("vector", values)
        found[f"velocity{i}"] = values.reshape(-1, 3)
camera = bpy.data.objects[CAMERA]
scene.camera = camera
scene.render.resolution_x, scene.render.resolution_y = camera["resolution_px"]
scene.frame_set(scene.frame_start)
seen = [world_to_camera_view(scene, camera, Vector(p)) for p in found["positions0"].tolist()]
found["pixels"] = [(s.x * scene.render.resolution_x - 0.5, (1 - s.y) * scene.render.resolution_y - 0.5) for s in seen]
found["rate"] = scene.render.fps / scene.render.fps_base
found["materials"] = [m.name for m in garment.data.materials]
found["uv_layers"] = len(garment.data.uv_layers)
found["start"] = scene.frame_start
bpy.ops.import_scene.weft_result(filepath=RESULT + "/job.json")
found["cameras"] = [thing.name for thing in bpy.data.objects if thing.type == "CAMERA"]
if SAVE:
    bpy.ops.wm.save_as_mainfile(filepath=SAVE)
np.savez(OUT, **found)
"""
DRESSED = """
import importlib.util, json
import bpy
spec = importlib.util.spec_from_file_location("weft_blender", ADD_ON)
weft_blender = importlib.util.module_from_spec(spec)
spec.loader.exec_module(weft_blender)
weft_blender.register()
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.weft_result(filepath=RESULT + "/job.json", pictures=PICTURES, printed=PRINT, color="print")
scene, garment = bpy.context.scene, bpy.data.objects["garment"]
shown = []
for frame in range(scene.frame_start, scene.frame_end + 1):
    scene.frame_set(frame)
    for camera in (thing.data for thing in bpy.data.objects if thing.type == "CAMERA"):
        for background in camera.background_images:
            shown.append(background.image.filepath_from_user(image_user=background.image_user))
material = garment.data.materials[garment.data.polygons[0].material_index]
printed = [node.image.filepath for node in material.node_tree.nodes if node.type == "TEX_IMAGE"]
lenses = {thing.name: list(thing["distortion"]) for thing in bpy.data.objects if thing.type == "CAMERA"}
with open(OUT, "w") as file:
    json.dump({"shown": shown, "material": material.name, "printed": printed, "lenses": lenses}, file)
"""
# In a file that was opened without the add-on.
REOPENED = """
import bpy, numpy as np
bpy.context.scene.frame_set(FRAME)
values = np.empty(3 * len(bpy.data.objects["garment"].data.vertices), dtype=np.float32)
bpy.data.objects["garment"].data.vertices.foreach_get("co", values)
np.save(OUT, values.reshape(-1, 3))
"""


@unittest.skipUnless(shutil.which("blender"), "blender is not installed")
class AddOn(StudioTest):
    def setUp(self):
        super().setUp()
        self.register(check=0)
        self.meshes = meshes_of(self.out, self.frames)

    def blender(self, *arguments, check=0):
        done = subprocess.run(["blender", "--background", "--factory-startup", "--python-exit-code", "1", *arguments],
                              capture_output=True, text=True, timeout=LONG_S, check=False)
        self.assertEqual(done.returncode, check, done.stdout + done.stderr)
        return done

    def look(self, baked, save=""):
        script, out = self.path("look.py"), self.path("look.npz")
        camera = json.loads(read(f"{self.take}/rig.json"))["cameras"][3]
        write(script, f"ADD_ON, RESULT, OUT, BAKE, CAMERA, SAVE = {(ADD_ON, self.out, out, baked, camera['id'], save)!r}\n" + LOOK)
        self.blender("--python", script)
        with np.load(out) as arrays:
            return dict(arrays), camera

    def assert_positions(self, found):
        for i, mesh in enumerate(self.meshes):
            expected = 1e-3 * xyz(mesh["vertex"]) @ Z_UP.T
            self.assertLess(np.abs(found[f"positions{i}"] - expected).max(), 1e-6 * np.ptp(expected, axis=0).max())

    def test_frames_have_their_positions_and_attributes(self):
        found, camera = self.look(baked=False)
        self.assert_positions(found)
        observed = np.mean([(m["vertex"]["state"] == 1) | (m["vertex"]["state"] == 2) for m in self.meshes], axis=0)
        for i, mesh in enumerate(self.meshes):
            for name in ("state", "sigma_mm", "views"):
                np.testing.assert_array_equal(found[f"{name}{i}"], mesh["vertex"][name])
            np.testing.assert_allclose(found[f"coverage{i}"], observed, rtol=1e-6)
        self.assertEqual(list(found["materials"]), ["Weft state", "Weft sigma_mm", "Weft coverage"])
        self.assertEqual((found["rate"], found["uv_layers"]), (50, 1))
        self.assert_pixels(found["pixels"], camera)
        # As exports begin; 50 frames a second; metres a second between the frames before and after.
        self.assertEqual(found["start"], 0)
        places = [1e-3 * xyz(mesh["vertex"]) @ Z_UP.T for mesh in self.meshes]
        for i in range(len(places)):
            before, after = max(i - 1, 0), min(i + 1, len(places) - 1)
            expected = 50 * (places[after] - places[before]) / max(after - before, 1)
            np.testing.assert_allclose(found[f"velocity{i}"], expected, atol=1e-4)
        # A second import leaves one of each camera.
        self.assertEqual(len(found["cameras"]), len(json.loads(read(f"{self.take}/rig.json"))["cameras"]))

    def test_pictures_are_behind_the_cameras_and_a_print_on_the_garment(self):
        script, out, pictures = self.path("dressed.py"), self.path("dressed.json"), self.path("backgrounds")
        weft("export", self.out, "--format", "png", "--overlay", "none", "--undistort", "--out", pictures)
        board = os.path.join(self.take, "board.png")
        write(script, f"ADD_ON, RESULT, OUT, PICTURES, PRINT = {(ADD_ON, self.out, out, pictures, board)!r}\n" + DRESSED)
        self.blender("--python", script)
        found = json.loads(read(out))
        cameras = [camera["id"] for camera in json.loads(read(f"{self.take}/rig.json"))["cameras"]]
        self.assertEqual(sorted(found["shown"]),
                         sorted(os.path.join(pictures, camera, f"{name}.png") for camera in cameras for name in self.frames))
        self.assertEqual((found["material"], found["printed"]), ("Weft print", [board]))
        self.assertFalse(any(any(lens) for lens in found["lenses"].values()))
        # Beside a take whose pictures are elsewhere.
        refused = self.blender("--python", ADD_ON, "--", self.out, "--pictures", self.take, check=1)
        self.assertIn("weft export RESULT --format jpg --overlay none --undistort", refused.stderr)

    def assert_pixels(self, pixels, camera):
        """The camera of Blender is that of the rig without distortion."""
        rotation = np.array(camera["rotation"]).reshape(3, 3)
        seen = xyz(self.meshes[0]["vertex"]) @ rotation.T + camera["translation_mm"]
        expected = seen[:, :2] / seen[:, 2:] * [camera["fx_px"], camera["fx_px"]] + [camera["cx_px"], camera["cy_px"]]
        self.assertLess(np.abs(pixels - expected).max(), 0.02)

    def test_baked_frames_need_no_result(self):
        found, _ = self.look(baked=True)
        self.assert_positions(found)
        # Attributes are those of all frames, not of the first.
        sigma_mm = np.mean([mesh["vertex"]["sigma_mm"] for mesh in self.meshes], axis=0)
        np.testing.assert_allclose(found["sigma_mm0"], sigma_mm, rtol=1e-5)

    def test_a_saved_file_moves_without_the_add_on(self):
        saved, script, out = self.path("saved.blend"), self.path("reopened.py"), self.path("reopened.npy")
        self.look(baked=False, save=saved)
        last = len(self.meshes) - 1
        write(script, f"FRAME, OUT = {last}, {out!r}\n" + REOPENED)
        self.blender("--enable-autoexec", saved, "--python", script)
        expected = 1e-3 * xyz(self.meshes[last]["vertex"]) @ Z_UP.T
        self.assertLess(np.abs(np.load(out) - expected).max(), 1e-6)

    def test_works_from_a_shell(self):
        done = self.blender("--python", ADD_ON, "--", self.out, "--save", self.path("garment.blend"))
        self.assertIn(f"frames 0 to {len(self.frames) - 1}", done.stdout)
        self.assertGreater(os.path.getsize(self.path("garment.blend")), 10000)
        os.remove(os.path.join(self.out, "job.json"))
        refused = self.blender("--python", ADD_ON, "--", self.out, check=1)
        self.assertIn("job.json: no such file", refused.stdout + refused.stderr)


if __name__ == "__main__":
    unittest.main()
