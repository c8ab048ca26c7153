"""`weft avatar`: a shirt is learnt from simulated motions and followed by two and three cameras in another one."""

import glob
import json
import os
import shutil
import signal
import subprocess
import tempfile
import unittest

from daemon_process import DaemonProcess
from shirt_studio import make_shirt_studio
from studio import BIN, page_data, read, results, temporary_files, vertex_states, wait_for, weft, write

DRIVEN = 4


def setUpModule():
    """Motions without pictures to learn from, one with pictures of three cameras to be driven, and the avatar. One of
    each for a whole run of ctest."""
    global folder, take, avatar, sources
    folder = tempfile.TemporaryDirectory(prefix="weft avatar ")
    shared = os.environ.get("WEFT_SHIRT_STUDIO") or folder.name
    if shared == folder.name:
        make_shirt_studio(shared)
    take, avatar = os.path.join(shared, "take"), os.path.join(shared, "shirt.avatar")
    sources = [os.path.join(shared, "twist-1")]


def tearDownModule():
    folder.cleanup()


def path(name):
    return os.path.join(folder.name, name)


def drive(out, *more, of=None, **replaced):
    inputs = {"avatar": avatar, "rig": f"{take}/rig.json", "board": f"{take}/board.json", "template": f"{take}/template",
              **{name: value for name, value in replaced.items() if name != "check"}}
    options = [word for name, value in inputs.items() for word in (f"--{name}", value)]
    return weft("avatar", "drive", of or take, *options, "--out", out, *more, check=replaced.get("check"))


def frame_reports(out):
    return [json.loads(read(file)) for file in sorted(glob.glob(f"{glob.escape(out)}/*/report.json"))]


