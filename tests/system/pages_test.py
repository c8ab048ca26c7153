"""The pages and first lines of calibrations, rig plans, templates and sync reports: verdict first, names and numbers that agree."""

import json
import re
import tempfile
import unittest

from browser import PageTest
from studio import StudioTest, read, weft

NBSP = "\u00a0"


def first_lines(done):
    """Grade and reason of what a command printed."""
    return re.match(r"(good|usable|bad): (.*)\n", done.stdout).groups()


class Page(PageTest):
    def assert_verdict_first(self, grade):
        self.assertEqual(self.js("[...document.querySelector('main > header').children].slice(0, 2).map(one => one.tagName)"), ["P", "H1"])
        self.assertTrue(self.texts("h1 .grade")[0].endswith(NBSP + grade))

    def assert_drawn_to_scale_with_names(self, cameras, drawings=2):
        names = self.texts("text.names")
        for camera in cameras:
            self.assertEqual(names.count(camera), drawings, camera)
        self.assertEqual(len([text for text in self.texts(".bar-line + text") if re.fullmatch(f"[0-9.]+{NBSP}m?m", text)]), drawings)

    def read_out(self, section, plot, presses):
        """What a plot says of its values, from the first on."""
        figure = f"#{section} figure:nth-of-type({plot})"
        self.browser.css(f"{figure} svg", "focus")
        said = []
        for _ in range(presses):
            self.browser.press("ArrowRight")
            said += self.texts(f"{figure} .reading")
        return said


class Calibration(Page):
    CAMERAS = [f"c{number:02}" for number in range(6)]

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.folder = tempfile.TemporaryDirectory(prefix="weft pages ")
        cls.addClassCleanup(cls.folder.cleanup)
        weft("rig", "target", "--rows", 3, "--cols", 4, "--tag-mm", 110, "--out", f"{cls.folder.name}/target", check=0)
        cls.target = f"{cls.folder.name}/target/target.json"
        weft("rig", "rehearse", "--target", cls.target, "--cameras", len(cls.CAMERAS), "--frames", 48, "--width-px", 480,
             "--height-px", 400, "--distance-mm", 2000, "--out", f"{cls.folder.name}/boards", check=0)

    def calibrate(self, name, *more, check):
        done = weft("rig", "calibrate", f"{self.folder.name}/boards", "--target", self.target, "--out",
                    f"{self.folder.name}/{name}.json", *more, check=check)
        self.show(f"{self.folder.name}/{name}.report.html")
        return done

    def test_verdict_names_error_and_the_camera_that_is_least_sure(self):
        done = self.calibrate("rig", "--min-views", 3, check=0)
        grade, _ = first_lines(done)
        self.assertIn(grade, ("good", "usable"))
        self.assertRegex(done.stdout, r"6 cameras from 48 frames: reprojection error 0\.\d{3} px; "
                                      r"projection uncertainty up to \d\.\d{3} px \(c0[0-5]\)\n")
        self.assert_verdict_first(grade)
        self.assertEqual(self.texts("h2"), ["By camera", "Corners in each camera", "Cameras that see the same boards", "Cameras", "Lenses and sigmas", "Boards"])
        self.assert_drawn_to_scale_with_names(self.CAMERAS)
        # Plot, table and report.json count the same views.
        report = json.loads(read(f"{self.folder.name}/rig.report.json"))
        views = {camera["id"]: f"{camera['views']:,}" for camera in report["cameras"]}
        self.assertEqual({row[0]: row[2] for row in self.rows("#cameras")}, views)
        self.assertEqual(self.read_out("plots", 3, 6), [f"camera {name}: {count}" for name, count in views.items()])
        self.assertEqual(report["verdict"]["grade"], f"GRADE_{grade.upper()}")
        # A panel per image with lines, the rig's lenses with sigmas.
        self.assertEqual(self.texts(".panels figcaption"), [f"{camera['id']} {camera['rms_px']:.3f} px" for camera in report["cameras"]])
        lines = self.js("[...document.querySelectorAll('.panels .corners')].map(path => path.getAttribute('d').split('M').length - 1)")
        self.assertGreater(min(lines), 100)
        shaded = self.js("[...document.querySelectorAll('.panels svg')].map(one => one.querySelectorAll('.uncovered').length)")
        self.assertEqual(shaded, [camera["coverage"].count(0) for camera in report["cameras"]])
        rig = json.loads(read(f"{self.folder.name}/rig.json"))
        for row, camera in zip(self.rows("#sigmas"), rig["cameras"]):
            self.assertRegex(row[1], rf"^{camera['fx_px']:.2f} ± [0-9.]+$")
        self.assertEqual(len(self.rows("#boards")), 1)

    def test_refused_is_bad_and_says_so_first(self):
        done = self.calibrate("refused", "--min-views", 40, "--every", 3, check=1)
        self.assertEqual(first_lines(done)[0], "bad")
        self.assertIn("refused.json was not written", done.stdout)
        self.assertEqual(done.stderr, "")
        self.assert_verdict_first("bad")
        self.assertIn("Calibration refused for ", self.texts("h1")[0])
        report = json.loads(read(f"{self.folder.name}/refused.report.json"))
        self.assertEqual(report["verdict"]["grade"], "GRADE_BAD")
        self.assertTrue(report["verdict"]["remedy"])
        self.assertEqual(self.texts("#warnings li"), [issue["message"] for issue in report["issues"]])
        self.assertEqual(self.texts("h2"), ["Why it is refused", "Corners in each camera", "Cameras that see the same boards", "Cameras"])


