"""Pages of jobs' reports in a browser: what they show of made-up jobs, in light, in dark and on paper."""

import os
import time
import unittest

from sample_pages import ReportPages

NBSP = "\u00a0"
# As sample_reports.cpp has it; characters that no page can show are replaced.
EVIL = "</script><script>window.evil=1</script><img src=x onerror=window.evil=1>\"'&\ufffd\u2028\u202e"


class Jobs(ReportPages):
    def test_the_whole_report_reads_from_the_verdict_to_the_inputs(self):
        shown = self.open("plain")
        self.assertRegex(self.text("h1"), f"^✓{NBSP}good 12 of 12 frames registered, 9\\d\\.\\d{NBSP}% of the cells observed\\.$")
        self.assertEqual(self.js("document.title"), self.text("h1").split("good ")[1])
        self.assertEqual(self.texts("h2"),
                         ["Over the frames", "Beside the paper", "Frames", "Cameras", "Cells that were seen", "Alignment",
                          "Inputs, versions and ids"])
        for text in (f"50.0{NBSP}s in all", "0f1e2d3c4b5a6978", "/takes/jersey_03", "detection and distortion",
                     "seen by fewer cameras than triangulation needs", "Every camera gave a usable image",
                     "measures drift and distortion", f"75.0{NBSP}% (54.0{NBSP}% to 90.0{NBSP}%)", "2 per frame"):
            self.assertIn(text, shown)
        self.assertEqual(self.count("svg"), 4)
        self.assertEqual(self.count(".tile"), 6)
        self.assertEqual(self.rows("#frames")[0][:5],
                         ["000000", "✓ done", f"95.2 %", "11,424 of 12,000", "11,600"])

    def test_one_frame_is_drawn_and_told(self):
        shown = self.open("one")
        self.assertIn("1 of 1 frame registered, ", shown)
        self.assertIn("of those that the template has", shown)
        self.assertEqual(self.count("circle.point"), 3)
        self.assertNotRegex(shown, "NaN|Infinity|undefined|null")

    def test_a_job_without_any_frame_still_has_a_report(self):
        shown = self.open("none")
        self.assertEqual(self.text("h1"), f"✕{NBSP}bad The job failed: No frame was registered.")
        self.assertIn("rig.json: camera 7 is named twice", shown)
        self.assertIn("No frame has a report.", shown)
        self.assertEqual(self.count("svg"), 0)

    def test_frames_cameras_and_scans_that_are_in_trouble_are_told_with_their_reasons(self):
        shown = self.open("troubled")
        rows = self.rows("#frames")
        self.assertEqual([row[1] for row in rows], ["! degraded"] * 4 + ["✕ bridged", "✕ failed", "! degraded"])
        self.assertIn("a new job retries it", rows[5][-1])
        self.assertEqual(rows[1][-3], "22 of 24")
        self.assertEqual([rows[3][at] for at in (2, 5)], ["–", "–"])  # what is no number
        self.assertEqual(self.rows("table.missing")[0][:2], ["400000", "7 of 7"])
        self.assertEqual(self.js("document.querySelector('table.missing tbody tr').cells[2].innerText"),
                         "no image in the dump (6 frames)\nimage has 100 x 100 pixels, the rig says 1280 x 960")
        self.assertEqual(self.rows("table.moved"), [["400021", "7 of 7", "3.3"]])
        self.assertIn("Red triangles mark frames without a mesh.", shown)
        self.assertEqual(self.count(".lost"), 8)
        self.assertEqual(self.rows("#scans"), [["000006", "5,000", "4,321", "0.25", "0", "0", "0", ""]])
        self.assertNotRegex(shown, "NaN|Infinity|undefined|null")

    def test_driven_jobs_have_figures_of_their_own(self):
        shown = self.open("driven")
        for text in ("Weft driving report", "3 of 3 frames driven.", "4,300", f"0.37{NBSP}px", f"2.25{NBSP}mm", "sigma of all vertices",
                     "found without the frame before", "Rays: cells seen by a camera"):
            self.assertIn(text, shown)
        for text in ("0.000", "of the cells observed", "Observed cells", "Triangulated"):
            self.assertNotIn(text, shown)

    def test_garments_of_a_joint_template_are_told_apart(self):
        shown = self.open("outfit")
        self.assertIn("<shirt> lies over skirt in 2 frames.", shown)
        self.assertIn(f"Of the garments' cells were observed: skirt 50.0{NBSP}%, <shirt> 90.0{NBSP}%.", shown)
        self.assertEqual(self.rows("#garments")[0], ["skirt", "1,200", "50.0 %", "30.0 %", "000001", "0.000"])

    def test_every_state_of_a_frame_is_named(self):
        self.open("states")
        self.assertEqual([row[1] for row in self.rows("#frames")],
                         ["? not recorded", "waiting", "running", "✓ done", "! degraded", "✕ failed", "cancelled"])

    def test_work_of_another_kind_shows_its_inputs_and_frames_alone(self):
        self.open("work")
        self.assertEqual(self.text(".kind"), "Weft report: copy")
        self.assertEqual(self.rows("#inputs")[:2], [["meshes", "/results/shirt", "1234567890abcdef"], ["twice", "yes", ""]])
        self.assertEqual(self.texts("h2"), ["Frames", "Inputs, versions and ids"])

    def test_names_from_outside_stay_text(self):
        self.open("hostile")
        self.assertIsNone(self.js("window.evil ?? null"))
        self.assertEqual(self.count("script"), 2)
        self.assertEqual(self.js("[...document.querySelectorAll('img')].map(one => one.src.slice(0, 22))"), ["data:image/png;base64,"])
        whole = self.js("document.querySelector('main').textContent")
        self.assertGreater(whole.count(EVIL), 40)
        self.assertNotIn("\x01", whole)
        # Right-to-left characters stay within their name.
        self.assertEqual(self.js("getComputedStyle(document.querySelector('bdi')).unicodeBidi"), "isolate")

    def test_thousands_of_frames_stay_readable(self):
        begin = time.monotonic()
        shown = self.open("thousands")
        self.assertLess(time.monotonic() - begin, 20)
        self.assertIn("2,999 of 3,000 frames registered", shown)
        self.assertEqual(len(self.rows("#frames")), 6)  # the one that failed, and the five worst
        self.assertLessEqual(self.count("rect.range"), 3 * 120)
        self.assertEqual(self.count("circle"), 0)
        self.assertEqual(self.count(".lost"), 4)
        self.assertEqual(self.text("#frames summary"), "All 3,000 frames")
        self.browser.css("#frames summary", "click")
        self.browser.css("#frames details tbody tr:nth-child(3000)", "waitFor")
        self.assertEqual(len(self.rows("#frames details")), 3000)
        self.assertLess(os.path.getsize(f"{self.folder}/thousands.html"), 6 << 20)


