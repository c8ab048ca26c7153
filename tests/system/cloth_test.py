"""Cloth without a board: an OBJ as Blender writes it, its atlas, an export, a comparison, and the console's player."""

import json
import math
import os
import shutil
import struct
import tempfile
import unittest

import browser
from console_studio import ConsoleDaemon
from studio import read, weft, write

AROUND, ROWS, CAP = 16, 12, 4  # squares of a sleeve around and along; of its cuff, a chart of its own, along
RADIUS_M, EDGE_M = 0.06, 0.025


class Sleeve:
    """A sleeve of quads with a cuff of triangles, as Blender's exporter writes it: metres, o, g, s, usemtl and vt with seams.

    It is unwrapped along one line, and the cuff is an island of its own."""

    def __init__(self, swing=0.0):
        self.vertices = []
        for row in range(ROWS + CAP + 1):
            for column in range(AROUND):
                angle = 2 * math.pi * column / AROUND
                bend = swing * (row / (ROWS + CAP)) ** 2
                self.vertices.append((RADIUS_M * math.cos(angle) + bend, EDGE_M * row, RADIUS_M * math.sin(angle)))

    def text(self, per_metre=1):
        lines = ["# Blender v3.4.1 OBJ File: 'sleeve.blend'", "# www.blender.org", "mtllib sleeve.mtl", "o Sleeve"]
        lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in ((per_metre * c for c in vertex) for vertex in self.vertices)]
        lines += ["vn 1.0000 0.0000 0.0000"]
        islands = [self.island(0, ROWS, 0.05, 0.05, 0.05), self.island(ROWS, CAP, 0.55, 0.7, 0.02)]
        lines += [f"vt {u:.6f} {v:.6f}" for places, _ in islands for u, v in places]
        first, group = 1, ["g Sleeve_arm", "g Sleeve_cuff"]
        for (places, faces), name in zip(islands, group):
            lines += [name, "s 1", "usemtl Cotton"]
            lines += ["f " + " ".join(f"{vertex + 1}/{first + place}/1" for vertex, place in face) for face in faces]
            first += len(places)
        return "\n".join(lines) + "\n"

    @staticmethod
    def island(begin, rows, u0, v0, step):
        """Texture coordinates, one column more than there are vertices around, and the faces on them."""
        places = [(u0 + step * column, v0 + step * row) for row in range(rows + 1) for column in range(AROUND + 1)]
        faces = []
        for row in range(rows):
            for column in range(AROUND):
                corners = []
                for dc, dr in ((0, 0), (0, 1), (1, 1), (1, 0)):
                    vertex = (begin + row + dr) * AROUND + (column + dc) % AROUND
                    corners.append((vertex, (row + dr) * (AROUND + 1) + column + dc))
                faces += [corners] if begin == 0 else [corners[:3], [corners[0], *corners[2:]]]
        return places, faces


def size_of_png(path):
    return struct.unpack(">II", read(path, "rb")[16:24])


