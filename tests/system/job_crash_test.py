"""The disk of a registration fails or loses what was not flushed: going on leads to the undisturbed results."""

import os
import random
import shutil
import tempfile
import unittest

from crash_states import Disk, crash_states, read_log
from job_campaign import Studio, differing, make_take
from studio import faulty_disk, read, results, temporary_files, weft

OUT = "crash-results"  # part of every path of the results, and of no other
CALLS = "write,sync,rename,open,mkdir,unlink"


class JobCrash(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        shared = tempfile.TemporaryDirectory(prefix="weft crash ")
        cls.addClassCleanup(shared.cleanup)
        cls.folder = shared.name
        cls.studio = Studio(shared.name, make_take(shared.name, frames=3))
        cls.log = cls.path("calls.log")
        cls.count = cls.path("count")
        cls.out = cls.path("first", OUT)
        cls.register(cls.out, WEFT_FAULT_LOG=cls.log, WEFT_FAULT_COUNT=cls.count, check=0)
        cls.expected = results(cls.out)

    @classmethod
    def path(cls, *names):
        return os.path.join(cls.folder, *names)

    @classmethod
    def register(cls, out, check=None, **faults):
        environment = {**os.environ, **faulty_disk(), "WEFT_FAULT_UNDER": OUT, "WEFT_FAULT_CALLS": CALLS, **faults}
        return weft(*cls.studio.register_arguments(out=out), check=check, env=environment if faults else None)

    def assert_whole(self, out):
        self.assertEqual(differing(results(out), self.expected), [])
        self.assertEqual(temporary_files(out), [])

    def assert_goes_on_to_whole_results(self, out):
        self.register(out, check=0)
        self.assert_whole(out)
        shutil.rmtree(out)

    def test_what_is_done_is_on_the_disk(self):
        disk = Disk(self.out)
        for call in read_log(self.log):
            disk.do(call)
        left = self.path("power-cut")
        disk.crash(random.Random(1), left, kept=0)
        self.assertEqual(differing(results(left), self.expected), [])

    def test_goes_on_after_lost_torn_and_reordered_writes(self):
        states = int(os.environ.get("WEFT_CRASH_STATES", 4))
        for number, (_, left) in enumerate(crash_states(self.log, self.out, self.folder, states)):
            with self.subTest(state=number):
                self.assert_goes_on_to_whole_results(left)

    def test_goes_on_after_any_call_that_failed(self):
        calls = len(read(self.count, "rb"))
        self.assertGreater(calls, 3 * 4 * 4)  # frames, files, and what each takes
        runs = int(os.environ.get("WEFT_FAILED_CALLS", 4))
        for run in range(min(runs, calls)):
            number = 1 + run * calls // runs
            how = ("error", "torn", "kill", "kill_torn")[run % 4]
            with self.subTest(call=number, how=how):
                out = self.path(f"failed{number}", OUT)
                done = self.register(out, WEFT_FAULT_NTH=str(number), WEFT_FAULT_HOW=how)
                if done.returncode == 0:
                    self.assertEqual(differing(results(out), self.expected), [])
                elif "kill" not in how:
                    self.assertIn("weft: error: ", done.stderr)
                    self.assertNotIn("/proc/", done.stderr)
                self.assert_goes_on_to_whole_results(out)


if __name__ == "__main__":
    unittest.main()
