"""Which values the goals of avatar_goals.json get from scores."""

import json
import os
import subprocess
import sys
import tempfile
import unittest

import avatar_goals


def score(split, cameras, method, mean_mm, **more):
    return {"split": split, "cameras": cameras, "method": method, "frames": 10, "mean_mm": mean_mm, "median_mm": 1,
            "across_mm": 0.1, "seen_mm": 1, "unseen_mm": 1, "chamfer_mm": 1, "error_jitter_seen_mm": 0, "error_jitter_unseen_mm": 0,
            "share_within_sigma": 0.7, "share_within_two_sigma": 0.93, "lost_vertices": "0", "ms_a_frame": 90, "threads": 1,
            "at_seams_mm": 0, "off_seams_mm": 0, **more}


class Goals(unittest.TestCase):
    def setUp(self):
        with open(avatar_goals.GOALS, encoding="utf-8") as file:
            self.goals = json.load(file)

    def values(self, *scores):
        return {(name, what): value for name, what, value, _, _ in avatar_goals.rows(scores, self.goals)}

    def test_are_those_of_the_scores_that_are_there(self):
        self.assertEqual(self.values(score("validate", 2, "driven", 1)), {})
        values = self.values(score("test-known", 2, "driven", 2))
        self.assertEqual(values[("A1", "mean mm, test-known, 2 cameras")], 2)
        self.assertNotIn("A2", {name for name, _ in values})
        self.assertNotIn("A5", {name for name, _ in values})

    def test_compare_with_other_methods_and_numbers_of_cameras(self):
        values = self.values(
            score("test-known", 2, "driven", 2, error_jitter_seen_mm=0.2, at_seams_mm=3, off_seams_mm=2),
            score("test-known", 2, "carrier", 5), score("test-known", 2, "frame by frame", 2, error_jitter_seen_mm=0.8),
            score("test-known", 8, "driven", 1.5, from_registered_mm=0.25), score("test-known", 3, "driven", 1),
            score("test-known", 2, "elsewhere", 2.5), score("test-known", 2, "one dark", 9, lost_vertices="3"),
            score("test-known", 2, "after dark", 2.2), score("test-known", 2, "never dark", 2))
        for (name, what), value in {
                ("A5", "mean over that of the carrier, test-known, 2 cameras"): 0.4,
                ("A7", "mean of 2 cameras elsewhere over theirs, test-known, 2 cameras"): 1.25,
                ("A8", "mean over that of one number of cameras less, the worst, test-known"): 1.5,
                ("A8", "mm from the registration, where it has points, test-known"): 0.25,
                ("A9", "jitter, seen, over that frame by frame, test-known, 2 cameras"): 0.25,
                ("A10", "vertices over 80 mm, one of 2 dark, test-known, 2 cameras"): 3,
                ("A10", "mean 10 frames after the dark over that without, test-known, 2 cameras"): 1.1,
                ("A11", "errors below 1 sigma, off 68 %, test-known, 2 cameras"): 2,
                ("A12", "ms a frame without decoding, one core, test-known, 2 cameras"): 90,
                ("X3", "mean at seams over that elsewhere, test-known, 2 cameras"): 1.5}.items():
            self.assertAlmostEqual(values[(name, what)], value, msg=what)

    def test_many_threads_say_nothing_of_one_core(self):
        self.assertNotIn("A12", {name for name, _ in self.values(score("test-known", 2, "driven", 2, threads=2))})

    def test_the_command_tells_what_is_missed(self):
        def run(*scores):
            with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
                json.dump({"scores": scores}, file)
                file.flush()
                return subprocess.run([sys.executable, avatar_goals.__file__, file.name], capture_output=True, text=True, check=False)
        missed = run(score("test-known", 2, "driven", 9))
        self.assertEqual(missed.returncode, 1)
        self.assertIn("missed", missed.stdout)
        self.assertEqual(run(score("test-known", 2, "driven", 1.5, ms_a_frame=50)).returncode, 0)
        self.assertIn("has no scores that a goal is about", run(score("validate", 2, "driven", 1)).stderr)

    def test_an_avatar_has_a_size(self):
        with tempfile.TemporaryDirectory() as folder:
            for name, kilobytes in (("space.bin", 7000), ("net.onnx", 4000)):
                with open(os.path.join(folder, name), "wb") as file:
                    file.write(bytes(1000 * kilobytes))
            evaluation = os.path.join(folder, "none.json")
            with open(evaluation, "w", encoding="utf-8") as file:
                file.write('{"scores": []}')
            done = subprocess.run([sys.executable, avatar_goals.__file__, evaluation, "--avatar", folder], capture_output=True,
                                  text=True, check=False)
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stdout, r"A14 +size of the avatar, MB +11\.000 +10 +6  missed")


if __name__ == "__main__":
    unittest.main()
