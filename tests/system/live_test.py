"""`weft take record` on GigE Vision cameras: whole frames, every trigger accounted for, sets of one moment."""

import json
import os
import subprocess
import tempfile
import time
import unittest

from live_studio import LiveTest, enter_network, frames, packet_loss, set_up_network, true_spread_ns
from studio import LONG_S, read, weft

CAMERAS = {"left": "127.0.0.2", "middle": "127.0.0.3", "right": "127.0.0.4", "top": "127.0.0.5"}
ESTIMATED = {"clocks": "SESSION_CLOCKS_ESTIMATED"}


def setUpModule():
    set_up_network(CAMERAS.values())


class Live(LiveTest):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="weft test ")
        self.addCleanup(folder.cleanup)
        self.live_set_up(folder.name, CAMERAS)

    def test_resend_brings_back_every_lost_packet(self):
        self.start_cameras()
        self.write_session(ptp=True)
        with packet_loss(0.02):
            recorder = self.record()
            self.wait_for_more_sets(recorder, 30)
            info = self.stop(recorder)
        self.assert_complete(info)
        for camera in info["take"]["cameras"]:
            self.assertGreater(int(camera["packets_resent"]), 0)
            self.assertEqual(camera["settings"]["PacketResend"], "on")
            self.assertEqual(camera["settings"]["PtpStatus"], "Slave")
            self.assertEqual(camera["model"], "GigeEmulator")
        self.assertEqual(true_spread_ns(self.take, CAMERAS), 0)
        images = os.path.join(os.path.dirname(self.take), "images")
        weft("take", "export", self.take, "--out", images, check=0)
        self.assertEqual(len(os.listdir(images)), int(info["sets"]))

    def test_operators_see_the_cameras_while_they_film(self):
        self.start_cameras()
        self.write_session(ptp=True)
        look = os.path.join(os.path.dirname(self.take), "look")
        recorder = self.record(arguments=["--preview", look, "--preview-interval", "0.3"])
        self.wait_for_more_sets(recorder, 5)
        page = os.path.join(look, "index.html")
        shown = []  # a page is whole whenever it is read
        end = time.monotonic() + LONG_S
        while len(shown) < 3 and time.monotonic() < end:
            text = read(page) if os.path.exists(page) else ""
            if text and text not in shown:
                self.assertTrue(text.rstrip().endswith("</html>"))
                shown.append(text)
            time.sleep(0.05)
        info = self.stop(recorder)
        self.assertEqual(len(shown), 3)
        self.assert_complete(info)
        for text in shown[1:]:
            for camera in CAMERAS:
                self.assertIn(f">{camera}<", text)
            self.assertEqual(text.count("image/jpeg"), len(CAMERAS))

    def test_without_resend_losses_stand_in_the_ledger(self):
        cameras = self.start_cameras()
        for gige, words in (({"no_resend": True}, "resend is off"), ({}, "the camera cannot resend them")):
            if not gige:
                cameras.tell("resend * 0")
                self.take += " 2"
            self.write_session(ptp=True, gige=gige)
            with packet_loss(0.01, CAMERAS["middle"]):
                recorder = self.record()
                self.wait_for(recorder, "missing", 3)
                info = self.stop(recorder, (0, 1))
            self.assert_accounted(info)
            lost = {timing["camera"]: int(timing["missing"]) for timing in info["timing"]}
            self.assertEqual([lost["left"], lost["right"], lost["top"]], [0, 0, 0])
            self.assertGreaterEqual(lost["middle"], 3)
            causes = [cause["cause"] for cause in info["causes"] if cause["camera"] == "middle"]
            self.assertRegex("\n".join(causes), f"packets of the frame (are missing|did not arrive in time): .* packets, {words}")

    def test_clocks_of_their_own_are_followed_through_drift_and_jumps(self):
        cameras = self.start_cameras()
        cameras.tell("set left offset_ns 5e9")
        cameras.tell("set middle drift_ppm 50")
        cameras.tell("set right drift_ppm -80")
        self.write_session(**ESTIMATED, tolerance_ms=30)
        recorder = self.record()
        self.wait_for_more_sets(recorder, 25)
        cameras.tell("set top jump_ns -3.2e9")
        self.wait_for(recorder, "note", words="jumped")
        self.wait_for_more_sets(recorder, 15)
        info = self.stop(recorder)
        self.assert_complete(info)
        self.assertEqual(true_spread_ns(self.take, CAMERAS), 0)
        jumps = [note for note in info["notes"] if "jumped" in note]
        self.assertEqual(len(jumps), 1, info["notes"])
        self.assertRegex(jumps[0], r"camera top: its clock jumped by -3\.\d+ s")

    def test_triggers(self):
        cameras = self.start_cameras()
        for kind, shared in (("SOFTWARE", False), ("ACTION", True)):
            self.write_session(ptp=shared, trigger={"kind": f"SESSION_TRIGGER_KIND_{kind}", "lead_ms": 80},
                               **({} if shared else {**ESTIMATED, "tolerance_ms": 40}))
            recorder = self.record()
            self.wait_for_more_sets(recorder, 15)
            info = self.stop(recorder, (0, 1))
            self.assert_accounted(info)
            # Action commands are for one moment; software triggers come one after the other, as fast as the
            # machine is. Sets reach a tolerance of 40 ms both ways, by clocks that are known to within half of it.
            self.assertLess(true_spread_ns(self.take, CAMERAS), 1 if shared else 160_000_000)
            self.take += " next"
        self.write_session(ptp=True, fps=0, trigger={"kind": "SESSION_TRIGGER_KIND_LINE"})
        recorder = self.record()
        recorded = 0
        while recorder.poll() is None:
            cameras.tell("line")
            time.sleep(0.2)
            if recorded < 5:
                recorded = sum(line[0] == "recorded" for line in self.ledger())
                if recorded >= 5:
                    recorder.terminate()
        info = self.finish(recorder)
        self.assert_complete(info)
        self.assertEqual(true_spread_ns(self.take, CAMERAS), 0)

    def test_goes_on_without_a_camera_and_takes_it_back(self):
        self.start_cameras("left", "right", "top")
        middle = self.start_cameras("middle")
        self.write_session(ptp=True)
        recorder = self.record()
        self.wait_for_more_sets(recorder, 10)
        middle.kill()
        self.wait_for(recorder, "note", words="disconnected: ")
        self.wait_for_more_sets(recorder, 10)
        self.start_cameras("middle")
        self.wait_for(recorder, "note", words="reconnected: ")
        self.wait_for_more_sets(recorder, 10)
        info = self.stop(recorder, (0, 1))
        self.assert_accounted(info)
        notes = "\n".join(info["notes"])
        self.assertRegex(notes, "camera middle: disconnected: the camera no longer answers")
        self.assertRegex(notes, r"camera middle: reconnected: after \d+ ms")
        self.assertIn("the camera is disconnected", {cause["cause"] for cause in info["causes"]})
        self.assertEqual({cause["camera"] for cause in info["causes"]}, {"middle"})
        self.assertEqual(true_spread_ns(self.take, CAMERAS), 0)

    def test_negotiates_the_packet_size_and_takes_times_from_inside_frames(self):
        self.start_cameras()
        subprocess.run(["ip", "link", "set", "lo", "mtu", "4000"], check=True)
        self.addCleanup(subprocess.run, ["ip", "link", "set", "lo", "mtu", "65536"], check=True)
        self.write_session(ptp=True, features=["PixelFormat=BayerRG12Packed", "Gain=6"],
                           gige={"packet_size_bytes": 0, "no_packet_socket": True, "chunk_timestamps": True})
        recorder = self.record()
        self.wait_for_more_sets(recorder, 11)
        info = self.stop(recorder)
        self.assert_complete(info)
        settings = info["take"]["cameras"][0]["settings"]
        self.assertGreater(int(settings["GevSCPSPacketSize"]), 3000)
        self.assertLessEqual(int(settings["GevSCPSPacketSize"]), 4000)
        self.assertEqual(settings["Gain"], "6")
        self.assertEqual(settings["PacketSocket"], "off")
        self.assertGreater(len(frames(self.take, "left")), 10)

    def test_looks_at_the_disk_before_it_records(self):
        self.start_cameras()
        self.write_session(ptp=True, low_disk_gib=1e9)
        recorder = self.record(1)
        _, errors = recorder.communicate(timeout=LONG_S)
        self.assertEqual(recorder.returncode, 2, errors)
        self.assertRegex(errors, "recording stops at the low-disk mark .* make room on the disk.*--no-disk-test")
        self.assertFalse(os.path.exists(self.take))

    def test_doctor_opens_the_cameras_of_a_session(self):
        cameras = self.start_cameras("left", "middle", "right")
        cameras.tell("resend right 0")
        self.write_session()
        done = weft("doctor", "--session", self.session, "--dir", os.path.dirname(self.session), "--disk-test-gib", "0.01",
                    "--json", check=1)
        findings = json.loads(done.stdout)["findings"]
        verdicts = {finding["subject"]: finding["verdict"] for finding in findings}
        self.assertEqual([verdicts["camera " + name] for name in CAMERAS],
                         ["DOCTOR_VERDICT_GOOD"] * 2 + ["DOCTOR_VERDICT_WARNING", "DOCTOR_VERDICT_BAD"])
        found = "\n".join(finding["found"] for finding in findings)
        self.assertIn("127.0.0.2: Weft GigeEmulator, serial left", found)
        self.assertEqual(json.loads(done.stdout)["verdict"]["grade"], "GRADE_BAD")
        self.assertIn("256x128 Mono8, 0.3 MB/s, packets of 1500 bytes, resend on", found)
        self.assertIn("the cameras send 1.0 MB/s", found)

    def test_refuses_what_the_camera_does_not_have(self):
        self.start_cameras()
        for features, words in ((["Colour=red"], "it has no feature Colour"), (["nothing"], "not of the form Name=value")):
            self.write_session(features)
            recorder = self.record(1)
            _, errors = recorder.communicate(timeout=LONG_S)
            self.assertEqual(recorder.returncode, 2, errors)
            self.assertRegex(errors, words)
        self.assertFalse(os.path.exists(self.take))


if __name__ == "__main__":
    enter_network()
    unittest.main()
