"""`weft register` in its own process: results, bad input, interruption."""

import json
import os
import shutil
import signal
import subprocess
import time
import unittest

from studio import BIN, BRIDGED, LONG_S, StudioTest, png, read, results, temporary_files, vertex_states, weft, write


def frame_report(out, frame):
    return json.loads(read(os.path.join(out, frame, "report.json")))


class Register(StudioTest):
    def test_registers_every_frame_close_to_the_truth(self):
        done = self.register("--observations", check=0)
        self.assertIn(f"{len(self.frames)} of {len(self.frames)} frames registered", done.stdout)
        evaluation = json.loads(weft("evaluate", self.out, "--truth", f"{self.take}/truth", "--json", "--quick",
                                     check=0).stdout)
        total = evaluation["total"]
        # The take is coarse, its folds are small beside its cells; readme_test.py asks for more of a finer one.
        self.assertGreater(total["centers"]["precision"], 0.99)
        self.assertGreater(total["centers"]["recall"], 0.65)
        self.assertGreater(total["cloud"]["coverage"], 0.7)
        self.assertLess(total["mesh"]["visible_mm"]["mean"], 1)
        self.assertEqual(temporary_files(self.out), [])

    def test_gives_the_same_bytes_at_any_thread_count_and_memory(self):
        self.register("--observations", "--threads", "1", "--memory", "0", check=0)
        one_thread = results(self.out)
        self.assertEqual(len(one_thread), 4 * len(self.frames))
        # All of the chain had something to do: the second pass, and the refinement by neighbouring frames.
        report = frame_report(self.out, self.frames[1])
        self.assertGreater(sum(view["second_pass_found"] for view in report["views"]), 0)
        self.assertGreater(report["second_pass_rounds"], 1, "images are read again with --memory 0")
        self.assertTrue(report["temporal"]["refined"])
        for threads, memory in (("2", "32"), ("4", "1000")):
            other = self.path(threads)
            self.register("--observations", "--threads", threads, "--memory", memory, check=0, out=other)
            self.assertEqual(one_thread, results(other), f"{threads} threads")

    def test_registers_the_frames_asked_for(self):
        self.register("--frames", "1:2", check=0)
        self.assertEqual([name for name in os.listdir(self.out) if name.isdigit()], [self.frames[1]])
        other = self.path("other")
        self.assert_refused(self.register("--frames", "2:9", out=other), "frames 2:9", "it has 3 frames", out=other)
        self.assert_refused(self.register("--frames", "two", out=other), "frame two is not in", "A:B", out=other)

    def test_keeps_complete_frames_and_computes_changed_ones_again(self):
        self.register(check=0)
        before = os.stat(os.path.join(self.out, self.frames[0], "mesh.ply")).st_mtime_ns
        shutil.copy(self.image(0, 0), self.image(1, 0))
        done = self.register(check=0)
        self.assertIn("2 kept from an earlier run", done.stdout)
        self.assertEqual(os.stat(os.path.join(self.out, self.frames[0], "mesh.ply")).st_mtime_ns, before)


class DegradedFrames(StudioTest):
    def assert_degraded(self, frame, camera_image, *facts):
        done = self.register("--frames", f"{frame}:{frame + 1}", check=0)
        self.assertIn("degraded", done.stderr)
        report = frame_report(self.out, self.frames[frame])
        self.assertEqual(report["state"], "FRAME_STATE_DEGRADED")
        missing = {view["camera"]: view["missing_reason"] for view in report["views"] if view["missing_reason"]}
        camera = os.path.splitext(camera_image)[0]
        self.assertIn(camera, missing)
        for fact in facts:
            self.assertIn(fact, missing[camera])
        self.assertTrue(os.path.exists(os.path.join(self.out, self.frames[frame], "mesh.ply")))

    def test_truncated_image(self):
        path = self.image(1, 2)
        write(path, read(path, "rb")[:-2000])
        self.assert_degraded(1, self.images[2], path, "truncated")

    def test_file_that_is_no_image(self):
        write(self.image(1, 2), b"no image at all")
        self.assert_degraded(1, self.images[2], self.image(1, 2))

    def test_image_of_another_size_than_the_rig_says(self):
        write(self.image(0, 1), png(32, 16, b"\x80"))
        self.assert_degraded(0, self.images[1], self.image(0, 1), "32x16", "the rig says")

    def test_frame_with_fewer_cameras(self):
        os.remove(self.image(2, 0))
        self.assert_degraded(2, self.images[0], "no image")

    def test_camera_without_images_is_named_before_the_work_starts(self):
        for frame in range(len(self.frames)):
            os.remove(self.image(frame, 3))
        done = self.register("--frames", "0:1", check=0)
        camera = os.path.splitext(self.images[3])[0]
        self.assertIn(f"weft: warning: camera {camera} of the rig has no images", done.stderr)

    def test_frame_with_two_cameras_fails_and_is_bridged_by_the_others(self):
        for camera in range(2, len(self.images)):
            os.remove(self.image(1, camera))
        done = self.register(check=1)
        self.assertIn("2 of 3 frames registered, 1 bridged\n", done.stdout)
        self.assertRegex(done.stderr, rf"{self.frames[1]} +bridged .*triangulation needs 3")
        report = frame_report(self.out, self.frames[1])
        self.assertEqual(report["state"], "FRAME_STATE_FAILED")
        self.assertIn("triangulation needs 3", report["reason"])
        self.assertTrue(report["temporal"]["bridged"])
        self.assertEqual(report["temporal"]["neighbors"], [self.frames[0], self.frames[2]])
        self.assertEqual(vertex_states(os.path.join(self.out, self.frames[1], "mesh.ply")), {BRIDGED})

    def test_failed_frame_has_no_mesh_where_frames_stand_alone(self):
        for camera in range(2, len(self.images)):
            os.remove(self.image(1, camera))
        done = self.register("--frames-alone", check=1)
        self.assertIn("2 of 3 frames registered, 1 failed\n", done.stdout)
        self.assertFalse(os.path.exists(os.path.join(self.out, self.frames[1], "mesh.ply")))


