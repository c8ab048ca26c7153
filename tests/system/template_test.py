"""A garment without a template: from its first recording to registered meshes, as a new studio does it."""

import json
import os
import unittest

from studio import StudioTest, page_data, read, weft


class TemplateFromARecording(StudioTest):
    def build(self, *more, check=None):
        return weft("template", "build", self.take, "--board", f"{self.take}/board.json", "--out", self.path("tube"),
                    *more, check=check)

    def test_recording_is_registered_with_the_template_built_from_it(self):
        built = self.build("--rig", f"{self.take}/rig.json", "--openings", "2", check=0)
        self.assertIn("2 openings", built.stdout)
        self.assertEqual(len(os.listdir(self.path("tube", "clouds"))), len(self.frames))
        done = self.register(template=self.path("tube"), check=0)
        self.assertIn(f"{len(self.frames)} of {len(self.frames)} frames registered", done.stdout)

    def test_corners_double_the_vertices_that_registration_and_evaluation_know(self):
        built = self.build("--rig", f"{self.take}/rig.json", "--openings", "2", "--corners", check=0)
        self.assertIn("2 openings", built.stdout)
        summary = json.loads(weft("template", "check", self.path("tube"), "--json", check=0).stdout)
        self.assertGreater(summary["vertices_with_corner"], 0.85 * summary["vertices_with_cell"])
        self.register(template=self.path("tube"), check=0)
        mesh = json.loads(read(os.path.join(self.out, self.frames[0], "report.json")))["mesh"]
        self.assertEqual(mesh["vertices_with_cell"], summary["vertices_with_cell"] + summary["vertices_with_corner"])
        self.assertGreater(mesh["coverage"], 0.9)
        self.assertEqual(mesh.get("self_intersections", 0), 0)
        scores = json.loads(weft("evaluate", self.out, "--no-truth", "--fps", "30", "--samples", "1", "--json",
                                 check=0).stdout)
        drift = scores["total"]["measures"]["texture_drift_mm_s"]
        self.assertGreater(drift["count"], 0.5 * summary["vertices_with_cell"])
        self.assertLess(drift["median"], 0.6)

    def test_clouds_are_kept_when_the_garment_is_not_what_was_expected(self):
        refused = self.build("--rig", f"{self.take}/rig.json", "--openings", "4", "--samples", "1", check=2)
        self.assertIn("has 2 openings, expected were 4", refused.stderr)
        self.assertEqual(os.listdir(self.path("tube")), ["clouds"])
        cloud = self.path("tube", "clouds", f"{self.frames[0]}.ply")
        weft("template", "build", cloud, "--board", f"{self.take}/board.json", "--openings", "2", "--out",
             self.path("tube"), check=0)
        self.assertIn("2 openings", page_data(self.path("tube", "report.html"))["summary"]["verdict"]["reason"])

    def test_recording_without_cameras_is_refused(self):
        self.assertIn("--rig", self.build(check=2).stderr)

    def test_frames_without_images_are_named(self):
        for frame in self.frames:
            for image in self.images[2:]:
                os.remove(os.path.join(self.take, frame, image))
        refused = self.build("--rig", f"{self.take}/rig.json", "--samples", "1", check=2)
        self.assertIn("only 2 of 12 cameras have a usable image, triangulation needs 3", refused.stderr)
        self.assertFalse(os.path.exists(self.path("tube")))


if __name__ == "__main__":
    unittest.main()