class Meshes(ReportPages):
    def test_pictures_are_shown_with_the_meaning_of_their_colours(self):
        shown = self.open("meshes/report")
        self.assertEqual(self.texts("#meshes h3"),
                         ["Frame 000000 first frame, lowest coverage", "Frame 000003 last frame"])
        self.assertEqual(self.js("[...document.querySelectorAll('#meshes img')].map(one => one.alt)")[:4],
                         ["Front of frame 000000, coloured by state", "Back of frame 000000, coloured by state",
                          "Front of frame 000000, coloured by uncertainty", "Back of frame 000000, coloured by uncertainty"])
        self.assertTrue(self.js("[...document.querySelectorAll('#meshes img')].every(one => one.complete && one.naturalWidth > 100)"))
        self.assertIn("0.1 mm and more", shown)
        self.assertEqual(self.count("#meshes .legend i"), 6)

    def test_the_sequence_turns_plays_and_goes_on_paper(self):
        self.open("meshes/report")
        self.assertEqual(self.text("#sequence output"), "000000")
        self.assertIn("shows 576 of its vertices", self.text("#sequence"))
        shot = lambda: self.js("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => done(0))))")
        shot()
        pixels = lambda: self.browser.css("#sequence canvas", "screenshot")
        front = pixels()
        self.browser.css("#sequence canvas", "focus")
        self.browser.press("ArrowRight", "ArrowRight", "+")
        shot()
        self.assertNotEqual(pixels(), front)
        self.js("{ const slider = document.querySelector('#sequence input'); slider.value = 1; slider.dispatchEvent(new Event('input')) }")
        self.assertEqual(self.text("#sequence output"), "000002 (bridged)")
        self.browser.css("#sequence .colors", "selectOption", "sigma")
        self.assertIn("0.1 mm and more", self.text("#sequence"))
        self.browser.role("button", "Play")
        self.assertEqual(self.text("#sequence button"), "Pause")
        self.browser.role("button", "Pause")
        still = "document.querySelector('.still img').src"
        before = self.js(still)
        self.js("window.dispatchEvent(new Event('beforeprint'))")
        self.assertNotEqual(self.js(still), before)
        self.assertRegex(self.js("document.querySelector('.still figcaption').textContent"), "^Frame .*, colours: sigma$")

    def test_paper_has_the_picture_and_no_controls(self):
        self.open("meshes/report")
        visible = lambda selector: self.js(f"document.querySelector('{selector}').checkVisibility()")
        self.assertEqual([visible(one) for one in ("canvas", ".controls", ".still")], [True, True, False])
        self.browser.page("emulateMedia", {"media": "print"})
        self.assertEqual([visible(one) for one in ("canvas", ".controls", ".still")], [False, False, True])
        self.browser.page("emulateMedia", {"media": "screen"})


class Looks(ReportPages):
    def test_light_and_dark_pages_have_no_serious_barrier(self):
        for scheme in ("light", "dark"):
            self.browser.page("emulateMedia", {"colorScheme": scheme})
            for name in ("plain", "troubled", "meshes/report"):
                self.open(name)
                self.assertEqual(self.browser.serious(), [], (scheme, name))
        self.browser.page("emulateMedia", {"colorScheme": "light"})

    def test_plots_read_out_what_the_pointer_and_keys_come_to(self):
        self.open("troubled")
        self.browser.css("#plots svg", "focus")
        self.browser.press(*["ArrowRight"] * 5)
        self.assertEqual(self.text("#plots .reading"), "frame 000004: no mesh")
        self.browser.press("ArrowLeft", "ArrowLeft", "ArrowLeft")
        self.assertEqual(self.text("#plots .reading"), f"frame 000001: 96.0{NBSP}%")
        self.browser.css("#plots svg", "hover")
        self.assertEqual(self.text("#plots .reading"), "frame 000003: none")

    def test_tables_sort_by_the_heading_that_is_pressed(self):
        self.open("plain")
        names = lambda: [row[0] for row in self.rows("#frames")]
        given = names()
        self.browser.css("#frames th:nth-child(3) button", "click")
        by_coverage = [row[2] for row in self.rows("#frames")]
        self.assertEqual(by_coverage, sorted(by_coverage))
        self.assertEqual(self.js("document.querySelector('#frames th:nth-child(3)').ariaSort"), "ascending")
        self.browser.css("#frames th:nth-child(3) button", "click")
        self.assertEqual([row[2] for row in self.rows("#frames")], sorted(by_coverage, reverse=True))
        self.browser.css("#frames th:nth-child(1) button", "click")
        self.assertEqual(names(), given)


if __name__ == "__main__":
    unittest.main()
