"""`weft avatar` where things go wrong in the studio, what is tried of that without pictures, and at a daemon."""

import json
import math
import os
import subprocess
import tempfile
import unittest

import avatar_test as shirt
from daemon_process import DaemonProcess
from shift_net import with_shift_net
from studio import BIN, read, results, vertex_states, wait_for, weft, write


def setUpModule():
    shirt.setUpModule()


def tearDownModule():
    shirt.tearDownModule()


class Trials(unittest.TestCase):
    def setUp(self):
        self.out = shirt.path(self.id().rsplit(".", 1)[1])

    def test_frames_of_another_decoder_are_driven_again(self):
        shirt.drive(self.out, check=0)
        whole = results(self.out)
        for stage in ("decode", "drive"):
            # As an earlier version of Weft left them: all from the first such frame on follow from it.
            report = json.loads(read(f"{self.out}/0007/report.json"))
            key = next(key for key in report["keys"] if key["stage"] == stage)
            key["version"] -= 1
            write(f"{self.out}/0007/report.json", json.dumps(report))
            job = json.loads(shirt.drive(self.out, "--json", check=0).stdout)
            self.assertLessEqual(job["frames"]["reused"], 11, stage)
            versions = {tuple((k["stage"], k["version"]) for k in report["keys"]) for report in shirt.frame_reports(self.out)}
            self.assertEqual(len(versions), 1, stage)
            self.assertEqual(results(self.out), whole, stage)

    def test_a_camera_that_moved_since_calibration(self):
        alarm = "moved, or its calibration is off"
        shirt.drive(self.out, check=0)
        self.assertNotIn(alarm, read(f"{self.out}/report.html"))
        rig = json.loads(read(f"{shirt.take}/rig.json"))
        rig.pop("hash", None)
        camera, cosine, sine = rig["cameras"][0], math.cos(math.radians(2)), math.sin(math.radians(2))
        turn = [cosine, 0, sine, 0, 1, 0, -sine, 0, cosine]
        for name, columns in (("rotation", 3), ("translation_mm", 1)):
            was = camera[name]
            camera[name] = [sum(turn[3 * row + k] * was[columns * k + column] for k in range(3))
                            for row in range(3) for column in range(columns)]
        write(shirt.path("knocked.json"), json.dumps(rig))
        knocked = self.out + " knocked"
        shirt.drive(knocked, rig=shirt.path("knocked.json"))
        self.assertIn(alarm, read(f"{knocked}/report.html"))

    def test_many_cameras_are_as_good_as_a_registration(self):
        scores = json.loads(weft("evaluate", shirt.sources[0], "--avatar", shirt.avatar, "--cameras", "2,8", "--frames", "6",
                                 "--json", check=0).stdout)["scores"]
        eight = {score["method"]: score for score in scores if score.get("cameras") == 8}
        self.assertLess(eight["driven"]["crossed_mm"], 1.5 * eight["registered"]["crossed_mm"])
        self.assertLess(eight["driven"]["from_registered_mm"], 0.3)
        # Skinning knows the true pose and the true cloth of the first frame.
        two = {score["method"]: score["mean_mm"] for score in scores if score.get("cameras") == 2}
        self.assertLess(two["skinned + rays"], two["skinned"])

    def test_a_range_of_frames_is_evaluated(self):
        def driven(frames, check=0):
            said = weft("evaluate", shirt.sources[0], "--avatar", shirt.avatar, "--cameras", 3, "--frames", frames, "--json", "--meshes",
                        shirt.path(f"range {frames}"), check=check)
            return said.stderr if check else {score["method"]: {**score, "ms_a_frame": 0} for score in json.loads(said.stdout)["scores"]}
        self.assertEqual(driven("4"), driven(":4"))
        self.assertEqual(driven("6:9")["driven"]["frames"], 3)
        folder = os.path.join(shirt.path("range 6:9"), os.listdir(shirt.path("range 6:9"))[0])
        self.assertEqual(sorted(os.listdir(folder)), ["0006", "0007", "0008"])
        self.assertIn("none of them from 600 on", driven("600:700", check=2))
        self.assertIn("--frames 9:6: expected A:B", driven("9:6", check=2))

    def test_pictures_are_rendered_and_decoded(self):
        def scores(*more):
            said = weft("evaluate", shirt.sources[0], "--avatar", shirt.avatar, "--cameras", 2, "--frames", 3, "--json", *more,
                        check=0).stdout
            return {score["method"]: score for score in json.loads(said)["scores"]}
        filmed, imitated = scores("--pictures"), scores()
        for name, value in imitated["driven"].items():
            if name not in ("method", "ms_a_frame"):
                self.assertEqual(filmed["imitated"].get(name, 0), 0 if name.endswith("seams_mm") else value, name)
        # Cells beside seams and hems are seen in part, and the decoder finds many of them.
        self.assertGreater(filmed["driven"]["cells_a_view"], imitated["driven"]["cells_a_view"] / 1.3)
        self.assertLess(filmed["driven"]["cells_a_view"], imitated["driven"]["cells_a_view"] * 1.3)
        # Imitation knows nothing of how cells of 20 mm bend.
        self.assertLess(filmed["driven"]["mean_mm"], 5 * imitated["driven"]["mean_mm"])
        once_more = scores("--pictures")["driven"]
        self.assertEqual(once_more | {"ms_a_frame": 0}, filmed["driven"] | {"ms_a_frame": 0})

    def test_trials_and_meshes_to_watch(self):
        meshes = shirt.path("meshes")
        table = weft("evaluate", shirt.sources[0], "--avatar", shirt.avatar, "--cameras", "2", "--frames", 45, "--trials",
                     "--meshes", meshes, check=0).stdout
        for method in ("elsewhere", "frame by frame", "skinned + rays", "one dark", "after dark", "never dark"):
            self.assertIn(method, table)
        folder = f"{meshes}/{os.path.basename(shirt.sources[0])}-2"
        self.assertEqual(len(os.listdir(folder)), 45)
        self.assertEqual(set(vertex_states(f"{folder}/0044/mesh.ply")) - {shirt.DRIVEN}, set())
        self.assertTrue(os.path.exists(f"{folder}/0044/truth.ply"))


