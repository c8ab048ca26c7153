"""`weft evaluate`: what it compares, at which frame rate, and its verdict."""

import json
import os
import re
import shutil
import unittest

from studio import StudioTest, page_data, read, weft, write


class Evaluate(StudioTest):
    def evaluate(self, *more, check=0):
        """The evaluation as JSON; what takes long is left out."""
        return json.loads(weft("evaluate", self.out, "--quick", "--json", *more, check=check).stdout)

    def reasons(self, evaluation):
        return "\n".join(f"{remark['measure']}: {remark['reason']}" for remark in evaluation["remarks"])


class OfOneJob(Evaluate):
    def test_results_are_read_from_every_folder(self):
        """The job ran with paths relative to its own folder."""
        weft("register", "take", "--rig", "take/rig.json", "--board", "take/board.json", "--template", "take/template",
             "--out", "result", cwd=self.folder, check=0)
        spec = json.loads(read(f"{self.out}/job.json"))["spec"]
        self.assertEqual([spec[name] for name in ("dump", "rig", "garment", "out")],
                         [self.take, f"{self.take}/rig.json", f"{self.take}/template", self.out])
        elsewhere = self.path("elsewhere")
        os.mkdir(elsewhere)
        for form, *more in (("jpg", "--overlay", "state"), ("png", "--texture", 64)):
            weft("export", "../result", "--format", form, *more, "--out", form, cwd=elsewhere, check=0)
            self.assertIn("export.json", os.listdir(os.path.join(elsewhere, form)))
        evaluation = json.loads(weft("evaluate", "../result", "--quick", "--json", cwd=elsewhere, check=0).stdout)
        self.assertEqual(evaluation["truth"], f"{self.take}/truth")

    def test_jobs_of_earlier_versions_say_what_is_missing(self):
        self.register(check=0)
        job = json.loads(read(f"{self.out}/job.json"))
        job["spec"]["dump"] = "take of an earlier job"
        write(f"{self.out}/job.json", json.dumps(job))
        refused = weft("export", self.out, "--format", "png", "--texture", 64, "--out", self.path("to"), check=2)
        self.assertIn("take of an earlier job: job.json names it", refused.stderr)
        self.assertIn("--take", refused.stderr)

    def test_an_evaluation_goes_with_its_result(self):
        self.register("--evaluate", "--frames", "0:2", check=0)
        evaluation, job = (json.loads(read(f"{self.out}/{name}.json")) for name in ("evaluation", "job"))
        self.assertEqual(evaluation["job_id"], job["id"])
        self.assertIn("<title>Weft evaluation</title>", read(f"{self.out}/report.html"))
        self.register("--preset", "paper", "--frames", "0:2", check=0)
        left = os.listdir(self.out)
        for name in ("evaluation.json", "frames.csv", "cameras.csv"):
            self.assertNotIn(name, left)
        self.assertNotIn("<title>Weft evaluation</title>", read(f"{self.out}/report.html"))


class BuiltTemplate(Evaluate):
    """A template that was built from the take has other vertices than the truth, and the same cells."""

    def setUp(self):
        super().setUp()
        weft("template", "build", self.take, "--rig", f"{self.take}/rig.json", "--board", f"{self.take}/board.json",
             "--openings", "2", "--corners", "--out", self.path("tube"), check=0)
        self.register(template=self.path("tube"), check=0)

    def test_is_compared_with_the_truth_by_board_cell(self):
        evaluation = self.evaluate()
        self.assertEqual(evaluation["truth"], f"{self.take}/truth")
        self.assertIn("by board cell", self.reasons(evaluation))
        total = evaluation["total"]
        # Corners between cells have their place on the true cloth as well.
        summary = json.loads(weft("template", "check", self.path("tube"), "--json", check=0).stdout)
        nodes = summary["vertices_with_cell"] + summary["vertices_with_corner"]
        scored = total["mesh"]["visible_mm"]["count"] + total["mesh"]["hidden_mm"]["count"]
        self.assertGreater(scored, 0.95 * nodes * len(self.frames))
        self.assertLess(total["mesh"]["visible_mm"]["mean"], 1)
        self.assertIn("true_drift_observed_mm_s", total["measures"])

    def test_truth_is_left_alone_on_request(self):
        evaluation = self.evaluate("--no-truth")
        self.assertEqual(evaluation.get("truth", ""), "")
        self.assertNotIn("mesh", evaluation["total"])
        self.assertIn("--no-truth", self.reasons(evaluation))
        refused = weft("evaluate", self.out, "--no-truth", "--truth", f"{self.take}/truth", check=2)
        self.assertIn("--truth", refused.stderr)

    def test_truth_that_tells_no_cells_is_a_note_and_not_an_error(self):
        shutil.rmtree(f"{self.take}/template")
        evaluation = self.evaluate()
        self.assertIn("only templates relate them", self.reasons(evaluation))
        self.assertNotIn("mesh", evaluation["total"])
        self.assertIn("cloud", evaluation["total"])


