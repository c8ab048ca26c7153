"""Takes that are damaged after they were recorded: `take recover` keeps every intact frame, `take verify` sees all."""

import json
import os
import random
import shutil
import subprocess
import tarfile
import tempfile
import unittest

from studio import BIN, LONG_S, read, weft, write

LOAD = os.path.join(BIN, "recorder_load")
CAMERAS = ["3", "48", "32"]  # cameras, width_px, height_px: a frame is a header block and a payload block
IDS = ["cam100", "cam101", "cam102"]
SETS = 8
BLOCK = 4096


def record(folder):
    subprocess.run([LOAD, "record", folder, *CAMERAS, str(SETS), "0", "16"], check=True, capture_output=True,
                   timeout=LONG_S)


def frames(folder):
    """(camera, set) to "exact", or "missing" and the reason. Fails where a frame has other bytes."""
    done = subprocess.run([LOAD, "intact", folder, *CAMERAS], capture_output=True, text=True, timeout=LONG_S, check=False)
    if done.returncode != 0:
        raise AssertionError(done.stdout + done.stderr)
    return {tuple(line.split()[:2]): line.split(" ", 2)[2] for line in done.stdout.splitlines()}


def files(folder):
    """Names, sizes and contents below the folder."""
    return {os.path.relpath(os.path.join(base, name), folder): read(os.path.join(base, name), "rb")
            for base, _, names in os.walk(folder) for name in names}


def flip(path, chance):
    content = bytearray(read(path, "rb"))
    at = chance.randrange(len(content))
    content[at] ^= 1 << chance.randrange(8)
    write(path, bytes(content))
    return at


