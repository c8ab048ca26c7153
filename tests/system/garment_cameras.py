"""Four GigE cameras without hardware that film a simulated garment or replay a take, and what they send."""

import json
import os
import subprocess

from live_studio import stream_frames
from studio import BIN, read, weft, write

CAMERAS = 4
SECOND_NS = 1_000_000_000
ROUNDING_NS = 1000  # of the camera, whose doubles hold the time since 1970


def depth_mm(camera):
    """How far behind the garment the camera is; negative: in front of a sheet's printed side."""
    return -sum(camera["rotation"][3 * row + 2] * camera["translation_mm"][row] for row in range(3))


def make_garment(folder, frames, width_px=128, height_px=170, more=()):
    """A dump of a sheet before four cameras so close together that cells are seen by three."""
    ring, garment, rig_file = (os.path.join(folder, name) for name in ("ring", "garment", "rig.json"))
    size = ["--width-px", width_px, "--height-px", height_px]
    weft("simulate", "--preset", "tiny", "--frames", 1, "--cameras", 16, *size, "--out", ring, check=0)
    rig = json.loads(read(f"{ring}/rig.json"))
    front = {camera["id"] for camera in sorted(rig["cameras"], key=depth_mm)[:CAMERAS]}
    rig["cameras"] = [camera for camera in rig["cameras"] if camera["id"] in front]
    del rig["hash"]
    write(rig_file, json.dumps(rig))
    weft("simulate", "--preset", "tiny", "--garment", "sheet", "--frames", frames, "--rig", rig_file, *more,
         "--out", garment, check=0)
    return garment


def camera_ids(garment):
    return [camera["id"] for camera in json.loads(read(f"{garment}/rig.json"))["cameras"]]


def pictures_of(garment):
    """The pixels of a dump's pictures, by camera and frame, decoded by a program that is not ours."""
    found = {}
    frames = sorted(name for name in os.listdir(garment) if name.isdigit())
    for camera in camera_ids(garment):
        decoded = [subprocess.run(["ffmpeg", "-v", "error", "-i", f"{garment}/{frame}/{camera}.png", "-f", "rawvideo",
                                   "-pix_fmt", "rgb24", "-"], capture_output=True, check=True).stdout for frame in frames]
        assert len(decoded) == len(frames) and all(decoded), f"{garment}: pictures of {camera}"
        found[camera] = decoded
    return found


def pictures_of_take(garment, take):
    """The same of a recorded take."""
    return {camera: [payload for *_, payload in stream_frames(take, camera)] for camera in camera_ids(garment)}


class FilmingCameras:
    """They film the pictures again and again; which one follows from the time of the exposure.

    `dump` is the garment itself, or a take of it that is replayed."""

    def __init__(self, folder, garment, dump, fps, packet_bytes=0, **session):
        self.garment, self.fps = garment, fps
        self.session = os.path.join(folder, "session.json")
        self.pictures = pictures_of_take(garment, dump) if dump != garment else pictures_of(garment)
        self.process = subprocess.Popen(
            [os.path.join(BIN, "weft"), "camera", "fake", "--pictures", dump, "--rig", f"{garment}/rig.json", "--fps",
             str(fps), "--session", self.session], stdout=subprocess.PIPE, text=True)
        assert "film" in self.process.stdout.readline()
        described = json.loads(read(self.session))
        for camera in described["cameras"] if packet_bytes else ():
            camera["gige"]["packet_size_bytes"] = packet_bytes
        # For the frames of a set, because the machine may have other things to do.
        write(self.session, json.dumps({**described, "max_wait_ms": 5000, "low_disk_gib": 0.001, **session}))

    def close(self):
        self.process.kill()
        self.process.communicate()

    def faults_of(self, take):
        """Frames of the take that are not what was sent, and sets that are there, by camera."""
        faults, sets = [], {}
        for camera, pictures in self.pictures.items():
            sets[camera] = set()
            first = None
            for number, device_ns, payload in stream_frames(take, camera):
                first = first or (number, device_ns)
                exposure = (device_ns * self.fps + SECOND_NS // 2) // SECOND_NS
                if payload != pictures[exposure % len(pictures)]:
                    faults.append(f"{camera}: the frame of set {number} is not what was sent")
                if abs((device_ns - first[1]) * self.fps - (number - first[0]) * SECOND_NS) > ROUNDING_NS * self.fps:
                    faults.append(f"{camera}: the frame of set {number} is of another trigger")
                sets[camera].add(number)
        return faults, sets
