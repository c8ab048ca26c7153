"""A session of live cameras in which everything goes wrong in a studio: packets are lost, a camera goes
away and comes back, a clock jumps, the disk stalls, the disk is full. Every frame is checked against what the cameras
really saw.

The take lasts 20 s; WEFT_ENDURANCE_S=600 makes it ten minutes and prints figures.
"""

import json
import os
import re
import tempfile
import time
import unittest

from live_studio import LiveTest, enter_network, frames, packet_loss, set_up_network
from studio import faulty_disk, weft

CAMERAS = {"left": "127.0.0.2", "middle": "127.0.0.3", "right": "127.0.0.4", "top": "127.0.0.5"}
SECONDS = float(os.environ.get("WEFT_ENDURANCE_S", "20"))
WIDTH, HEIGHT, FPS = 256, 192, 10
PERIOD_NS = 1_000_000_000 // FPS
QUEUE_MIB = 2


def setUpModule():
    set_up_network(CAMERAS.values())


class Endurance(LiveTest):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="weft test ")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.live_set_up(folder.name, CAMERAS)
        self.write_session([f"Width={WIDTH}", f"Height={HEIGHT}"], ptp=True, fps=FPS, queue_mib=QUEUE_MIB,
                           tolerance_ms=2)

    def start(self, seconds, **faults):
        return self.record(seconds, env={**os.environ, **faulty_disk(), **faults})

    def assert_true_frames(self):
        """Every frame holds what its camera saw at the trigger of its set, bit by bit. Returns their number."""
        first = None
        total = 0
        for camera in CAMERAS:
            for number, _, true_ns, _ in frames(self.take, camera):
                first = first or (number, true_ns)
                self.assertEqual(true_ns - first[1], (number - first[0]) * PERIOD_NS, (camera, number))
                total += 1
        return total

    def test_every_frame_is_accounted_for(self):
        others = self.start_cameras("left", "right", "top")
        middle = self.start_cameras("middle")
        stall = os.path.join(self.folder, "stall")
        with packet_loss(0.01):
            recorder = self.start(0, WEFT_FAULT_STALL=stall)
            self.wait_for_more_sets(recorder, 10)
            begin = time.monotonic()
            self.sleep_until(begin, 0.1)
            middle.kill()
            self.wait_for(recorder, "note", words="disconnected: ")
            self.sleep_until(begin, 0.25)
            self.start_cameras("middle")
            self.wait_for(recorder, "note", words="reconnected: ")
            self.sleep_until(begin, 0.5)
            others.tell("set right jump_ns 3.2e9")
            self.wait_for(recorder, "note", words="jumped")
            self.sleep_until(begin, 0.65)
            open(stall, "w").close()
            self.sleep_until(begin, 0.8)
            os.unlink(stall)
            self.wait_for(recorder, "dropped", words="disk")
            self.wait_for_more_sets(recorder, 10)
            self.sleep_until(begin, 1)
            with open(f"/proc/{recorder.pid}/status") as status:
                peak_kib = int(re.search(r"VmHWM:\s+(\d+)", status.read()).group(1))
            info = self.stop(recorder, (0, 1))
        self.assert_accounted(info)
        total = self.assert_true_frames()
        notes = "\n".join(info["notes"])
        self.assertRegex(notes, "camera middle: disconnected: ")
        self.assertRegex(notes, r"camera middle: reconnected: after \d+ ms")
        self.assertRegex(notes, r"camera right: its clock jumped by 3\.2\d+ s")
        self.assertEqual(notes.count("jumped"), 1, notes)
        events = self.ledger()
        # A machine that is slow to start a camera begins the take without it.
        first = {camera: frames(self.take, camera)[0][0] for camera in CAMERAS}
        self.assertEqual({camera for event, number, _, camera, _ in events if event == "missing" and number >= first[camera]},
                         {"middle"},
                         [event for event in events if event[0] in ("missing", "note") and event[3] != "middle"][:20])
        dropped = [(last - first + 1, cause) for event, first, last, _, cause in events if event == "dropped"]
        self.assertTrue(dropped and all("disk" in cause for _, cause in dropped), dropped)
        sync = json.loads(weft("take", "sync", self.take, "--json").stdout)
        self.assertEqual({clock["camera"]: clock.get("jumps", 0) for clock in sync["clocks"]},
                         {"left": 0, "middle": 0, "right": 1, "top": 0})
        self.assertLess(sync["spread_median_ms"], 100)
        self.assertTrue(any("camera right: its clock jumped" in finding for finding in sync["findings"]))
        if SECONDS > 60:
            print(json.dumps({"frames": total, "sets": info["sets"], "dropped": dropped, "peak_mib": peak_kib // 1024,
                              "cameras": info["take"]["cameras"], "causes": info["causes"], "notes": info["notes"]}, indent=1))
            print(weft("take", "sync", self.take).stdout)

    def sleep_until(self, begin, share):
        time.sleep(max(0, begin + share * SECONDS - time.monotonic()))

    def test_a_full_disk_ends_the_take_and_costs_nothing_that_is_on_it(self):
        self.start_cameras()
        recorder = self.start(30, WEFT_FAULT_FULL=str(4 * 20 * 2 * 4096 * 8))
        told, errors = recorder.communicate(timeout=120)
        self.assertEqual(recorder.returncode, 1, errors)
        self.assertIn("No space left on device", errors)
        self.assertIn("No space left on device", json.loads(told)["verdict"]["reason"])
        info = json.loads(weft("take", "info", self.take, "--json", check=0).stdout)
        # This disk did not take the end of the streams either.
        weft("take", "recover", self.take, check=0)
        self.assert_accounted(info)
        self.assertGreater(self.assert_true_frames(), 4)
        self.assertEqual(info["take"]["state"], "TAKE_STATE_STOPPED")


if __name__ == "__main__":
    enter_network()
    unittest.main()