class Damage(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temp = tempfile.TemporaryDirectory(prefix="weft test ")
        cls.addClassCleanup(cls.temp.cleanup)
        cls.original = os.path.join(cls.temp.name, "original")
        record(cls.original)

    def setUp(self):
        self.take = os.path.join(self.temp.name, "take")
        shutil.rmtree(self.take, ignore_errors=True)
        shutil.copytree(self.original, self.take)

    def stream(self, camera, kind="stream"):
        return os.path.join(self.take, "streams", f"{camera}.{kind}")

    def verify(self):
        done = weft("take", "verify", self.take, "--json")
        report = json.loads(done.stdout)
        self.assertEqual(done.returncode, 0 if report["whole"] else 1, done.stderr)
        return report

    def assert_warns(self, report, path, at, what):
        told = f"{path}: byte {at}: padding is not zero; no frame is harmed"
        self.assertEqual(report["warnings"], [told], what)
        self.assertEqual((report["verdict"]["grade"], report["verdict"]["reason"]), ("GRADE_USABLE", told), what)
        text = weft("take", "verify", self.take, check=0).stdout
        self.assertTrue(text.startswith(f"usable: {told}\n"), text)
        self.assertIn(f"warning: {told}\n", text)

    def recover(self, *how):
        return json.loads(weft("take", "recover", self.take, "--json", *how, check=0).stdout)

    def assert_recovered(self, damaged, what):
        """After --force all is readable but what was damaged, verify passes, and a second call finds nothing to do.
        `damaged`: the stream's camera, or None; `what`: for the message."""
        self.recover("--force")
        report = self.verify()
        self.assertTrue(report["whole"], (what, report))
        found = frames(self.take)
        self.assertEqual(len(found), len(IDS) * SETS, what)
        for (camera, number), state in found.items():
            if camera != damaged:
                self.assertEqual(state, "exact", (what, camera, number))
            elif state != "exact":
                self.assertIn("lost: ", state, what)
        before = files(self.take)
        self.assertEqual(self.recover("--force").get("changes", []), [], what)
        self.assertEqual(files(self.take), before, what)
        return sum(state != "exact" for state in found.values())

    def test_a_closed_take_whose_stream_was_cut_keeps_all_frames_of_the_others(self):
        path = self.stream("cam101")
        os.truncate(path, 3 * BLOCK + 1000)
        before = files(self.take)
        refused = weft("take", "recover", self.take, check=2)
        self.assertIn("the take was closed", refused.stderr)
        self.assertEqual(files(self.take), before)
        plan = self.recover("--dry-run")
        self.assertEqual(files(self.take), before)
        self.assertTrue(plan["dry_run"])
        self.assertGreaterEqual(int(plan["frames_lost"]), SETS - 1)
        report = self.verify()
        self.assertEqual(report["verdict"]["grade"], "GRADE_BAD")
        self.assertTrue(any("camera cam101: its stream has no end record" in line for line in report["problems"]), report)
        self.assertEqual(self.assert_recovered("cam101", "cut"), int(plan["frames_lost"]))
        take = json.loads(read(os.path.join(self.take, "take.json")))
        self.assertEqual(take["state"], "TAKE_STATE_RECOVERED")
        self.assertEqual((int(take["sets_recorded"]), int(take["frames_missing"])), (SETS, int(plan["frames_lost"])))
        self.assertIn("lost: the stream ends before it", read(os.path.join(self.take, "ledger.csv")))
        kept = os.path.join(self.take, "recovered", "1")
        self.assertTrue(any(before["streams/cam101.stream"].endswith(content) and content
                            for content in files(kept).values()), os.listdir(kept))
        self.assertIn("removed", weft("take", "recover", "--purge", self.take, check=0).stdout)
        self.assertFalse(os.path.exists(os.path.dirname(kept)))
        self.assertTrue(self.verify()["whole"])

    def test_any_cut_any_flipped_bit_and_any_file_that_is_gone(self):
        chance = random.Random(11)
        targets = [(f"streams/{camera}.{kind}", camera if kind == "stream" else None)
                   for camera in IDS for kind in ("stream", "index")] + [("ledger.csv", None), ("take.json", None)]
        lost = harmless = 0
        for round_number in range(int(os.environ.get("WEFT_DAMAGE_ROUNDS", "16"))):
            self.setUp()
            name, damaged = targets[round_number % len(targets)]
            path = os.path.join(self.take, name)
            how = ("cut", "flip", "gone", "flip", "empty")[(round_number + round_number // len(targets)) % 5]
            what = f"{name}: {how}"
            if how == "cut":
                size = chance.randrange(os.path.getsize(path))
                os.truncate(path, size)
                what += f" to {size}"
            elif how == "flip":
                at = flip(path, chance)
                what += f" at {at}"
            elif how == "empty":
                os.truncate(path, 0)
            else:
                os.remove(path)
            report = self.verify()
            if report["whole"]:  # a bit of the zeros that fill a block harms no frame, and is told all the same
                self.assertTrue(damaged, what)
                self.assertEqual(set(frames(self.take).values()), {"exact"}, what)
                self.assert_warns(report, path, at, what)
                harmless += 1
            self.assertEqual(weft("take", "info", self.take, check=0).stderr.count("error"), 0, what)
            gone = self.assert_recovered(damaged, what)
            if how == "flip":
                self.assertLessEqual(gone, 1, what)
            lost += gone
        self.assertGreater(lost, 0)
        self.assertGreater(harmless, 0)

    def test_every_damage_to_take_json_and_ledger_is_seen(self):
        chance = random.Random(5)
        for name in ("take.json", "ledger.csv"):
            path = os.path.join(self.take, name)
            whole = read(path, "rb")
            for _ in range(10):
                at = flip(path, chance)
                self.assertFalse(self.verify()["whole"], (name, at))
                write(path, whole)
            lines = whole.splitlines(keepends=True)
            for damaged in (b"", whole[:-1], b"".join(lines[:-1]), b"".join(lines[:2] + lines[3:])):
                write(path, damaged)
                self.assertFalse(self.verify()["whole"], (name, damaged[-80:]))
            write(path, whole)
        self.assertTrue(self.verify()["whole"])

    def test_take_json_that_is_gone_comes_back_from_the_streams(self):
        path = os.path.join(self.take, "take.json")
        before = json.loads(read(path))
        os.remove(path)
        self.recover("--force")
        after = json.loads(read(path))
        for field in ("id", "started_host_time_ns", "weft_version", "cameras", "sets_recorded"):
            self.assertEqual(after[field], before[field])
        self.assertTrue(self.verify()["whole"])

    def test_a_stream_that_is_gone_is_named_and_leaves_gaps(self):
        os.remove(self.stream("cam102"))
        text = weft("take", "verify", self.take, check=1).stdout
        self.assertTrue(text.startswith("bad: camera cam102: the stream is gone"), text)
        info = weft("take", "info", self.take, check=0).stdout
        self.assertTrue(info.startswith("bad: camera cam102: its stream is gone"), info)
        self.assertEqual(self.assert_recovered("cam102", "gone"), SETS)
        self.assertIn("usable", weft("take", "verify", self.take, check=0).stdout.splitlines()[0])

    def test_cameras_of_which_indexes_alone_are_left_are_named(self):
        for camera in IDS:
            os.remove(self.stream(camera))
        os.remove(os.path.join(self.take, "take.json"))
        self.recover("--force")
        self.assertTrue(self.verify()["whole"])
        take = json.loads(read(os.path.join(self.take, "take.json")))
        self.assertEqual([camera["id"] for camera in take["cameras"]], IDS)
        self.assertEqual({state.split()[0] for state in frames(self.take).values()}, {"missing"})

    def test_takes_of_earlier_versions_are_recovered_in_the_same_way(self):
        with tarfile.open(os.path.join(os.environ["WEFT_SOURCE"], "tests", "data", "compat", "0.1.0.tar.xz")) as archive:
            archive.extractall(self.take)
        take = os.path.join(self.take, "takes", "closed")

        def images(name):
            weft("take", "export", take, "--out", os.path.join(self.take, name), check=0)
            return files(os.path.join(self.take, name))
        before = images("before")
        path = os.path.join(take, "streams", "right.stream")
        os.truncate(path, os.path.getsize(path) // 2)
        self.assertFalse(json.loads(weft("take", "verify", take, "--json", check=1).stdout)["whole"])
        self.assertIn("the take was closed", weft("take", "recover", take, check=2).stderr)
        lost = int(json.loads(weft("take", "recover", "--force", take, "--json", check=0).stdout)["frames_lost"])
        self.assertGreater(lost, 0)
        self.assertTrue(json.loads(weft("take", "verify", take, "--json", check=0).stdout)["whole"])
        after = images("after")
        self.assertEqual(len(before) - len(after), lost)
        for name, content in before.items():
            if "left" in name or name in after:
                self.assertEqual(after[name], content)

    def test_outputs_begin_with_the_verdict(self):
        for command in ("info", "verify"):
            self.assertTrue(weft("take", command, self.take, check=0).stdout.startswith("good: "), command)
        self.assertTrue(weft("take", "recover", "--dry-run", self.take, check=0).stdout.startswith("good: "))
        write(os.path.join(self.take, "take.json"), "")
        self.assertTrue(weft("take", "info", self.take, check=0).stdout.startswith("bad: "))
        self.assertTrue(weft("take", "verify", self.take, check=1).stdout.startswith("bad: "))


if __name__ == "__main__":
    unittest.main()
