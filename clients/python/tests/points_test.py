"""Clouds of PLY and PCD files, observations, and files that are not there."""

import os
import struct
import tempfile
import unittest

import numpy as np

import weft

COVARIANCE = ("cov_xx_mm2", "cov_xy_mm2", "cov_xz_mm2", "cov_yy_mm2", "cov_yz_mm2", "cov_zz_mm2")
FIELDS = ("x", "y", "z", "board_row", "board_col", "kind", "views", "sigma_mm", *COVARIANCE)
TYPES = "fffiiBif" + "f" * 6
POINTS = [(1, 2, 3, 4, 5, 0, 6, 0.5, 1, 2, 3, 4, 5, 6), (-1, 0, 0.5, 0, 7, 1, 3, 0.25, 6, 5, 4, 3, 2, 1)]


def ply():
    names = {"f": "float", "i": "int", "B": "uchar"}
    lines = [f"property {names[kind]} {name}" for kind, name in zip(TYPES, FIELDS)]
    header = "\n".join(["ply", "format binary_little_endian 1.0", f"element vertex {len(POINTS)}", *lines, "end_header\n"])
    return header.encode() + b"".join(struct.pack("<" + TYPES, *point) for point in POINTS)


def pcd(data="binary", points=POINTS):
    sizes, kinds = {"f": "4", "i": "4", "B": "1"}, {"f": "F", "i": "I", "B": "U"}
    header = "\n".join(["# .PCD v0.7", "VERSION 0.7", "FIELDS " + " ".join(FIELDS), "SIZE " + " ".join(sizes[t] for t in TYPES),
                        "TYPE " + " ".join(kinds[t] for t in TYPES), "COUNT" + " 1" * len(FIELDS), f"WIDTH {len(points)}",
                        "HEIGHT 1", "VIEWPOINT 0 0 0 1 0 0 0", f"POINTS {len(points)}", f"DATA {data}\n"])
    rows = (b"".join(struct.pack("<" + TYPES, *point) for point in points) if data == "binary" else
            "".join(" ".join(map(str, point)) + "\n" for point in points).encode())
    return header.encode() + rows


class Clouds(unittest.TestCase):
    def test_are_the_same_from_every_format(self):
        lost = (float("nan"), *POINTS[0][1:])  # a point without position, as the Point Cloud Library marks them
        for cloud in (weft.Cloud.from_ply(ply()), weft.Cloud.from_pcd(pcd()), weft.Cloud.from_pcd(pcd("ascii")),
                      weft.Cloud.from_pcd(pcd(points=[POINTS[0], lost, POINTS[1]]))):
            np.testing.assert_array_equal(cloud.positions_mm, [[1, 2, 3], [-1, 0, 0.5]])
            np.testing.assert_array_equal(cloud.board_row, [4, 0])
            np.testing.assert_array_equal(cloud.board_col, [5, 7])
            np.testing.assert_array_equal(cloud.is_corner, [False, True])
            np.testing.assert_array_equal(cloud.views, [6, 3])
            np.testing.assert_array_equal(cloud.covariance_mm2[0], [[1, 2, 3], [2, 4, 5], [3, 5, 6]])
            self.assertIsNone(cloud.fold_covariance_mm2)

    def test_have_the_rays_of_nodes_without_a_point(self):
        self.assertIsNone(weft.Cloud.from_ply(ply()).rays)
        kinds = {"f": "float", "i": "int", "B": "uchar"}
        names, types = ("x", "y", "z", "dx", "dy", "dz", "board_row", "board_col", "kind", "sigma_rad"), "ffffffiiBf"
        element = "".join(f"property {kinds[kind]} {name}\n" for name, kind in zip(names, types))
        data = ply().replace(b"end_header\n", f"element ray 1\n{element}end_header\n".encode())
        rays = weft.Cloud.from_ply(data + struct.pack("<" + types, 1, 2, 3, 0, 1, 0, 8, 9, 1, 0.25)).rays
        np.testing.assert_array_equal(rays.origins_mm, [[1, 2, 3]])
        np.testing.assert_array_equal(rays.directions, [[0, 1, 0]])
        self.assertEqual((rays.board_row[0], rays.board_col[0], rays.is_corner[0], rays.sigma_rad[0]), (8, 9, True, 0.25))

    def assert_refused(self, read, data, *facts):
        with self.assertRaises(weft.FormatError) as caught:
            read(data, "cloud")
        for fact in ("cloud: ", *facts):
            self.assertIn(fact, str(caught.exception))

    def test_names_what_is_wrong(self):
        of_pcd = weft.Cloud.from_pcd
        self.assert_refused(weft.Cloud.from_ply, ply().replace(b"board_col", b"board_ill"), "vertex board_col", "missing")
        self.assert_refused(weft.Cloud.from_ply, ply().replace(b"cov_yz", b"cov_zy"), "vertex cov_yz_mm2", "missing")
        self.assert_refused(of_pcd, pcd().replace(b"board_col", b"board_ill"), "field board_col", "missing")
        self.assert_refused(of_pcd, pcd()[:-1], "POINTS", "2 points", "has 1")
        self.assert_refused(of_pcd, pcd("ascii")[:-8], "points")
        self.assert_refused(of_pcd, pcd("ascii").replace(b"POINTS 2", b"POINTS 3"), "POINTS", "3 points")
        self.assert_refused(of_pcd, pcd("ascii").replace(b"POINTS 2", b"POINTS 2e9"), "POINTS", "2e9")
        self.assert_refused(of_pcd, pcd().replace(b"DATA binary", b"DATA binary_compressed"), "DATA", "pcl_convert")
        self.assert_refused(of_pcd, pcd().replace(b"COUNT 1", b"COUNT 2"), "field x", "COUNT 2")
        self.assert_refused(of_pcd, pcd().replace(b"TYPE F", b"TYPE Q"), "field x", "Q 4")
        self.assert_refused(of_pcd, pcd().replace(b"SIZE 4", b"SIZE"), "FIELDS", "13")
        self.assert_refused(of_pcd, pcd().replace(b"FIELDS x y", b"FIELDS x x"), "twice")
        self.assert_refused(of_pcd, pcd().replace(b"TYPE ", b"KIND "), "TYPE", "missing")
        self.assert_refused(of_pcd, b"", "DATA")


