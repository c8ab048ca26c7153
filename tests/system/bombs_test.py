"""Small or sparse inputs that take gigabytes once they are read: the daemon answers, stays small, and serves others meanwhile."""

import concurrent.futures
import http.client
import os
import re
import shutil
import time
import unittest
import zlib

import http2
from daemon_process import DaemonProcess
from studio import StudioTest, read, weft, write

MIB = 1 << 20
MOST_MIB, MOST_LEFT_MIB = 400, 50


def memory_mib(process):
    """Resident now, and at most so far."""
    lines = dict(line.split(":", 1) for line in read(f"/proc/{process}/status").splitlines())
    return tuple(int(lines[name].split()[0]) >> 10 for name in ("VmRSS", "VmHWM"))


def sparse(path, head, size):
    with open(path, "wb") as file:
        file.write(head)
        file.truncate(size)


def ply(element, count, properties):
    return (f"ply\nformat binary_little_endian 1.0\nelement {element} {count}\n" +
            "".join(f"property {one}\n" for one in properties) + "end_header\n").encode()


# Name, file, what it becomes, and what the error says.
BOMBS = [
    ("objects", "rig.json", lambda path: write(path, b'{"cameras":[' + b"{}," * (20 * MIB) + b"{}]}"), "rig.json"),
    ("numbers", "rig.json", lambda path: write(path, b'{"cameras":[{"id":"a","distortion":[' + b"1," * (7 * MIB) + b"1]}]}"), "rig.json"),
    ("nested", "rig.json", lambda path: write(path, b'{"cameras":' + b"[" * (15 * MIB)), "rig.json"),
    ("escapes", "rig.json", lambda path: write(path, b'{"cameras":[{"id":"' + b"\\u0001" * (2 * MIB) + b'"}]}'), "rig.json"),
    ("board", "board.json", lambda path: write(path, b'{"ink_colors":[' + b"{}," * (5 * MIB) + b"{}]}"), "board.json"),
    ("image tail", "board.png", lambda path: sparse(path, read(path, "rb"), 3 << 30), "board.png"),
    ("template", "template/template.json", lambda path: write(path, b'{"panels":[' + b"{}," * (5 * MIB) + b"{}]}"), "template.json"),
    ("rows", "template/mesh.ply",
     lambda path: sparse(path, ply("vertex", (1 << 30) // 8, [f"uchar p{i}" for i in range(8)]), (1 << 30) + 4096), "mesh.ply"),
    ("fewer rows", "template/mesh.ply",
     lambda path: sparse(path, ply("vertex", (500 * MIB) // 8, [f"uchar p{i}" for i in range(8)]), 501 * MIB), ""),
    ("lists", "template/mesh.ply",
     lambda path: sparse(path, ply("face", 400 * MIB, ["list uchar uchar vertex_indices"]), 401 * MIB), ""),
    ("text", "template/cells.txt", lambda path: sparse(path, b"", 3 << 30), "cells.txt"),
]


class Bombs(DaemonProcess, StudioTest):
    def test_cost_the_daemon_nothing(self):
        self.start_plainly("--workers", 1)
        server = self.addresses[0]
        weft("job", "list", "--server", server, check=0)
        begin, _ = memory_mib(self.daemon.pid)
        for name, file, make, says in BOMBS:
            path = os.path.join(self.take, file)
            before = read(path, "rb") if os.path.exists(path) else None
            with self.subTest(name):
                make(path)
                done = self.register("--server", server)
                self.assertIn(done.returncode, (1, 2), done.stdout + done.stderr)
                self.assertIn(says, done.stderr)
                self.assertNotIn("ended its process", done.stderr)
                asked = time.monotonic()
                weft("job", "list", "--server", server, check=0)
                self.assertLess(time.monotonic() - asked, 10)
            if before is None:
                os.remove(path)
            else:
                write(path, before)
        now, most = memory_mib(self.daemon.pid)
        self.assertLess(most, MOST_MIB)
        self.assertLess(now, begin + MOST_LEFT_MIB)
        # What is right goes on as before.
        self.register("--server", server, check=0)

    def test_cost_it_nothing_all_at_once(self):
        """Each in a take of its own, with items, compressed messages and requests of the console."""
        self.start_plainly("--workers", 1, "--console", "127.0.0.1:0")
        server = self.addresses[0]
        self.wait_for_log("console at")
        console = re.search(r"console at ([\w.]+):(\d+)", self.log())
        for name, file, make, _ in BOMBS:
            shutil.copytree(self.take, self.path(name))
            make(self.path(name, file))
        items = {"objects.json": b'{"cameras":[' + b"{}," * (5 * MIB) + b"{}]}", "nested.json": b'{"cameras":' + b"[" * (10 * MIB)}
        for name, text in items.items():
            write(self.path(name), text)
        packer = zlib.compressobj(9, zlib.DEFLATED, 31)
        packed = packer.compress(bytes(60 * MIB)) + packer.flush()

        def register(name):
            take = self.path(name)
            done = self.register("--server", server, dump=take, rig=f"{take}/rig.json", board=f"{take}/board.json",
                                 template=f"{take}/template", out=f"{take}/out")
            return done.returncode in (1, 2) and "ended its process" not in done.stderr

        def upload(name):
            return weft("library", "upload", "rig", self.path(name), "--server", server).returncode == 2

        def post(text):
            connection = http.client.HTTPConnection(console[1], int(console[2]), timeout=60)
            try:
                connection.request("POST", "/api/Jobs/ListJobs", text, {"Content-Type": "application/json", "Origin": f"http://{console[0][11:]}"})
                return connection.getresponse().status >= 400
            except ConnectionError:  # it is closed before all is sent
                return True

        begin, _ = memory_mib(self.daemon.pid)
        with concurrent.futures.ThreadPoolExecutor(32) as pool:
            ends = {name: pool.submit(register, name) for name, *_ in BOMBS}
            ends |= {name: pool.submit(upload, name) for name in items}
            ends |= {f"message {i}": pool.submit(http2.send_packed, server, "/weft.v1.Jobs/GetJob", None, "gzip", packed) for i in range(8)}
            ends |= {f"console {i}": pool.submit(post, "[" * MIB if i % 2 else '{"a":[' + "{}," * (MIB // 4) + "{}]}") for i in range(8)}
            longest_s = 0
            while not all(end.done() for end in ends.values()):
                asked = time.monotonic()
                weft("job", "list", "--server", server, check=0)
                longest_s = max(longest_s, time.monotonic() - asked)
                time.sleep(0.2)
        for name, end in ends.items():
            self.assertTrue(end.result(), name)
        now, most = memory_mib(self.daemon.pid)
        print(f"memory of weftd: {begin} MiB at first, {most} at most, {now} at last; the longest of other calls {longest_s:.2f} s")
        self.assertLess(most, MOST_MIB)
        self.assertLess(now, begin + MOST_LEFT_MIB)
        self.assertLess(longest_s, 10)

    def test_are_no_items_either(self):
        self.start_plainly("--workers", 1)
        server = self.addresses[0]
        begin, _ = memory_mib(self.daemon.pid)
        for text in (b'{"cameras":[' + b"{}," * (5 * MIB) + b"{}]}", b'{"cameras":' + b"[" * (10 * MIB)):
            write(self.path("rig.json"), text)
            refused = weft("library", "upload", "rig", self.path("rig.json"), "--server", server)
            self.assertEqual(refused.returncode, 2, refused.stdout + refused.stderr)
            self.assertIn("rig.json", refused.stderr)
        now, most = memory_mib(self.daemon.pid)
        self.assertLess(most, MOST_MIB)
        self.assertLess(now, begin + MOST_LEFT_MIB)


if __name__ == "__main__":
    unittest.main()
