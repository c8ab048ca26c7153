"""Meshes of PLY and OBJ files."""

import json
import os
import struct
import tempfile
import unittest

import numpy as np

import weft

HEADER = """ply
format {encoding} 1.0
comment positions in mm
element vertex 4
property float x
property float y
property float z
property uchar state
property float sigma_mm
property int views
property float s
property float t
element face 2
property list uchar int vertex_indices
property list uchar float texcoord
end_header
"""
VERTICES = [(0, 0, 0, 1, 0.25, 5, 0, 0), (1, 0, 0, 0, 2, 0, 1, 0), (0, 1, 0, 2, 0.5, 2, 0, 1), (1, 1, 0.5, 3, 1, 0, 1, 1)]
FACES = [(0, 1, 2), (2, 1, 3)]


def binary_mesh(order="<", faces=FACES):
    encoding = {"<": "binary_little_endian", ">": "binary_big_endian"}[order]
    body = b"".join(struct.pack(order + "fffBfiff", *vertex) for vertex in VERTICES)
    for face in faces:
        body += struct.pack(f"{order}B{len(face)}i", len(face), *face) + struct.pack(order + "B6f", 6, *range(6))
    return HEADER.format(encoding=encoding).encode() + body


def ascii_mesh():
    rows = [" ".join(map(str, vertex)) for vertex in VERTICES] + [f"3 {a} {b} {c} 6 0 1 2 3 4 5" for a, b, c in FACES]
    return (HEADER.format(encoding="ascii") + "\n".join(rows) + "\n").encode()


class Ply(unittest.TestCase):
    def test_is_the_same_in_every_encoding(self):
        for data in (binary_mesh("<"), binary_mesh(">"), ascii_mesh(), ascii_mesh().replace(b"\n", b"\r\n")):
            mesh = weft.Mesh.from_ply(data)
            np.testing.assert_array_equal(mesh.vertices_mm, np.array([vertex[:3] for vertex in VERTICES], np.float32))
            np.testing.assert_array_equal(mesh.faces, FACES)
            np.testing.assert_array_equal(mesh.state, [1, 0, 2, 3])
            np.testing.assert_array_equal(mesh.observed, [True, False, False, False])
            np.testing.assert_array_equal(mesh.sigma_mm, [0.25, 2, 0.5, 1])
            np.testing.assert_array_equal(mesh.views, [5, 0, 2, 0])
            np.testing.assert_array_equal(mesh.texture, [[0, 0], [1, 0], [0, 1], [1, 1]])
            self.assertEqual((mesh.vertices_mm.dtype, mesh.faces.dtype, mesh.vertices_mm.dtype.isnative),
                             (np.float32, np.int32, True))

    def test_that_is_cut_anywhere_is_refused(self):
        for data in (binary_mesh(), ascii_mesh()[:-1]):
            for size in range(len(data) - 1):
                with self.assertRaises(weft.FormatError, msg=size) as caught:
                    weft.Mesh.from_ply(data[:size], "a/mesh.ply")
                self.assertIn("a/mesh.ply: ", str(caught.exception))

    def assert_refused(self, data, *facts):
        with self.assertRaises(weft.FormatError) as caught:
            weft.Mesh.from_ply(data, "mesh.ply")
        for fact in ("mesh.ply: ", *facts):
            self.assertIn(fact, str(caught.exception))

    def test_names_what_is_wrong(self):
        data = binary_mesh()
        self.assert_refused(b"solid", "header")
        self.assert_refused(data.replace(b"property float z", b"property float w"), "vertex z", "missing")
        self.assert_refused(data.replace(b"property float y", b"property float x"), "property x", "twice")
        self.assert_refused(data.replace(b"property float z", b"property half z"), "header line 7", "property half z")
        self.assert_refused(data.replace(b"format binary_little_endian", b"format gzip"), "header line 2")
        self.assert_refused(data.replace(b"element face 2", b"element side 2"), "element face", "missing")
        self.assert_refused(data.replace(b"element vertex 4", b"element vertex 999999999999"), "vertex x", "ends in row")
        self.assert_refused(ascii_mesh().replace(b"element vertex 4", b"element vertex 999999999999"), "vertex x", "ends before")
        self.assert_refused(binary_mesh(faces=[(0, 1, 4), (0, 1, 2)]), "face vertex_indices", "names vertex 4 in row 0")
        self.assert_refused(binary_mesh(faces=[(0, 1, 2), (0, 1, 2, 3)]), "face vertex_indices", "no triangles")
        self.assert_refused(ascii_mesh().replace(b"1 0 0 0 2", b"1 nan 0 0 2"), "vertex y", "row 1")
        self.assert_refused(ascii_mesh().replace(b"1 0 0 0 2", b"1 0 0 7 2"), "vertex state", "is 7", "row 1")
        self.assert_refused(ascii_mesh().replace(b"1 0 0 0 2", b"1 0 0 0 two"), "vertex sigma_mm", "two")

    def test_is_a_value_error_too(self):
        with self.assertRaises(ValueError):
            weft.Mesh.from_ply(b"")

    def test_of_a_driven_garment(self):
        mesh = weft.Mesh.from_ply(ascii_mesh().replace(b"1 0 0 0 2", b"1 0 0 4 2"))
        self.assertEqual(mesh.state[1], 4)

    def test_without_state_says_so(self):
        data = binary_mesh().replace(b"property uchar state", b"property uchar other")
        self.assertIsNone(weft.Mesh.from_ply(data).state)
        with self.assertRaisesRegex(ValueError, "state"):
            weft.Mesh.from_ply(data).observed  # pylint: disable=expression-not-assigned


