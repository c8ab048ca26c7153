"""What the parts of pages' program make of numbers and names: its functions are called on a page of next to nothing."""

import glob
import json
import os
import re
import subprocess
import tempfile
import unittest

from browser import MODULES, SOURCE, need_browser
from sample_pages import ReportPages

NBSP = "\u00a0"


class Types(unittest.TestCase):
    def test_of_the_program_agree(self):
        need_browser()
        files = glob.glob(os.path.join(SOURCE, "services", "results", "report", "page", "*.js"))
        done = subprocess.run([os.path.join(MODULES, ".bin", "tsc"), "--noEmit", "--checkJs", "--allowJs", "--strict", "--noUnusedLocals", "--target",
                               "es2022", "--module", "es2022", "--moduleResolution", "bundler", "--lib", "es2022,dom,dom.iterable", *files],
                              capture_output=True, text=True, check=False, cwd=tempfile.gettempdir())
        self.assertEqual(done.stdout, "")
        self.assertEqual(done.returncode, 0)


class Parts(ReportPages):
    def setUp(self):
        self.open("none")

    def html(self, expression):
        """Of what an expression makes, or null."""
        return self.js(f"({expression})?.outerHTML ?? null")

    def shown(self, expression):
        return self.js(f"({expression}).textContent")

    def test_numbers_read_well(self):
        for expression, text in {
            "formatCount(1234567)": "1,234,567", "formatCount(999)": "999", "formatCount(-1200)": "−1,200", "formatCount('1234')": "1,234",
            "formatCount(NaN)": "–", "formatCount(undefined)": "–", "formatNumber(10447.316, 2)": "10,447.32",
            "formatNumber(-0.26, 1)": "−0.3", "formatNumber(-0.0004, 3)": "0.000", "formatNumber(12, 0)": "12",
            "formatNumber('NaN', 2)": "–", "formatNumber('Infinity', 2)": "–",
            "formatPercent(0.9997)": f"99.9{NBSP}%", "formatPercent(1)": f"100.0{NBSP}%", "formatPercent(0.952)": f"95.2{NBSP}%",
            "formatDuration(0.3)": f"0.3{NBSP}ms", "formatDuration(340)": f"340{NBSP}ms", "formatDuration(999.6)": f"1.00{NBSP}s",
            "formatDuration(2310)": f"2.31{NBSP}s", "formatDuration(250000)": f"4{NBSP}min{NBSP}10{NBSP}s",
            "formatDuration(3599700)": f"1{NBSP}h{NBSP}0{NBSP}min", "formatDuration(-1)": "–",
            "formatUnixTime('1790000000000000000')": "2026-09-21 14:13:20 UTC", "formatUnixTime('0')": "–",
            "formatShort(0.5)": "0.5", "formatShort(-2)": "−2", "counted(1, 'frame', 'frames')": "1 frame",
            "counted(1200, 'frame', 'frames')": "1,200 frames", "words('too_few_views')": "too few views",
            "shortened('äöü', 2)": "äö…", "shortened('abc', 3)": "abc", "printable('a\\u0001b\\n')": "a\ufffdb\n",
        }.items():
            self.assertEqual(self.js(expression), text, expression)
        self.assertEqual(self.js("[medianOf([3, NaN, 1, '2']), medianOf([1, 2])]"), [2, 1.5])

    def test_bins_hold_every_frame_once(self):
        for count in (1, 119, 120, 121, 240, 1000, 100_003):
            bins = self.js(f"makeBins({count}, 120).map(bin => [bin.begin, bin.end])")
            self.assertLessEqual(len(bins), 120)
            self.assertEqual([bin[0] for bin in bins], [0] + [bin[1] for bin in bins[:-1]])
            self.assertEqual(bins[-1][1], count)
        self.assertEqual(self.js("makeBins(0, 120)"), [])
        self.assertEqual(self.js("valuesIn({begin: 1, end: 4}, [9, 1, NaN, 3])"), {"mean": 2, "low": 1, "high": 3})

    def test_ticks_are_round_and_hold_the_range(self):
        self.assertEqual(self.js("roundTicks(0, 10)"), [0, 2.5, 5, 7.5, 10])
        self.assertEqual(self.js("roundTicks(0, 0)"), [0, 0.25, 0.5, 0.75, 1])
        for low, high in ((0, 11_730), (0, 0.087), (-3, 4.5), (5, 5), (0, 1e-9)):
            ticks = self.js(f"roundTicks({low}, {high})")
            self.assertIn(len(ticks), range(3, 8))
            self.assertLessEqual(ticks[0], low + 1e-12)
            self.assertGreaterEqual(ticks[-1], high * (1 - 1e-12))
        self.assertEqual(self.js("tickLabels([0, 0.25, 0.5], {})"), ["0.00", "0.25", "0.50"])
        self.assertEqual(self.js("tickLabels([0, 2000], {})"), ["0", "2,000"])
        self.assertEqual(self.js("tickLabels([0.5, 1], {unit: '%'})"), [f"50{NBSP}%", f"100{NBSP}%"])
        one = "[{mean: 0.93, low: 0.93, high: 0.93}]"
        for tick, expected in zip(self.js(f"valueTicks({one}, {{unit: '%', fromZero: false}})"), (0.8, 0.85, 0.9, 0.95, 1)):
            self.assertAlmostEqual(tick, expected)
        close = "[{mean: 0.022, low: 0.021, high: 0.026}]"
        self.assertLess(self.js(f"valueTicks({close}, {{unit: '%', fromZero: false, wholePercent: false}}).at(-1)"), 0.03)
        self.assertEqual(self.js("valueTicks([{mean: NaN}], {})"), [0, 0.25, 0.5, 0.75, 1])

    def test_lines_break_where_a_value_is_missing(self):
        axis = "{names: ['0', '1', '2', '3', '4'], withoutMesh: [false, false, true, false, false], noun: 'frame'}"
        svg = self.html(f"linePlot({axis}, [1, 2, NaN, 4, 5], {{title: 'Cells'}})")
        data = re.search('class="line" d="([^"]*)"', svg)[1]
        self.assertEqual((data.count("M"), data.count("L")), (2, 2))
        self.assertEqual(svg.count('class="lost"'), 1)
        self.assertNotIn("NaN", svg)
        nothing = self.html(f"linePlot({axis}, [NaN, NaN, NaN, NaN, NaN], {{title: 'Coverage', unit: '%'}})")
        self.assertIn(f"100{NBSP}%", self.shown(f"linePlot({axis}, [], {{title: 'Coverage', unit: '%'}})"))
        self.assertNotIn("<circle", nothing)
        self.assertEqual(self.js("new PlotArea(2, [0, 5, 10]).path([{mean: 0}, {mean: 10}])"), "M183.5 186.0L426.5 14.0")
        self.assertEqual(self.js("[5, 20, -1].map(value => new PlotArea(2, [0, 5, 10]).y(value))"), [100, 14, 186])

    def test_values_of_a_few_of_many_frames_are_points(self):
        svg = self.html("linePlot({names: Array(400).fill('x'), noun: 'frame'}, Array.from({length: 400}, (_, i) => "
                        "i >= 198 && i < 204 ? 3 : i >= 10 && i % 20 === 10 ? 2 : NaN), {title: 'Drift'})")
        self.assertEqual(svg.count("<circle"), 20)  # and a line where neighbours have values

    def test_bars_stack_to_the_total_of_the_frame(self):
        svg = self.html("stackedPlot({names: ['0'], noun: 'frame'}, [{name: 'decode', values: [3000]}, {name: 'align', values: [1000]}], {title: 'Time'})")
        # 4 s fill the axis from the bottom at 186 to the top at 14.
        self.assertRegex(svg, 'class="f0" x="[0-9.]+" y="57.00" width="60.00" height="129.00"')
        self.assertRegex(svg, 'class="f1" x="[0-9.]+" y="14.00" width="60.00" height="43.00"')
        folded = self.js("foldedLayers(Array.from({length: 11}, (_, i) => ({name: `stage_${i}`, values: [10]})))")
        self.assertEqual([layer["name"] for layer in folded], [f"stage_{i}" for i in range(7)] + ["other"])
        self.assertEqual(folded[-1]["values"], [40])

    def test_series_differ_without_colours_too(self):
        html = self.html("overlaidPlot({names: ['0', '1', '2'], noun: 'frame'}, [{name: 'A <1>', values: [1, 2, 3]}, {name: 'B', values: [1.5, NaN, 2.5]},"
                         "{name: 'c', values: []}, {name: 'd', values: []}, {name: 'e', values: [1]}], {title: 'Error, mm', unit: 'mm', decimals: 2})")
        for part in ('class="series s0"', 'class="series s1"', '<circle class="m0"', '<rect class="m1"', "</svg>A &lt;1&gt;</li>", "</svg>d</li>"):
            self.assertIn(part, html)
        self.assertNotIn("</svg>e</li>", html)
        self.assertIn("series s2", self.html("overlaidPlot({names: ['0'], noun: 'frame'}, [{name: 'a', values: [1]}], {title: '', firstStyle: 2})"))
        self.assertLess(len(self.html("overlaidPlot({names: Array(10000).fill('x'), noun: 'frame'}, [{name: 'a', values: Array(10000).fill(1)}], "
                                      "{title: ''})")), 60_000)

    def test_verdicts_tell_a_reason_once_then_remedy_checks_and_findings(self):
        bad = "{grade: 'GRADE_BAD', reason: '3\u00a0of 9 frames <failed>', remedy: 'add cameras & light', checks: [], others: []}"
        self.assertEqual(self.shown("pageHead('Report', 'a < b', undefined)"), "Reporta < b")
        self.assertIn("3\u00a0of 9 frames <failed>", self.shown(f"pageHead('', 'Another headline', {bad})"))
        self.assertNotIn("\u00a0of 9", self.shown(f"pageHead('', '3 of 9 frames <failed>.', {bad})"))
        self.assertIn("Remedy: add cameras & light", self.shown(f"pageHead('', 'x', {bad})"))
        full = ("{grade: 'GRADE_GOOD', reason: 'x', remedy: '', checks: [{name: 'coverage', grade: 'GRADE_USABLE', value: '71 %', limits: "
                "'good from 80 %'}], others: [{grade: 'GRADE_GOOD', reason: 'all cameras agree'}]}")
        block = self.js(f"verdictBlock('Headline', {full}).map(one => one.innerText ?? one.textContent).join('|')")
        self.assertIn(f"coverage71 %!{NBSP}usablegood from 80 %", block)
        self.assertIn(f"✓{NBSP}good all cameras agree", block)
        self.assertNotIn('id="verdict"', self.html("pageHead('', '12 frames.', {grade: 'GRADE_GOOD', reason: '12 frames', remedy: '', checks: [], others: []})"))

    def test_scales_say_where_they_are_open(self):
        scale = "{low: %s, high: %s, label: %s, unit: %s, bounded: %s, colors: ['#000000', '#ffffff']}"
        self.assertEqual(self.shown(f"colorBar({scale % (0, 0.5, '`sigma`', '`mm`', 'false')})"), "sigma 0 mm0.5 mm and more")
        self.assertEqual(self.shown(f"colorBar({scale % (0, 0.5, '`sigma`', '`mm`', 'true')})"), "sigma 0 mm0.5 mm")
        self.assertEqual(self.shown(f"colorBar({scale % (-2, 2, '`A<B`', '``', 'false')})"), "A<B −2 and less+2 and more")

    def test_fifty_warnings_are_shown(self):
        self.assertFalse(self.js("Boolean(warnings([]))"))
        self.assertIn("and 2 more", self.shown("warnings(Array(52).fill('note'))"))
        self.assertEqual(self.html("warnings(['a<b'])"), '<section id="warnings"><h2>Warnings</h2><ul class="warnings"><li>a&lt;b</li></ul></section>')

    def camera(self, **more):
        return json.dumps([{"camera": "<c>", "frames_seen": 1, "frames_missing": 0, "missing_reasons": [], "frames_moved": 0, "centers": "0",
                            "corners": "0", "patches_accepted": "0", "patches_rejected": [], "residual_px": "NaN", "frames_with_bias": 0,
                            "bias_x_px": 0, "bias_y_px": 0, "bias_significance": 0, "median_grey_levels": "NaN", **more}])

    def test_cameras(self):
        self.assertIsNone(self.html("cameraSection([])"))
        html = self.html(f"cameraSection({self.camera(frames_seen=3, centers='10', corners='300')})")
        self.assertIn("<bdi>&lt;c&gt;</bdi>", html)
        self.assertIn('<td class="number">3.3<i class="bar"><i style="width: 100%;">', html)
        self.assertIn('<td class="number">100</td>', html)
        missing = self.camera(frames_seen=0, frames_missing=6, missing_reasons=[{"reason": r, "count": n} for r, n in (("dark", 3), ("gone", 1), ("x", 1), ("y", 1))])
        self.assertIn("<td>6 of 6</td><td><div>dark (3 frames)</div><div>gone</div><div>x</div><div>and 1 more</div></td>", self.html(f"cameraSection({missing})"))
        for significance, text in ((5, "<b>0.50 (5.0 σ)</b>"), (3, "0.50 (3.0 σ)")):
            biased = self.camera(frames_with_bias=1, bias_x_px=0.3, bias_y_px=0.4, bias_significance=significance)
            self.assertIn(f'<td class="number">{text}</td>', self.html(f"cameraSection({biased})"))
        reasons = [{"reason": reason, "count": 20} for reason in "abdef"]
        self.assertNotIn("other reasons", self.html(f"cameraSection({self.camera(patches_rejected=reasons)})"))
        html = self.html(f"cameraSection({self.camera(patches_rejected=[*reasons, {'reason': 'rare_one', 'count': 7}])})")
        self.assertIn("Rejected: other reasons", html)
        self.assertIn('<td class="number">20</td><td class="number">7</td></tr>', html)
        self.assertNotIn("rare one", html)

    DONE = ("(count => Array.from({length: count}, (_, i) => ({frame: `f${i}`, state: 'FRAME_STATE_DONE', reason: '', views_used: 0, views_missing: 0, "
            "total_ms: 0, stages: [], mesh: {coverage: 0.5 + 0.01 * i, stages: []}})))")

    def test_long_tables_of_frames_fold_behind_the_worst(self):
        self.assertNotIn("<details>", self.html(f"frameSection({self.DONE}(40))"))
        html = self.html(f"frameSection({self.DONE}(41))")
        self.assertIn("<summary>All 41 frames</summary></details>", html)
        self.assertIn("<bdi>f4</bdi>", html)
        self.assertNotIn("<bdi>f5</bdi>", html)
        failed = self.html(f"frameSection({self.DONE}(41).map((frame, i) => i === 30 ? {{...frame, state: 'FRAME_STATE_FAILED', temporal: {{bridged: true}}}} : frame))")
        self.assertIn('<bdi>f30</bdi></td><td><span class="state bad">✕ bridged</span></td><td class="number">–</td>', failed)

    def test_what_nobody_measured_has_no_columns_and_no_plots(self):
        imported = f"{self.DONE}(2).map(frame => ({{...frame, mesh: {{vertices: 4, vertices_with_cell: 0, coverage: 0}}}}))"
        self.assertEqual(self.shown(f"frameSection({imported})"), "FramesFrameStateCamerasTimeRemarkf0✓ done––f1✓ done––")
        self.assertIsNone(self.html(f"plotSection({imported})"))
        self.assertIn("Coverage", self.shown(f"frameSection({self.DONE}(2))"))
        self.assertIn("Coverage", self.shown(f"plotSection({self.DONE}(2))"))
        failed = f"{imported}.map(frame => ({{...frame, state: 'FRAME_STATE_FAILED', mesh: undefined}}))"
        self.assertIn("Coverage", self.shown(f"frameSection({failed})"))

    def test_remarks_say_what_untangling_cost(self):
        frame = f"{{...{self.DONE}(1)[0], reason: 'a<b', mesh: {{demoted: 1, self_intersections: 2}}}}"
        self.assertIn("a<b; 2 pairs of faces intersect; 1 observed vertex moved to undo a self-intersection", self.shown(f"frameSection([{frame}])"))
        # The refinement counts anew.
        refined = f"{{...{frame}, temporal: {{refined: true, self_intersections: 0, demoted: 0}}}}"
        self.assertNotIn("intersect;", self.shown(f"frameSection([{refined}])"))

    def test_stages(self):
        frame = "({cloud: {centers: %d, corners: 0, rejected: [{reason: 'too_few_views', count: %d}]}})"
        shown = self.html(f"cellSection([{frame % (8, 3)}, {frame % (12, 4)}, {{}}])")
        self.assertIsNone(self.html("cellSection([{}])"))
        self.assertIn('<td><b>triangulated</b></td><td class="number">10</td>', shown)
        self.assertIn('<td>too few views</td><td class="number">3.5</td><td>seen by fewer cameras', shown)
        stage = "({mesh: {stages: [{name: 'rigid_fit', iterations: %d, energy_before: 52000, energy_after: 0.5, time_ms: 40}]}})"
        self.assertIsNone(self.html("alignmentSection([{}])"))
        self.assertIn(f"rigid fit26 (4 to 8)52,0000.540{NBSP}ms", self.shown(f"alignmentSection([{stage % 4}, {stage % 8}])"))
        self.assertIn("rigid fit1452,000", self.shown(f"alignmentSection([{stage % 4}])"))
        scan = self.shown("scanSection([{frame: '1', mesh: {scan: {points: 100, found: 0, median_distance_mm: 0, vertices: 0, unmeasured: 0, without_normal: 0}}}])")
        self.assertIn("0 of 100 points found the cloth in 1 frame;", scan)
        self.assertIn("1000–", scan)
        self.assertIsNone(self.html("scanSection([{}])"))

    def test_inputs_say_which_frames_were_asked_for(self):
        page = "{job: {spec: %s}, frames: [], take: [], algorithms: ['rigid fit 3']}"
        spec = {"frames": "", "first_frame": 0, "end_frame": 0}
        for more, text in (({}, "all frames of the dump"), ({"first_frame": 2}, "from position 2 to the end"),
                           ({"first_frame": 2, "end_frame": 5}, "positions 2 to 4 of the dump"), ({"frames": "<7"}, "<7")):
            self.assertIn(f"Frames{text}Preset", self.shown(f"inputSection({page % json.dumps({**spec, **more})})"))
        self.assertIn("Algorithmsrigid fit 3", self.shown(f"inputSection({page % json.dumps(spec)})"))

    def test_options_that_differ_from_the_preset_come_first(self):
        options = [{"path": "decode.a", "value": "1", "preset": "2", "meaning": "first"}, {"path": "decode.b", "value": "3", "preset": "3", "meaning": "second"}]
        shown = self.shown(f"optionSection({{options: {json.dumps(options)}, preset: 'best'}})")
        self.assertIn("decode.a12first", shown)
        self.assertNotIn("decode.b", shown)
        self.assertIn("All 2 options", shown)
        self.assertIn("All are those of the preset best.", self.shown(f"optionSection({{options: {json.dumps(options[1:])}, preset: 'best'}})"))

    def test_the_paper_says_how_to_measure_what_is_missing(self):
        ours = "paperSection({drift_mm_s: %s, geodesic_distortion_mm: %s, coverage: %s, lowest_coverage: %s, highest_coverage: 0.9}, [])"
        self.assertIn("measures drift and distortion", self.shown(ours % ("0.5", "NaN", "NaN", "NaN")))
        self.assertNotIn("measures drift and distortion", self.shown(ours % (0.5, 2, 0.8, 0.7)))
        self.assertIn(f"80.0{NBSP}% (70.0{NBSP}% to 90.0{NBSP}%)", self.shown(ours % (0.5, 2, 0.8, 0.7)))
        self.assertIn(f"80.0{NBSP}%</td>".replace(NBSP, "&nbsp;"), self.html(ours % (0.5, 2, 0.8, "NaN")))


