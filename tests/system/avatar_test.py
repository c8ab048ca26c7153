"""`weft avatar`: a shirt is learnt from simulated motions and followed by two and three cameras in another one."""

import glob
import json
import os
import shutil
import tempfile
import unittest

from studio import read, results, temporary_files, vertex_states, weft, write

CELL_MM = 20
DRIVEN = 4


def setUpModule():
    """Motions without pictures to learn from, one with pictures of three cameras to be driven, and the avatar."""
    global folder, take, avatar, sources
    folder = tempfile.TemporaryDirectory(prefix="weft avatar ")
    take, avatar = path("take"), path("shirt.avatar")
    sources = []
    for kind, seed, frames in (("twist", 1, 60), ("twist", 2, 12)):
        motion = path(f"{kind}-{seed}.motion")
        weft("motion", "make", "--kind", kind, "--seconds", 4, "--seed", seed, "--out", motion, check=0)
        is_learnt = seed == 1
        out = path(f"{kind}-{seed}") if is_learnt else take
        pictures = ["--no-pictures"] if is_learnt else ["--cameras", 3, "--width-px", 480, "--height-px", 384]
        weft("simulate", "--preset", "shirt-drive", "--cell-mm", CELL_MM, "--motion", motion, "--frames", frames,
             *pictures, "--out", out, check=0, patience_s=600)
        if is_learnt:
            sources.append(out)
    weft("avatar", "train", *sources, "--components", 12, "--out", avatar, check=0)


def tearDownModule():
    folder.cleanup()


def path(name):
    return os.path.join(folder.name, name)


def drive(out, *more, of=None, **replaced):
    inputs = {"avatar": avatar, "rig": f"{take}/rig.json", "board": f"{take}/board.json", "template": f"{take}/template",
              **{name: value for name, value in replaced.items() if name != "check"}}
    options = [word for name, value in inputs.items() for word in (f"--{name}", value)]
    return weft("avatar", "drive", of or take, *options, "--out", out, *more, check=replaced.get("check"))


def frame_reports(out):
    return [json.loads(read(file)) for file in sorted(glob.glob(f"{glob.escape(out)}/*/report.json"))]


class Driving(unittest.TestCase):
    def setUp(self):
        self.out = path(self.id().rsplit(".", 1)[1])

    def error_mm(self, result):
        mesh = json.loads(weft("evaluate", result, "--quick", "--json", check=0).stdout)["total"]["mesh"]
        errors = [mesh[name] for name in ("visible_mm", "hidden_mm") if name in mesh]
        return sum(e["mean"] * e["count"] for e in errors) / sum(e["count"] for e in errors)

    def test_three_cameras_find_the_garment_and_two_nearly(self):
        three = drive(self.out, "--observations", check=0)
        self.assertIn("12 of 12 frames driven", three.stdout)
        reports = frame_reports(self.out)
        self.assertEqual({report["state"] for report in reports}, {"FRAME_STATE_DONE"})
        self.assertEqual([report["driven"]["started_anew"] for report in reports], [True] + 11 * [False])
        self.assertGreater(min(report["driven"]["rays"] for report in reports), 500)
        self.assertIn(DRIVEN, vertex_states(f"{self.out}/0003/mesh.ply"))
        self.assertEqual(temporary_files(self.out), [])
        self.assertLess(self.error_mm(self.out), 8)
        job = json.loads(read(f"{self.out}/job.json"))
        self.assertEqual(job["driven"]["cameras"], ["c00", "c01", "c02"])
        two = self.out + " of two"
        drive(two, "--cameras", "c00,c01", check=0)
        self.assertEqual(len(frame_reports(two)[0]["views"]), 2)
        self.assertLess(self.error_mm(two), 25)
        # Ordinary results for whatever follows.
        weft("export", self.out, "--format", "npz", "--fps", 30, "--out", self.out + " npz", check=0)
        self.assertIn("driven", read(f"{self.out}/report.html"))

    def test_a_run_in_pieces_and_at_other_threads_gives_the_same_files(self):
        drive(self.out, "--threads", 1, check=0)
        whole = results(self.out)
        self.assertEqual(len(whole), 12)
        pieces = self.out + " pieces"
        drive(pieces, "--threads", 3, check=0)
        for frame in ("0005", "0009"):
            shutil.rmtree(f"{pieces}/{frame}")
        kept = os.stat(f"{pieces}/0007/mesh.ply").st_mtime_ns
        drive(pieces, check=0)
        self.assertEqual(results(pieces), whole)
        self.assertEqual(os.stat(f"{pieces}/0007/mesh.ply").st_mtime_ns, kept)
        job = json.loads(drive(pieces, "--json", check=0).stdout)
        self.assertEqual(job["frames"]["reused"], 12)
        # With another camera everything is driven again.
        drive(pieces, "--cameras", "c00,c02", check=0)
        self.assertNotEqual(results(pieces), whole)

    def test_a_frame_without_the_garment_fails_and_the_next_one_finds_it(self):
        dark = path("dark")
        shutil.copytree(take, dark)
        for picture in glob.glob(f"{glob.escape(dark)}/0004/*.png"):
            shutil.copy(f"{take}/board.png", picture)  # of another size than the rig says
        done = drive(self.out, of=dark)
        self.assertEqual(done.returncode, 0, done.stderr)  # usable
        reports = frame_reports(self.out)
        self.assertEqual(reports[4]["state"], "FRAME_STATE_FAILED")
        self.assertIn("3 of 3 cameras have no usable image", reports[4]["reason"])
        self.assertFalse(os.path.exists(f"{self.out}/0004/mesh.ply"))
        self.assertTrue(reports[5]["driven"]["started_anew"])
        self.assertEqual(reports[5]["state"], "FRAME_STATE_DONE")

    def test_a_table_compares_with_the_truth(self):
        table = weft("evaluate", take, "--avatar", avatar, "--cameras", "2,3,4", check=0).stdout
        self.assertIn("best shape", table)
        self.assertIn("has pictures of 3 cameras, not of 4", table)
        # Without pictures the decoder is imitated.
        scores = json.loads(weft("evaluate", sources[0], "--avatar", avatar, "--cameras", "3", "--frames", "8", "--json",
                                 check=0).stdout)
        mean = {score["method"]: score["mean_mm"] for score in scores["scores"]}
        self.assertLess(mean["driven"], 2)
        self.assertLess(mean["best shape"], mean["mean shape"])
        self.assertEqual(scores["goals"][0]["id"], "A14")
        weft("evaluate", take, "--avatar", avatar, "--cameras", "2", "--check", check=0)

    def test_show_tells_what_it_was_trained_on(self):
        about = json.loads(weft("avatar", "show", avatar, "--json", check=0).stdout)
        self.assertEqual((about["kind"], about["components"], about["sources"][0]["name"]), ("sparse-view", 12, sources[0]))
        self.assertEqual(about["training_frames"] + about["held_out_frames"], 60)
        text = weft("avatar", "show", avatar, check=0).stdout
        self.assertIn(sources[0], text)
        self.assertIn("held out", text)