class Driving(unittest.TestCase):
    def setUp(self):
        self.out = path(self.id().rsplit(".", 1)[1])

    def error_mm(self, result):
        mesh = json.loads(weft("evaluate", result, "--quick", "--json", check=0).stdout)["total"]["mesh"]
        errors = [mesh[name] for name in ("visible_mm", "hidden_mm") if name in mesh]
        return sum(e["mean"] * e["count"] for e in errors) / sum(e["count"] for e in errors)

    def test_three_cameras_find_the_garment_and_two_nearly(self):
        three = drive(self.out, "--observations", check=0)
        self.assertIn("12 of 12 frames driven", three.stdout)
        reports = frame_reports(self.out)
        self.assertEqual({report["state"] for report in reports}, {"FRAME_STATE_DONE"})
        self.assertEqual([report["driven"]["started_anew"] for report in reports], [True] + 11 * [False])
        self.assertGreater(min(report["driven"]["rays"] for report in reports), 500)
        self.assertIn(DRIVEN, vertex_states(f"{self.out}/0003/mesh.ply"))
        self.assertEqual(temporary_files(self.out), [])
        self.assertLess(self.error_mm(self.out), 8)
        job = json.loads(read(f"{self.out}/job.json"))
        self.assertEqual(job["driven"]["cameras"], ["c00", "c01", "c02"])
        two = self.out + " of two"
        drive(two, "--cameras", "c00,c01", check=0)
        self.assertEqual(len(frame_reports(two)[0]["views"]), 2)
        self.assertLess(self.error_mm(two), 25)
        # Ordinary results for whatever follows.
        weft("export", self.out, "--format", "npz", "--fps", 30, "--out", self.out + " npz", check=0)
        self.assertTrue(page_data(f"{self.out}/report.html")["job"]["figures"]["driven"])

    def test_a_run_in_pieces_and_at_other_threads_gives_the_same_files(self):
        drive(self.out, "--threads", 1, check=0)
        whole = results(self.out)
        self.assertEqual(len(whole), 12)
        pieces = self.out + " pieces"
        drive(pieces, "--threads", 3, check=0)
        for frame in ("0005", "0009"):
            shutil.rmtree(f"{pieces}/{frame}")
        kept = {frame: os.stat(f"{pieces}/{frame}/report.json").st_mtime_ns for frame in ("0004", "0007", "0011")}
        # What the driver knew stands in the report before: two frames are driven, no others, to the same bytes.
        job = json.loads(drive(pieces, "--json", check=0).stdout)
        self.assertEqual(job["frames"]["reused"], 10)
        self.assertEqual(results(pieces), whole)
        self.assertEqual({frame: os.stat(f"{pieces}/{frame}/report.json").st_mtime_ns for frame in kept}, kept)
        self.assertEqual([report["driven"] for report in frame_reports(pieces)],
                         [report["driven"] for report in frame_reports(self.out)])
        job = json.loads(drive(pieces, "--json", check=0).stdout)
        self.assertEqual(job["frames"]["reused"], 12)
        # A frame that comes out otherwise changes all that follow it.
        other = path("other pictures")
        shutil.copytree(take, other)
        shutil.copy(f"{take}/0003/c00.png", f"{other}/0004/c00.png")
        job = json.loads(drive(pieces, "--json", of=other, check=0).stdout)
        self.assertEqual(job["frames"]["reused"], 4)
        # With another camera everything is driven again.
        drive(pieces, "--cameras", "c00,c02", check=0)
        self.assertNotEqual(results(pieces), whole)

    def test_a_frame_without_the_garment_fails_and_the_next_one_finds_it(self):
        dark = path("dark")
        shutil.copytree(take, dark)
        for picture in glob.glob(f"{glob.escape(dark)}/0004/*.png"):
            shutil.copy(f"{take}/board.png", picture)  # of another size than the rig says
        done = drive(self.out, of=dark)
        self.assertEqual(done.returncode, 0, done.stderr)  # usable
        reports = frame_reports(self.out)
        self.assertEqual(reports[4]["state"], "FRAME_STATE_FAILED")
        self.assertIn("3 of 3 cameras have no usable image", reports[4]["reason"])
        self.assertFalse(os.path.exists(f"{self.out}/0004/mesh.ply"))
        self.assertTrue(reports[5]["driven"]["started_anew"])
        self.assertEqual(reports[5]["state"], "FRAME_STATE_DONE")

    def test_a_table_compares_with_the_truth(self):
        table = weft("evaluate", take, "--avatar", avatar, "--cameras", "2,3,4", check=0).stdout
        self.assertIn("best shape", table)
        self.assertIn("has pictures of 3 cameras, not of 4", table)
        # Without pictures the decoder is imitated.
        scores = json.loads(weft("evaluate", sources[0], "--avatar", avatar, "--cameras", "3", "--frames", "8", "--json",
                                 check=0).stdout)
        mean = {score["method"]: score["mean_mm"] for score in scores["scores"]}
        self.assertLess(mean["driven"], 2)
        self.assertLess(mean["best shape"], mean["mean shape"])

    def test_show_tells_what_it_was_trained_on(self):
        about = json.loads(weft("avatar", "show", avatar, "--json", check=0).stdout)
        self.assertEqual((about["kind"], about["components"], about["sources"][0]["name"]), ("sparse-view", 12, sources[0]))
        self.assertEqual(about["training_frames"] + about["held_out_frames"], 60)
        text = weft("avatar", "show", avatar, check=0).stdout
        self.assertIn(sources[0], text)
        self.assertIn("held out", text)


class Training(unittest.TestCase):
    def test_gives_the_same_bytes_at_any_number_of_threads(self):
        other = path("again.avatar")
        weft("avatar", "train", *sources, "--components", 12, "--threads", 1, "--out", other, check=0)
        for name in ("avatar.json", "space.bin"):
            self.assertEqual(read(f"{other}/{name}", "rb"), read(f"{avatar}/{name}", "rb"))

    def test_learns_from_registered_results(self):
        result, other = path("registered"), path("registered.avatar")
        weft("simulate", "--preset", "tiny", "--frames", 12, "--out", path("tube"), check=0)
        tube = path("tube")
        weft("register", tube, "--rig", f"{tube}/rig.json", "--board", f"{tube}/board.json", "--template",
             f"{tube}/template", "--out", result, check=0)
        weft("avatar", "train", result, "--components", 4, "--out", other, check=0)
        about = json.loads(weft("avatar", "show", other, "--json", check=0).stdout)
        self.assertEqual(about["training_frames"] + about["held_out_frames"], 12)
        # Of another garment: both are named.
        refused = drive(path("none"), avatar=other, check=2).stderr
        for name in (other, f"{take}/template"):
            self.assertIn(name, refused)
        mixed = weft("avatar", "train", *sources, result, "--out", path("mixed.avatar"), check=2).stderr
        self.assertIn(result, mixed)
        self.assertFalse(os.path.exists(path("mixed.avatar")))