class WhileRecorded(DaemonProcess, unittest.TestCase):
    session, recorded = shirt.Live.session, shirt.Live.recorded

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="weft followed ")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.start_plainly("--allow-path", shirt.folder.name, "--allow-path", os.path.dirname(shirt.take), "--workers", 2)

    def test_the_daemon_drives_every_frame_of_a_take_that_grows(self):
        filmed, out, every = self.path("filmed"), self.path("out"), self.path("after the take")
        recorder = subprocess.Popen([os.path.join(BIN, "weft"), "take", "record", "--session", self.session(), "--out", filmed,
                                     "--no-disk-test"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(recorder.kill)
        wait_for(lambda: os.path.exists(f"{filmed}/ledger.csv"), "the recorder to begin")
        server = self.addresses[0]
        job = shirt.drive(out, "--live", "--server", server, "--detach", of=filmed, check=0).stdout.strip()

        def shown():
            return json.loads(weft("job", "show", job, "--server", server, "--json", check=0).stdout)["job"]
        wait_for(lambda: shown()["frames"].get("done", 0) >= 1, "a mesh")
        first = os.stat(f"{out}/0000/report.json").st_mtime_ns
        said, errors = recorder.communicate(timeout=240)
        self.assertEqual(recorder.returncode, 0, said + errors)
        done = weft("job", "watch", job, "--server", server, check=0).stdout
        self.assertIn("12 of 12 frames driven", done)
        self.assertEqual(shown()["live"].get("backlog", 0), 0)
        # None is driven twice, and all are what driving the take after its end gives.
        self.assertEqual(os.stat(f"{out}/0000/report.json").st_mtime_ns, first)
        shirt.drive(every, of=filmed, check=0)
        self.assertEqual(results(out), results(every))
        self.assertIn("cannot be sent", shirt.drive(self.path("sent"), "--live", "--server", server, "--upload", of=filmed,
                                                    check=2).stderr)


class Net(DaemonProcess, unittest.TestCase):
    """An avatar with a net goes wherever avatars go."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="weft nets ")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.start_plainly("--workers", 2)

    def test_a_job_of_uploads_gives_what_driving_here_gives(self):
        net, server = with_shift_net(shirt.avatar, self.path("net.avatar")), self.addresses[0]
        here, there, plain = self.path("here"), self.path("there"), self.path("plain")
        shirt.drive(here, avatar=net, check=0)
        shirt.drive(there, "--server", server, "--upload", avatar=net, check=0)
        self.assertEqual(results(there), results(here))
        listed = json.loads(weft("library", "list", "avatar", "--server", server, "--json", check=0).stdout)
        self.assertEqual([item["file_count"] for item in listed["items"]], [4])
        # The same shapes without the net are another avatar: nothing is taken for done.
        os.rename(here, plain)
        job = json.loads(shirt.drive(plain, "--json", check=0).stdout)
        self.assertEqual(job["frames"].get("reused", 0), 0)
        self.assertNotEqual(results(plain), results(there))
        os.remove(f"{net}/sample.bin")
        self.assertIn("sample.bin", shirt.drive(self.path("broken"), avatar=net, check=2).stderr)


if __name__ == "__main__":
    unittest.main()