class FrameRate(Evaluate):
    def test_of_a_recorded_take_is_that_of_its_times(self):
        recorded = self.path("recorded")
        weft("take", "import", self.take, "--out", recorded, "--fps", "50", check=0)
        self.register(dump=recorded, check=0)
        evaluation = json.loads(weft("evaluate", self.out, "--samples", "1", "--json", check=0).stdout)
        self.assertAlmostEqual(evaluation["frames_per_s"], 50, places=3)
        measures = evaluation["total"]["measures"]
        self.assertAlmostEqual(measures["texture_drift_mm_s"]["mean"], 50 * measures["texture_drift_mm"]["mean"],
                               places=4)
        text = weft("evaluate", self.out, "--quick", check=0).stdout
        self.assertIn("rate     50.00 frames/s, by the take's times\n", text)

    def test_is_not_assumed_where_nothing_tells_it(self):
        self.register(check=0)
        shutil.rmtree(f"{self.take}/truth")
        evaluation = json.loads(weft("evaluate", self.out, "--samples", "1", "--json", check=0).stdout)
        self.assertEqual(evaluation.get("frames_per_s", 0), 0)
        self.assertIn("the frame rate of the take is unknown", self.reasons(evaluation))
        measures = evaluation["total"]["measures"]
        self.assertNotIn("texture_drift_mm_s", measures)
        self.assertGreater(measures["texture_drift_mm"]["mean"], 0)
        told = self.evaluate("--fps", "40")
        self.assertEqual(told["frames_per_s"], 40)


class FramesThatWereNotAskedFor(Evaluate):
    def test_are_no_failures_of_an_evaluation(self):
        self.register("--frames", "1:3", check=0)
        evaluation = self.evaluate("--out", self.path("evaluation"))
        self.assertEqual([frame["frame"] for frame in evaluation["frames"]], self.frames[1:])
        self.assertTrue(all("mesh.ply" not in frame.get("missing", []) for frame in evaluation["frames"]))
        page = page_data(self.path("evaluation", "report.html"))
        self.assertTrue(all(frame["state"] == "FRAME_STATE_DONE" for frame in page["job"]["frames"]))
        self.assertEqual([frame["frame"] for frame in page["job"]["frames"]], self.frames[1:])

    def test_frames_that_were_asked_for_and_are_gone_are_failures(self):
        self.register("--frames", "1:3", check=0)
        shutil.rmtree(os.path.join(self.out, self.frames[2]))
        evaluation = self.evaluate(check=1)
        self.assertEqual([frame["frame"] for frame in evaluation["frames"]], self.frames[1:])
        self.assertEqual(evaluation["verdict"]["grade"], "GRADE_BAD")

    def test_failures_of_an_earlier_job_are_not_those_of_this_one(self):
        for image in self.images[2:]:
            os.remove(os.path.join(self.take, self.frames[0], image))
        self.register("--frames-alone", check=1)
        self.assertIn("triangulation needs 3", str(page_data(os.path.join(self.out, "report.html"))))
        self.register("--frames-alone", "--frames", "1:3", check=0)
        page = page_data(os.path.join(self.out, "report.html"))["job"]
        self.assertIn("2 of 2 frames registered", page["headline"])
        self.assertNotIn("triangulation needs 3", str(page))
        self.assertEqual([frame["frame"] for frame in page["frames"]], self.frames[1:])
        self.assertIn("not part of this report", str(page["notes"]))


