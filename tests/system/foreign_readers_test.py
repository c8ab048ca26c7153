"""`weft export`: what programs of others read, attributes that Blender drops among them."""

import io
import json
import os
import shutil
import unittest

import numpy as np
from export_readers import read_ply
from export_test import FLOAT_STEPS, Y_UP, Z_UP, Export
from foreign_readers import in_assimp, in_node, meshopt_allowance, why_no_node
from matplotlib.image import imread
from studio import read

EXTENT_SHARE = 1e-6


class Foreign(Export):
    def exported(self, form, *more, name=None):
        self.to = self.path(name or form)
        self.export(form, "--fps", "50", *more)
        return os.path.join(self.to, f"{self.names[0]}.{form}" if form in ("ply", "obj") else f"garment.{form}")

    def expected(self, rotation):
        return 1e-3 * self.world_mm @ rotation.T

    def assert_within(self, read, expected):
        self.assertEqual(read.shape, expected.shape)
        extent = np.ptp(expected.reshape(-1, 3), axis=0).max()
        self.assertLess(np.abs(read - expected).max(), EXTENT_SHARE * extent)

    def corners_uv(self):
        mesh = self.meshes[0]
        if "texcoord" in mesh["face"].dtype.names:
            return mesh["face"]["texcoord"].reshape(-1, 3, 2)
        return np.column_stack([mesh["vertex"]["s"], mesh["vertex"]["t"]])[mesh["face"]["vertex_indices"]]


