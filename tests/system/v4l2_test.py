"""V4L2 cameras: the kernel's virtual driver in a guest. WEFT_ENDURANCE_S=600 adds a session of that many seconds with four
GigE Vision cameras besides, which takes a quiet machine, and prints figures."""

import csv
import json
import os
import re
import subprocess
import tempfile
import unittest

from guest import kernel, run_in_guest
from live_studio import LiveTest, frames
from studio import BIN, read, weft, write

GIGE = {"left": "127.0.0.2", "middle": "127.0.0.3", "right": "127.0.0.4", "top": "127.0.0.5"}
SECONDS = float(os.environ.get("WEFT_ENDURANCE_S", "0"))
FPS = 4  # a guest is slow
STILL = ["Test Pattern=100% Colorbar", "OSD Text Mode=None", "Timestamp Source=Start of Exposure"]
SABOTAGE = (("0.3", "0", "Inject V4L2_BUF_FLAG_ERROR"), ("0.45", "0", "Disconnect"),
            ("0.6", "1", "Percentage of Dropped Buffers=30"), ("0.7", "1", "Percentage of Dropped Buffers=0"))


class V4l2(LiveTest):
    def setUp(self):
        kernel()
        folder = tempfile.TemporaryDirectory(prefix="weft test ")
        self.addCleanup(folder.cleanup)
        self.live_set_up(folder.name, GIGE)
        for program in ("v4l2_guest", "gige_emulators"):
            subprocess.run(["strip", "-o", os.path.join(folder.name, program), os.path.join(BIN, program)], check=True)
        self.folder = folder.name

    @staticmethod
    def usb_camera(i, **more):
        return {"id": f"usb{i}", **more,
                "v4l2": {"device": f"platform:vivid-00{i}", "format": "YUYV", "width_px": 320, "height_px": 180,
                         "controls": STILL, "user_buffers": i == 1}}

    def write_mixed_session(self):
        usb = [self.usb_camera(i, unsynchronized=True) for i in range(2)]
        self.write_session(["Width=64", "Height=64"], ptp=True, fps=FPS, tolerance_ms=2)
        with open(self.session) as file:
            session = json.load(file)
        session["cameras"] += usb
        write(self.session, json.dumps(session))

    def test_formats_controls_buffers_and_losses(self):
        run_in_guest(self.folder, "./v4l2_guest check\n")

    def test_a_take_of_a_daemon(self):
        for program in ("weft", "weftd", "weft-recorder", "weft-worker"):
            subprocess.run(["strip", "-o", os.path.join(self.folder, program), os.path.join(BIN, program)], check=True)
        write(self.session, json.dumps({
            "fps": FPS, "max_wait_ms": 5000, "low_disk_gib": 0.01, "clocks": "SESSION_CLOCKS_ESTIMATED",
            "cameras": [self.usb_camera(0), self.usb_camera(1, unsynchronized=True)]}))
        output = run_in_guest(self.folder, """set -e
./weftd --listen 127.0.0.1:0 --address-file /tmp/address --state /tmp/state --allow-path /mnt --workers 1 2> /mnt/weftd.log &
daemon=$!
until [ -s /tmp/address ]; do sleep 0.2; done
export server=$(cat /tmp/address)
./weft camera look --session session.json --out looks --server $server
lease=$(./weft session open session.json --detach --lease-s 3600 --server $server)
take=$(./weft take start --lease $lease --no-disk-test --server $server)
until ./weft take list --json --server $server | grep -q '"sets_recorded": "*[1-9]'; do sleep 0.2; done
./weft camera list --json --server $server > cameras.json
./weft take stop $take --server $server
./weft take verify take:$take --server $server
cp -r /tmp/state/takes/$take/take take
kill $daemon
wait $daemon
""", memory_mib=2048)  # a take reserves 256 MiB of a disk per camera, and here that is memory
        self.assertRegex(output, "0 frames missing")
        cameras = json.loads(read(f"{self.folder}/cameras.json"))["cameras"]
        self.assertTrue(all("take " in camera["used_by"] for camera in cameras), cameras)
        self.assertEqual(sorted(name[:4] for name in os.listdir(f"{self.folder}/looks") if name.endswith(".jpg")), ["usb0", "usb1"])
        self.assertGreater(int(json.loads(weft("take", "info", self.take, "--json", check=0).stdout)["sets"]), FPS)
        self.assert_usb_frames_are_whole()

    @unittest.skipIf(SECONDS == 0, "WEFT_ENDURANCE_S is not set")
    def test_a_session_with_gige_cameras(self):
        self.write_mixed_session()
        faults = " ".join(f"{float(at) * SECONDS} /dev/video{device} '{control}'" for at, device, control in SABOTAGE)
        addresses = "\n".join(f"ip address add {address}/8 dev lo" for address in GIGE.values())
        names = " ".join(f"{name}={address}" for name, address in GIGE.items())
        run_in_guest(self.folder, f"""set -e
{addresses}
mkfifo /tmp/lines
./gige_emulators {names} < /tmp/lines > /tmp/answers &
exec 3> /tmp/lines
until grep -q ready /tmp/answers; do sleep 0.2; done
./v4l2_guest record session.json take {SECONDS} {faults}
""", limit_s=400 + 1.2 * SECONDS)
        info = json.loads(weft("take", "info", self.take, "--json", check=0).stdout)
        self.assert_accounted(info)
        self.assert_gige_frames_are_true()
        self.assert_usb_frames_are_whole()
        self.assert_events_have_causes(info)
        sync = json.loads(weft("take", "sync", self.take, "--json").stdout)
        self.assertLess(sync["spread_worst_ms"], 2)
        for timing in sync["timing"]:
            limit_ms = 1500 / FPS if timing["camera"].startswith("usb") else 2
            self.assertLess(timing["offset_worst_ms"], limit_ms, timing)
        print(json.dumps(info, indent=1), weft("take", "sync", self.take, check=0).stdout)

    def assert_gige_frames_are_true(self):
        """Of every set, all GigE cameras exposed at the same moment."""
        times = {}
        for camera in GIGE:
            for number, _, true_ns, _ in frames(self.take, camera):
                times.setdefault(number, set()).add(true_ns)
        self.assertGreater(len(times), SECONDS * FPS / 4)
        self.assertTrue(all(len(found) == 1 for found in times.values()))

    def assert_usb_frames_are_whole(self):
        """The picture is still, so every frame has the same bytes; and no frame is in two sets."""
        images = os.path.join(self.folder, "images")
        weft("take", "export", self.take, "--out", images, check=0)
        for camera in ("usb0", "usb1"):
            pictures = set()
            for base, _, names in os.walk(images):
                for name in names:
                    if name.startswith(camera):
                        with open(os.path.join(base, name), "rb") as file:
                            pictures.add(file.read())
            self.assertEqual(len(pictures), 1)

    def assert_events_have_causes(self, info):
        with open(os.path.join(self.take, "ledger.csv"), newline="") as file:
            missing = [(line[5], line[6]) for line in csv.reader(file) if line[0] == "missing"]
        notes = "\n".join(info["notes"])
        self.assertRegex(notes, "camera usb0: disconnected: .*the device is gone")
        back = re.search(r"camera usb0: reconnected: after (\d+) ms", notes)
        self.assertTrue(back, notes)
        causes = {camera: [cause for of, cause in missing if of == camera] for camera in ("usb0", "usb1")}
        self.assertTrue(any("torn: the driver marks" in cause for cause in causes["usb0"]), causes["usb0"])
        if int(back.group(1)) > 2000 / FPS:  # unsynchronized it may be back before its next frame
            self.assertTrue(any("disconnected" in cause for cause in causes["usb0"]), causes["usb0"])
        self.assertTrue(any("did not deliver it: dropped by" in cause for cause in causes["usb1"]), causes["usb1"])


if __name__ == "__main__":
    unittest.main(verbosity=2)
