"""GigE Vision cameras without hardware in a network of their own, and what was really in front of them."""

import contextlib
import csv
import functools
import ipaddress
import json
import os
import select
import socket
import struct
import subprocess
import sys
import threading
import time
import unittest

from studio import BIN, LONG_S, read, weft, write

# With root's own rights, disks on loop devices can be mounted, too.
NAMESPACES = [["unshare", *user, "--net", "--mount"] for user in ([], ["--user", "--map-root-user"])]


def enter_network():
    """Runs the program again in a network of its own, since cameras are looked for by broadcast."""
    if "WEFT_IN_NAMESPACE" in os.environ:
        return
    for namespace in NAMESPACES:
        if subprocess.run([*namespace, "true"], check=False, stderr=subprocess.DEVNULL).returncode == 0:
            os.environ["WEFT_IN_NAMESPACE"] = "1"
            os.execvp("unshare", [*namespace, sys.executable, *sys.argv])


def set_up_network(addresses):
    if "WEFT_IN_NAMESPACE" not in os.environ:
        raise unittest.SkipTest("this machine lets no user have a network of their own")
    subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
    for address in addresses:
        subprocess.run(["ip", "address", "add", address + "/8", "dev", "lo"], check=True)


class Cameras:
    """A process with cameras, by name and address."""

    def __init__(self, cameras):
        self.process = subprocess.Popen(
            [os.path.join(BIN, "gige_emulators"), *(f"{name}={address}" for name, address in cameras.items())],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert self.process.stdout.readline() == "ready\n"

    def tell(self, line):
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        assert self.process.stdout.readline() == "done\n", line

    def kill(self):
        self.process.kill()
        self.process.communicate()


class GoneCameras:
    """Stands in the place of cameras that are gone: hears what is asked of them, and answers nothing.

    Aravis sends a request to a silent camera five times, and 2.5 s pass until it fails. So the requests tell how long a
    recorder waited, whatever else the machine had to do meanwhile."""
    PORT, DISCOVERY, TRIES = 3956, 0x0002, 5
    ACQUISITION = 0x800c  # the register that stops our cameras
    # Registers of taking leave, for which nobody waits; the heartbeat reads the first, in a thread of its own.
    PRIVILEGE, STREAM_PORT = 0x0a00, 0x0d00

    def __init__(self, addresses):
        self.heard = []  # host time in s, address, command, number of the request, first register
        self.sockets = {}
        for address in addresses:
            ear = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            ear.bind((address, self.PORT))
            self.sockets[ear] = address
        self.over, self.end = os.pipe()
        self.thread = threading.Thread(target=self.listen)
        self.thread.start()

    def listen(self):
        while self.over not in (ready := select.select([*self.sockets, self.over], [], [])[0]):
            for ear in ready:
                packet = ear.recv(2048)
                _, command, _, number = struct.unpack_from(">4H", packet)
                register, = struct.unpack_from(">I", packet.ljust(12, b"\0"), 8)
                self.heard.append((time.time(), self.sockets[ear], command, number, register))

    def close(self):
        os.write(self.end, b".")
        self.thread.join()
        for ear in self.sockets:
            ear.close()

    def questions(self, address):
        """Host times in s of the questions whether the camera is there, for whose answers nobody waits."""
        return [at for at, of, command, *_ in self.heard if of == address and command == self.DISCOVERY]

    def requests(self, address):
        """Host time in s at which each request was first heard, and its register."""
        first = {}
        for at, of, command, number, register in self.heard:
            if of == address and command != self.DISCOVERY and register not in (self.PRIVILEGE, self.STREAM_PORT):
                first.setdefault((command, number, register), at)
        return [(at, register) for (_, _, register), at in first.items()]

    def farewells(self, address):
        """Host times in s at which a stream took leave of the camera, every try."""
        return [at for at, of, _, _, register in self.heard if of == address and register == self.STREAM_PORT]


@contextlib.contextmanager
def packet_loss(share, address=None):
    """Cameras (or that of one address) lose this share of their large packets."""
    rule = ["OUTPUT", *(["-s", address] if address else []), "-p", "udp", "-m", "length", "--length", "1000:65535",
            "-m", "statistic", "--mode", "random", "--probability", str(share), "-j", "DROP"]
    subprocess.run(["iptables", "-A", *rule], check=True)
    try:
        yield
    finally:
        subprocess.run(["iptables", "-D", *rule], check=True)


@functools.cache
def pattern(phase):
    """2048 pixels of what gige_emulator_frames.cpp films; they repeat."""
    return bytes((i * 31 + phase) >> 3 & 0xff for i in range(2048))


def stream_frames(take, camera):
    """(set, device time, bytes) of every frame in the stream that is not compressed, by docs/file-formats.md."""
    with open(os.path.join(take, "streams", camera + ".stream"), "rb") as stream:
        head = stream.read(4096)
        id_bytes, = struct.unpack_from("<I", head, 20)
        description_bytes, = struct.unpack_from("<Q", head, 24 + id_bytes)
        stream.seek(4096 + (description_bytes + 4095) // 4096 * 4096)
        while len(header := stream.read(4096)) == 4096 and header[:8] == b"WEFTCHNK":
            codec, = struct.unpack_from("<I", header, 12)
            number, device_ns = struct.unpack_from("<Qq", header, 32)
            size, = struct.unpack_from("<Q", header, 88)
            payload = stream.read((size + 4095) // 4096 * 4096)
            if codec == 0:
                yield number, device_ns, payload[:size]


def frames(take, camera):
    """(set, device time, true host time of the exposure, count) of every frame in the stream.

    Every byte is compared with what this camera sent."""
    found = []
    settings = {c["id"]: c["settings"] for c in json.loads(read(os.path.join(take, "take.json")))["cameras"]}
    own_address = int(ipaddress.ip_address(settings[camera]["DeviceAddress"]))
    for number, device_ns, payload in stream_frames(take, camera):
        true_ns, count, said_ns, address = struct.unpack_from("<4q", payload)
        assert address == own_address, f"frame {count} is said to be of {camera} and is of {address:#x}"
        assert said_ns == device_ns, "the frame's time and its own record of it"
        sent = pattern(count * 7 % 2048) * (len(payload) // 2048 + 1)
        assert payload[32:] == sent[32:len(payload)], f"frame {count} of {camera} is not what was sent"
        found.append((number, device_ns, true_ns, count))
    return found


def read_ledger(take):
    """The lines that are whole so far: event, first set, last set, camera, cause."""
    path = os.path.join(take, "ledger.csv")
    text = read(path) if os.path.exists(path) else ""
    return [(line[0], int(line[1]), int(line[2]), line[5], line[6])
            for line in csv.reader(text[:text.rfind("\n") + 1].splitlines()[1:])]


def true_spread_ns(take, cameras):
    """The largest difference between the true times of exposures that the take calls one set."""
    times = {}
    for camera in cameras:
        for number, _, true_ns, _ in frames(take, camera):
            times.setdefault(number, []).append(true_ns)
    return max(max(t) - min(t) for t in times.values())


class LiveTest(unittest.TestCase):
    def live_set_up(self, folder, cameras):
        self.cameras = cameras
        self.take = os.path.join(folder, "take")
        self.session = os.path.join(folder, "session.json")

    def start_cameras(self, *names):
        cameras = Cameras({name: self.cameras[name] for name in names or self.cameras})
        self.addCleanup(cameras.kill)
        return cameras

    def write_session(self, features=(), gige=(), **more):
        cameras = [{"id": name, "gige": {"device": address, "packet_size_bytes": 1500, "buffers": 64,
                                         "features": ["Width=256", "Height=128", *features], **dict(gige)}}
                   for name, address in self.cameras.items()]
        # Waits are long because the machine may have other things to do.
        write(self.session, json.dumps({"cameras": cameras, "fps": 10, "tolerance_ms": 2, "max_wait_ms": 5000,
                                        "low_disk_gib": 0.01, **more}))

    def record(self, seconds=0, arguments=(), **options):
        """0 s: until `stop`, as tests do that wait for what they need; how long that takes depends on the machine."""
        return subprocess.Popen([os.path.join(BIN, "weft"), "take", "record", "--session", self.session, "--out", self.take,
                                 "--seconds", str(seconds), "--json", *arguments],
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)

    def ledger(self):
        return read_ledger(self.take)

    def written_s(self, event, camera="", words=""):
        """The host times in s of the ledger's lines of this kind, of this camera, that begin with these words."""
        lines = csv.reader(read(os.path.join(self.take, "ledger.csv")).splitlines()[1:])
        return [int(line[4]) / 1e9 for line in lines
                if (line[0], line[5]) == (event, camera) and line[6].startswith(words)]

    def wait_for(self, recorder, event, count=1, words=""):
        """Until the ledger has so many lines of this kind."""
        end = time.monotonic() + LONG_S
        while sum(line[0] == event and words in line[4] for line in self.ledger()) < count:
            if recorder.poll() is not None or time.monotonic() > end:
                recorder.kill()
                self.fail(f"the take has not got {count} {event} {words}: {recorder.communicate()[1]}")
            time.sleep(0.1)

    def wait_for_more_sets(self, recorder, count):
        self.wait_for(recorder, "recorded", sum(line[0] == "recorded" for line in self.ledger()) + count)

    def stop(self, recorder, statuses=(0,)):
        recorder.terminate()
        return self.finish(recorder, statuses)

    def finish(self, recorder, statuses=(0,)):
        """Exit status 1 is a bad verdict: too many frame sets lack a camera."""
        out, self.errors = recorder.communicate(timeout=LONG_S)
        self.assertIn(recorder.returncode, statuses, self.errors + out[:300])
        info = json.loads(out)
        self.assertEqual(recorder.returncode == 1, info["verdict"]["grade"] == "GRADE_BAD", info["verdict"])
        return info

    def assert_accounted(self, info):
        """The take is whole, its streams have one length, and no set is missing between the first and the last."""
        weft("take", "verify", self.take, check=0)
        lengths = {int(t.get("frames", 0)) + int(t.get("missing", 0)) for t in info["timing"]}
        self.assertEqual(lengths, {int(info["sets"])})
        accounted = set()
        for event, first, last, _, _ in self.ledger():
            if event in ("recorded", "dropped"):
                accounted |= set(range(first, last + 1))
        self.assertEqual(accounted, set(range(len(accounted))))

    def assert_complete(self, info):
        self.assert_accounted(info)
        told = "\n".join(map(str, (line for line in self.ledger() if line[0] != "recorded")))
        self.assertEqual(info.get("causes", []), [], told)