@unittest.skipIf(why_no_node(), why_no_node())
class Node(Foreign):
    def assert_valid(self, path):
        told = in_node("validate", path, self.path("told"))
        self.assertEqual((told["errors"], told["warnings"]), (0, 0), told["messages"])

    def test_three_plays_plain_glb(self):
        path = self.exported("glb")
        self.assert_valid(path)
        read = in_node("gltf", path, self.path("read"))
        np.testing.assert_allclose(read["times"], np.arange(3) / 50, rtol=1e-6)
        self.assert_attributes(read)
        expected = self.expected(Y_UP)
        self.assert_within(read["positions"][:, :expected.shape[1]], expected)

    def assert_attributes(self, read):
        origin = read["_vertex"].ravel().astype(int) if "_vertex" in read else np.arange(len(read["position"]))
        faces, order = origin[read["faces"]], np.arange(3)
        # Compression may begin a face at another of its corners.
        order = (order + np.argmax(faces == self.meshes[0]["face"]["vertex_indices"][:, :1], axis=1)[:, None]) % 3
        np.testing.assert_array_equal(np.take_along_axis(faces, order, 1), self.meshes[0]["face"]["vertex_indices"])
        uv = np.take_along_axis(read["uv"][read["faces"]], order[..., None], 1)
        np.testing.assert_allclose(uv * [1, -1] + [0, 1], self.corners_uv(), atol=1e-6)
        seen = np.mean([np.isin(mesh["vertex"]["state"], (1, 2)) for mesh in self.meshes], axis=0)
        np.testing.assert_allclose(read["_coverage"].ravel(), seen[origin], rtol=1e-6)
        states = np.array([mesh["vertex"]["state"] for mesh in self.meshes])
        usual = np.argmax([(states == state).sum(axis=0) for state in range(4)], axis=0)
        np.testing.assert_array_equal(read["_state"].ravel(), usual[origin])
        sigma_mm = np.mean([mesh["vertex"]["sigma_mm"] for mesh in self.meshes], axis=0)
        np.testing.assert_allclose(read["_sigma_mm"].ravel(), sigma_mm[origin], rtol=1e-6)

    def test_three_plays_normals(self):
        for form in ([], ["--meshopt"]):
            path = self.exported("glb", "--attributes", "uv,normal", *form, name="normals" + "".join(form))
            self.assert_valid(path)
            read = in_node("gltf", path, self.path("read"))
            corners = self.expected(Y_UP)[:, self.meshes[0]["face"]["vertex_indices"]]  # [frames, faces, 3, 3]
            of_face = np.cross(corners[:, :, 1] - corners[:, :, 0], corners[:, :, 2] - corners[:, :, 0])
            normals = np.zeros((3, self.world_mm.shape[1], 3))
            for frame in range(3):
                for k in range(3):
                    np.add.at(normals[frame], self.meshes[0]["face"]["vertex_indices"][:, k], of_face[frame])
            normals /= np.linalg.norm(normals, axis=2, keepdims=True)
            np.testing.assert_allclose(read["normals"][:, :normals.shape[1]], normals, atol=1e-4)
            self.assertNotIn("_state", read)

    def test_three_shows_the_texture_that_a_glb_holds(self):
        self.to = self.path("alone")
        camera = ("--camera", json.loads(read(f"{self.original}/rig.json"))["cameras"][0]["id"])
        self.export("png", "--texture", "256", "--frames", self.names[0], *camera)
        alone = imread(os.path.join(self.to, f"{self.names[0]}.png"))
        seen = alone[..., 3] == 1
        for form in ([], ["--meshopt"]):
            path = self.exported("glb", "--texture", "256", "--texture-frames", "1", *camera, *form, name="textured" + "".join(form))
            self.assert_valid(path)
            told = in_node("gltf", path, self.path("read"))
            self.assertTrue(told["has_texture"])
            picture = imread(io.BytesIO(told["picture"].astype(np.uint8).tobytes()))
            self.assertEqual(picture.shape, (256, 256, 3))
            np.testing.assert_array_equal(picture[seen], alone[seen][:, :3])
            self.assertGreater(picture[~seen].min(), 0)  # what no camera sees is filled
            self.assert_attributes(told)
            self.assert_within(told["positions"][:1, :self.world_mm.shape[1]], self.expected(Y_UP)[:1])
            self.assertEqual(self.manifest()["texture_frames"], self.names[:1])
        self.assertIn("--format png", self.export("obj", "--texture", 64, check=2).stderr)
        self.assertIn("needs uv", self.export("glb", "--texture", 64, "--attributes", "none", "--fps", 50, check=2).stderr)

    def test_three_shows_a_normal_map_on_a_coarser_mesh(self):
        self.to = self.path("maps")
        coarse = ("--max-vertices", "60", "--normal-map", "128", "--frames", self.names[1])
        self.export("png", *coarse)
        alone = imread(os.path.join(self.to, f"{self.names[1]}.normal.png"))
        for form in ([], ["--meshopt"]):
            path = self.exported("glb", *coarse, *form, name="mapped" + "".join(form))
            self.assert_valid(path)
            told = in_node("gltf", path, self.path("read"))
            self.assertEqual((told["has_texture"], told["has_normal_map"]), (False, True))
            np.testing.assert_array_equal(imread(io.BytesIO(told["picture"].astype(np.uint8).tobytes())), alone)
            vertices = told["_vertex"].ravel().astype(int)
            self.assertLessEqual(len(set(vertices)), 60)
            self.assert_within(told["position"], self.expected(Y_UP)[1][vertices])
            self.assertEqual(told["normal"].shape, told["position"].shape)  # without it faces would be flat
            along = (told["normal"] * told["tangent"][:, :3]).sum(axis=1)
            self.assertLess(np.abs(along).max(), 1e-5)
        path = self.exported("glb", *coarse, "--texture", "64", name="both")
        self.assert_valid(path)
        told = in_node("gltf", path, self.path("read"))
        self.assertEqual((told["has_texture"], told["has_normal_map"]), (True, True))
        refused = self.export("glb", "--max-vertices", "60", "--normal-map", "64", "--fps", "50", check=2)
        self.assertIn("a glb holds one map for its 3 frames", refused.stderr)

    def test_three_plays_compressed_glb_within_its_rounding(self):
        path = self.exported("glb", "--meshopt")
        self.assert_valid(path)
        read = in_node("gltf", path, self.path("read"))
        self.assert_attributes(read)
        expected = self.expected(Y_UP)
        moved = expected - expected[0]
        off = np.abs(read["positions"][:, :expected.shape[1]] - expected)
        allowance = meshopt_allowance(moved) + 2 * FLOAT_STEPS * np.abs(expected).max()
        self.assertTrue((off <= allowance).all(), off.max())
        self.assertLessEqual(off[0].max(), FLOAT_STEPS * np.abs(expected).max())  # the first frame is not rounded

    def test_three_reads_every_time_sample_of_usda(self):
        path = self.exported("usda")
        read = in_node("usda", path, self.path("read"))
        npz = np.load(self.exported("npz"))
        np.testing.assert_array_equal(read["points_times"], [0, 1, 2])
        self.assert_within(read["points"].reshape(3, -1, 3), npz["positions"].astype(np.float64))
        np.testing.assert_allclose(read["velocities"].reshape(3, -1, 3), npz["velocities"], rtol=1e-6, atol=1e-7)
        np.testing.assert_array_equal(read["primvars_state"], npz["state"])
        np.testing.assert_array_equal(read["primvars_views"], npz["views"])
        np.testing.assert_allclose(read["primvars_sigma"], npz["sigma"], rtol=1e-6)
        np.testing.assert_allclose(read["primvars_coverage"], npz["coverage"], rtol=1e-6)
        np.testing.assert_array_equal(read["faceVertexIndices"].reshape(-1, 3), npz["faces"])
        np.testing.assert_allclose(read["primvars_st"].reshape(-1, 3, 2), npz["uv"], rtol=1e-6)

    def test_tinyusdz_reads_the_first_frame(self):
        read = in_node("tinyusdz", self.exported("usda"), self.path("read"))
        expected = self.expected(Y_UP)[0][self.meshes[0]["face"]["vertex_indices"]]
        self.assertEqual(read["meshes"], 1)
        self.assert_within(read["points"][read["faces"]], expected)

    def test_three_reads_attributes_of_ply(self):
        read = in_node("ply", self.exported("ply"), self.path("read"))
        table = read_ply(os.path.join(self.to, f"{self.names[0]}.ply"))
        corners = self.meshes[0]["face"]["vertex_indices"].ravel()  # three.js has a vertex for each
        self.assert_within(read["position"], self.expected(Z_UP)[0][corners])
        for name in ("state", "sigma", "views", "coverage"):
            np.testing.assert_array_equal(read[name].ravel(), table["vertex"][name][corners], name)
        np.testing.assert_array_equal(read["state"].ravel(), self.meshes[0]["vertex"]["state"][corners])
        np.testing.assert_allclose(read["uv"].reshape(-1, 3, 2), self.corners_uv(), atol=1e-6)
        velocity = (self.world_mm[1] - self.world_mm[0]) * 50 * 1e-3 @ Z_UP.T
        np.testing.assert_allclose(read["velocity"], velocity[corners], atol=1e-4)


@unittest.skipUnless(shutil.which("assimp"), "assimp is not installed")
class Assimp(Foreign):
    def test_reads_positions_and_texture_coordinates(self):
        for form, rotation in (("ply", Z_UP), ("obj", Y_UP), ("glb", Y_UP)):
            positions, uv = in_assimp(self.exported(form), self.path("read", form))
            self.assert_within(positions, self.expected(rotation)[0][self.meshes[0]["face"]["vertex_indices"]])
            # Of PLY it takes those of the vertices, which are wrong on faces that close seams.
            if form != "ply":
                np.testing.assert_allclose(uv, self.corners_uv(), atol=1e-6, err_msg=form)


if __name__ == "__main__":
    unittest.main()
