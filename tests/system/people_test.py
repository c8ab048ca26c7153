"""The studio's people: bodies and motions as files, and cloth that is worn by them."""

import os
import tempfile
import unittest

import numpy as np
from export_readers import read_ply, xyz
from studio import read, weft, write


class Bodies(unittest.TestCase):
    def test_a_body_wears_the_shirt_and_stands_in_the_recipe(self):
        with tempfile.TemporaryDirectory(prefix="weft test ") as folder:
            body, take = os.path.join(folder, "anna.body"), os.path.join(folder, "take")
            made = weft("body", "make", "--stature-mm", 1650, "--girth", 0.95, "--out", body, check=0).stdout
            self.assertIn("1650 mm tall", made)
            key = made.split("hash ")[1].split()[0]
            motion = os.path.join(folder, "stand.motion")
            weft("motion", "make", "--kind", "standing", "--seconds", 1, "--out", motion, check=0)
            simulate = ["simulate", "--preset", "shirt-drive", "--cell-mm", 20, "--motion", motion, "--no-pictures", "--frames", 1,
                        "--out", take]
            weft(*simulate, "--body", body, check=0)
            with open(os.path.join(take, "recipe.txt"), encoding="utf-8") as recipe:
                self.assertIn(f"body {key}", recipe.read())
            self.assert_meshes_of(take, body, os.path.join(folder, "meshes"))
            again = weft(*simulate)
            self.assertEqual(again.returncode, 2, again.stderr)
            self.assertIn("body", again.stderr)

    def assert_meshes_of(self, take, body_file, out):
        """The true cloth, upright and in metres, around the person who wore it."""
        self.assertIn("give with --body the file", weft("dataset", "meshes", take, "--out", out, check=2).stderr)
        said = weft("dataset", "meshes", take, "--body", body_file, "--out", out, check=0).stdout
        self.assertIn("the cloth of 1 frames, and the body, m, y up", said)
        cloth, body = (read_ply(os.path.join(out, thing, "0000.ply")) for thing in ("cloth", "body"))
        low, high = xyz(body["vertex"]).min(axis=0), xyz(body["vertex"]).max(axis=0)
        at_ease = body_file + ".ply"
        weft("body", "show", body_file, "--mesh", at_ease, check=0)
        self.assertAlmostEqual(high[1] - low[1], 1e-3 * np.ptp(xyz(read_ply(at_ease)["vertex"])[:, 1]), delta=0.01)
        shirt = xyz(cloth["vertex"])
        self.assertGreater(shirt[:, 1].min(), low[1] + 0.3, "no foot is in the shirt")
        self.assertLess(shirt[:, 1].max(), high[1])
        self.assertIn("s", cloth["vertex"].dtype.names)
        refused = weft("dataset", "meshes", take, "--out", os.path.join(out, "no", "such", "folder"))
        self.assertEqual(refused.returncode, 2, refused.stderr)

    def test_what_is_wrong_is_named(self):
        with tempfile.TemporaryDirectory(prefix="weft test ") as folder:
            body = os.path.join(folder, "anna.body")
            refused = weft("body", "make", "--waist-girth", 2, "--out", body)
            self.assertEqual(refused.returncode, 2)
            self.assertIn("waist_girth is 2, expected 0.7 to 1.4", refused.stderr)
            self.assertFalse(os.path.exists(body))
            weft("body", "make", "--seed", 3, "--out", body, check=0)
            skirt = weft("simulate", "--preset", "shirt-drive", "--garment", "skirt", "--no-pictures", "--body", body,
                         "--out", os.path.join(folder, "take"))
            self.assertEqual(skirt.returncode, 2)
            self.assertIn("choose the garment tshirt", skirt.stderr)


# A person in T pose, whose left leg swings forwards; only what must be there.
def bvh():
    turn = "CHANNELS 3 Zrotation Xrotation Yrotation\n"
    text = "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
    for side, x in (("Left", 1), ("Right", -1)):
        for upper, lower, at, bone in (("UpLeg", "Leg", (9 * x, -4), (0, -41.5)), ("Arm", "ForeArm", (17 * x, 45), (28 * x, 0))):
            text += f"JOINT {side}{upper}\n{{\nOFFSET {at[0]} {at[1]} 0\n{turn}"
            text += f"JOINT {side}{lower}\n{{\nOFFSET {bone[0]} {bone[1]} 0\n{turn}"
            text += f"End Site\n{{\nOFFSET {bone[0]} {bone[1]} 0\n}}\n}}\n}}\n"
    text += "}\nMOTION\nFrames: 31\nFrame Time: 0.0333333\n"
    for frame in range(31):
        angles = [0.0] * 24
        angles[1] = -2 * frame  # LeftUpLeg, about x
        text += " ".join(map(str, [0, 90, 0, 0, 0, 0, *angles])) + "\n"
    return text


class Motions(unittest.TestCase):
    def test_motion_capture_moves_a_person(self):
        with tempfile.TemporaryDirectory(prefix="weft test ") as folder:
            path, motion = os.path.join(folder, "kick.bvh"), os.path.join(folder, "kick.motion")
            write(path, bvh())
            said = weft("motion", "import", path, "--out", motion, check=0).stdout
            self.assertRegex(said, r"right-thigh +LeftUpLeg")
            self.assertIn("1.0 s, 31 poses at 30 a second", said)
            self.assertRegex(weft("motion", "show", motion, check=0).stdout, r"right-thigh +60\.0 +60\.0")
            write(path, bvh().replace("LeftUpLeg", "Limb7"))
            refused = weft("motion", "import", path, "--out", motion)
            self.assertEqual(refused.returncode, 2)
            self.assertIn("no joint was recognised as right-thigh", refused.stderr)
            again = os.path.join(folder, "again.motion")
            weft("motion", "import", path, "--joint", "right-thigh=Limb7", "--out", again, check=0)
            self.assertEqual(read(motion, "rb"), read(again, "rb"))


class Datasets(unittest.TestCase):
    def test_a_set_tells_what_it_holds_and_notices_damage(self):
        with tempfile.TemporaryDirectory(prefix="weft test ") as folder:
            out = os.path.join(folder, "set")
            refused = weft("dataset", "info", folder)
            self.assertEqual(refused.returncode, 2)
            self.assertIn("weft dataset make", refused.stderr)
            # Time is over after the first frame.
            weft("dataset", "make", "tiny-drive", "--minutes", 1e-6, "--out", out, check=0)
            said = weft("dataset", "info", out, check=0).stdout
            self.assertIn("train        0 of 7 takes are complete", said)
            self.assertRegex(said, r"test-unseen +0 of 2 takes are complete, 0 frames: reach, squat")
            self.assertIn("chaos floor: not known", said)
            weft("dataset", "check", out, check=0)
            record = os.path.join(out, "dataset.json")
            write(record, read(record).replace('"validate"', '"train"').replace("validate-", "train-")
                  .replace('"motion_seed": "401"', '"motion_seed": "101"').replace("squat-401", "squat-101"))
            self.assertEqual(weft("dataset", "check", out).returncode, 0)
            write(record, read(record).replace('"test-known"', '"train"').replace("test-known-", "train-")
                  .replace('"squat"', '"walk"').replace("-squat-", "-walk-"))
            leaks = weft("dataset", "check", out)
            self.assertEqual(leaks.returncode, 2)
            self.assertRegex(leaks.stderr, "is of a class that|has the motion of|repeats no take")


if __name__ == "__main__":
    unittest.main()
