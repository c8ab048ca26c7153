"""Recorders whose disk loses what was not flushed, and whose writes and flushes fail one by one.

What the recorder acknowledged is back, byte by byte, after `take recover`; a failure is never called complete.
WEFT_CRASH_STATES=N rebuilds N disks instead of a few; WEFT_CRASH_CALLS=all fails every call instead of a sample.
"""

import json
import os
import random
import re
import shutil
import subprocess
import tempfile
import unittest

from crash_states import crash_states, read_log
from studio import BIN, LONG_S, faulty_disk, read, weft

LOAD = os.path.join(BIN, "recorder_load")
CAMERAS = ["3", "48", "32"]
STATES = int(os.environ.get("WEFT_CRASH_STATES", "18"))
ALL_CALLS = os.environ.get("WEFT_CRASH_CALLS") == "all"


def run(*arguments, **faults):
    environment = {**os.environ, **faulty_disk(), **faults} if faults else None
    return subprocess.run([str(argument) for argument in arguments], capture_output=True, text=True, timeout=LONG_S,
                          env=environment, check=False)


def acknowledged(output):
    sets = [int(line.split()[1]) for line in output[:output.rfind("\n") + 1].splitlines() if line.startswith("ack ")]
    return max(sets, default=-1)


class Crashes(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="weft-crash-")
        self.addCleanup(folder.cleanup)
        self.folder = os.path.realpath(folder.name)
        self.root = os.path.join(self.folder, "disk")
        self.take = os.path.join(self.root, "take")
        os.mkdir(self.root)

    def record(self, sets=12, **faults):
        """Sixty sets a second, so that flushes come between them."""
        shutil.rmtree(self.root)
        os.mkdir(self.root)
        return run(LOAD, "record", self.take, *CAMERAS, sets, 60, 16, **{"WEFT_FAULT_UNDER": self.root, **faults})

    def assert_back(self, take, last, what, *force):
        """After recovery every frame up to set `last` is exact, and the take is whole."""
        if not os.path.isdir(os.path.join(take, "streams")):
            self.assertEqual(last, -1, what)
            return
        done = weft("take", "recover", *force, take)
        if done.returncode != 0:
            self.assertEqual(last, -1, (what, done.stderr))
            return
        report = json.loads(weft("take", "verify", take, "--json").stdout)
        self.assertTrue(report["whole"], (what, report))
        found = run(LOAD, "check", take, *CAMERAS, last)
        self.assertEqual(found.returncode, 0, (what, found.stderr))
        self.assertGreaterEqual(int(found.stdout.split()[-1]), last, what)

    def test_lost_torn_and_reordered_writes_take_nothing_that_was_acknowledged(self):
        log = os.path.join(self.folder, "log")
        self.assertEqual(self.record(WEFT_FAULT_LOG=log).returncode, 0)
        highest = -1
        for said, disk in crash_states(log, self.root, self.folder, STATES):
            last = acknowledged(said)
            highest = max(highest, last)
            self.assert_back(os.path.join(disk, "take"), last, f"{disk} after {last}", "--force")
        self.assertGreater(highest, 0)

    def test_a_recovery_that_crashes_takes_nothing_either(self):
        self.record(WEFT_FAULT_HOW="kill", WEFT_FAULT_NTH="60")
        stream = os.path.join(self.take, "streams", "cam101.stream")
        content = bytearray(read(stream, "rb"))
        content[3 * 4096 + 2000] ^= 4  # in the frame of set 0 or 1
        with open(stream, "wb") as file:
            file.write(content)
        before, log = os.path.join(self.folder, "before"), os.path.join(self.folder, "log")
        shutil.copytree(self.root, before)
        done = run(os.path.join(BIN, "weft"), "take", "recover", self.take, WEFT_FAULT_UNDER=self.root, WEFT_FAULT_LOG=log)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertGreater(len(read_log(log)), 10)
        intact = self.exact(self.take)
        for _, disk in crash_states(log, self.root, self.folder, STATES // 3, before=before):
            take = os.path.join(disk, "take")
            weft("take", "recover", "--force", take, check=0)
            self.assertTrue(json.loads(weft("take", "verify", take, "--json").stdout)["whole"])
            self.assertEqual(self.exact(take), intact)

    def exact(self, take):
        done = run(LOAD, "intact", take, *CAMERAS)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return {line for line in done.stdout.splitlines() if line.endswith(" exact")}

    def test_no_call_fails_in_silence(self):
        for kind in ("write", "sync", "fallocate", "truncate", "rename", "open", "mkdir"):
            count = os.path.join(self.folder, "count." + kind)
            self.assertEqual(self.record(6, WEFT_FAULT_CALLS=kind, WEFT_FAULT_COUNT=count).returncode, 0)
            calls = os.path.getsize(count)
            chosen = range(1, calls + 1)
            if not ALL_CALLS:
                chosen = sorted({1, calls} | set(random.Random(kind).sample(chosen, min(calls, 2))))
            for number in chosen:
                how = ("error", "torn")[number % 2]
                answer = (5, 28)[number // 2 % 2]
                what = f"{kind} {number} of {calls}, {how}, errno {answer}"
                done = self.record(6, WEFT_FAULT_CALLS=kind, WEFT_FAULT_NTH=str(number), WEFT_FAULT_HOW=how,
                                   WEFT_FAULT_ERRNO=str(answer))
                self.assertIn(done.returncode, (0, 1, 2), (what, done.stderr))
                if done.returncode == 0:
                    # Room that cannot be reserved is no loss, and runs differ a little in their calls.
                    report = json.loads(weft("take", "verify", self.take, "--json", check=0).stdout)
                    self.assertEqual((report["sets"], report["dropped"]), ("6", "0"), what)
                else:
                    self.assertTrue(done.stderr, what)
                    if done.returncode == 1 and "TAKE_STATE_COMPLETE" in read(os.path.join(self.take, "take.json")):
                        # Renamed, and then the folder was not flushed: all is there, but for a power cut.
                        self.assertIn("take.json", done.stderr, what)
                        report = json.loads(weft("take", "verify", self.take, "--json", check=0).stdout)
                        self.assertEqual((report["sets"], report["dropped"]), ("6", "0"), what)
                self.assert_back(self.take, acknowledged(done.stdout), what, "--force")

    def test_a_flush_that_failed_is_not_tried_again_and_called_success(self):
        """The system forgets what it could not write, so the next flush succeeds and means nothing."""
        for number in (4, 8):
            done = self.record(30, WEFT_FAULT_CALLS="sync", WEFT_FAULT_NTH=str(number), WEFT_FAULT_PROGRAM="recorder_load",
                               WEFT_FAULT_UNDER=".stream")
            self.assertEqual(done.returncode, 1, done.stderr)
            self.assertIn("cannot be flushed", done.stderr)
            recorded = int(re.search(r"recorded (\d+)", done.stdout).group(1))
            self.assertEqual(recorded, acknowledged(done.stdout) + 1)
            report = json.loads(weft("take", "verify", self.take, "--json", check=0).stdout)
            self.assertEqual(int(report["sets"]), recorded)
            self.assertEqual(int(report["dropped"]), 30 - recorded)


if __name__ == "__main__":
    unittest.main()
