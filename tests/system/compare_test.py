"""`weft evaluate A --against B`: two presets and two rigs of one take, with the truth and without it."""

import csv
import io
import json
import os
import shutil
import unittest
import xml.etree.ElementTree

from studio import StudioTest, page_data, read, weft


class Compare(StudioTest):
    def setUp(self):
        super().setUp()
        self.other = self.path("other result")
        self.register("--observations", check=0)

    def compare(self, *more, check=0):
        return json.loads(weft("evaluate", self.out, "--against", self.other, "--quick", "--json", *more, check=check).stdout)

    def by_name(self, comparison):
        return {measure["measure"]: measure for measure in comparison["measures"]}


class Presets(Compare):
    def setUp(self):
        super().setUp()
        self.register("--observations", "--preset", "paper", out=self.other, check=0)

    def test_are_compared_with_the_truth(self):
        folder = self.path("comparison")
        comparison = self.compare("--out", folder)
        measures = self.by_name(comparison)
        error = measures["mesh_visible_mean_mm"]
        self.assertEqual(error["frames"], len(self.frames))
        self.assertAlmostEqual(error["difference"], error["a"] - error["b"])
        self.assertEqual(error["outcome"], "COMPARISON_OUTCOME_NOT_TESTED")  # three frames are too few
        self.assertIn({"what": "preset", "a": "best", "b": "paper"}, comparison["differences"])
        self.assertGreater(comparison["meshes"]["distance_mm"]["max"], 0)
        alone = json.loads(weft("evaluate", self.other, "--quick", "--json", check=0).stdout)["total"]
        self.assertAlmostEqual(measures["left_out_px"]["b"], alone["measures"]["left_out_px"]["mean"], delta=0.02)
        self.check_files(folder, measures)

    def check_files(self, folder, measures):
        with open(os.path.join(folder, "measures.csv"), newline="") as file:
            lines = {line["measure"]: line for line in csv.DictReader(file)}
        self.assertEqual(set(lines), set(measures))
        for name, measure in measures.items():
            self.assertAlmostEqual(float(lines[name]["a"]), measure["a"], delta=1e-5 * max(1, abs(measure["a"])))
        frames = list(csv.DictReader(io.StringIO(read(os.path.join(folder, "frames.csv")))))
        self.assertEqual([line["frame"] for line in frames], self.frames)
        self.assertTrue(all(float(line["distance_mean_mm"]) > 0 for line in frames))
        for name in os.listdir(os.path.join(folder, "plots")) + os.listdir(os.path.join(folder, "maps")):
            kind = "maps" if os.path.exists(os.path.join(folder, "maps", name)) else "plots"
            svg = xml.etree.ElementTree.parse(os.path.join(folder, kind, name)).getroot()
            self.assertEqual(svg.tag, "{http://www.w3.org/2000/svg}svg", name)
        self.assertIn("mesh_visible_mean_mm.svg", os.listdir(os.path.join(folder, "plots")))
        self.assertIn("error_difference_mm.svg", os.listdir(os.path.join(folder, "maps")))
        page = page_data(os.path.join(folder, "report.html"))
        self.assertEqual(page["comparison"], json.loads(read(os.path.join(folder, "comparison.json"))))
        self.assertEqual([frame["name"] for frame in page["meshes"]["frames"]], self.frames)
        self.assertEqual([one["name"] for one in page["meshes"]["colorings"] if one["first_shown"]], ["distance of A and B"])
        self.assertEqual(page["meshes"]["still"]["type"], "image/png")
        self.assertGreater(len(page["maps"]["maps"]), 3)
        self.assertEqual(page["maps"]["problems"], [])

    def test_are_compared_without_a_truth(self):
        shutil.rmtree(f"{self.take}/truth")
        measures = self.by_name(self.compare())
        self.assertNotIn("mesh_visible_mean_mm", measures)
        self.assertGreaterEqual(set(measures), {"coverage", "jitter_observed_mm", "reprojection_px", "left_out_px"})
        text = weft("evaluate", self.out, "--against", self.other, "--quick", check=0).stdout
        self.assertRegex(text, r"Left-out camera error, px +\| +[0-9.]+ +[0-9.]+ \|")
        self.assertIn("differs  preset: A best, B paper", text)


class Rigs(Compare):
    def test_before_and_after_a_correction_each_have_their_own(self):
        rig = json.loads(read(f"{self.take}/rig.json"))
        rig["cameras"][0]["translation_mm"][0] += 1.5
        for key in ("id", "hash", "content_hash"):
            rig.pop(key, None)
        knocked = self.path("knocked.json")
        with open(knocked, "w") as file:
            json.dump(rig, file)
        self.register("--observations", rig=knocked, out=self.other, check=0)
        comparison = self.compare()
        measures = self.by_name(comparison)
        self.assertGreater(measures["left_out_px"]["b"], measures["left_out_px"]["a"])
        self.assertIn("rig", [difference["what"] for difference in comparison["differences"]])
        os.rename(knocked, self.path("moved.json"))
        self.assertIn("reprojection", str(self.compare()["remarks"]))
        again = self.by_name(self.compare("--against-rig", self.path("moved.json")))
        self.assertEqual(again["left_out_px"]["b"], measures["left_out_px"]["b"])


class WhatIsRefused(Compare):
    def test_says_what_to_do(self):
        nothing = weft("evaluate", self.out, "--against", self.path("nowhere"), "--no-truth", check=2)
        self.assertIn("nowhere", nothing.stderr)
        alone = weft("evaluate", self.out, "--against-rig", f"{self.take}/rig.json", check=2)
        self.assertIn("--against", alone.stderr)
        shutil.copytree(os.path.join(self.out, self.frames[0]), os.path.join(self.other, "elsewhere"))
        shutil.copytree(self.out, self.path("bare"), ignore=shutil.ignore_patterns("job.json"))
        shutil.rmtree(f"{self.take}/truth")
        foreign = weft("evaluate", self.path("bare"), "--against", self.other, "--quick", check=2)
        self.assertIn("no frame in common", foreign.stderr)


if __name__ == "__main__":
    unittest.main()