class Cloth(unittest.TestCase):
    """The three that need no daemon."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="weft cloth ")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.meshes = []
        for frame in range(5):
            self.meshes.append(self.path(f"sleeve_{frame + 1:06d}.obj"))
            write(self.meshes[-1], Sleeve(0.01 * frame).text())

    def path(self, *names):
        return os.path.join(self.folder, *names)

    def imported(self, name="sleeve", meshes=None):
        weft("garment", "import", *(meshes or self.meshes), "--unit", "m", "--out", self.path(name), check=0)
        return self.path(name)

    def test_has_an_atlas(self):
        atlas = self.path("atlas.png")
        done = weft("garment", "check", self.meshes[0], "--unit", "m", "--level", "0", "--atlas", atlas, "--json", check=0)
        summary = json.loads(done.stdout)
        self.assertEqual(summary["vertices"], AROUND * (ROWS + CAP + 1))
        self.assertEqual(summary["faces"], 2 * AROUND * (ROWS + CAP))
        self.assertEqual(summary["charts"], 2)
        # One line along the whole sleeve, and the ring where the cuff begins.
        self.assertEqual(summary["seam_edges"], ROWS + CAP + AROUND)
        self.assertEqual(len(summary["openings_mm"]), 2)
        self.assertEqual(summary["warnings"], [])
        width, height = size_of_png(atlas)
        self.assertEqual([summary["atlas_width_px"], summary["atlas_height_px"]], [width, height])
        self.assertGreaterEqual(width * height, AROUND * (ROWS + CAP))
        self.assertIn("2 charts", weft("garment", "check", self.meshes[0], "--unit", "m", check=0).stdout)

    def test_is_exported(self):
        result = self.imported()
        for form in ("glb", "obj", "ply", "usda", "npz", "mdd", "pc2"):
            with self.subTest(form):
                to = self.path("export", form)
                weft("export", result, "--format", form, "--fps", "25", "--out", to, check=0)
                manifest = json.loads(read(os.path.join(to, "export.json")))
                self.assertEqual(manifest["vertices"], AROUND * (ROWS + CAP + 1))
                self.assertEqual(len(manifest["frames"]), 5)
                # Nothing measured the cloth.
                self.assertFalse({"state", "sigma", "views", "coverage"} & set(manifest.get("attributes", [])), manifest)
        manifest = json.loads(read(self.path("export", "ply", "export.json")))
        self.assertIn("uv", manifest["attributes"])
        self.assertTrue(any("were not measured" in note for note in manifest["notes"]), manifest["notes"])
        # Out and in again it is the same mesh.
        back = weft("garment", "check", self.path("export", "obj", "000001.obj"), "--unit", "m", "--json", check=0)
        self.assertEqual(json.loads(back.stdout)["charts"], 2)
        exported = [self.path("export", "obj", f"{frame + 1:06d}.obj") for frame in range(5)]
        turned = weft("garment", "import", *exported, "--unit", "m", "--out", self.path("turned"), check=0)
        self.assertIn("exported with --up y --unit m", turned.stderr)
        back = weft("garment", "import", *exported, "--unit", "m", "--up", "y", "--out", self.path("back"), check=0)
        self.assertNotIn("warning", back.stderr)
        for other, least_mm, most_mm in (("turned", 30, 1000), ("back", 0, 1e-3)):
            comparison = json.loads(weft("evaluate", result, "--against", self.path(other), "--json").stdout)
            self.assertTrue(least_mm <= comparison["meshes"]["distance_mm"]["mean"] <= most_mm, comparison["meshes"])

    def test_is_compared_with_another(self):
        first = self.imported()
        moved = []
        for mesh in self.meshes:
            moved.append(self.path("moved", os.path.basename(mesh)))
            os.makedirs(os.path.dirname(moved[-1]), exist_ok=True)
            lines = read(mesh).splitlines()
            write(moved[-1], "\n".join(self.shifted(line) for line in lines) + "\n")
        second = self.imported("moved result", moved)
        done = weft("evaluate", first, "--against", second, "--json", "--out", self.path("comparison"), check=0)
        comparison = json.loads(done.stdout)
        self.assertAlmostEqual(comparison["meshes"]["distance_mm"]["mean"], 3, delta=1e-3)
        self.assertAlmostEqual(comparison["meshes"]["distance_mm"]["max"], 3, delta=1e-3)
        self.assertTrue(os.path.exists(self.path("comparison", "report.html")))
        # Alone, against its own shape at rest.
        evaluation = json.loads(weft("evaluate", first, "--json").stdout)
        self.assertIn("no board was printed", json.dumps(evaluation))

    @staticmethod
    def shifted(line):
        if not line.startswith("v "):
            return line
        x, y, z = map(float, line.split()[1:])
        return f"v {x:.6f} {y:.6f} {z + 0.003:.6f}"

    def test_says_what_is_wrong_and_what_to_do(self):
        text = Sleeve().text()
        broken = {
            "unwrapped": (text.replace("/1/1 ", " ", 1), ["has no texture coordinates (vt)", "unwrap"]),
            "number": (text.replace("v 0.060000", "v nan", 1), ["finite numbers", "nan"]),
            "edge": (text + "f 1/1 17/1 2/1\nf 1/1 17/1 3/1\n", ["has two faces already", "Non Manifold"]),
        }
        for name, (content, words) in broken.items():
            with self.subTest(name):
                mesh = self.path(f"{name}.obj")
                write(mesh, content)
                error = weft("garment", "check", mesh, "--unit", "m", check=2).stderr
                for word in [f"{name}.obj:", *words]:
                    self.assertIn(word, error)
        error = weft("garment", "import", *self.meshes, "--out", self.path("small"), check=2).stderr
        self.assertIn("--unit m", error)
        self.assertFalse(os.path.exists(self.path("small", "job.json")))


class Player(ConsoleDaemon, unittest.TestCase):
    def setUp(self):
        browser.need_browser()
        super().setUp()

    def test_shows_its_charts_frame_by_frame(self):
        self.begin()
        frames = self.path("frames")
        os.mkdir(frames)
        for frame in range(3):
            write(os.path.join(frames, f"sleeve_{frame + 1}.obj"), Sleeve(0.02 * frame).text(1000))
        weft("library", "upload", "garment", frames, "--name", "sleeve", "--server", self.addresses[0], check=0)
        page = self.browser(expected=["401"])
        self.log_in(page, self.token("anna", "viewer"))
        page.press("g", "l")
        page.role("link", "sleeve@1")
        page.see("2 charts of its texture")
        page.see("Frame 1 of 3")
        page.see(f"sleeve_1.obj: {2 * AROUND * (ROWS + CAP)} triangles")
        page.css("input[type=range]", "fill", "2")
        page.see("sleeve_3.obj")


class Library(ConsoleDaemon, unittest.TestCase):
    """What the player is given, without a browser."""

    def test_takes_garments_and_refuses_what_is_none(self):
        self.begin()
        mesh = self.path("sleeve.obj")
        write(mesh, Sleeve().text())
        server = ("--server", self.addresses[0])
        self.assertIn("mm across; the file does not say its unit", weft("library", "upload", "garment", mesh, *server, check=2).stderr)
        write(mesh, Sleeve().text(1000))
        weft("library", "upload", "garment", mesh, *server, check=0)
        self.assertIn("sleeve", weft("library", "list", "garment", *server, check=0).stdout)
        write(mesh, Sleeve().text().replace("/1/1 ", " ", 1))
        self.assertIn("has no texture coordinates", weft("library", "upload", "garment", mesh, "--name", "bad", *server, check=2).stderr)
        shutil.copy(mesh, self.path("sleeve.txt"))
        self.assertIn("neither .obj nor .ply",
                      weft("library", "upload", "garment", self.path("sleeve.txt"), "--name", "bad", *server, check=2).stderr)


if __name__ == "__main__":
    unittest.main()