class Live(unittest.TestCase):
    def setUp(self):
        self.out = path(self.id().rsplit(".", 1)[1])

    def live(self, out, *more, of=None):
        job = json.loads(drive(out, "--live", "--json", *more, of=of, check=0).stdout)
        self.assertEqual(job["state"], "JOB_STATE_DONE")
        return job["frames"], job["driven"]["live"]

    def begin(self, out, *more):
        process = subprocess.Popen(
            [os.path.join(BIN, "weft"), "avatar", "drive", take, "--avatar", avatar, "--rig", f"{take}/rig.json", "--board",
             f"{take}/board.json", "--template", f"{take}/template", "--out", out, "--live", *map(str, more)],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def recorded(self):
        """The frames of the take as if they had been recorded, at 2 frames a second."""
        recorded = path("recorded")
        if not os.path.exists(recorded):
            weft("take", "import", take, "--out", recorded, "--fps", 2, check=0)
        return recorded

    def session(self):
        cameras = [{"id": f"c{k:02}", "replay": {"take": self.recorded(), "speed": 1}} for k in range(3)]
        write(path("session.json"), json.dumps({"cameras": cameras, "fps": 2, "clocks": "SESSION_CLOCKS_SHARED",
                                                "low_disk_gib": 0.01}))
        return path("session.json")

    def test_a_slow_replay_gives_what_driving_every_frame_does(self):
        frames, live = self.live(self.out, "--speed", 0.02)
        self.assertEqual((frames["done"], live["frames_arrived"], live.get("frames_passed_over", 0)), (12, 12, 0))
        self.assertLess(live["latency_median_ms"], 1600)  # the time between two frames
        self.assertLessEqual(live["latency_median_ms"], live["latency_p95_ms"])
        every = self.out + " every"
        drive(every, check=0)
        self.assertEqual(results(self.out), results(every))
        self.assertGreater(frame_reports(self.out)[5]["stages"][0]["time_ms"], 0)
        # Frames that were chosen by their arrival are no part of a run that drives all.
        refused = drive(every, "--live", check=2).stderr
        self.assertIn("holds frame 0000 of another run", refused)
        self.assertEqual(temporary_files(self.out), [])

    def test_frames_that_come_too_fast_are_passed_over(self):
        frames, live = self.live(self.out, "--speed", 100)
        self.assertEqual(frames["done"] + live["frames_passed_over"], 12)
        self.assertGreater(live["frames_passed_over"], 3)
        done = [report["frame"] for report in frame_reports(self.out)]
        self.assertEqual(done[-1], "0011")  # the newest wins
        text = drive(self.out, "--live", check=0).stdout  # nothing is left
        self.assertEqual([report["frame"] for report in frame_reports(self.out)], done)
        self.assertIn("0 of 0 passed over", text)
        # What was passed over is driven where every frame is.
        drive(self.out, check=0)
        self.assertEqual(len(frame_reports(self.out)), 12)

    def test_is_stopped_and_goes_on(self):
        process = self.begin(self.out, "--speed", 0.05)
        wait_for(lambda: os.path.exists(f"{self.out}/0002/report.json"), "three frames")
        process.send_signal(signal.SIGINT)
        said, errors = process.communicate(timeout=240)
        self.assertEqual(process.returncode, 0, errors)
        self.assertIn("passed over", said)
        self.assertEqual(temporary_files(self.out), [])
        stopped = [report["frame"] for report in frame_reports(self.out)]
        self.assertEqual(json.loads(read(f"{self.out}/job.json"))["frames"]["done"], len(stopped))
        first = {frame: os.stat(f"{self.out}/{frame}/report.json").st_mtime_ns for frame in stopped}
        frames, _ = self.live(self.out, "--speed", 1)
        self.assertEqual(frames["reused"], len(stopped))
        self.assertEqual({frame: os.stat(f"{self.out}/{frame}/report.json").st_mtime_ns for frame in stopped}, first)
        self.assertEqual([report["driven"]["started_anew"] for report in frame_reports(self.out)][1:],
                         (len(frame_reports(self.out)) - 1) * [False])

    def test_a_take_is_followed_while_it_is_recorded(self):
        filmed = path("filmed")
        recorder = subprocess.Popen([os.path.join(BIN, "weft"), "take", "record", "--session", self.session(), "--out", filmed,
                                     "--no-disk-test"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(recorder.kill)
        wait_for(lambda: os.path.isdir(f"{filmed}/streams"), "the recorder")
        frames, live = self.live(self.out, of=filmed)
        said, errors = recorder.communicate(timeout=240)
        self.assertEqual(recorder.returncode, 0, said + errors)
        self.assertEqual(frames["done"] + live.get("frames_passed_over", 0), 12)
        self.assertGreaterEqual(frames["done"], 4)
        self.assertEqual(frame_reports(self.out)[-1]["frame"], "0011")
        self.assertIn("drive", drive(self.out, of=filmed, check=0).stdout)
        self.assertEqual(len(frame_reports(self.out)), 12)

    def test_cameras_are_driven_and_recorded(self):
        filmed = path("filmed here")
        frames, live = self.live(self.out, "--session", self.session(), of=filmed)
        self.assertEqual(frames["done"] + live.get("frames_passed_over", 0), 12)
        self.assertGreaterEqual(frames["done"], 4)
        self.assertEqual(int(json.loads(weft("take", "info", filmed, "--json", check=0).stdout)["sets"]), 12)
        self.assertIn("lies in the folder of the take",
                      drive(f"{filmed}/out", "--live", "--session", self.session(), of=filmed, check=2).stderr)


class Daemon(DaemonProcess, unittest.TestCase):
    def setUp(self):
        folder_of_test = tempfile.TemporaryDirectory(prefix="weft avatars ")
        self.addCleanup(folder_of_test.cleanup)
        self.folder = folder_of_test.name
        self.start_plainly("--workers", 2)
        self.server = self.addresses[0]

    def test_a_job_of_uploads_gives_what_driving_here_gives(self):
        out = self.path("result")
        done = drive(out, "--server", self.server, "--upload", check=0)
        self.assertIn("12 of 12 frames driven", done.stdout)
        local = path("driven here")
        drive(local, check=0)
        self.assertEqual(results(out), results(local))
        job = json.loads(read(f"{out}/job.json"))
        self.assertEqual(job["driven"]["cameras"], ["c00", "c01", "c02"])
        self.assertEqual(len(job["items"]["avatar"]), 64)
        listed = json.loads(weft("library", "list", "avatar", "--server", self.server, "--json", check=0).stdout)
        item, = listed["items"]
        self.assertEqual((item["kind"], item["file_count"], item["id"]), ("ITEM_KIND_AVATAR", 2, job["items"]["avatar"]))
        # By name, and without an upload of what is there.
        named = self.path("named")
        drive(named, "--server", self.server, "--upload", "--cameras", "c00,c02", avatar="library:shirt.avatar", check=0)
        self.assertEqual(json.loads(read(f"{named}/job.json"))["driven"]["cameras"], ["c00", "c02"])
        fetched = self.path("fetched")
        weft("library", "get", "avatar", "shirt.avatar", "--out", fetched, "--server", self.server, check=0)
        self.assertEqual(read(f"{fetched}/space.bin", "rb"), read(f"{avatar}/space.bin", "rb"))

    def test_a_cancelled_job_is_resumed_and_a_killed_daemon_goes_on(self):
        long = self.path("long")
        shutil.copytree(take, long)
        there_and_back = [f"{k:04}" for k in [*range(12), *reversed(range(12))]]
        for position in range(12, 72):
            shutil.copytree(f"{take}/{there_and_back[position % 24]}", f"{long}/{position:04}")
        job = drive(self.path("result"), "--server", self.server, "--upload", "--detach", of=long, check=0).stdout.strip()

        def shown():
            return json.loads(weft("job", "show", job, "--server", self.server, "--json", check=0).stdout)["job"]
        wait_for(lambda: shown()["frames"].get("done", 0) >= 2, "two frames")
        weft("job", "cancel", job, "--server", self.server, check=0)
        wait_for(lambda: shown()["state"] == "JOB_STATE_CANCELLED", "the end")
        before = shown()["frames"]["done"]
        weft("job", "retry", job, "--server", self.server, check=0)
        wait_for(lambda: shown()["frames"]["done"] > before, "a further frame")
        self.kill_daemon()
        self.start_plainly("--workers", 2)
        self.server = self.addresses[0]
        weft("job", "watch", job, "--server", self.server, check=0)
        out = self.path("fetched")
        weft("job", "fetch", job, "--out", out, "--server", self.server, check=0)
        local = self.path("driven in one go")
        drive(local, of=long, check=0)
        self.assertEqual(len(results(out)), 72)
        self.assertEqual(results(out), results(local))
        self.assertEqual([report["driven"]["started_anew"] for report in frame_reports(out)], [True] + 71 * [False])

    def test_refuses_what_is_no_avatar_of_the_template(self):
        broken = self.path("broken.avatar")
        shutil.copytree(avatar, broken)
        write(f"{broken}/space.bin", read(f"{broken}/space.bin", "rb")[:-9])

        def refused(folder, status=2):
            return weft("library", "upload", "avatar", folder, "--server", self.server, check=status).stderr
        self.assertIn("space.bin", refused(broken))
        os.remove(f"{broken}/space.bin")
        self.assertIn("an avatar is avatar.json and space.bin", refused(broken))
        self.assertIn("is a file; give the folder", refused(f"{avatar}/avatar.json"))
        shutil.copytree(avatar, broken, dirs_exist_ok=True)
        write(f"{broken}/notes.txt", "more")
        self.assertIn("other files are given", refused(broken))
        done = drive(self.path("result"), "--server", self.server, "--upload", "--cameras", "c00,front", check=2)
        self.assertIn("has no camera \"front\"", done.stderr)
        self.assertEqual(json.loads(weft("job", "list", "--server", self.server, "--json", check=0).stdout).get("jobs", []), [])


class Refusals(unittest.TestCase):
    def refused(self, *more, **replaced):
        return drive(path("refused"), *more, **replaced, check=2).stderr

    def copy_of_avatar(self):
        other = path("broken.avatar")
        shutil.rmtree(other, ignore_errors=True)
        shutil.copytree(avatar, other)
        return other

    def test_cameras_that_do_not_exist(self):
        self.assertIn("c00, c01, c02", self.refused("--cameras", "c00,front"))
        self.assertIn("twice", self.refused("--cameras", "c00,c00"))

    def test_a_rig_in_metres(self):
        rig = json.loads(read(f"{take}/rig.json"))
        rig.pop("hash", None)
        for camera in rig["cameras"]:
            camera["translation_mm"] = [x / 1000 for x in camera["translation_mm"]]
        write(path("metres.json"), json.dumps(rig))
        refused = self.refused(rig=path("metres.json"))
        for words in ("metres.json", f"{take}/template", "in metres"):
            self.assertIn(words, refused)

    def test_broken_files(self):
        other = self.copy_of_avatar()
        write(f"{other}/space.bin", read(f"{other}/space.bin", "rb")[:-9])
        self.assertIn("space.bin", drive(path("refused"), avatar=other, check=1).stderr)
        write(f"{other}/avatar.json", "{\"kind\": \"walk\"}")
        self.assertIn("avatar.json: kind is \"walk\"", self.refused(avatar=other))
        os.remove(f"{other}/avatar.json")
        self.assertIn("weft avatar train", self.refused(avatar=other))

    def test_results_in_the_avatar(self):
        self.assertIn("lies in the folder of the avatar", drive(f"{avatar}/out", check=2).stderr)
        self.assertEqual(sorted(os.listdir(avatar)), ["avatar.json", "space.bin"])

    def test_results_among_the_inputs(self):
        refused = drive(f"{take}/out", check=2).stderr
        self.assertIn("lies in the folder of the take", refused)

    def test_an_avatar_in_place_of_something_else(self):
        self.assertIn("is no avatar", weft("avatar", "train", *sources, "--out", take, check=2).stderr)

    def test_sources_without_meshes(self):
        self.assertIn("weft register", weft("avatar", "train", folder.name, "--out", path("x.avatar"), check=2).stderr)


if __name__ == "__main__":
    unittest.main()
