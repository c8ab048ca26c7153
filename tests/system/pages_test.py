"""The pages and first lines of calibrations, rig plans and templates: verdict first, names and numbers that agree."""

import html
import json
import re
import tempfile
import unittest

from studio import StudioTest, read, weft


def first_lines(done):
    """Grade and reason of what a command printed."""
    return re.match(r"(good|usable|bad): (.*)\n", done.stdout).groups()


class Page(unittest.TestCase):
    def assert_verdict_first(self, page, grade):
        head = page[page.index("<main>"):page.index("</header>")]
        self.assertRegex(head, rf'^<main>\s*<header>\s*<p class="kind">[^\n]*\s*<h1><span class="grade \w+">[^<]*{grade}')

    def names(self, page):
        """Names beside the cameras of a page's drawings, as often as they occur."""
        return [html.unescape(name) for name in re.findall(r'<text class="names"[^>]*>([^<]*)</text>', page)]

    def assert_drawn_to_scale_with_names(self, page, cameras, drawings=2):
        for camera in cameras:
            self.assertEqual(self.names(page).count(camera), drawings, camera)
        self.assertEqual(len(re.findall(r'class="bar-line".*?[0-9]\u00a0m?m</text>', page)), drawings)


class Calibration(Page):
    CAMERAS = [f"c{number:02}" for number in range(6)]

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="weft pages ")
        cls.addClassCleanup(cls.folder.cleanup)
        weft("rig", "target", "--rows", 3, "--cols", 4, "--tag-mm", 110, "--out", f"{cls.folder.name}/target", check=0)
        cls.target = f"{cls.folder.name}/target/target.json"
        weft("rig", "rehearse", "--target", cls.target, "--cameras", len(cls.CAMERAS), "--frames", 48, "--width-px", 480,
             "--height-px", 400, "--distance-mm", 2000, "--out", f"{cls.folder.name}/boards", check=0)

    def calibrate(self, name, *more, check):
        done = weft("rig", "calibrate", f"{self.folder.name}/boards", "--target", self.target, "--out",
                    f"{self.folder.name}/{name}.json", *more, check=check)
        return done, read(f"{self.folder.name}/{name}.report.html")

    def test_verdict_names_error_and_the_camera_that_is_least_sure(self):
        done, page = self.calibrate("rig", "--min-views", 3, check=0)
        grade, _ = first_lines(done)
        self.assertIn(grade, ("good", "usable"))
        self.assertRegex(done.stdout, r"6 cameras from 48 frames: reprojection error 0\.\d{3} px; "
                                      r"projection uncertainty up to \d\.\d{3} px \(c0[0-5]\)\n")
        self.assert_verdict_first(page, grade)
        self.assert_drawn_to_scale_with_names(page, self.CAMERAS)
        # Plot and table count the same views.
        table = dict(re.findall(r"<tr><td><bdi>(c\d\d)</bdi></td><td>[\d,]+</td><td>([\d,]+)</td>", page))
        plot = page[page.index("<figcaption>Views of boards"):]
        self.assertEqual(dict(re.findall(r"<title>camera (c\d\d): ([\d,]+)</title>", plot[:plot.index("</figure>")])), table)
        report = json.loads(read(f"{self.folder.name}/rig.report.json"))
        self.assertEqual({camera["id"]: f"{camera['views']:,}" for camera in report["cameras"]}, table)
        self.assertEqual(report["verdict"]["grade"], f"GRADE_{grade.upper()}")

    def test_refused_is_bad_and_says_so_first(self):
        done, page = self.calibrate("refused", "--min-views", 40, "--every", 3, check=1)
        self.assertEqual(first_lines(done)[0], "bad")
        self.assertIn("refused.json was not written", done.stdout)
        self.assertEqual(done.stderr, "")
        self.assert_verdict_first(page, "bad")
        report = json.loads(read(f"{self.folder.name}/refused.report.json"))
        self.assertEqual(report["verdict"]["grade"], "GRADE_BAD")
        self.assertTrue(report["verdict"]["remedy"])


class TakePages(StudioTest, Page):
    def test_rig_plan_draws_its_cameras_with_names_and_to_scale(self):
        plan = self.path("plan")
        done = weft("rig", "plan", "--rig", f"{self.take}/rig.json", "--template", f"{self.take}/template", "--out", plan,
                    check=0)
        grade, _ = first_lines(done)
        page = read(f"{plan}/report.html")
        self.assert_verdict_first(page, grade)
        told = json.loads(read(f"{plan}/plan.json"))
        self.assertEqual(told["verdict"]["grade"], f"GRADE_{grade.upper()}")
        self.assertIn(told["verdict"]["checks"][0]["limits"], page)
        self.assert_drawn_to_scale_with_names(page, [step["camera"] for step in told["steps"][:told["chosen"]]])
        self.assertIn("<span>100 %</span>", page)  # shares end at 100 %
        self.assertIn("<figcaption>Front</figcaption>", page)
        self.assertIn("<figcaption>Back</figcaption>", page)

    def test_template_begins_with_its_verdict(self):
        built = weft("template", "build", self.take, "--rig", f"{self.take}/rig.json", "--board", f"{self.take}/board.json",
                     "--openings", "2", "--out", self.path("tube"), check=0)
        grade, _ = first_lines(built)
        page = read(self.path("tube", "report.html"))
        self.assert_verdict_first(page, grade)
        self.assertIn("edges off the print, 95 of 100", page)
        checked = weft("template", "check", self.path("tube"), check=0)
        self.assertIn(first_lines(checked)[0], ("good", "usable"))
        told = json.loads(weft("template", "check", self.path("tube"), "--json", check=0).stdout)
        self.assertLessEqual({"template.scale", "template.strain"}, {check["id"] for check in told["verdict"]["checks"]})


if __name__ == "__main__":
    unittest.main()