class Report(Evaluate):
    def test_holds_all_of_the_job_in_one_file(self):
        self.register("--observations", check=0)
        weft("evaluate", self.out, "--samples", "1", "--out", self.path("evaluation"), check=0)
        page = page_data(self.path("evaluation", "report.html"))
        self.assertEqual(page["evaluation"], json.loads(read(self.path("evaluation", "evaluation.json"))))
        self.assertGreater(len(page["maps"]["maps"]), 3)
        job = page["job"]
        self.assertEqual([coloring["name"] for coloring in job["sequence"]["colorings"]], ["state", "sigma", "error"])
        self.assertIn("largest error", str([frame["why_shown"] for frame in job["pictures"]]))
        in_images = [picture["type"] for frame in job["pictures"] for picture in frame["in_images"]]
        self.assertEqual(set(in_images), {"image/jpeg"})  # images of cameras with the mesh over them
        self.assertIn("decode ", job["algorithms"][0])
        self.assertIsNone(re.search(r"""(?:src|href)=["']|@import|url\(""", read(self.path("evaluation", "report.html"))))

    def test_of_the_job_itself_has_drift_and_distortion_on_request(self):
        self.register("--evaluate", check=0)
        total = json.loads(read(os.path.join(self.out, "evaluation.json")))["total"]["measures"]
        drift, distortion = total["texture_drift_mm_s"]["mean"], total["geodesic_distortion_mm"]
        page = page_data(os.path.join(self.out, "report.html"))
        shown = page["evaluation"]["total"]["measures"]
        self.assertEqual((shown["texture_drift_mm_s"]["mean"], shown["geodesic_distortion_mm"]), (drift, distortion))
        self.assertEqual(len(page["evaluation"]["paper"]), 4)
        self.assertEqual(len(page["job"]["sequence"]["frames"]), len(self.frames))
        self.assertGreater(len(page["job"]["options"]), 50)
        self.register(check=0)  # complete already: the page is that of the job alone
        self.assertEqual(list(page_data(os.path.join(self.out, "report.html"))), ["job"])

    def test_of_a_job_shows_what_the_cameras_saw_of_failed_frames(self):
        for camera in range(2, len(self.images)):
            os.remove(self.image(1, camera))
        self.register("--frames-alone")
        pictures = page_data(os.path.join(self.out, "report.html"))["job"]["pictures"]
        failed = next(frame for frame in pictures if frame["frame"] == self.frames[1])
        self.assertRegex(failed["why_shown"], "^failed: .")
        self.assertEqual(failed["by_state"], [])
        self.assertEqual([picture["type"] for picture in failed["in_images"]], ["image/jpeg"] * 2)

    def test_of_a_job_has_no_images_where_the_take_is_gone(self):
        self.register(check=0)
        job = page_data(os.path.join(self.out, "report.html"))["job"]
        self.assertTrue(any(frame["in_images"] for frame in job["pictures"]))
        shutil.rmtree(self.take)
        weft("evaluate", self.out, "--quick", "--out", self.path("evaluation"))
        job = page_data(self.path("evaluation", "report.html"))["job"]
        self.assertFalse(any(frame["in_images"] for frame in job["pictures"]))
        self.assertEqual(len(job["sequence"]["frames"]), len(self.frames))


class Verdict(Evaluate):
    def test_comes_first_and_bad_is_exit_status_1(self):
        self.register("--observations", check=0)
        good = weft("evaluate", self.out, "--quick", "--out", self.path("evaluation"), check=0)
        self.assertRegex(good.stdout, r"^(good|usable): ")
        verdict = json.loads(read(self.path("evaluation", "evaluation.json")))["verdict"]
        checks = {check["id"]: check for check in verdict["checks"]}
        self.assertEqual(checks["evaluate.frames"]["value"], "100.0 %")
        self.assertIn("good from", checks["evaluate.coverage"]["limits"])
        self.assertEqual(page_data(self.path("evaluation", "report.html"))["evaluation"]["verdict"], verdict)
        for frame in self.frames[:2]:
            os.remove(os.path.join(self.out, frame, "mesh.ply"))
        bad = weft("evaluate", self.out, "--quick", check=1)
        self.assertRegex(bad.stdout, "^bad: 2 of 3 frames that were asked for have no mesh\n  remedy: ")
        self.assertEqual(bad.stderr, "")
        verdict = self.evaluate(check=1)["verdict"]
        self.assertEqual(verdict["grade"], "GRADE_BAD")
        self.assertIn("have no mesh", verdict["reason"])
        self.assertTrue(verdict["remedy"])


if __name__ == "__main__":
    unittest.main()
