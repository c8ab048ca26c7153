"""What every earlier version wrote is read, and goes on from there: tests/data/compat/<version>.tar.xz, see the README there."""

import json
import os
import shutil
import signal
import subprocess
import tarfile
import tempfile
import unittest

from studio import BIN, LONG_S, read, results, wait_for, weft

SAMPLES = os.path.join(os.environ["WEFT_SOURCE"], "tests", "data", "compat")
VERSIONS = sorted(name.removesuffix(".tar.xz") for name in os.listdir(SAMPLES) if name.endswith(".tar.xz"))
NEW_NAMES = {"single_look": "single_pass"}
ENDED = ("JOB_STATE_DONE", "JOB_STATE_FAILED", "JOB_STATE_CANCELLED")


class Samples(unittest.TestCase):
    """Every test gets a copy of each version's samples, which it may change."""

    @classmethod
    def setUpClass(cls):
        cls.unpacked = tempfile.TemporaryDirectory(prefix="weft samples ")
        cls.addClassCleanup(cls.unpacked.cleanup)
        for version in VERSIONS:
            with tarfile.open(os.path.join(SAMPLES, version + ".tar.xz")) as archive:
                archive.extractall(os.path.join(cls.unpacked.name, version))

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="weft test ")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.assertTrue(VERSIONS)

    def each(self):
        for version in VERSIONS:
            here = os.path.join(self.folder, version)
            shutil.copytree(os.path.join(self.unpacked.name, version), here, symlinks=True)
            self.expected = json.loads(read(os.path.join(here, "expected.json")))
            self.frames = sorted(name for name in os.listdir(os.path.join(here, "result")) if name.isdigit())
            yield lambda *names, here=here: os.path.join(here, *names)

    def inputs(self, path, template="template"):
        return ["--rig", path("rig.json"), "--board", path("board", "board.json"), "--template", path(template)]

    def register(self, path, out, *more, template="template"):
        return weft("register", path("takes", "garment"), *self.inputs(path, template), "--out", out, *more, check=0).stdout

    def all_registered(self):
        return f"{len(self.frames)} of {len(self.frames)} frames registered"


class Compatibility(Samples):
    def test_closed_takes_are_whole_and_replay_as_they_were(self):
        for path in self.each():
            expected = self.expected["takes"]
            for name, state in (("closed", "COMPLETE"), ("garment", "COMPLETE"), ("recovered", "RECOVERED")):
                if name not in expected:
                    continue
                take = path("takes", name)
                info = json.loads(weft("take", "info", take, "--json", check=0).stdout)
                self.assertEqual(info["take"]["state"], f"TAKE_STATE_{state}")
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
            expected = self.expected["takes"]["crashed"]
            recovery = json.loads(weft("take", "recover", take, "--json", check=0).stdout)
            self.assertGreaterEqual(int(recovery["sets"]), expected["acknowledged"])
            self.assertTrue(json.loads(weft("take", "verify", take, "--json", check=0).stdout)["whole"])
            info = json.loads(weft("take", "info", take, "--json", check=0).stdout)
            self.assertEqual(info["take"]["state"], "TAKE_STATE_RECOVERED")

    def test_a_take_is_registered_with_the_rig_board_and_template_of_its_time(self):
        for path in self.each():
            for template in ("template", "templates/built", "templates/corners"):
                self.assertIn(self.all_registered(), self.register(path, path("out", template), template=template))

    def test_a_file_of_all_options_is_taken(self):
        for path in self.each():
            if not os.path.exists(path("options.txtpb")):
                continue
            # Its values are defaults of that time.
            self.assertIn(self.all_registered(), self.register(path, path("out"), "--config", path("options.txtpb")))
            listed = json.loads(weft("options", "--config", path("options.txtpb"), "--json", check=0).stdout)["options"]
            text = read(path("options.txtpb"))
            for option in listed:
                if option["value"] != option["default"]:
                    self.assertIn(option["path"].split(".")[-1] + ": " + option["value"], text)

    def test_results_are_evaluated_and_go_on(self):
        for path in self.each():
            found = json.loads(weft("evaluate", path("result"), "--take", path("takes", "garment"), "--rig", path("rig.json"),
                                    "--template", path("template"), "--quick", "--json", check=0).stdout)
            before = json.loads(read(path("evaluation", "evaluation.json")))
            self.assertEqual(len(found["frames"]), len(before["frames"]))
            self.assertEqual(found["total"]["measures"].get("self_intersecting_pairs", 0),
                             before["total"]["measures"].get("self_intersecting_pairs", 0))
            # As the start of another registration, and the other way round.
            done = self.register(path, path("again"), "--start-from", path("result"), "--frames", "0:1")
            self.assertIn("1 of 1 frame registered", done)
            weft("align", path("result", "0000", "cloud.ply"), "--template", path("template"), "--start",
                 path("result", "0000", "mesh.ply"), "--out", path("aligned.ply"), check=0)

    def test_a_job_goes_on_in_the_folder_of_its_results(self):
        """Also where a frame is missing, or of today, and has neighbours of its time."""
        for path in self.each():
            self.register(path, path("fresh"), "--observations")
            for name, frame in (("whole", None), ("first missing", 0), ("last missing", -1), ("first of today", 0)):
                out = path("out", name)
                shutil.copytree(path("result"), out)
                if "missing" in name:
                    shutil.rmtree(os.path.join(out, self.frames[frame]))
                elif frame is not None:
                    self.register(path, out, "--observations", "--frames", self.frames[frame])
                self.assertIn(self.all_registered(), self.register(path, out, "--observations"))
                self.assertEqual(results(out), results(path("fresh")), out)

    def test_templates_are_accepted_with_their_hashes(self):
        for path in self.each():
            expected = self.expected["templates"]
            self.assertEqual(len(expected), 4)
            for name, hash_of_it in expected.items():
                summary = json.loads(weft("template", "check", path(name), "--json", check=0).stdout)
                self.assertEqual(summary["hash"], hash_of_it, name)
                weft("align", path("result", "0000", "cloud.ply"), "--template", path(name), "--out", path("aligned.ply"),
                     check=0)
            weft("template", "build", *[path("templates", "built", "clouds", cloud) for cloud in
                                        os.listdir(path("templates", "built", "clouds"))], "--board",
                 path("board", "board.json"), "--openings", self.expected.get("openings", 2), "--out", path("rebuilt"), check=0)

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


