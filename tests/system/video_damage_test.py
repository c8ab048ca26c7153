"""Damaged videos: pictures that are wrong are missing in the take, sound ones are in it, and it is said."""

import glob
import json
import os
import subprocess
import tempfile
import unittest

from made_films import cut_off, damage, ffmpeg, lose, moving, with_false_sei
from studio import read, weft

FRAMES = 90
H264 = ("-c:v", "libx264", "-preset", "veryfast", "-pix_fmt", "yuv420p", "-g", "15")
HEVC = ("-c:v", "libx265", "-preset", "veryfast", "-pix_fmt", "yuv420p", "-x265-params",
        "log-level=error:keyint=15:bframes=2:open-gop=0")


class VideoDamageTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def imported(self, films):
        """The take's pictures of each camera by frame set, and what is warned of it."""
        cameras = [word for name, path in films.items() for word in ("--camera", f"{name}={path}")]
        done = json.loads(weft("take", "import", *cameras, "--sync", "together", "--out", self.path("take"), "--json",
                               check=0).stdout)
        weft("take", "export", self.path("take"), "--out", self.path("pictures"), check=0)
        sets = sorted(glob.glob(self.path("pictures/*/")))
        pictures = {name: [read(file, "rb") if os.path.exists(file := f"{folder}{name}.png") else None for folder in sets]
                    for name in films}
        warnings = {name: [text for text in done["warnings"] if text.startswith(f"{name} (")] for name in films}
        return pictures, warnings

    def check(self, pictures, warnings, name, whole, missing):
        """`missing`: numbers of the pictures; all others are as in the film that is whole."""
        found = [i for i in range(FRAMES) if pictures[name][i] is None]
        wrong = [i for i in range(FRAMES) if pictures[name][i] not in (None, pictures[whole][i])]
        with self.subTest(name):
            self.assertEqual((wrong, found), ([], list(missing)))
            self.assertEqual(any("it is damaged" in text for text in warnings[name]), bool(missing), warnings[name])

    def test_wrong_pictures_are_missing_and_sound_ones_are_not(self):
        good = moving(self.path("good.mp4"), *H264, "-bf", "2")
        open_groups = moving(self.path("open.mp4"), *H264, "-bf", "2", "-x264opts", "open-gop=1")
        baseline = moving(self.path("baseline.mp4"), *H264, "-profile:v", "baseline")
        hevc = moving(self.path("hevc.mp4"), *HEVC)
        mjpeg = moving(self.path("mjpeg.mov"), "-c:v", "mjpeg", "-pix_fmt", "yuvj420p")
        prores = moving(self.path("prores.mov"), "-c:v", "prores")
        whole = {"good": good, "open": open_groups, "baseline": baseline, "hevc": hevc, "mjpeg": mjpeg, "prores": prores}
        films = dict(whole)
        of = {}

        def add(name, source, path):
            films[name], of[name] = path, source

        add("key", "good", damage(good, self.path("key.mp4"), 30, 600))
        add("no_key", "good", lose(good, self.path("no_key.mkv"), "eq(n,30)"))
        add("gone", "good", lose(good, self.path("gone.mkv"), "eq(n,19)"))
        add("open_key", "open", damage(open_groups, self.path("open_key.mp4"), 30, 600))
        add("in_order", "baseline", damage(baseline, self.path("in_order.mp4"), 33, 300, at=0.1))
        add("hevc_gone", "hevc", lose(hevc, self.path("hevc_gone.mkv"), "eq(n,20)"))
        add("jpeg", "mjpeg", damage(mjpeg, self.path("jpeg.mov"), 33, 400, at=0.3))
        add("intra", "prores", damage(prores, self.path("intra.mov"), 33, 400, at=0.3))
        add("false_sei", "good", with_false_sei(good, self.path("false_sei.mp4")))
        pictures, warnings = self.imported(films)
        for name in whole:
            self.check(pictures, warnings, name, name, [])
        expected = {"key": range(30, 45), "jpeg": [33], "intra": [33], "in_order": range(33, 45), "false_sei": []}
        for name, missing in expected.items():
            self.check(pictures, warnings, name, of[name], missing)
        for name in set(of) - set(expected):
            found = [i for i in range(FRAMES) if pictures[name][i] is None]
            self.check(pictures, warnings, name, of[name], found)
            self.assertLessEqual(len(found), 17, f"{name}: more than a group of pictures: {found}")
        ledger = read(self.path("take/ledger.csv"))
        self.assertIn("the video is damaged at this time", ledger)

    def test_cut_files_keep_what_they_hold(self):
        good = moving(self.path("good.mp4"), *H264, "-bf", "2")
        films = {"good": good}
        for name, ending, options in (("mkv", "mkv", ()), ("stream", "ts", ()), ("fast", "mp4", ("-movflags", "+faststart"))):
            ffmpeg("-i", good, "-c", "copy", *options, self.path(f"whole_{name}.{ending}"))
            films[name] = cut_off(self.path(f"whole_{name}.{ending}"), self.path(f"{name}.{ending}"), 0.6)
        pictures, warnings = self.imported(films)
        for name in ("mkv", "stream", "fast"):
            kept = sum(picture is not None for picture in pictures[name])
            self.assertGreater(kept, FRAMES // 2, name)
            found = [i for i in range(FRAMES) if pictures[name][i] is None]
            wrong = [i for i in range(FRAMES) if pictures[name][i] not in (None, pictures["good"][i])]
            self.assertEqual(wrong, [], name)
            # The last ones wait for others, which the file lacks.
            self.assertGreaterEqual(min(found), kept - 2, name)
            self.assertTrue(any("the video has ended" in line or "films sets 0 to" in line for line in warnings[name]), name)

    def test_chapters_are_one_recording(self):
        first, second = self.path("GX010042.MP4"), self.path("GX020042.MP4")
        moving(first, *H264, seconds=1)
        moving(second, *H264, seconds=1)
        done = weft("take", "import", first, second, "--sync", "together", "--out", self.path("take"), check=2)
        self.assertIn("is a chapter of the same recording as", done.stderr)
        done = weft("take", "import", "--camera", f"a={first}", "--sync", "together", "--out", self.path("take"), check=0)
        self.assertIn("goes on in GX020042.MP4", done.stderr)

    def test_a_limit_of_file_sizes_is_an_error(self):
        path = moving(self.path("good.mp4"), *H264)
        program = os.path.join(os.environ["WEFT_BIN"], "weft")
        for limit_kib in (2, 64):
            command = f"ulimit -f {limit_kib}; exec '{program}' take import 'a={path}' --out '{self.path('take')}'"
            command = command.replace("import ", "import --sync together --camera ")
            done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 1, done.stderr)
            self.assertIn("ulimit -f", done.stderr)


if __name__ == "__main__":
    unittest.main()
