"""A small synthetic studio on disk, and the programs of Weft as users run them."""

import atexit
import functools
import json
import os
import re
import shutil
import struct
import subprocess
import tempfile
import time
import unittest
import zlib

BIN = os.environ["WEFT_BIN"]
LONG_S = 240  # far more than any command takes; a hang fails instead of blocking


def weft(*arguments, check=None, patience_s=LONG_S, **options):
    """Runs `weft`; `check` is the exit status that is expected."""
    done = subprocess.run([os.path.join(BIN, "weft"), *map(str, arguments)], capture_output=True, text=True,
                          timeout=patience_s, check=False, **options)
    if check is not None and done.returncode != check:
        raise AssertionError(f"weft {' '.join(map(str, arguments))}: exit status {done.returncode}, expected {check}\n"
                             f"{done.stdout}{done.stderr}")
    return done


@functools.cache
def faulty_disk():
    """The environment in which a program's disk is that of disk_faults.cpp. LD_PRELOAD takes no path with a space."""
    folder = tempfile.mkdtemp(prefix="weft-faults-")
    atexit.register(shutil.rmtree, folder)
    return {"LD_PRELOAD": shutil.copy(os.environ["WEFT_DISK_FAULTS"], folder)}


def read(path, mode="r"):
    with open(path, mode) as file:
        return file.read()


def page_data(path):
    """What a report's page holds for the program that shows it."""
    found = re.search(r'<script type="application/json" id="data" data-kind="[^"]*">(.*?)</script>', read(path), re.DOTALL)
    return json.loads(found.group(1))


def write(path, content):
    with open(path, "wb" if isinstance(content, bytes) else "w") as file:
        file.write(content)


def png(width, height, pixel):
    """The bytes of a PNG of one colour; `pixel` has one byte (grey) or three."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    color_type = {1: 0, 3: 2}[len(pixel)]
    rows = (b"\0" + bytes(pixel) * width) * height
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, color_type, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def results(folder):
    """Name and bytes of every file of the frames that must not depend on threads, times or where it ran."""
    found = {}
    for base, _, names in os.walk(folder):
        for name in names:
            if name.endswith((".ply", ".csv")):
                path = os.path.join(base, name)
                found[os.path.relpath(path, folder)] = read(path, "rb")
    return found


INFERRED, OBSERVED, TWO_VIEW, BRIDGED = range(4)


def vertex_states(mesh):
    """The states that occur in a mesh.ply."""
    header, body = read(mesh, "rb").split(b"end_header\n", 1)
    vertices = int(re.search(rb"element vertex (\d+)", header).group(1))
    vertex = struct.Struct("<fffBfi" + ("ff" if b"property float t" in header else ""))  # x y z state sigma_mm views s t
    return {values[3] for values in vertex.iter_unpack(body[:vertices * vertex.size])}


def temporary_files(folder):
    """Files that a finished or stopped program must not leave behind."""
    known = {"cloud.ply", "cloud.pcd", "mesh.ply", "unrefined.ply", "observations.csv", "report.json", "job.json", "report.html"}
    return [os.path.join(base, name) for base, _, names in os.walk(folder) for name in names if name not in known]


def wait_for(condition, what, pause_s=0.02):
    """Pauses for longer than a condition takes, or a question that starts a program would keep a processor busy."""
    deadline = time.monotonic() + LONG_S
    while (asked := time.monotonic()) < deadline:
        value = condition()
        if value:
            return value
        took_s = time.monotonic() - asked
        time.sleep(min(0.5, max(pause_s, 2 * took_s)) if pause_s else 0)
    raise AssertionError(f"waited {LONG_S} s for {what}")


def processes_of(folder, program):
    """Process ids of a program of ours whose arguments name `folder`."""
    found = []
    for name in os.listdir("/proc"):
        if name.isdigit():
            try:
                arguments = read(f"/proc/{name}/cmdline").split("\0")
            except OSError:
                continue
            if os.path.basename(arguments[0]) == program and any(folder in argument for argument in arguments):
                found.append(int(name))
    return found


def make_tiny_studio(folder):
    """A take of three frames and its registration, `take` and `result`."""
    take = os.path.join(folder, "take")
    weft("simulate", "--preset", "tiny", "--out", take, check=0)
    weft("register", take, "--rig", f"{take}/rig.json", "--board", f"{take}/board.json", "--template", f"{take}/template",
         "--out", os.path.join(folder, "result"), check=0)


@functools.cache
def tiny_studio():
    """Folder of a take and its registration, with a space in its path; nobody changes them. One for a whole run of ctest."""
    of_the_run = os.environ.get("WEFT_TINY_STUDIO")
    if of_the_run:
        return of_the_run
    folder = tempfile.mkdtemp(prefix="weft studio ")
    atexit.register(shutil.rmtree, folder)
    make_tiny_studio(folder)
    return folder


class StudioTest(unittest.TestCase):
    """Every test gets a copy of one take of three frames, with a space in its path."""

    @classmethod
    def setUpClass(cls):
        cls.shared = tempfile.TemporaryDirectory(prefix="weft studio ")
        cls.addClassCleanup(cls.shared.cleanup)
        cls.original = os.path.join(tiny_studio(), "take")

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="weft test ")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.take = self.path("take")
        shutil.copytree(self.original, self.take)
        self.frames = sorted(name for name in os.listdir(self.take) if name.isdigit())
        self.images = sorted(os.listdir(os.path.join(self.take, self.frames[0])))
        self.out = self.path("result")

    def path(self, *names):
        return os.path.join(self.folder, *names)

    def image(self, frame, camera):
        """Path of an image by position of frame and camera."""
        return os.path.join(self.take, self.frames[frame], self.images[camera])

    def register_arguments(self, **replaced):
        paths = {"dump": self.take, "rig": f"{self.take}/rig.json", "board": f"{self.take}/board.json",
                 "template": f"{self.take}/template", "out": self.out, **replaced}
        return ["register", paths["dump"], "--rig", paths["rig"], "--board", paths["board"],
                "--template", paths["template"], "--out", paths["out"]]

    def register(self, *more, check=None, **replaced):
        return weft(*self.register_arguments(**replaced), *more, check=check)

    def assert_refused(self, done, *facts, out=None):
        """Exit status 2, an error that names all `facts`, and no result."""
        out = out or self.out
        self.assertEqual(done.returncode, 2, done.stdout + done.stderr)
        self.assertIn("weft: error: ", done.stderr)
        for fact in facts:
            self.assertIn(fact, done.stderr)
        self.assertEqual(list(results(out)), [])