OBJ = b"""# a square and a triangle
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
vn 0 0 1
f 1/1/1 2/2/1 3/3/1 4/4/1
f -4/1 -3/2 -1/4
"""


class Obj(unittest.TestCase):
    def test_polygons_become_triangles(self):
        mesh = weft.Mesh.from_obj(OBJ)
        np.testing.assert_array_equal(mesh.vertices_mm, [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
        np.testing.assert_array_equal(mesh.faces, [[0, 1, 2], [0, 2, 3], [0, 1, 3]])
        np.testing.assert_array_equal(mesh.texture, [[0, 0], [1, 0], [1, 1], [0, 1]])
        self.assertIsNone(weft.Mesh.from_obj(OBJ.replace(b"f -4/1 ", b"f -4/2 ")).texture)
        self.assertIsNone(weft.Mesh.from_obj(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1//1 2//1 3//1\n").texture)

    def test_names_what_is_wrong(self):
        for bad, *facts in ((OBJ.replace(b"2/2/1", b"9/2/1"), "line 11, f", "vertex 9"),
                            (OBJ.replace(b"2/2/1", b"2/9/1"), "line 11, f", "texture coordinate 9"),
                            (OBJ.replace(b"v 1 1 0", b"v 1 one 0"), "line 4, v", "one"),
                            (OBJ.replace(b"v 1 1 0", b"v 1 1"), "line 4, v", "2 values"),
                            (OBJ.replace(b"v 1 1 0", b"v 1 inf 0"), "finite"),
                            (OBJ.replace(b"v 1 1 0", b"v 0 0 0\nf 0 1 2"), "line 5, f", "vertex 0")):
            with self.assertRaises(weft.FormatError) as caught:
                weft.Mesh.from_obj(bad, "a.obj")
            for fact in ("a.obj: ", *facts):
                self.assertIn(fact, str(caught.exception))


class Exported(unittest.TestCase):
    """Metres, z up, as `weft export` writes them beside export.json, are mm in the rig's world again."""

    FROM_WORLD = [0.01, 0, 0, 3, 0, 0, 0.01, 4, 0, -0.01, 0, 5, 0, 0, 0, 1]  # dm, z up

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory(prefix="weft test ")
        self.addCleanup(self.folder.cleanup)

    def path(self, name, data):
        path = os.path.join(self.folder.name, name)
        with open(path, "wb") as file:
            file.write(data)
        return path

    def tell(self, transform):
        self.path("export.json", json.dumps({"format": "ply", "transform": {"export_from_world": transform}}).encode())

    def ply(self):
        rows = b"".join(struct.pack("<fffBfiff", 0.01 * x + 3, 0.01 * z + 4, -0.01 * y + 5, state, 0.01 * sigma, views, s, t)
                        for x, y, z, state, sigma, views, s, t in VERTICES)
        header = HEADER.format(encoding="binary_little_endian").replace("sigma_mm", "sigma")
        header = header.replace("positions in mm", "written by weft export; units and axes stand in export.json")
        faces = b"".join(struct.pack("<B3i", 3, *face) + struct.pack("<B6f", 6, *range(6)) for face in FACES)
        return header.encode() + rows + faces

    def test_meshes_are_in_mm_and_the_world_of_the_rig(self):
        self.tell(self.FROM_WORLD)
        mesh = weft.read_mesh(self.path("0000.ply", self.ply()))
        np.testing.assert_allclose(mesh.vertices_mm, [vertex[:3] for vertex in VERTICES], atol=1e-4)
        np.testing.assert_allclose(mesh.sigma_mm, [0.25, 2, 0.5, 1], rtol=1e-6)
        np.testing.assert_array_equal(mesh.state, [1, 0, 2, 3])
        self.assertEqual(mesh.vertices_mm.dtype, np.float32)
        obj = self.path("0000.obj", b"# written by weft export; units and axes stand in export.json\no garment\nv 3.01 4 5\n")
        np.testing.assert_allclose(weft.read_mesh(obj).vertices_mm, [[1, 0, 0]], atol=1e-9)

    def test_without_its_transform_an_export_is_refused(self):
        path = self.path("0000.ply", self.ply())
        with self.assertRaisesRegex(weft.FormatError, "export.json is missing"):
            weft.read_mesh(path)
        with self.assertRaisesRegex(weft.FormatError, "use read_mesh"):
            weft.Mesh.from_ply(self.ply())
        for transform in ([], [0.0] * 16):
            self.tell(transform)
            with self.assertRaisesRegex(weft.FormatError, "export_from_world"):
                weft.read_mesh(path)


class Files(unittest.TestCase):
    def test_a_folder_stands_for_the_file_in_it(self):
        with tempfile.TemporaryDirectory(prefix="weft test ") as folder:
            with open(os.path.join(folder, "job.json"), "w", encoding="utf-8") as file:
                file.write('{"id": "one"}')
            self.assertEqual(weft.read_job(folder).id, "one")
            with self.assertRaisesRegex(weft.NotFound, "report.json"):
                weft.read_report(folder)

    def test_the_package_tells_its_version(self):
        self.assertRegex(weft.__version__, r"^\d+\.\d+")

    def test_what_the_daemon_lists_is_a_sequence(self):
        listed = weft.Listing(weft.v1.ListJobsResponse(jobs=[weft.v1.Job(id="a"), weft.v1.Job(id="b")], warnings=["full"]), "jobs")
        self.assertEqual([job.id for job in listed], ["a", "b"])
        self.assertEqual((len(listed), listed[-1].id, [job.id for job in listed[:1]]), (2, "b", ["a"]))
        self.assertEqual((list(listed.warnings), len(listed.jobs)), (["full"], 2))
        with self.assertRaises(AttributeError):
            listed.job


if __name__ == "__main__":
    unittest.main()