CSV = b"""image,x_px,y_px,board_row,board_col,kind,confidence,sigma_px
c01,1.5000,2.0000,3,4,center,0.99,0.0500
"c,02",7,8.25,0,9,corner,1,0.1
c01,3,4,5,6,center,0.5,0.2
"""


class ObservationsTest(unittest.TestCase):
    def test_are_arrays(self):
        seen = weft.Observations.from_csv(CSV)
        self.assertEqual(seen.cameras, ("c01", "c,02"))
        np.testing.assert_array_equal(seen.positions_px, [[1.5, 2], [7, 8.25], [3, 4]])
        np.testing.assert_array_equal(seen.board_row, [3, 0, 5])
        np.testing.assert_array_equal(seen.board_col, [4, 9, 6])
        np.testing.assert_array_equal(seen.is_corner, [False, True, False])
        np.testing.assert_array_equal(seen.of_camera("c01"), [True, False, True])
        np.testing.assert_array_equal(seen.sigma_px, [0.05, 0.1, 0.2])
        older = weft.Observations.from_csv(b"".join(line.rsplit(b",", 1)[0] + b"\n" for line in CSV.splitlines()))
        self.assertIsNone(older.sigma_px)
        self.assertEqual(weft.Observations.from_csv(CSV.splitlines()[0]).cameras, ())

    def test_names_what_is_wrong(self):
        for bad, *facts in ((b"", "column image"), (CSV.replace(b"x_px", b"x_mm"), "column x_px", "missing"),
                            (CSV.replace(b"7,8.25", b"7,high"), "line 3, column y_px", "high"),
                            (CSV.replace(b"7,8.25", b"7,inf"), "column y_px", "row 1"),
                            (CSV.replace(b"corner", b"edge"), "line 3, column kind", "edge"),
                            (CSV.replace(b"7,8.25,0", b"7,8.25,0.5"), "column board_row", "0.5"),
                            (CSV.replace(b"7,8.25,", b"7,"), "line 3", "7 values"), (CSV[:-20], "line 4"),
                            (b"\xff" + CSV, "no CSV"), (CSV.replace(b'"c,02"', b'"c,02'), "no CSV")):
            with self.assertRaises(weft.FormatError, msg=bad) as caught:
                weft.Observations.from_csv(bad, "observations.csv")
            for fact in ("observations.csv: ", *facts):
                self.assertIn(fact, str(caught.exception))


class Files(unittest.TestCase):
    def test_that_are_not_there_are_named(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "no.file")
            for read in (weft.read_mesh, weft.read_cloud, weft.read_observations, weft.read_report, weft.read_job,
                         weft.read_evaluation, weft.read_export):
                with self.assertRaisesRegex(weft.NotFound, path):
                    read(path)

    def test_of_json_name_the_unknown_field(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "report.json")
            with open(path, "w", encoding="ascii") as file:
                file.write('{"frame": "0001", "mesh": {"coverage": 0.5}}')
            self.assertEqual(weft.read_report(path).mesh.coverage, 0.5)
            with open(path, "w", encoding="ascii") as file:
                file.write('{"frame": "0001", "shoe": 3}')
            with self.assertRaisesRegex(weft.FormatError, "report.json: .*shoe"):
                weft.read_report(path)
            with open(path, "w", encoding="ascii") as file:
                file.write('{"frame": ')
            with self.assertRaisesRegex(weft.FormatError, "report.json: "):
                weft.read_report(path)


if __name__ == "__main__":
    unittest.main()
