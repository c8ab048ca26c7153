"""Rigs that are not those of the take: what `weft register`, `evaluate` and `rig refine` say of them."""

import json
import os
import unittest

from camera_campaign import exchanged, with_focal, with_scale
from studio import StudioTest, page_data, read, weft, write


class RigFaults(StudioTest):
    def setUp(self):
        super().setUp()
        self.model = json.loads(read(os.path.join(self.take, "rig.json")))
        self.model.pop("hash", None)
        self.ids = [camera["id"] for camera in self.model["cameras"]]

    def register_with(self, model, *more, check=0):
        write(self.path("rig.json"), json.dumps(model))
        return weft("register", self.take, "--rig", self.path("rig.json"), "--board", f"{self.take}/board.json", "--template",
                    f"{self.take}/template", "--frames", "0:1", "--out", self.out, *more, check=check)

    def test_exchanged_cameras_are_named_by_every_command(self):
        pair = [self.ids[2], self.ids[7]]
        words = f"cameras {pair[0]} and {pair[1]} are exchanged"
        done = self.register_with(exchanged(self.model, pair), "--observations")
        self.assertIn(f"usable: {words}", done.stdout)
        self.assertIn(f"weft rig exchange RIG {pair[0]} {pair[1]}", done.stdout)
        self.assertIn(words, read(os.path.join(self.out, "report.html")))
        evaluated = weft("evaluate", self.out, "--quick")
        self.assertIn(words, evaluated.stdout)
        refined = weft("rig", "refine", self.out, "--rig", self.path("rig.json"), "--out", self.path("refined.json"), check=1)
        self.assertIn(f"bad: {words}", refined.stdout)
        self.assertFalse(os.path.exists(self.path("refined.json")))
        # The remedy is one.
        weft("rig", "exchange", self.path("rig.json"), *pair, "--out", self.path("right.json"), check=0)
        right = json.loads(read(self.path("right.json")))
        again = weft("rig", "exchange", self.path("rig.json"), *pair, "--out", self.path("rig.json"), check=2)
        self.assertIn("--force", again.stderr)
        self.assertEqual(right["hash"], json.loads(read(os.path.join(self.take, "rig.json")))["hash"])

    def test_an_exchanged_part_takes_its_sigmas_along(self):
        """Sigmas of the lens are nine of the first camera 1, of the other 2; those of the place 10 and 20."""
        self.model["calibration"] = {"version": 3}
        one, other = self.ids[2], self.ids[7]
        for camera in self.model["cameras"]:
            lens, place = (2, 20) if camera["id"] == other else (1, 10)
            camera["sigmas"] = {**dict.fromkeys(("fx_px", "fy_px", "cx_px", "cy_px"), lens), "distortion": [lens] * 5,
                                "rotation_deg": [place] * 3, "center_mm": [place] * 3, "views": lens}
        write(self.path("rig.json"), json.dumps(self.model))
        for part, lens, place, views in (("camera", 2, 20, 2), ("place-and-lens", 2, 20, 1), ("place", 1, 20, 1), ("lens", 2, 10, 1)):
            out = self.path(f"{part}.json")
            weft("rig", "exchange", self.path("rig.json"), one, other, "--only", part, "--out", out, check=0)
            sigmas = {camera["id"]: camera["sigmas"] for camera in json.loads(read(out))["cameras"]}[one]
            self.assertEqual([sigmas["fx_px"], sigmas["distortion"][4], sigmas["views"]], [lens, lens, views], part)
            for value in (*sigmas["rotation_deg"], *sigmas["center_mm"]):
                self.assertAlmostEqual(value, place, msg=part)

    def test_cameras_that_the_rig_lacks_count(self):
        self.model["cameras"] = self.model["cameras"][:8]
        done = self.register_with(self.model)
        self.assertIn(f"usable: 4 of {len(self.ids)} cameras of the recording are not in the rig", done.stdout)
        page = page_data(os.path.join(self.out, "report.html"))["job"]
        self.assertEqual((len(page["cameras"]), page["figures"]["unknown_cameras"]), (8, 4))

    def test_cloth_that_is_not_as_large_as_its_print_is_named(self):
        # Before such long lenses the perspective of the cloth tells nothing, so both causes are named.
        for model in (with_focal(self.model, 0.95), with_scale(self.model, 1.05)):
            done = self.register_with(model)
            self.assertIn("usable: the cloth is not as large as its print", done.stdout)
            self.assertIn("another scale or other units, its focal lengths are off", done.stdout)


if __name__ == "__main__":
    unittest.main()