class TakePages(Page, StudioTest):
    def test_rig_plan_draws_its_cameras_with_names_and_to_scale(self):
        plan = self.path("plan")
        done = weft("rig", "plan", "--rig", f"{self.take}/rig.json", "--template", f"{self.take}/template", "--out", plan,
                    check=0)
        grade, _ = first_lines(done)
        shown = self.show(f"{plan}/report.html")
        self.assert_verdict_first(grade)
        told = json.loads(read(f"{plan}/plan.json"))
        self.assertEqual(told["verdict"]["grade"], f"GRADE_{grade.upper()}")
        self.assertIn(told["verdict"]["checks"][0]["limits"], shown)
        self.assert_drawn_to_scale_with_names([step["camera"] for step in told["steps"][:told["chosen"]]])
        self.assertEqual(self.texts(".colorbar")[0], "share 0 %100 %")  # shares end at 100 %
        self.assertEqual(self.texts("#maps figcaption"), ["Front", "Back"] * 4)
        self.assertEqual([row[:3] for row in self.rows("#cameras")][:2],
                         [[step["camera"], f"{place} (chosen)", f"{100 * step['coverage']:.1f} %"] for place, step in enumerate(told["steps"][:2], 1)])
        self.assertEqual(self.read_out("curves", 1, 1), [f"camera 1: {100 * told['steps'][0]['coverage']:.1f}{NBSP}%"])
        self.assertEqual(self.browser.serious(), [])

    def test_template_begins_with_its_verdict(self):
        built = weft("template", "build", self.take, "--rig", f"{self.take}/rig.json", "--board", f"{self.take}/board.json",
                     "--openings", "2", "--out", self.path("tube"), check=0)
        grade, _ = first_lines(built)
        shown = self.show(self.path("tube", "report.html"))
        self.assert_verdict_first(grade)
        for text in ("edges off the print, 95 of 100", "2 openings", "packed into a square of", "(its pose is the rest state's)"):
            self.assertIn(text, shown)
        self.assertEqual(self.texts("h2"), ["Panels on the board", "The sewn garment", "Texture", "Seams", "Openings and closed holes", "Rest state", "Panels",
                                            "Inputs"])
        # Both sides of the only seam have its number and colour.
        self.assertEqual(self.js("[...document.querySelectorAll('#board text[stroke]')].map(one => one.textContent)"), ["1", "1"])
        self.assertEqual(self.js("new Set([...document.querySelectorAll('#board path[fill=none]')].map(one => one.getAttribute('stroke'))).size"), 1)
        self.assertEqual([row[0] for row in self.rows("#borders")], ["Opening 1", "Opening 2"])
        self.assertTrue(self.js("[...document.images].every(image => image.complete && image.naturalWidth > 100)"))
        self.assertEqual(self.browser.serious(), [])
        checked = weft("template", "check", self.path("tube"), check=0)
        self.assertIn(first_lines(checked)[0], ("good", "usable"))
        told = json.loads(weft("template", "check", self.path("tube"), "--json", check=0).stdout)
        self.assertLessEqual({"template.scale", "template.strain"}, {check["id"] for check in told["verdict"]["checks"]})


