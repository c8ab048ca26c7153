"""Recorders that are killed, and recorders whose disk fails: what was acknowledged is there, byte by byte."""

import json
import os
import random
import re
import shutil
import subprocess
import tempfile
import time
import unittest

from studio import BIN, LONG_S, StudioTest, faulty_disk, read, results, weft

LOAD = os.path.join(BIN, "recorder_load")
SMALL = ["3", "96", "64"]  # cameras, width_px, height_px
LARGE = ["2", "1024", "512"]  # 1 MiB a set
MIDDLE = ["2", "512", "256"]
NEVER_FULL_MIB = 256  # no set is dropped, however busy the machine


def load(*arguments, faults=None, **options):
    environment = dict(os.environ)
    if faults:
        environment.update(faults, **faulty_disk())
    return subprocess.Popen([LOAD, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                            env=environment, **options)


def acknowledged(output):
    """The last set that was acknowledged; a line that was cut off does not count."""
    sets = [int(line.split()[1]) for line in output[:output.rfind("\n") + 1].splitlines() if line.startswith("ack ")]
    return max(sets, default=-1)


def frame_bytes(take):
    """Of all chunks in the streams, in order."""
    return json.loads(weft("take", "replay", take, "--fastest", "--json", check=0).stdout)["checksum"]


class Recording(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="weft test ")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.take = os.path.join(folder.name, "take")

    def check(self, cameras, last=None):
        """Number of sets, and the last one; every byte is as it was recorded. After set `last`, frames may be missing."""
        done = load("check", self.take, *cameras, *([] if last is None else [last]))
        out, errors = done.communicate(timeout=LONG_S)
        self.assertEqual(done.returncode, 0, out + errors)
        return tuple(map(int, re.fullmatch(r"sets (\d+) last (-?\d+)\n", out).groups()))

    def ledger(self):
        """Sets by event, and all lines."""
        lines = read(os.path.join(self.take, "ledger.csv")).splitlines()[1:]
        sets = {"recorded": set(), "dropped": set()}
        for line in lines:
            event, first, last = line.split(",")[:3]
            if event in sets:
                sets[event] |= set(range(int(first), int(last) + 1))
        return sets, lines

    def assert_all_accounted(self, counters):
        sets, _ = self.ledger()
        self.assertEqual(len(sets["recorded"]), counters["recorded"])
        self.assertEqual(len(sets["dropped"]), counters["dropped"])
        self.assertFalse(sets["recorded"] & sets["dropped"])
        self.assertEqual(sets["recorded"] | sets["dropped"], set(range(counters["offered"])))

    def counters(self, out):
        found = re.search(r"offered (\d+) recorded (\d+) dropped (\d+) peak_mib (\d+) cause (.*)", out)
        self.assertIsNotNone(found, out)
        return {**dict(zip(["offered", "recorded", "dropped", "peak_mib"], map(int, found.groups()))),
                "cause": found.group(5)}

    def assert_whole(self):
        report = json.loads(weft("take", "verify", self.take, "--json", check=0).stdout)
        self.assertTrue(report["whole"])
        return report

    def test_keeps_every_acknowledged_set_when_it_is_killed_at_any_moment(self):
        chance = random.Random(7)
        brought_back = later_than_acknowledged = 0
        for round_number in range(100):
            shutil.rmtree(self.take, ignore_errors=True)
            recorder = load("record", self.take, *SMALL, 1000000, chance.choice([0, 2000]), 16)
            begun = recorder.stdout.readline() if round_number % 5 else ""
            time.sleep(chance.uniform(0, 0.1))
            recorder.kill()
            out = begun + recorder.communicate(timeout=LONG_S)[0]
            if not os.path.exists(os.path.join(self.take, "take.json")):
                self.assertEqual(acknowledged(out), -1)  # killed before it began
                continue
            done = load("recover", self.take, *SMALL, acknowledged(out))
            found, errors = done.communicate(timeout=LONG_S)
            self.assertEqual(done.returncode, 0, errors)
            back, sets, last = map(int, re.fullmatch(r"brought_back (\d+)\nsets (\d+) last (-?\d+)\n", found).groups())
            accounted, _ = self.ledger()  # at 2000 sets a second a busy machine drops some
            self.assertEqual(len(accounted["recorded"]), sets)
            self.assertLessEqual(set(range(last + 1)), accounted["recorded"] | accounted["dropped"])
            self.assertGreaterEqual(last, acknowledged(out))
            later_than_acknowledged += last > acknowledged(out)
            brought_back += back
        self.assertGreater(later_than_acknowledged, 0)
        self.assertGreater(brought_back, 0)

    def test_drops_whole_sets_while_the_disk_stalls_and_goes_on_afterwards(self):
        stall = os.path.join(self.folder, "stall")
        recorder = load("record", self.take, *MIDDLE, 300, 100, 2, faults={"WEFT_FAULT_STALL": stall})
        self.assertTrue(recorder.stdout.readline().startswith("ack "))
        open(stall, "w").close()
        time.sleep(1)
        os.remove(stall)
        out, errors = recorder.communicate(timeout=LONG_S)
        self.assertEqual(recorder.returncode, 0, errors)
        counters = self.counters(out)
        self.assertLessEqual(counters["peak_mib"], 2)
        self.assertGreater(counters["dropped"], 0)
        self.assert_all_accounted(counters)
        sets, lines = self.ledger()
        self.assertGreater(max(sets["recorded"]), max(sets["dropped"]))
        self.assertTrue(any("disk too slow: the queue of 2 MiB is full" in line for line in lines))
        self.assertTrue(any("slow disk: writing the frame took" in line for line in lines))
        self.assertEqual(self.check(MIDDLE)[0], counters["recorded"])
        self.assert_whole()

    def test_gives_up_on_a_disk_that_never_answers_and_loses_nothing_acknowledged(self):
        stall = os.path.join(self.folder, "stall")
        recorder = load("record", self.take, *LARGE, 200, 100, 8, faults={"WEFT_FAULT_STALL": stall})
        begun = recorder.stdout.readline()
        open(stall, "w").close()
        out, errors = recorder.communicate(timeout=LONG_S)
        self.assertEqual(recorder.returncode, 1)
        self.assertIn("the disk has not answered", errors)
        weft("take", "recover", self.take, check=0)
        last = max(acknowledged(begun), acknowledged(out))
        self.assertGreaterEqual(self.check(LARGE, last)[1], last)
        self.assert_whole()

    def test_a_full_disk_stops_the_take_at_a_whole_set(self):
        for fault, cause in (("WEFT_FAULT_FULL", "No space left on device"), ("WEFT_FAULT_ERROR", "Input/output error")):
            shutil.rmtree(self.take, ignore_errors=True)
            recorder = load("record", self.take, *LARGE, 100, 200, NEVER_FULL_MIB, faults={fault: "20000000"})
            out, errors = recorder.communicate(timeout=LONG_S)
            self.assertEqual(recorder.returncode, 1)
            self.assertIn(cause, errors)
            counters = self.counters(out)
            self.assertIn(cause, counters["cause"])
            self.assertGreater(counters["recorded"], 0)
            self.assert_all_accounted(counters)
            sets, last = self.check(LARGE)
            self.assertEqual((sets, last), (counters["recorded"], counters["recorded"] - 1))
            # This disk did not take the end of the streams either.
            before = frame_bytes(self.take)
            weft("take", "recover", self.take, check=0)
            self.assert_whole()
            self.assertEqual(frame_bytes(self.take), before)

    def test_a_file_system_without_room_stops_the_take_at_a_whole_set(self):
        mount = os.path.join(self.folder, "disk")
        os.mkdir(mount)
        inside = subprocess.run(
            ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c",
             'mount -t tmpfs -o size=24m tmpfs "$1" || exit 77; '
             '"$2" record "$1/take" 2 1024 512 100 200 "$4"; echo "status $?"; "$2" check "$1/take" 2 1024 512; '
             '"$3" take verify "$1/take" --json',
             "sh", mount, LOAD, os.path.join(BIN, "weft"), str(NEVER_FULL_MIB)],
            capture_output=True, text=True, timeout=LONG_S, check=False)
        if inside.returncode == 77 or "unshare" in inside.stderr:
            self.skipTest("this machine lets no user mount a file system: " + inside.stderr)
        self.assertIn("status 1", inside.stdout, inside.stderr)
        self.assertIn("No space left on device", inside.stderr)
        self.assertRegex(inside.stdout, r'"whole": true')
        counters = self.counters(inside.stdout)
        self.assertGreater(counters["recorded"], 5)
        self.assertIn(f"sets {counters['recorded']} last {counters['recorded'] - 1}", inside.stdout)


