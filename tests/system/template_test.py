"""A garment without a template: from its first recording to registered meshes, as a new studio does it."""

import os
import unittest

from studio import StudioTest, read, weft


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

    def test_clouds_are_kept_when_the_garment_is_not_what_was_expected(self):
        refused = self.build("--rig", f"{self.take}/rig.json", "--openings", "4", "--samples", "1", check=2)
        self.assertIn("has 2 openings, expected were 4", refused.stderr)
        self.assertEqual(os.listdir(self.path("tube")), ["clouds"])
        cloud = self.path("tube", "clouds", f"{self.frames[0]}.ply")
        weft("template", "build", cloud, "--board", f"{self.take}/board.json", "--openings", "2", "--out",
             self.path("tube"), check=0)
        self.assertIn("2 openings", read(self.path("tube", "report.html")))

    def test_recording_without_cameras_is_refused(self):
        self.assertIn("--rig", self.build(check=2).stderr)

    def test_frames_without_images_are_named(self):
        for frame in self.frames:
            for image in self.images[2:]:
                os.remove(os.path.join(self.take, frame, image))
        refused = self.build("--rig", f"{self.take}/rig.json", "--samples", "1", check=2)
        self.assertIn("only 2 of 12 cameras have an image, triangulation needs 3", refused.stderr)
        self.assertFalse(os.path.exists(self.path("tube")))


if __name__ == "__main__":
    unittest.main()
