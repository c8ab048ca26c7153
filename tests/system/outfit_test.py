"""A person in a skirt and a shirt over it: two boards and two templates in one take."""

import json
import os
import tempfile
import unittest

from browser import need_browser
from console_studio import ConsoleDaemon
from studio import page_data, read, weft

# With smaller pictures the end of a sleeve is seen by three cameras or by two, as rounding has it.
SHIRT_AND_SKIRT = ["simulate", "--preset", "shirt-and-skirt", "--cell-mm", 20, "--frames", 1, "--cameras", 12,
                   "--width-px", 400, "--height-px", 360]


def setUpModule():
    """The take of both, registered with the joint template."""
    global folder, take, result
    folder = tempfile.TemporaryDirectory(prefix="weft test ")
    take, result = os.path.join(folder.name, "take"), os.path.join(folder.name, "result")
    weft(*SHIRT_AND_SKIRT, "--out", take, check=0, patience_s=900)
    register(take, result)


def tearDownModule():
    folder.cleanup()


def register(of, out):
    weft("register", of, "--rig", of + "/rig.json", "--board", of + "/board.json", "--template", of + "/template",
         "--observations", "--out", out, check=0)


def cells_by_garment(observations, board):
    """The count of cells that lie on each part of the joint board, and of those on none."""
    parts = json.loads(read(board))["parts"]
    counts = [0] * len(parts) + [0]
    for line in read(observations).splitlines()[1:]:
        row = int(line.split(",")[3])
        own = [i for i, p in enumerate(parts) if 0 <= row - p.get("first_row", 0) <= p["rows"]]
        counts[own[0] if own else -1] += 1
    return counts


class Outfit(unittest.TestCase):
    def test_both_garments_are_registered_and_keep_out_of_each_other(self):
        total = json.loads(weft("evaluate", result, "--json", check=0).stdout)["total"]
        self.assertGreater(total["measures"]["coverage"], 0.6)
        self.assertEqual(total["measures"].get("self_intersecting_pairs", 0), 0)
        mesh = json.loads(read(os.path.join(result, "0000/report.json")))["mesh"]
        self.assertEqual([garment["id"] for garment in mesh["garments"]], ["skirt", "shirt"])
        self.assertEqual(sum(garment["observed"] for garment in mesh["garments"]), mesh["observed"])
        self.assertEqual(mesh["overlaps"], [{"inner": "skirt", "outer": "shirt"}])
        self.assertEqual(page_data(os.path.join(result, "report.html"))["job"]["overlaps"], [{"inner": "skirt", "outer": "shirt", "frames": 1}])

    def test_split_gives_a_result_of_each_garment(self):
        out = os.path.join(folder.name, "garments")
        printed = weft("split", result, "--out", out, check=0).stdout
        self.assertIn("1 frames of skirt", printed)
        vertices = {}
        for name in ("skirt", "shirt"):
            one = os.path.join(out, name)
            report = json.loads(read(os.path.join(one, "0000/report.json")))
            vertices[name] = report["mesh"]["vertices"]
            self.assertGreater(report["mesh"]["coverage"], 0.5)
            weft("evaluate", one, check=0)
            weft("export", one, "--format", "glb", "--fps", 30, "--out", os.path.join(folder.name, f"glb_{name}"), check=0)
        joint = json.loads(read(os.path.join(result, "0000/report.json")))
        self.assertEqual(sum(vertices.values()), joint["mesh"]["vertices"])
        # Again, and over somebody else's result.
        weft("split", result, "--out", out, check=0)
        other = weft("split", os.path.join(out, "shirt"), "--out", out)
        self.assertEqual(other.returncode, 2)
        self.assertIn("is of one garment", other.stderr)

    def test_a_garment_filmed_alone_gives_no_cell_of_the_other(self):
        alone = os.path.join(folder.name, "shirt")
        weft(*SHIRT_AND_SKIRT, "--show", "shirt", "--out", alone, check=0, patience_s=900)
        register(alone, alone + "-result")
        skirt, shirt, none = cells_by_garment(alone + "-result/0000/observations.csv", alone + "/board.json")
        self.assertGreater(shirt, 300)
        self.assertEqual((skirt, none), (0, 0))

    def test_who_is_not_in_the_take_is_named(self):
        refused = weft(*SHIRT_AND_SKIRT, "--show", "hat", "--out", os.path.join(folder.name, "hat"))
        self.assertEqual(refused.returncode, 2)
        self.assertIn("none of skirt, shirt", refused.stderr)


class OutfitInTheConsole(ConsoleDaemon, unittest.TestCase):
    def setUp(self):
        need_browser()
        super().setUp()

    def test_each_garment_is_shown_alone(self):
        self.start_plainly("--console", f"127.0.0.1:{self.port}", "--workers", "1", "--allow-path", folder.name)
        weft("register", take, "--rig", take + "/rig.json", "--board", take + "/board.json", "--template", take + "/template",
             "--out", self.path("out"), "--server", self.addresses[0], check=0)
        page = self.browser(expected=["401"])
        self.log_in(page, self.token("anna", "operator"))
        page.press("g", "j")
        page.see("Ended")
        page.press("j", "Enter")
        page.css("a:has-text('View in 3D')", "click")
        page.see("first frame after", ".player-stats")
        garments = "label:has-text('Garments') select"
        pictures = {}
        for name in ("", "skirt", "shirt"):
            page.css(garments, "selectOption", name)
            pictures[name] = page.css(".player-stage canvas", "screenshot")
            self.look(page, f"garment-{name or 'all'}")
        self.assertEqual(len({str(picture) for picture in pictures.values()}), 3)


if __name__ == "__main__":
    unittest.main()