class ResultPages(Page, StudioTest):
    def register(self, out, *more):
        weft("register", self.take, "--rig", f"{self.take}/rig.json", "--board", f"{self.take}/board.json", "--template", f"{self.take}/template",
             "--observations", "--out", out, *more, check=0)

    def test_evaluation_shows_the_job_and_what_was_measured(self):
        out = self.path("evaluation")
        self.register(self.path("result"))
        done = weft("evaluate", self.path("result"), "--samples", "1", "--out", out, check=0)
        grade, _ = first_lines(done)
        shown = self.show(f"{out}/report.html")
        self.assert_verdict_first(grade)
        self.assertEqual(self.js("[...document.querySelectorAll('section')].map(one => one.id)"),
                         ["paper", "job", "sequence", "meshes", "maps", "visibility", "accuracy", "frame-measures", "camera-errors", "plots", "frames",
                          "cameras", "cells", "alignment", "options", "inputs"])
        told = json.loads(read(f"{out}/evaluation.json"))
        measures, mesh = told["total"]["measures"], told["total"]["mesh"]
        self.assertEqual(self.texts(".tile b")[:3], [f"{mesh['visible_mm']['mean']:.3f}{NBSP}mm", f"{measures['texture_drift_mm_s']['mean']:.2f}{NBSP}mm/s",
                                                     f"{measures['geodesic_distortion_mm']:.2f}{NBSP}mm"])
        self.assertEqual(self.rows("#paper")[0][:3],
                         ["This result", f"{measures['texture_drift_mm_s']['mean']:.2f}", f"{measures['geodesic_distortion_mm']:.2f}"])
        self.assertEqual(self.rows("#frame-measures")[0][1], f"{100 * measures['coverage']:.1f} %")
        self.assertEqual([row[0] for row in self.rows("#frame-measures")], ["all", *self.frames])
        self.assertEqual(self.read_out("accuracy", 1, 1), [f"frame {self.frames[0]}: {told['frames'][0]['mesh']['visible_mm']['mean']:.3f}{NBSP}mm"])
        self.assertEqual([row[0] for row in self.rows("#camera-errors")], [camera["camera"] for camera in told["cameras"]])
        self.assertEqual(self.texts("#sequence .colors option"), ["state", "sigma", "error", "cloth"])
        self.assertIn("largest error", shown)
        self.assertNotRegex(shown, "NaN|Infinity|undefined|null")

    def test_comparison_sets_two_results_side_by_side(self):
        self.register(self.path("a"))
        self.register(self.path("b"), "--preset", "paper")
        weft("evaluate", self.path("a"), "--against", self.path("b"), "--out", self.path("comparison"), check=0)
        shown = self.show(self.path("comparison", "report.html"))
        told = json.loads(read(self.path("comparison", "comparison.json")))
        self.assertEqual(self.js("[...document.querySelectorAll('section')].map(one => one.id)"),
                         ["measures", "differences", "sequence", "maps", "plots", "cameras", "remarks"])
        self.assertEqual(self.texts(".sides bdi"), [self.path("a"), self.path("b")])
        rows = {row[0]: row for row in self.rows("#measures")}
        error = next(one for one in told["measures"] if one["measure"] == "mesh_visible_mean_mm")
        self.assertEqual(rows["Vertex error, seen by 3 or more, mm"][1:3], [f"{error['a']:.3f}", f"{error['b']:.3f}"])
        self.assertEqual(rows["Vertex error, seen by 3 or more, mm"][8], "not tested")
        self.assertEqual(self.texts("#sequence select.colors option")[2], "distance of A and B")
        self.assertEqual(self.js("document.querySelector('#sequence select.colors').value"), "distance of A and B")
        self.assertIn("Meshes of A, ", shown)
        self.assertGreater(len(self.texts("#plots figure")), 10)
        self.assertIn(["preset", "best", "paper"], self.rows("#differences"))
        self.assertNotRegex(shown, "NaN|Infinity|undefined|null")
        self.check_outcomes()
        self.check_sync_reports()

    def show_data(self, kind, data):
        """The page of a kind with made-up data, in the place of the page that is open."""
        self.js(f"(data => {{ const source = document.getElementById('data'); source.dataset.kind = '{kind}'; source.textContent = JSON.stringify(data); "
                f"startPage(); }})({json.dumps(data)})")
        return self.js("document.querySelector('main').innerText")

    def check_outcomes(self):
        measure = {"measure": "m", "title": "Error", "unit": "%", "frames": 9, "a": 0.5, "b": 0.25, "difference": 0.25, "standard_error": 0.01, "p": 0.0001,
                   "p_adjusted": 0.0312, "outcome": "COMPARISON_OUTCOME_A_BETTER"}
        remarks = [{"measure": "A: drift", "reason": "r1"}, {"measure": "significance", "reason": "r2"}]
        comparison = {"a": "<a>", "b": "b", "measures": [measure, {**measure, "outcome": "COMPARISON_OUTCOME_B_BETTER"}], "meshes": {}, "frames": [],
                      "differences": [], "remarks": remarks, "significance_level": 0.05, "truth": "t"}
        self.show_data("comparison", {"comparison": comparison, "maps": {"maps": [], "problems": []}, "meshes": None,
                                      "page": {"headline": "h", "decimals": [1, 1], "plots": [], "without_mesh": [], "a_cameras": [], "b_cameras": [], "notes": []}})
        self.assertEqual(self.rows("#measures"), [["Error, %", "50.0", "25.0", "25.00", "± 1.00", "9", "< 0.001", "0.031", "● A is better"],
                                                  ["Error, %", "50.0", "25.0", "25.00", "± 1.00", "9", "< 0.001", "0.031", "■ B is better"]])
        self.assertEqual(self.rows("#remarks"), [["A", "drift", "r1"], ["both", "significance", "r2"]])
        self.assertEqual(self.texts(".sides bdi")[0], "<a>")

    def check_sync_reports(self):
        def data(cameras, **more):
            timing = [{"camera": f"c{k}", "frames": "3", "missing": "0", "offset_mean_ms": 0.1 * k, "offset_jitter_ms": 0, "offset_worst_ms": 0}
                      for k in range(cameras)]
            clocks = [{"camera": f"c{k}", "readings": 1, "drift_ppm": 0, "jumps": 0, "ptp_states": [], "ptp_offset_rms_us": 0, "ptp_offset_worst_us": 0}
                      for k in range(cameras)]
            report = {"take": {"id": "take<1>", "sync": ""}, "verdict": {"grade": "GRADE_GOOD", "reason": "all", "remedy": "", "checks": [], "others": []},
                      "sets": "1234", "sets_complete": "1230", "sets_dropped": "4", "spread_median_ms": 0.25, "spread_worst_ms": 1, "timing": timing,
                      "clocks": clocks, "notes": [], "findings": []}
            series = [{"camera": f"c{k}", "offset_ms": [0.1 * k] * 3, "clock_ms": [], "ptp_us": []} for k in range(cameras)]
            return {"report": {**report, **more.pop("report", {})}, "page": {"set_names": ["0", "1", "2"], "series": series, "causes": [], **more}}
        # Six of nine cameras stray farthest.
        shown = self.show_data("sync", data(9))
        self.assertIn("1,230 of 1,234 frame sets complete, 4 dropped. Between the cameras of a set: 0.2500 ms in the median", shown)
        self.assertEqual(self.texts(".kind"), ["Weft sync of take take<1>"])
        self.assertEqual(self.texts("h2"), ["Offset from the other cameras", "Cameras"])
        self.assertEqual(self.texts("#offsets .plot figcaption"), [f"Offset, camera c{k} " for k in range(8, 2, -1)])
        self.assertIn("c8: at most 0.800 ms from 0", self.texts("#offsets .heat title"))
        self.assertEqual([row[6:] for row in self.rows("#cameras")][0], ["–", "0", "–", "–", "-"])
        self.show_data("sync", data(1, causes=["c0: 3 packets lost, 17 times"], report={"findings": ["look for <loose> cables"]}))
        self.assertEqual(self.texts("h2"), ["Findings", "Offset from the other cameras", "Missing frames", "Cameras"])
        self.assertEqual(self.texts("li"), ["look for <loose> cables", "c0: 3 packets lost, 17 times"])
        self.assertEqual(self.texts(".heat"), [])  # one camera
        series = [{"camera": "c0", "offset_ms": ["NaN"] * 3, "clock_ms": [0, 1], "ptp_us": []}, {"camera": "c1", "offset_ms": [0, 0, "NaN"], "clock_ms": [], "ptp_us": []}]
        self.show_data("sync", data(2, series=series))
        self.assertEqual(self.texts("#offsets .plot figcaption"), ["Offset, camera c1 "])
        self.assertEqual(self.texts("#offsets .heat title"), ["c0, 3 frames missing", "c1: at most 0.000 ms from 0, 1 frame missing"])
        self.assertIn("frame missing", self.texts("#offsets .tick"))
        self.assertEqual(self.texts("#clocks .plot figcaption"), ["Since the first reading, camera c0 "])
        # The ends of the scale hold all but the highest values; two hundred rows fit one picture.
        self.assertEqual(self.js("[heatScale([[0.3, -0.4, 0.2]]), heatScale([[NaN, 0]]), heatScale([[3], [7]])]"), [0.5, 1, 5])
        rows = "Array.from({length: 200}, (_, r) => ({name: `cam${r}`, values: Array(5000).fill(0.01 * r), note: ''}))"
        html = self.js(f"heatMap({{noun: 'set', names: Array.from({{length: 5000}}, (_, i) => String(i))}}, {rows}, {{title: 'Offset', unit: 'ms'}}, true).outerHTML")
        self.assertLess(len(html), 80_000)
        self.assertIn('viewBox="0 0 1120 846"', html)
        self.assertIn(">cam0</text>", html)
        self.assertNotIn(">cam1</text>", html)


if __name__ == "__main__":
    unittest.main()
