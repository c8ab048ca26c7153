"""`weft avatar train --net`: the net is trained by weft-train, stopped, gone on with, and drives."""

import json
import os
import re
import shutil
import signal
import subprocess
import tempfile
import unittest

from shift_net import write_shift_net
from studio import BIN, LONG_S, read, wait_for, weft, write

FILES = ("avatar.json", "space.bin", "net.onnx", "sample.bin")
# A take so small that a net learns little of it.
CELL_MM, FRAMES, COMPONENTS, STEPS = 20, 50, 6, 100


def setUpModule():
    global folder, take
    folder = tempfile.TemporaryDirectory(prefix="weft net ")
    take = path("take")
    weft("motion", "make", "--kind", "twist", "--seconds", 4, "--seed", 1, "--out", path("a.motion"), check=0)
    weft("simulate", "--preset", "shirt-drive", "--cell-mm", CELL_MM, "--motion", path("a.motion"), "--frames", FRAMES,
         "--no-pictures", "--out", take, check=0, patience_s=600)


def tearDownModule():
    folder.cleanup()


def path(name):
    return os.path.join(folder.name, name)


def arguments(out, *more, steps=STEPS):
    return ["avatar", "train", take, "--components", COMPONENTS, "--net", "--steps", steps, "--threads", 2, "--out", out,
            *more]


def files(avatar):
    return {name: read(f"{avatar}/{name}", "rb") for name in os.listdir(avatar)}


class WithoutTrainer(unittest.TestCase):
    def test_says_what_is_missing_before_it_begins(self):
        alone = shutil.copy(os.path.join(BIN, "weft"), folder.name)
        done = subprocess.run([alone, *map(str, arguments(path("none.avatar")))], capture_output=True, text=True,
                              timeout=LONG_S, check=False)
        self.assertEqual(done.returncode, 2, done.stderr)
        for words in ("weft-train", "libtorch-dev", "WEFT_TRAIN=ON", "without --net"):
            self.assertIn(words, done.stderr)
        self.assertFalse(os.path.exists(path("none.avatar.training")))


@unittest.skipUnless(os.path.exists(os.path.join(BIN, "weft-train")), "weft-train is not built")
class Training(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.avatar = path("shirt.avatar")
        cls.said = weft(*arguments(cls.avatar), check=0, patience_s=600)

    def stop_after_samples(self, avatar):
        process = subprocess.Popen([os.path.join(BIN, "weft"), *map(str, arguments(avatar))], stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.kill)
        wait_for(lambda: os.path.exists(f"{avatar}.training/samples.bin"), "the samples")
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=240)
        self.assertNotEqual(process.returncode, 0)
        self.assertIn("the same command goes on", errors)
        self.assertFalse(os.path.exists(avatar))

    def test_the_net_stays_where_it_gains_on_frames_that_it_never_saw(self):
        """Edges say so much that a net of a small set may have nothing to add: then the avatar does without."""
        self.assertFalse(os.path.exists(self.avatar + ".training"))
        about = json.loads(weft("avatar", "show", self.avatar, "--json", check=0).stdout)
        left_out = re.search(r"the net is left out: (.*)", self.said.stderr)
        self.assertEqual(set(os.listdir(self.avatar)), set(FILES[:2] if left_out else FILES))
        if left_out:
            pairs = re.findall(r"([0-9.]+) mm with it and ([0-9.]+) without before (\d) cameras", left_out[1])
            self.assertEqual([cameras for _, _, cameras in pairs], ["2", "3", "4"])
            self.assertGreaterEqual(sum(float(after) for after, _, _ in pairs), sum(float(before) for _, before, _ in pairs))
            self.assertNotIn("net", about)
            return
        training, gains = about["net"]["training"], about["net"]["gain"]
        self.assertEqual((training["steps_taken"], training["seed"], training["threads"]), (str(STEPS), "1", 2))
        self.assertEqual([gain["cameras"] for gain in gains], [2, 3, 4])
        self.assertLess(sum(gain["after_mm"] for gain in gains), sum(gain["before_mm"] for gain in gains))
        self.assertIn(f"trained in {STEPS} of {STEPS} steps", weft("avatar", "show", self.avatar, check=0).stdout)

    def test_a_run_in_pieces_gives_the_same_files(self):
        """Row X5 of the design: the same sources, options, seed, machine and threads."""
        other = path("pieces.avatar")
        self.stop_after_samples(other)
        refused = weft(*arguments(other, "--seed", 2), check=2).stderr
        self.assertIn("is of a training with other sources or options", refused)
        weft(*arguments(other, "--keep"), check=0, patience_s=600)
        self.assertEqual(files(other), files(self.avatar))
        self.assertEqual(set(os.listdir(f"{other}.training")),
                         {"recipe.txt", "samples.bin", "net.onnx", "sample.bin", "training.json"})

    def test_a_net_that_does_harm_is_left_out(self):
        plain, harmed = path("plain.avatar"), path("harmed.avatar")
        weft("avatar", "train", take, "--components", COMPONENTS, "--out", plain, check=0)
        self.stop_after_samples(harmed)
        write_shift_net(f"{harmed}.training")
        write(f"{harmed}.training/training.json", "{}")
        done = weft(*arguments(harmed), check=0)
        self.assertRegex(done.stderr, r"the net is left out: [0-9.]+ mm with it and [0-9.]+ without before 2 cameras")
        self.assertEqual(files(harmed), files(plain))