class BadInput(StudioTest):
    def test_empty_dump(self):
        empty = self.path("empty")
        os.mkdir(empty)
        self.assert_refused(self.register(dump=empty), empty, "holds no image", "<frame>/<camera>.png")

    def test_dump_that_is_not_there(self):
        self.assert_refused(self.register(dump=self.path("nowhere")), self.path("nowhere"))

    def test_board_with_double_codes(self):
        board = self.path("red.png")
        write(board, png(12, 12, (255, 50, 50)))
        weft("template", "import", "--mesh", f"{self.take}/template/mesh.ply", "--cells",
             f"{self.take}/template/cells.txt", "--board", board, "--out", self.path("red"), check=2)
        self.assert_refused(weft("decode", self.image(0, 0), "--board", board, "--out", self.path("red.csv")),
                            board, "read the same")
        self.assertFalse(os.path.exists(self.path("red.csv")))

    def test_template_of_another_board_names_both_hashes(self):
        weft("pattern", "generate", "--rows", "40", "--cols", "40", "--seed", "9", "--out", self.path("other"), check=0)
        done = self.register(board=f"{self.path('other')}/board.json")
        self.assert_refused(done, json.loads(read(f"{self.path('other')}/board.json"))["hash"],
                            json.loads(read(f"{self.take}/board.json"))["hash"])

    def test_unknown_field_of_a_json_file(self):
        rig = json.loads(read(f"{self.take}/rig.json"))
        rig["cameras"][0]["focal_length"] = 3
        write(f"{self.take}/rig.json", json.dumps(rig))
        self.assert_refused(self.register(), f"{self.take}/rig.json", "focal_length")

    def test_map_that_does_not_fit_the_mesh(self):
        cells = f"{self.take}/template/cells.txt"
        lines = read(cells).splitlines(keepends=True)
        write(cells, "".join(lines[:-1]))
        self.assert_refused(self.register(), cells, f"{len(lines) - 1} lines", f"{len(lines)} vertices")

    def test_output_folder_that_cannot_be_written(self):
        # A file in the way stops root as well, which permissions would not.
        blocked = self.path("blocked")
        write(blocked, "a file")
        done = self.register(out=f"{blocked}/result")
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn(f"{blocked}/result", done.stderr)

    def test_missing_arguments_are_explained(self):
        done = weft("register", self.take, "--out", self.out)
        self.assertEqual(done.returncode, 2)
        self.assertIn("--rig, --board, --template are required", done.stderr)
        self.assertIn("weft register --help", done.stderr)


class Interruption(StudioTest):
    def test_interrupted_run_leaves_whole_frames_only_and_goes_on_to_the_same_bytes(self):
        reference = self.path("reference")
        self.register("--observations", check=0, out=reference)
        process = subprocess.Popen([os.path.join(BIN, "weft"), *self.register_arguments(), "--observations"],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        first_report = os.path.join(self.out, self.frames[0], "report.json")
        deadline = time.monotonic() + LONG_S
        while not os.path.exists(first_report) and time.monotonic() < deadline and process.poll() is None:
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=LONG_S)
        self.assertEqual(process.returncode, 1, errors)
        self.assertIn("cancelled", errors)
        self.assertIn("run the command again to go on", errors)
        self.assertEqual(temporary_files(self.out), [])
        whole = results(reference)
        for name, content in results(self.out).items():
            self.assertEqual(content, whole[name], name)
        self.assertEqual(json.loads(read(f"{self.out}/job.json"))["state"], "JOB_STATE_CANCELLED")

        done = self.register("--observations", check=0)
        self.assertIn("kept from an earlier run", done.stdout)
        self.assertEqual(results(self.out), whole)


if __name__ == "__main__":
    unittest.main()
