"""Daemon, recorder and workers die, and disks fail, while four cameras are recorded and registered (take_campaign.py).

WEFT_TAKE_TRIALS=all runs the whole campaign instead of one trial of some kinds; WEFT_TAKE_LOG=FILE keeps its records."""

import os
import tempfile
import unittest

from live_studio import enter_network, set_up_network
from studio import weft
from take_campaign import FAULTY, FILM, FULL, LOOP, TRIALS, Scene, add_to_log, closing_table, run_trial
from take_disks import can_have_loops

ALL = os.environ.get("WEFT_TAKE_TRIALS") == "all"
# One kills daemon, worker and, at last, all; another fills the disk under a daemon that is killed; a recorder's disk fails.
CHOSEN = {FILM: 18, FULL: 63, FAULTY: 90}


def setUpModule():
    set_up_network([])


class TakeCrash(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="weft-scene-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name
        cls.scene = Scene(folder.name)
        cls.addClassCleanup(cls.scene.close)
        cls.records = []

    def test_what_was_acknowledged_is_exact_and_jobs_end_as_if_nothing_was(self):
        self.addCleanup(lambda: print(closing_table(self.records)))
        for number in range(len(TRIALS)) if ALL else CHOSEN.values():
            if TRIALS[number] == LOOP and not can_have_loops():
                continue
            with self.subTest(trial=number):
                record = run_trial(number, TRIALS[number], self.scene)
                self.records.append(record)
                if "WEFT_TAKE_LOG" in os.environ:
                    add_to_log(os.environ["WEFT_TAKE_LOG"], record)
                self.assertEqual(record["wrong"], [], record)

    def test_a_bit_that_was_not_sent_is_found(self):
        self.scene.use(FILM)
        self.scene.wait_for_cameras()
        take, cameras = os.path.join(self.folder, "compared"), self.scene.cameras
        weft("take", "record", "--session", cameras.session, "--out", take, "--seconds", 2, "--no-disk-test", check=0)
        faults, sets = cameras.faults_of(take)
        self.assertEqual(faults, [])
        self.assertGreater(min(map(len, sets.values())), 4)
        camera = sorted(cameras.pictures)[0]
        kept = cameras.pictures[camera]
        self.addCleanup(cameras.pictures.update, {camera: kept})
        cameras.pictures[camera] = [picture[:-1] + bytes([picture[-1] ^ 1]) for picture in kept]
        self.assertEqual(len(cameras.faults_of(take)[0]), len(sets[camera]))


if __name__ == "__main__":
    enter_network()
    unittest.main()