class Daemons(Samples):
    """State folders that an earlier weftd left when it was killed, with the samples where they were made: /srv/weft."""

    @classmethod
    def setUpClass(cls):
        if subprocess.run(["unshare", "--user", "--map-root-user", "--mount", "true"], stderr=subprocess.DEVNULL).returncode:
            raise unittest.SkipTest("no mount namespaces for this user")
        super().setUpClass()

    def start(self, path, allowed="/srv/weft", listens=True):
        """In a mount namespace of its own."""
        self.path = path
        if os.path.exists(path("address")):
            os.remove(path("address"))
        with open(path("weftd.log"), "a") as log:
            self.daemon = subprocess.Popen(
                ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c",
                 'mount -t tmpfs tmpfs /srv && mkdir /srv/weft && mount --bind "$0" /srv/weft && exec "$@"', path(),
                 os.path.join(BIN, "weftd"), "--listen", "127.0.0.1:0", "--address-file", path("address"), "--state",
                 "/srv/weft/state", "--allow-path", allowed, "--workers", "1"], stdout=log, stderr=log)
        self.addCleanup(self.kill)
        if listens:
            wait_for(self.listens, "weftd to listen")
            self.server = ["--server", read(path("address")).strip()]

    def listens(self):
        self.assertIsNone(self.daemon.poll(), read(self.path("weftd.log")))
        return os.path.exists(self.path("address")) and read(self.path("address")).strip()

    def kill(self):
        if self.daemon.poll() is None:
            self.daemon.kill()
            self.daemon.wait()

    def stop(self):
        self.daemon.send_signal(signal.SIGTERM)
        self.assertEqual(self.daemon.wait(LONG_S), 0, read(self.path("weftd.log")))

    def job(self, *command):
        return weft("job", *command, *self.server, check=0).stdout

    def shown(self):
        """By id: the job as `weft job show` has it, with its frames."""
        ids = [job["id"] for job in json.loads(self.job("list", "--json"))["jobs"]]
        return {job: json.loads(self.job("show", job, "--json")) for job in ids}

    def ended(self):
        return sum(job["state"] in ENDED for job in json.loads(self.job("list", "--json"))["jobs"])

    def wait_for_all(self):
        wait_for(lambda: self.ended() == len(self.expected["jobs"]), "the jobs to end")

    def unfinished(self):
        return [job for job, state in self.expected["jobs"].items() if state not in ENDED]

    def assert_as_they_were(self, shown):
        """Ids, inputs and hashes of all jobs, and everything of those that had ended."""
        self.assertEqual(set(shown), set(self.expected["jobs"]))
        for job, state in self.expected["jobs"].items():
            self.assertEqual(shown[job]["job"]["id"], job)
            if job not in self.unfinished():
                self.assertEqual(shown[job]["job"]["state"], state)
            if "shown" not in self.expected:
                continue
            now, then = shown[job], self.expected["shown"][job]
            for name in ("spec", "inputs", "created_unix_ns", "weft_version", "first_frame", "last_frame"):
                self.assert_holds(now["job"][name], then["job"][name])
            self.assertEqual([frame["frame"] for frame in now["frames"]], [frame["frame"] for frame in then["frames"]])
            if job not in self.unfinished():
                self.assert_holds(now, then)

    def assert_holds(self, now, then, *but):
        """All that was said then is said now, under its name of today."""
        if isinstance(then, dict):
            for name in then.keys() - but:
                self.assert_holds(now[NEW_NAMES.get(name, name)], then[name])
        elif isinstance(then, list):
            self.assertEqual(len(now), len(then))
            for a, b in zip(now, then):
                self.assert_holds(a, b)
        else:
            self.assertEqual(now, then)

    def assert_done(self, shown, jobs):
        """No worker crashed on what lay in their folders."""
        for job in jobs:
            self.assertEqual(shown[job]["job"]["state"], "JOB_STATE_DONE", shown[job])
            for warning in shown[job]["job"]["warnings"]:
                self.assertIn("of an earlier run", warning)
            for frame in shown[job]["frames"]:
                self.assertEqual(frame["state"], "FRAME_STATE_DONE", frame)
            fetched = self.path("fetched", job)
            self.job("fetch", job, "--out", fetched)
            for frame in shown[job]["frames"]:
                report = json.loads(read(os.path.join(fetched, frame["frame"], "report.json")))
                self.assertTrue(report["keys"], job)

    def test_a_daemon_goes_on_with_the_jobs_of_its_catalogue(self):
        """Also where it is killed itself meanwhile."""
        for path in self.each():
            self.start(path)
            self.assert_as_they_were(self.shown())
            had_ended = len(self.expected["jobs"]) - len(self.unfinished())
            for more in (1, 2):
                wait_for(lambda: self.ended() >= had_ended + more, "a job to end", pause_s=0)
                self.kill()
                self.start(path)
            self.wait_for_all()
            shown = self.shown()
            self.assert_as_they_were(shown)
            self.assert_done(shown, self.unfinished())
            # What is its own state folder now, once more.
            self.stop()
            self.start(path)
            self.assertEqual(self.shown(), shown)
            self.kill()

    def test_results_of_its_time_are_fetched(self):
        for path in self.each():
            self.start(path)
            for job, state in self.expected["jobs"].items():
                if state != "JOB_STATE_DONE" or "shown" not in self.expected:  # 0.1.0 kept none
                    continue
                self.job("fetch", job, "--out", path("fetched", job))
                out = self.expected["shown"][job]["job"]["spec"]["out"]
                stored, fetched = results(path(os.path.relpath(out, "/srv/weft"))), results(path("fetched", job))
                self.assertEqual({name for name in stored if not name.endswith("unrefined.ply")}, set(fetched))
                self.assertEqual({name: stored[name] for name in fetched}, fetched)
            self.kill()

    def test_jobs_whose_inputs_were_moved_say_so_and_go_on_when_they_are_back(self):
        for path in self.each():
            os.rename(path("rig.json"), path("moved.json"))
            self.start(path)
            self.wait_for_all()
            shown = self.shown()
            self.assert_as_they_were(shown)
            for job in self.unfinished():
                self.assertEqual(shown[job]["job"]["state"], "JOB_STATE_FAILED")
                self.assertIn("/srv/weft/rig.json", shown[job]["job"]["message"])
            os.rename(path("moved.json"), path("rig.json"))
            # One of them; the others go the same way.
            again = [job for job in self.unfinished() if shown[job]["job"]["frames"]["cancelled"]][-1:]
            self.assertTrue(again)
            self.job("retry", again[0])
            self.wait_for_all()
            self.assert_done(self.shown(), again)
            self.kill()

    def test_a_folder_that_is_gone_is_no_longer_allowed(self):
        for path in self.each():
            self.start(path, allowed="/srv/weft/gone", listens=False)
            self.assertEqual(self.daemon.wait(LONG_S), 2)
            self.assertIn("--allow-path: /srv/weft/gone is no folder", read(path("weftd.log")))
            os.mkdir(path("other"))
            self.start(path, allowed="/srv/weft/other")
            self.assert_as_they_were(self.shown())
            self.kill()


if __name__ == "__main__":
    unittest.main()
