"""`weft export` of pictures: overlays, videos and textures."""

import json
import os
import shutil
import signal
import subprocess
import time
import unittest

import numpy as np
from export_test import Y_UP, Export
from matplotlib.image import imread
from studio import BIN, LONG_S, read, write


def vertex_normals(positions, faces):
    corners = positions[faces]
    normals = np.zeros_like(positions)
    for k in range(3):
        np.add.at(normals, faces[:, k], np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


class Pictures(Export):
    def test_show_the_mesh_where_the_cloth_is(self):
        camera = json.loads(read(f"{self.original}/rig.json"))["cameras"][0]["id"]
        for what in ("wireframe", "state", "sigma"):
            self.to = self.path(what)
            told = self.export("png", "--overlay", what, "--camera", camera)
            self.assertIn(f"{what} over the pictures of 1 cameras, 3 frames", told.stdout)
            self.assertEqual(sorted(os.listdir(os.path.join(self.to, camera))), [f"{name}.png" for name in self.names])
        self.assertEqual(self.manifest()["overlay"], "sigma")
        self.assertGreater(self.manifest()["overlay_sigma_mm"], 0)
        self.assertIn("complete already", self.export("png", "--overlay", "sigma", "--camera", camera).stdout)

    def test_undistorted_pictures_have_a_rig_of_their_own(self):
        rig = json.loads(read(f"{self.original}/rig.json"))["cameras"]
        first, second = rig[0]["id"], rig[1]["id"]
        told = self.export("png", "--overlay", "none", "--undistort", "--camera", first, "--camera", second)
        self.assertIn("the pictures of 2 cameras, undistorted, 3 frames", told.stdout)
        self.assertEqual((self.manifest()["overlay"], self.manifest()["files"]), ("none, undistorted", [first, second, "rig.json"]))
        straight = json.loads(read(f"{self.to}/rig.json"))["cameras"]
        self.assertEqual([camera["id"] for camera in straight], [first, second])
        for camera, lens in zip(straight, rig):
            self.assertFalse(any(camera["distortion"]))
            self.assertEqual((camera["fx_px"], camera["fy_px"]), (lens["fx_px"], lens["fx_px"]))
            self.assertEqual(camera["rotation"], lens["rotation"])
        # Not bent nor stretched, the pictures alone are those of the recording.
        self.to = self.path("alone")
        self.export("png", "--overlay", "none", "--camera", first)
        alone = imread(os.path.join(self.to, first, f"{self.names[0]}.png"))
        np.testing.assert_array_equal(alone, imread(f"{self.original}/{self.names[0]}/{first}.png")[..., :3])
        self.assertIn("say with --overlay what is drawn over them", self.export("jpg", check=2).stderr)
        self.assertIn("--undistort requires --overlay", self.export("png", "--undistort", check=2).stderr)

    def test_pictures_that_are_missing_are_named(self):
        camera = json.loads(read(f"{self.original}/rig.json"))["cameras"][0]["id"]
        os.remove(os.path.join(self.take, self.names[1], f"{camera}.png"))
        told = self.export("jpg", "--overlay", "state", "--take", self.take, "--camera", camera)
        self.assertIn(f"Frame {self.names[1]}, camera {camera}", told.stderr)
        self.assertEqual(len(os.listdir(os.path.join(self.to, camera))), 2)

    @unittest.skipUnless(shutil.which("ffmpeg"), "ffmpeg is not installed")
    def test_videos_show_every_frame_set(self):
        cameras = [camera["id"] for camera in json.loads(read(f"{self.original}/rig.json"))["cameras"]][:2]
        folder = self.changed_result()
        report = json.loads(read(f"{folder}/{self.names[1]}/report.json"))
        report["state"], report["reason"], report["temporal"]["bridged"] = "FRAME_STATE_FAILED", "too dark", False
        write(f"{folder}/{self.names[1]}/report.json", json.dumps(report))
        options = ["--overlay", "wireframe", "--camera", cameras[0], "--camera", cameras[1]]
        self.assertIn("--fps", self.export("mp4", *options, result=self.without_times(), check=2).stderr)
        told = self.export("mkv", *options, "--fps", 10, result=folder)
        self.assertIn("wireframe over the pictures of 2 cameras, 2 frames", told.stdout)
        self.assertEqual(self.manifest()["files"], [f"{camera}.mkv" for camera in cameras])
        pictures = self.frames_of_video(os.path.join(self.to, f"{cameras[0]}.mkv"))
        plain = imread(f"{self.original}/{self.names[1]}/{cameras[0]}.png")[..., :3] * 255
        self.assertEqual(pictures.shape, (3, *plain.shape))
        # The frame without a mesh shows the picture alone; lines of the others are cyan.
        self.assertLess(np.abs(pictures[1] - plain).mean(), 6)  # colours of single pixels are averaged
        cyan = (pictures[..., 0] < 80) & (pictures[..., 1] > 170) & (pictures[..., 2] > 170)
        self.assertTrue(cyan[0].mean() > 0.02 and cyan[2].mean() > 0.02, cyan.mean(axis=(1, 2)))
        self.assertGreater(cyan[0].mean(), 4 * cyan[1].mean())

    def without_times(self):
        folder = self.path("timeless")
        shutil.copytree(self.result, folder)
        job = json.loads(read(f"{folder}/job.json"))
        job["spec"]["dump"] = "/nowhere"
        write(f"{folder}/job.json", json.dumps(job))
        return folder

    @staticmethod
    def frames_of_video(path):
        told = subprocess.run(["ffprobe", "-v", "error", "-show_entries", "stream=width,height", "-of", "csv=p=0", path],
                              capture_output=True, text=True, timeout=LONG_S, check=True).stdout
        width, height = map(int, told.split(","))
        raw = subprocess.run(["ffmpeg", "-v", "error", "-i", path, "-f", "rawvideo", "-pix_fmt", "rgb24", "pipe:1"],
                             capture_output=True, timeout=LONG_S, check=True).stdout
        return np.frombuffer(raw, np.uint8).reshape(-1, height, width, 3).astype(np.float32)

    def test_stopped_videos_go_on_camera_by_camera(self):
        if not shutil.which("ffmpeg"):
            self.skipTest("ffmpeg is not installed")
        whole, self.to = self.path("whole"), self.path("whole")
        self.export("mp4", "--overlay", "sigma", "--fps", "50")
        self.to = self.path("parts")
        process = subprocess.Popen([os.path.join(BIN, "weft"), "export", self.result, "--format", "mp4", "--overlay", "sigma",
                                    "--fps", "50", "--out", self.to], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        deadline = time.monotonic() + LONG_S
        while time.monotonic() < deadline and not (os.path.isdir(self.to) and any(
                name.endswith(".mp4") for name in os.listdir(self.to))):
            time.sleep(0.005)
        process.send_signal(signal.SIGTERM)
        self.assertNotEqual(process.wait(LONG_S), 0)
        self.assertFalse(os.path.exists(os.path.join(self.to, "export.json")))
        self.export("mp4", "--overlay", "sigma", "--fps", "50")
        names = sorted(os.listdir(whole))
        self.assertEqual(sorted(os.listdir(self.to)), names)
        for name in names:
            self.assertEqual(read(os.path.join(self.to, name), "rb"), read(os.path.join(whole, name), "rb"), name)

    def test_textures_show_the_board(self):
        told = self.export("png", "--texture", 512)
        self.assertIn("textures of 512 px, 3 frames", told.stdout)
        manifest = self.manifest()
        self.assertEqual([frame["file"] for frame in manifest["frames"]], [f"{name}.png" for name in self.names])
        texture, board = imread(os.path.join(self.to, f"{self.names[1]}.png")), imread(f"{self.original}/board.png")
        rows, cols = board.shape[:2]
        middle = texture[(512 * (np.arange(rows)[:, None] + 0.5) / rows).astype(int),
                         (512 * (np.arange(cols) + 0.5) / cols).astype(int)]
        seen = middle[..., 3] > 0
        self.assertGreater(seen.mean(), 0.9)
        # The inks are not the board's pure colours, and light is uneven; one cell aside nothing is alike.
        for aside, low, high in ((0, 0.6, 1), (1, -0.2, 0.2)):
            print_there = np.roll(board, aside, axis=1)[seen][:, :3]
            alike = np.corrcoef(middle[seen][:, :3].ravel(), print_there.ravel())[0, 1]
            self.assertTrue(low < alike < high, alike)
        self.assertIn("--format png", self.export("jpg", "--texture", 512, check=2).stderr)

    def test_normal_maps_hold_what_the_coarser_mesh_lacks(self):
        size, coarse = 256, ("--max-vertices", 60)
        told = self.export("png", "--normal-map", size, *coarse)
        self.assertRegex(told.stdout, r"normal maps of 256 px for \d\d vertices, 3 frames")
        frame = self.manifest()["frames"][1]
        self.assertEqual((frame["normal_map"], frame["file"]), (f"{self.names[1]}.normal.png", ""))
        map_ = imread(os.path.join(self.to, frame["normal_map"])) * 2 - 1
        self.to = self.path("coarse")
        self.export("npz", "--unit", "mm", "--fps", 50, *coarse)
        read_ = np.load(os.path.join(self.to, "garment.npz"))
        np.testing.assert_allclose(read_["positions"], (self.world_mm @ Y_UP.T)[:, read_["template_vertex"]], rtol=1e-6)
        fine = self.world_mm[1] @ Y_UP.T
        shown, plain, expected = [], [], vertex_normals(fine, self.meshes[1]["face"]["vertex_indices"])
        base, faces, uv = read_["positions"][1].astype(float), read_["faces"], read_["uv"].astype(float)
        base_normals = vertex_normals(base, faces)
        places = np.column_stack([self.meshes[1]["vertex"]["s"], self.meshes[1]["vertex"]["t"]]).astype(float)
        vertices = []
        for face, corners in zip(faces, uv):
            edges = np.column_stack([corners[1] - corners[0], corners[2] - corners[0]])
            if np.linalg.det(edges) == 0:
                continue  # three vertices of a straight hem: nothing of the print is in it
            into = np.linalg.inv(edges)
            weights = (places - corners[0]) @ into.T
            inside = np.flatnonzero((weights >= 0).all(axis=1) & (weights.sum(axis=1) <= 1))
            weights = np.column_stack([1 - weights[inside].sum(axis=1), weights[inside]])
            normal = weights @ base_normals[face]
            normal /= np.linalg.norm(normal, axis=1, keepdims=True)
            along_u = np.column_stack([base[face[1]] - base[face[0]], base[face[2]] - base[face[0]]]) @ into[:, 0]
            tangent = along_u - (normal @ along_u)[:, None] * normal
            tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
            side = np.sign(np.linalg.det(into))  # of a print that is mirrored
            x, y = (places[inside] * size).astype(int).clip(0, size - 1).T
            red, green, blue = map_[size - 1 - y, x].T[..., None]
            shown.extend(red * tangent + green * side * np.cross(normal, tangent) + blue * normal)
            plain.extend(normal)
            vertices.extend(inside)
        expected = expected[vertices]
        off = [np.degrees(np.arccos(np.clip((np.array(these) * expected).sum(axis=1)
                                            / np.linalg.norm(these, axis=1), -1, 1))) for these in (plain, shown)]
        self.assertGreater(np.median(off[0]), 3)
        self.assertLess(np.median(off[1]), 0.3 * np.median(off[0]))
        self.assertIn("--max-vertices", self.export("png", "--normal-map", 64, check=2).stderr)
        self.assertIn("--normal-map", self.export("png", "--texture", 64, *coarse, check=2).stderr)
        self.assertIn("choose fewer", self.export("png", "--normal-map", 64, "--max-vertices", 10**6, check=2).stderr)

    def test_say_what_they_need(self):
        self.assertIn("--format jpg or png", self.export("ply", "--overlay", "state", check=2).stderr)
        self.assertIn("wireframe, state, sigma", self.export("jpg", check=2).stderr)
        self.assertIn("the rig has no camera c99", self.export("jpg", "--overlay", "state", "--camera", "c99", check=2).stderr)


if __name__ == "__main__":
    unittest.main()