class Rigs(ReportPages):
    CIRCLE = ("(count => Array.from({length: count}, (_, c) => { const a = 2 * Math.PI * c / count; "
              "return {id: `cam<${c}>`, center_mm: [2000 * Math.cos(a), 0, 2000 * Math.sin(a)], look: [-Math.cos(a), 0, -Math.sin(a)]} }))")

    def drawn(self, count):
        self.open("none")
        return self.js(f"(cameras => {{ const drawing = new RigDrawing(FROM_ABOVE, cameras.map(camera => camera.center_mm)); "
                       f"cameras.forEach(camera => drawing.addCamera(camera, 'point', ': 3 views', true)); return drawing.figure().outerHTML }})({self.CIRCLE}({count}))")

    def test_every_camera_of_a_small_rig_bears_its_name(self):
        svg = self.drawn(16)
        self.assertEqual(svg.count('class="names"'), 16)
        self.assertIn(">cam&lt;7&gt;</text>", svg)
        self.assertIn("<title>cam&lt;7&gt;: 3 views</title>", svg)
        self.assertNotIn("without room", svg)

    def test_names_without_room_are_counted_and_none_lies_on_another(self):
        svg = self.drawn(400)
        self.assertIn(f"; {400 - svg.count('class=' + chr(34) + 'names')} cameras without room for a name", svg)
        places = [(float(x), float(y)) for x, y in re.findall('class="names" x="([0-9.]+)" y="([0-9.]+)"', self.drawn(60))]
        self.assertGreater(len(places), 40)
        for i, a in enumerate(places):
            for b in places[:i]:
                self.assertTrue(abs(a[0] - b[0]) > 25 or abs(a[1] - b[1]) > 8.9, (a, b))

    def test_the_scale_bar_is_a_round_length_in_the_drawings_scale(self):
        self.open("none")
        drawing = "new RigDrawing(FROM_ABOVE, [[-1000, 0, 0], [1000, 0, 500]])"
        svg = self.js(f"{drawing}.figure().outerHTML")
        self.assertIn("500&nbsp;mm</text>", svg)
        length = self.js(f"(drawing => drawing.place([500, 0, 0])[0] - drawing.place([0, 0, 0])[0])({drawing})")
        self.assertIn(f"h{length:.1f}m0", svg)


if __name__ == "__main__":
    unittest.main()