@unittest.skipUnless(os.path.exists(os.path.join(BIN, "weft-train")), "weft-train is not built")
class PresetPaper(unittest.TestCase):
    def test_is_driven_beside_another_avatar(self):
        paper, ours = path("paper.avatar"), path("ours.avatar")
        said = weft("avatar", "train", take, "--preset", "paper", "--steps", 40, "--threads", 1, "--keep", "--out", paper,
                    check=0, patience_s=600)
        self.assertIn("paper avatar of the template", said.stdout)
        self.assertEqual(set(os.listdir(f"{paper}.training")),
                         {"recipe.txt", "poses.bin", "left.txt", "prior.bin", "samples.bin", "net.onnx", "sample.bin",
                          "training.json"})
        weft("avatar", "train", take, "--components", COMPONENTS, "--out", ours, check=0)
        done = weft("evaluate", take, "--avatar", ours, "--baseline", paper, "--cameras", "2,3", "--frames", 6, "--trials",
                    "--json", check=0, patience_s=600)
        scores = {(score["cameras"], score["method"]): score for score in json.loads(done.stdout)["scores"]
                  if "cameras" in score}
        for method, frames in (("paper", 6), ("paper carrier", 6), ("paper elsewhere", 12)):
            score = scores[2, method]
            self.assertEqual(score["frames"] + score.get("lost_frames", 0), frames)
        self.assertNotIn((3, "paper"), scores)  # it knows two cameras
        # Even a prior of twenty steps is fitted to the rays.
        self.assertLess(scores[2, "paper carrier"]["mean_mm"], 60)
        self.assertIn("--baseline", weft("evaluate", take, "--avatar", paper, check=2).stderr)
        self.assertIn("--baseline", weft("evaluate", take, "--avatar", ours, "--baseline", ours, check=2).stderr)


class Options(unittest.TestCase):
    def test_of_nets_go_with_a_net(self):
        for option in (("--steps", 5), ("--hours", 1), ("--keep",)):
            self.assertIn("requires --net", weft("avatar", "train", take, *option, "--out", path("no.avatar"), check=2).stderr)
        for option in ("--net", "--components=3"):
            self.assertIn("excludes", weft("avatar", "train", take, "--preset", "paper", option, "--out", path("no.avatar"),
                                           check=2).stderr)


if __name__ == "__main__":
    unittest.main()
