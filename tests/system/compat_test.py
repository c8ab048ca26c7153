"""What every earlier version wrote is read, and goes on from there: tests/data/compat/<version>.tar.xz, see the README there."""

import json
import os
import shutil
import subprocess
import tarfile
import tempfile
import time
import unittest

from studio import BIN, LONG_S, read, weft

SAMPLES = os.path.join(os.environ["WEFT_SOURCE"], "tests", "data", "compat")
VERSIONS = sorted(name.removesuffix(".tar.xz") for name in os.listdir(SAMPLES) if name.endswith(".tar.xz"))


class Compatibility(unittest.TestCase):
    """Every test gets a copy of each version's samples, which it may change."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="weft test ")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.assertTrue(VERSIONS)

    def each(self):
        for version in VERSIONS:
            here = os.path.join(self.folder, version)
            with tarfile.open(os.path.join(SAMPLES, version + ".tar.xz")) as archive:
                archive.extractall(here)
            yield lambda *names, here=here: os.path.join(here, *names)

    def inputs(self, path, template="template"):
        return ["--rig", path("rig.json"), "--board", path("board", "board.json"), "--template", path(template)]

    def test_closed_takes_are_whole_and_replay_as_they_were(self):
        for path in self.each():
            expected = json.loads(read(path("expected.json")))["takes"]
            for name in ("closed", "garment"):
                take = path("takes", name)
                info = json.loads(weft("take", "info", take, "--json", check=0).stdout)
                self.assertEqual(info["take"]["state"], "TAKE_STATE_COMPLETE")
                self.assertEqual(int(info["sets"]), expected[name]["sets"])
                self.assertTrue(json.loads(weft("take", "verify", take, "--json", check=0).stdout)["whole"])
                replay = json.loads(weft("take", "replay", take, "--fastest", "--json", check=0).stdout)
                self.assertEqual(replay["checksum"], expected[name]["checksum"])
                for folder in ("images", "trimmed"):
                    os.makedirs(path(folder), exist_ok=True)
                weft("take", "export", take, "--out", path("images", name), check=0)
                self.assertEqual(len(os.listdir(path("images", name))), expected[name]["sets"])
                copy = path("trimmed", name)
                weft("take", "trim", take, "--out", copy, "--compress", check=0)
                copied = json.loads(weft("take", "replay", copy, "--fastest", "--json", check=0).stdout)
                self.assertEqual(copied["checksum"], expected[name]["checksum"])

    def test_clocks_of_a_take_are_reported(self):
        for path in self.each():
            report = json.loads(weft("take", "sync", path("takes", "closed"), "--json").stdout)
            self.assertEqual({clock["camera"] for clock in report["clocks"]}, {"left", "right"})
            for clock in report["clocks"]:
                self.assertGreater(int(clock["readings"]), 1)

    def test_a_crashed_take_is_recovered(self):
        for path in self.each():
            take = path("takes", "crashed")
            expected = json.loads(read(path("expected.json")))["takes"]["crashed"]
            recovery = json.loads(weft("take", "recover", take, "--json", check=0).stdout)
            self.assertGreaterEqual(int(recovery["sets"]), expected["acknowledged"])
            self.assertTrue(json.loads(weft("take", "verify", take, "--json", check=0).stdout)["whole"])
            info = json.loads(weft("take", "info", take, "--json", check=0).stdout)
            self.assertEqual(info["take"]["state"], "TAKE_STATE_RECOVERED")

    def test_a_take_is_registered_with_the_rig_board_and_template_of_its_time(self):
        for path in self.each():
            for template in ("template", "templates/built", "templates/corners"):
                out = path("out", template)
                done = weft("register", path("takes", "garment"), *self.inputs(path, template), "--out", out, check=0)
                self.assertIn("3 of 3 frames registered", done.stdout)

    def test_results_are_evaluated_and_go_on(self):
        for path in self.each():
            found = json.loads(weft("evaluate", path("result"), "--take", path("takes", "garment"), "--rig", path("rig.json"),
                                    "--template", path("template"), "--quick", "--json", check=0).stdout)
            before = json.loads(read(path("evaluation", "evaluation.json")))
            self.assertEqual(len(found["frames"]), len(before["frames"]))
            self.assertEqual(found["total"]["measures"].get("self_intersecting_pairs", 0),
                             before["total"]["measures"].get("self_intersecting_pairs", 0))
            # As the start of another registration, and the other way round.
            done = weft("register", path("takes", "garment"), *self.inputs(path), "--out", path("again"), "--start-from",
                        path("result"), "--frames", "0:1", check=0)
            self.assertIn("1 of 1 frame registered", done.stdout)
            weft("align", path("result", "0000", "cloud.ply"), "--template", path("template"), "--start",
                 path("result", "0000", "mesh.ply"), "--out", path("aligned.ply"), check=0)

    def test_a_job_goes_on_in_the_folder_of_its_results(self):
        for path in self.each():
            shutil.rmtree(path("result", "0001"))
            done = weft("register", path("takes", "garment"), *self.inputs(path), "--observations", "--out", path("result"),
                        check=0)
            self.assertIn("3 of 3 frames registered", done.stdout)
            self.assertTrue(os.path.exists(path("result", "0001", "mesh.ply")))

    def test_templates_are_accepted_with_their_hashes(self):
        for path in self.each():
            expected = json.loads(read(path("expected.json")))["templates"]
            self.assertEqual(len(expected), 4)
            for name, hash_of_it in expected.items():
                summary = json.loads(weft("template", "check", path(name), "--json", check=0).stdout)
                self.assertEqual(summary["hash"], hash_of_it, name)
                weft("align", path("result", "0000", "cloud.ply"), "--template", path(name), "--out", path("aligned.ply"),
                     check=0)
            weft("template", "build", *[path("templates", "built", "clouds", cloud) for cloud in
                                        os.listdir(path("templates", "built", "clouds"))], "--board",
                 path("board", "board.json"), "--openings", 2, "--out", path("rebuilt"), check=0)

    def test_rigs_are_read_in_every_format(self):
        for path in self.each():
            for name in ("rig.json", "rigs/calibrated.json", "rigs/imported.json", "rigs/refined.json"):
                weft("rig", "export", path(name), "--format", "opencv", "--out", path("out.yml"), check=0)
            ids = [camera["id"] for camera in json.loads(read(path("rigs", "calibrated.json")))["cameras"]]
            for source in (["--krt", path("rigs", "KRT"), "--width-px", 640, "--height-px", 480],
                           ["--opencv", path("rigs", "cameras.yml")], ["--colmap", path("rigs", "colmap")]):
                weft("rig", "import", *source, "--out", path("in.json"), check=0)
                self.assertEqual([camera["id"] for camera in json.loads(read(path("in.json")))["cameras"]], ids)

    def test_a_rig_is_refined_from_results(self):
        for path in self.each():
            weft("rig", "refine", path("result"), "--rig", path("rig.json"), "--out", path("refined.json"), check=0)
            refined, before = (json.loads(read(path(name))) for name in ("refined.json", "rigs/refined.json"))
            self.assertEqual(len(refined["cameras"]), len(before["cameras"]))
            for now, then in zip(refined["cameras"], before["cameras"]):
                for a, b in zip(now["translation_mm"], then["translation_mm"]):
                    self.assertAlmostEqual(a, b, delta=3)

    def test_boards_and_targets_are_read(self):
        for path in self.each():
            weft("pattern", "check", path("board", "board.json"), check=0)
            weft("rig", "rehearse", "--target", path("rigs", "target.json"), "--cameras", 2, "--frames", 1, "--width-px", 64,
                 "--height-px", 64, "--out", path("boards"), check=0)

    def test_a_daemon_knows_the_jobs_of_its_catalogue(self):
        for path in self.each():
            expected = json.loads(read(path("expected.json")))["jobs"]
            with open(path("weftd.log"), "w") as log:
                daemon = subprocess.Popen(
                    [os.path.join(BIN, "weftd"), "--listen", "127.0.0.1:0", "--address-file", path("address"), "--state",
                     path("state"), "--allow-path", self.folder, "--workers", "1"], stderr=log)
            try:
                end = time.monotonic() + LONG_S
                while not (os.path.exists(path("address")) and read(path("address")).strip()):
                    self.assertIsNone(daemon.poll(), read(path("weftd.log")))
                    self.assertLess(time.monotonic(), end)
                    time.sleep(0.02)
                server = read(path("address")).strip()
                jobs = {job["id"]: job["state"] for job in
                        json.loads(weft("job", "list", "--server", server, "--json", check=0).stdout)["jobs"]}
                self.assertEqual(set(jobs), set(expected))
                for job, state in expected.items():
                    if state not in ("JOB_STATE_QUEUED", "JOB_STATE_RUNNING"):  # these go on, and end
                        self.assertEqual(jobs[job], state)
                    shown = json.loads(weft("job", "show", job, "--server", server, "--json", check=0).stdout)
                    self.assertEqual(shown["job"]["id"], job)
            finally:
                daemon.terminate()
                daemon.wait(LONG_S)


if __name__ == "__main__":
    unittest.main()
