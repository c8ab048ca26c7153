"""Videos of a studio become a take: put in step by the motion of the print, and registered."""

import json
import os
import subprocess
import unittest

from studio import StudioTest, page_data, read, weft, write

CAMERAS = 8
FILM_FPS = 90  # of the simulation; each camera gets every third picture
EVERY = 3
LATE = (0, 25, 12, 40, 5, 31, 17, 38)  # pictures of the simulation by which the cameras begin later: up to 0.44 s
FRAMES = 50  # of each video
FIRST_REGISTERED, REGISTERED = 20, 4


def ffmpeg(*arguments):
    subprocess.run(["ffmpeg", "-v", "error", "-y", *arguments], check=True)


class VideosTest(StudioTest):
    # The take of StudioTest is not used, its folders and paths are.
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.film = os.path.join(cls.shared.name, "film")
        weft("simulate", "--preset", "tiny", "--cameras", CAMERAS, "--frames", max(LATE) + EVERY * FRAMES, "--fps", FILM_FPS,
             "--out", cls.film, check=0, patience_s=900)
        cls.moments = sorted(name for name in os.listdir(cls.film) if name.isdigit())
        cls.ids = [camera["id"] for camera in json.loads(read(f"{cls.film}/rig.json"))["cameras"]]

    def video(self, camera, *options, ending="mp4"):
        """The video of a camera, whose first picture is that of its lateness, as H.264 of good quality."""
        picked = self.path(f"pictures {camera}")
        os.makedirs(picked)
        for i in range(FRAMES):
            os.symlink(f"{self.film}/{self.moments[LATE[camera] + EVERY * i]}/{self.ids[camera]}.png", f"{picked}/{i:04}.png")
        path = self.path(f"{self.ids[camera]}.{ending}")
        ffmpeg("-framerate", str(FILM_FPS // EVERY), "-i", f"{picked}/%04d.png",
               *(options or ("-c:v", "libx264", "-crf", "14", "-pix_fmt", "yuv420p")), path)
        return path

    def imported(self, videos, *options, check=0):
        done = weft("take", "import", *videos, "--out", self.path("imported"), "--rig", f"{self.film}/rig.json", "--json", *options,
                    check=check)
        return json.loads(done.stdout) if check == 0 else done

    def median_error(self, dump, moments):
        """Of vertices that are seen; `moments` of the film by frame."""
        result, truth = self.path("result of " + os.path.basename(dump)), self.path("truth of " + os.path.basename(dump))
        weft("register", dump, "--rig", f"{self.film}/rig.json", "--board", f"{self.film}/board.json", "--template",
             f"{self.film}/template", "--frames", f"{FIRST_REGISTERED}:{FIRST_REGISTERED + REGISTERED}",
             "--out", result, check=0)
        os.makedirs(truth)
        for frame, moment in moments.items():
            os.symlink(f"{self.film}/truth/{moment}", f"{truth}/{frame}")
        found = json.loads(weft("evaluate", result, "--truth", truth, "--json", check=0).stdout)
        errors = [frame["mesh"]["visible_mm"]["median"] for frame in found["frames"]]
        self.assertEqual(len(errors), REGISTERED)
        return sum(errors) / REGISTERED

    def test_motion_puts_them_in_step(self):
        videos = [self.video(camera) for camera in range(CAMERAS)]
        copy = self.imported(videos, "--board", f"{self.film}/board.json")
        syncs = {camera["id"]: camera["sync"] for camera in copy["take"]["cameras"]}
        offsets = [syncs[camera].get("offset_s", 0) for camera in self.ids]
        late = [pictures / FILM_FPS for pictures in LATE]
        # Only differences can be seen.
        mean = sum(offsets) / CAMERAS - sum(late) / CAMERAS
        worst = max(abs(offset - mean - true) for offset, true in zip(offsets, late))
        period = EVERY / FILM_FPS
        print(f"worst offset error {1e3 * worst:.3f} ms = {worst / period:.3f} frames", flush=True)
        self.assertLess(worst, 0.1 * period)
        self.assertTrue(all(sync["found_by"] == "motion" for sync in syncs.values()))
        self.assertTrue(all(0 < sync["offset_sigma_s"] < 0.1 * period for sync in syncs.values()))
        weft("take", "verify", self.path("imported"), check=0)

        # The first camera makes the frame sets. The same moments from pictures without loss, all cameras in step:
        moments = {f"{i:04}": self.moments[EVERY * i] for i in range(FIRST_REGISTERED, FIRST_REGISTERED + REGISTERED)}
        lossless = self.path("lossless")
        os.makedirs(lossless)
        for frame, moment in moments.items():
            os.symlink(f"{self.film}/{moment}", f"{lossless}/{frame}")
        of_pictures = self.median_error(lossless, moments)
        of_videos = self.median_error(self.path("imported"), moments)
        print(f"median error of seen vertices: {of_videos:.4f} mm, without loss {of_pictures:.4f} mm", flush=True)
        self.assertLess(of_videos, 1.3 * of_pictures)
        self.says_which_views_were_moved(self.path("result of imported"), late, period)

    def says_which_views_were_moved(self, result, late, period):
        """To the frames of the first camera, which are a third of the film's pictures apart."""
        views = json.loads(read(f"{result}/{FIRST_REGISTERED:04}/report.json"))["views"]
        for view, begins in zip(views, late):
            expected = (begins - late[0] + period / 2) % period - period / 2
            moved = view.get("moved_ms", 0) / 1e3
            self.assertLess(abs(abs(moved) - abs(expected)), 0.1 * period, view)
        cameras = page_data(f"{result}/report.html")["job"]["cameras"]
        self.assertTrue(any(camera["frames_moved"] > 0 for camera in cameras))

    def test_says_what_is_wrong_and_goes_on(self):
        videos = [self.video(camera, "-c:v", "ffv1", ending="mkv") for camera in range(3)]
        refused = self.imported(videos, check=2)
        self.assertIn("no timecode in the videos of c00, c01, c02", refused.stderr)
        self.assertIn("--sync together", refused.stderr)
        self.assertFalse(os.path.exists(self.path("imported")))
        stray = self.path("GX01.mkv")
        os.rename(videos[2], stray)
        self.assertIn("has no camera GX01", self.imported([*videos[:2], stray], check=2).stderr)
        whole = read(stray, "rb")
        write(stray, whole[:len(whole) // 2])
        copy = self.imported([*videos[:2], "--camera", f"c02={stray}"], "--sync", "together", "--slate", "12A take 3")
        self.assertTrue(any("it is damaged" in warning for warning in copy["warnings"]), copy["warnings"])
        self.assertEqual(int(copy["sets"]), FRAMES)
        weft("take", "verify", self.path("imported"), check=0)
        info = weft("take", "info", self.path("imported"), check=0).stdout
        for words in ("slate: 12A take 3", "the video has ended", "together", "c02"):
            self.assertIn(words, info)
        weft("take", "describe", self.path("imported"), "--name", "slow walk", check=0)
        self.assertIn("12A take 3  slow walk", weft("take", "search", "WALK", "12a", "--in", self.folder, check=0).stdout)
        self.assertIn("no take", weft("take", "search", "jump", "--in", self.folder, check=0).stdout)


if __name__ == "__main__":
    unittest.main()
