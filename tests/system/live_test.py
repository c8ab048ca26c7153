"""`weft take record` on GigE Vision cameras: whole frames, every trigger accounted for, cameras that come and go.

Runs itself in a network namespace of its own, since cameras are looked for by broadcast.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
import unittest

NAMESPACE = ["unshare", "--user", "--map-root-user", "--net"]
if "WEFT_IN_NAMESPACE" not in os.environ and subprocess.run([*NAMESPACE, "true"], check=False).returncode == 0:
    os.environ["WEFT_IN_NAMESPACE"] = "1"
    os.execvp("unshare", [*NAMESPACE, sys.executable, *sys.argv])

from studio import BIN, LONG_S, read, weft, write

CAMERAS = {"left": "127.0.0.2", "middle": "127.0.0.3", "right": "127.0.0.4"}
FPS = 10


def setUpModule():
    if "WEFT_IN_NAMESPACE" not in os.environ:
        raise unittest.SkipTest("this machine lets no user have a network of their own")
    subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
    for address in CAMERAS.values():
        subprocess.run(["ip", "address", "add", address + "/8", "dev", "lo"], check=True)


def start_cameras(*names):
    process = subprocess.Popen([os.path.join(BIN, "fake_cameras"), *(f"{n}-1={CAMERAS[n]}" for n in names)],
                               stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "ready\n"
    return process


def stop(process):
    process.kill()
    process.communicate()


class Live(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="weft test ")
        self.addCleanup(folder.cleanup)
        self.take = os.path.join(folder.name, "take")
        self.session = os.path.join(folder.name, "session.json")

    def write_session(self, features=(), **more):
        cameras = [{"id": name, "gige": {"device": address, "packet_size_bytes": 1400,
                                         "features": ["Width=512", "Height=256", *features]}}
                   for name, address in CAMERAS.items()]
        write(self.session, json.dumps({"cameras": cameras, "fps": FPS, "tolerance_ms": 40, "low_disk_gib": 0.01,
                                        "clocks": "SESSION_CLOCKS_ESTIMATED", **more}))

    def record(self, seconds, **options):
        return subprocess.Popen([os.path.join(BIN, "weft"), "take", "record", "--session", self.session, "--out", self.take,
                                 "--seconds", str(seconds), "--json"],
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)

    def finish(self, recorder):
        out, errors = recorder.communicate(timeout=LONG_S)
        self.assertEqual(recorder.returncode, 0, errors)
        return json.loads(out)

    def assert_accounted(self, info):
        """The take is whole, its streams have one length, and no set is missing between the first and the last."""
        weft("take", "verify", self.take, check=0)
        lengths = {int(t.get("frames", 0)) + int(t.get("missing", 0)) for t in info["timing"]}
        self.assertEqual(lengths, {int(info["sets"])})
        accounted = set()
        for line in read(os.path.join(self.take, "ledger.csv")).splitlines()[1:]:
            event, first, last = line.split(",")[:3]
            if event in ("recorded", "dropped"):
                accounted |= set(range(int(first), int(last) + 1))
        self.assertEqual(accounted, set(range(len(accounted))))

    def test_records_whole_frames_of_several_cameras(self):
        cameras = start_cameras(*CAMERAS)
        self.addCleanup(stop, cameras)
        self.write_session()
        info = self.finish(self.record(4))
        self.assert_accounted(info)
        self.assertGreater(int(info["sets"]), 3 * FPS)
        for timing in info["timing"]:
            self.assertAlmostEqual(timing["interval_mean_ms"], 1000 / FPS, delta=500 / FPS)
        described = info["take"]["cameras"][0]
        self.assertEqual(described["model"], "Fake")
        self.assertEqual(described["settings"]["Width"], "512")
        images = os.path.join(os.path.dirname(self.take), "images")
        weft("take", "export", self.take, "--out", images, check=0)
        self.assertIn({f"{name}.png" for name in CAMERAS},
                      [set(os.listdir(os.path.join(images, frame))) for frame in os.listdir(images)])

    def test_names_lost_packets_and_keeps_no_part_of_a_frame(self):
        cameras = start_cameras(*CAMERAS)
        self.addCleanup(stop, cameras)
        rule = ["OUTPUT", "-s", CAMERAS["middle"], "-p", "udp", "-m", "length", "--length", "1000:65535", "-m", "statistic",
                "--mode", "random", "--probability", "0.004", "-j", "DROP"]
        subprocess.run(["iptables", "-A", *rule], check=True)
        self.addCleanup(subprocess.run, ["iptables", "-D", *rule], check=True)
        self.write_session()
        info = self.finish(self.record(5))
        self.assert_accounted(info)
        lost = {timing["camera"]: int(timing["missing"]) for timing in info["timing"]}
        self.assertGreater(lost["middle"], 5)
        self.assertGreater(int(info["timing"][1]["frames"]), 5)
        causes = [cause["cause"] for cause in info["causes"] if cause["camera"] == "middle"]
        self.assertTrue(any("packets of the frame" in cause for cause in causes), causes)
        self.assertLess(len(causes), 15, causes)

    def test_goes_on_without_a_camera_and_takes_it_back(self):
        others = start_cameras("left", "right")
        self.addCleanup(stop, others)
        middle = start_cameras("middle")
        self.write_session()
        recorder = self.record(16)
        time.sleep(4)
        stop(middle)
        time.sleep(2)
        middle = start_cameras("middle")
        self.addCleanup(stop, middle)
        info = self.finish(recorder)
        self.assert_accounted(info)
        notes = "\n".join(info["notes"])
        self.assertRegex(notes, "camera middle: disconnected: the camera no longer answers")
        self.assertRegex(notes, r"camera middle: reconnected: after \d+ ms")
        self.assertIn("the camera is disconnected", {cause["cause"] for cause in info["causes"]})
        self.assertGreater(int(info["timing"][0]["frames"]), 10 * FPS)

    def test_refuses_what_the_camera_does_not_have(self):
        cameras = start_cameras(*CAMERAS)
        self.addCleanup(stop, cameras)
        for features, words in ((["Colour=red"], "it has no feature Colour"), (["nothing"], "not of the form Name=value")):
            self.write_session(features)
            recorder = self.record(1)
            _, errors = recorder.communicate(timeout=LONG_S)
            self.assertEqual(recorder.returncode, 2, errors)
            self.assertRegex(errors, words)
        self.assertFalse(os.path.exists(self.take))


if __name__ == "__main__":
    unittest.main()