class RecordedTakes(StudioTest):
    def test_register_like_the_images_that_they_were_made_of(self):
        recorded = self.path("recorded")
        weft("take", "import", self.take, "--out", recorded, "--fps", "30", check=0)
        weft("take", "verify", recorded, check=0)
        self.register("--frames", "0:2", check=0)
        from_take = self.path("from_take")
        self.register("--frames", "0:2", check=0, dump=recorded, out=from_take)
        self.assertTrue(results(self.out))
        self.assertEqual(results(self.out), results(from_take))

    def test_tell_what_they_hold(self):
        recorded = self.path("recorded")
        os.remove(self.image(1, 0))
        weft("take", "import", self.take, "--out", recorded, "--fps", "25", check=0)
        info = weft("take", "info", recorded, check=0).stdout
        self.assertIn("closed", info)
        self.assertIn(f"{len(self.frames)} frame sets of {len(self.images)} cameras", info)
        self.assertIn("1 frame missing: no image in the dump", info)
        self.assertRegex(info, r" 40\.000 +0\.0000")
        refused = weft("take", "import", self.take, "--out", recorded, check=2)
        self.assertIn("holds a take", refused.stderr)

    def test_are_played_again(self):
        recorded = self.path("recorded")
        weft("take", "import", self.take, "--out", recorded, "--fps", "25", "--compress", check=0)
        replays = [json.loads(weft("take", "replay", recorded, "--json", *how, check=0, input="\n" * 99).stdout)
                   for how in (["--fastest"], [], ["--speed", "2"], ["--step"])]
        self.assertEqual([int(replay["sets"]) for replay in replays], [len(self.frames)] * 4)
        self.assertEqual(len({replay["checksum"] for replay in replays}), 1)
        self.assertGreaterEqual(replays[1]["wall_s"], 0.04 * (len(self.frames) - 1))
        stepped = weft("take", "replay", recorded, "--step", check=0, input="\nq\n").stdout
        self.assertEqual(stepped.count(" late "), 2)
        weft("take", "replay", recorded, "--step", "--fastest", check=2)

    def test_are_looked_at_while_they_play(self):
        recorded, look = self.path("recorded"), self.path("look")
        weft("take", "import", self.take, "--out", recorded, "--fps", "25", check=0)
        weft("take", "replay", recorded, "--preview", look, "--board", f"{self.take}/board.json", "--template",
             f"{self.take}/template", "--decoded-views", "3", check=0)
        page = read(os.path.join(look, "index.html"))
        self.assertEqual(page.count("<figure id="), len(self.images))
        self.assertIn(f"frame set {len(self.frames) - 1}", page)
        self.assertIn("cells are read by three cameras or more", page)
        self.assertGreater(page.count("image/png"), 1)  # both sides of the garment
        refused = weft("take", "replay", recorded, "--template", f"{self.take}/template", check=2)
        self.assertIn("--board", refused.stderr)

    def test_are_trimmed_shifted_and_decoded(self):
        recorded, part = self.path("recorded"), self.path("part")
        weft("take", "import", self.take, "--out", recorded, "--fps", "25", check=0)
        # 40 ms are one period: the pictures of the first camera come one set later.
        camera = os.path.splitext(self.images[0])[0]
        copied = json.loads(weft("take", "trim", recorded, "--sets", "1:3", "--shift", f"{camera}=40",
                                 "--out", part, "--json", check=0).stdout)
        self.assertEqual(int(copied["sets"]), 2)
        weft("take", "verify", part, check=0)
        self.assertIn(f"camera {camera} shifted by 40.000000 ms", read(os.path.join(part, "take.json")))
        board = ["--board", f"{self.take}/board.json"]
        for take, frame in ((recorded, "0"), (part, "1")):
            weft("decode", take, "--frame", frame, *board, "--out", self.path(f"{frame}.csv"), check=0)
        cells = [[line for line in read(self.path(name)).splitlines() if line.startswith(camera + ",")]
                 for name in ("0.csv", "1.csv")]
        self.assertGreater(len(cells[0]), 20)
        self.assertEqual(*cells)
        refused = weft("decode", recorded, "--frames", "99", *board, "--out", self.path("no.csv"), check=2)
        self.assertIn("it has 3 frames, 0000 to", refused.stderr)

    def test_become_archives_and_videos(self):
        recorded, archive = self.path("recorded"), self.path("archive")
        weft("take", "import", self.take, "--out", recorded, "--fps", "25", check=0)
        copied = json.loads(weft("take", "export", recorded, "--format", "ffv1", "--out", archive, "--json", check=0).stdout)
        self.assertEqual(int(copied["frames"]), len(self.frames) * len(self.images))
        camera = os.path.splitext(self.images[0])[0]
        self.assertEqual(len(read(os.path.join(archive, camera + ".csv")).splitlines()), 1 + len(self.frames))
        weft("take", "export", recorded, "--format", "proxy", "--out", self.path("look.mkv"), check=0)
        for video in (os.path.join(archive, camera + ".mkv"), self.path("look.mkv")):
            shown = subprocess.run(["ffprobe", "-v", "error", "-count_frames", "-show_entries", "stream=nb_read_frames,r_frame_rate",
                                    "-of", "csv=p=0", video], capture_output=True, text=True, check=True).stdout
            self.assertEqual(shown.strip(), f"25/1,{len(self.frames)}")
        refused = weft("take", "export", recorded, "--format", "proxy", "--out", self.path("look.nothing"), check=1)
        self.assertIn("ffmpeg", refused.stderr)


if __name__ == "__main__":
    unittest.main()
