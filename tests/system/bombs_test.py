"""Small or sparse inputs that take gigabytes once they are read: the daemon answers, stays small, and serves others meanwhile."""

import os
import time
import unittest

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