class Training(unittest.TestCase):
    def test_gives_the_same_bytes_at_any_number_of_threads(self):
        other = path("again.avatar")
        weft("avatar", "train", *sources, "--components", 12, "--threads", 1, "--out", other, check=0)
        for name in ("avatar.json", "space.bin"):
            self.assertEqual(read(f"{other}/{name}", "rb"), read(f"{avatar}/{name}", "rb"))

    def test_learns_from_registered_results(self):
        result, other = path("registered"), path("registered.avatar")
        weft("simulate", "--preset", "tiny", "--frames", 12, "--out", path("tube"), check=0)
        tube = path("tube")
        weft("register", tube, "--rig", f"{tube}/rig.json", "--board", f"{tube}/board.json", "--template",
             f"{tube}/template", "--out", result, check=0)
        weft("avatar", "train", result, "--components", 4, "--out", other, check=0)
        about = json.loads(weft("avatar", "show", other, "--json", check=0).stdout)
        self.assertEqual(about["training_frames"] + about["held_out_frames"], 12)
        # Of another garment: both are named.
        refused = drive(path("none"), avatar=other, check=2).stderr
        for name in (other, f"{take}/template"):
            self.assertIn(name, refused)
        mixed = weft("avatar", "train", *sources, result, "--out", path("mixed.avatar"), check=2).stderr
        self.assertIn(result, mixed)
        self.assertFalse(os.path.exists(path("mixed.avatar")))


class Refusals(unittest.TestCase):
    def refused(self, *more, **replaced):
        return drive(path("refused"), *more, **replaced, check=2).stderr

    def copy_of_avatar(self):
        other = path("broken.avatar")
        shutil.rmtree(other, ignore_errors=True)
        shutil.copytree(avatar, other)
        return other

    def test_cameras_that_do_not_exist(self):
        self.assertIn("c00, c01, c02", self.refused("--cameras", "c00,front"))
        self.assertIn("twice", self.refused("--cameras", "c00,c00"))

    def test_a_rig_in_metres(self):
        rig = json.loads(read(f"{take}/rig.json"))
        rig.pop("hash", None)
        for camera in rig["cameras"]:
            camera["translation_mm"] = [x / 1000 for x in camera["translation_mm"]]
        write(path("metres.json"), json.dumps(rig))
        refused = self.refused(rig=path("metres.json"))
        for words in ("metres.json", f"{take}/template", "in metres"):
            self.assertIn(words, refused)

    def test_broken_files(self):
        other = self.copy_of_avatar()
        write(f"{other}/space.bin", read(f"{other}/space.bin", "rb")[:-9])
        self.assertIn("space.bin", drive(path("refused"), avatar=other, check=1).stderr)
        write(f"{other}/avatar.json", "{\"kind\": \"walk\"}")
        self.assertIn("avatar.json: kind is \"walk\"", self.refused(avatar=other))
        os.remove(f"{other}/avatar.json")
        self.assertIn("weft avatar train", self.refused(avatar=other))

    def test_results_among_the_inputs(self):
        refused = drive(f"{take}/out", check=2).stderr
        self.assertIn("lies in the folder of the take", refused)

    def test_an_avatar_in_place_of_something_else(self):
        self.assertIn("is no avatar", weft("avatar", "train", *sources, "--out", take, check=2).stderr)

    def test_sources_without_meshes(self):
        self.assertIn("weft register", weft("avatar", "train", folder.name, "--out", path("x.avatar"), check=2).stderr)


if __name__ == "__main__":
    unittest.main()
