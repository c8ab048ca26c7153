"""Avatars of strangers: nets that would break the library that runs them are refused by name, wherever they are read."""

import os
import tempfile
import unittest

from daemon_process import DaemonProcess
from shift_net import put_net, with_shift_net
from studio import read, weft, write

EXAMPLE = os.path.join(os.environ["WEFT_SOURCE"], "deploy", "examples", "tshirt", "tshirt.avatar")


def hostile_nets(good):
    """By what is wrong: the net of 27 channels has other dims, operators, numbers and fields than it says."""
    conv = good.index(b"conv0.weight", good.index(b"raw") if b"raw" in good else 0)
    return {
        "dims": good.replace(b"\x08\x02\x08\x1b\x08\x03\x08\x03", b"\x08\x02\x08\x7f\x08\x7f\x08\x03"),
        "kernel_shape": good.replace(b"kernel_shape@\x03@\x03", b"kernel_shape@\x7f@\x7f", 1),
        "operator": good.replace(b"LeakyRelu", b"ScatterND", 1),
        "stands before": good[:conv] + b"c" * 12 + good[conv + 12:],
        "field 14": good + b"\x72\x01x",
        "damaged": good[:-1],
    }


class HostileNets(DaemonProcess, unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="weft hostile ")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.avatar = with_shift_net(EXAMPLE, f"{self.folder}/shirt.avatar")
        self.good = read(f"{self.avatar}/net.onnx", "rb")

    def assert_refused(self, done, words):
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("net.onnx", done.stderr)
        self.assertIn(words, done.stderr)

    def test_are_refused_by_name_where_they_are_read(self):
        self.start_plainly()
        for words, onnx in hostile_nets(self.good).items():
            with self.subTest(words):
                self.assertNotEqual(onnx, self.good)
                put_net(self.avatar, onnx)
                self.assert_refused(weft("avatar", "show", self.avatar), words)
                self.assert_refused(weft("evaluate", self.folder, "--avatar", self.avatar), words)
                sent = weft("library", "upload", "avatar", self.avatar, "--server", self.addresses[0])
                self.assertNotEqual(sent.returncode, 0)
                self.assertIn(words, sent.stderr)
        put_net(self.avatar, self.good)
        weft("avatar", "show", self.avatar, check=0)
        weft("library", "upload", "avatar", self.avatar, "--server", self.addresses[0], check=0)

    def test_a_folder_for_results_is_not_left_behind(self):
        write(f"{self.folder}/board.json", "{}")
        out = f"{self.folder}/out"
        done = weft("avatar", "drive", self.folder, "--avatar", self.avatar, "--rig", f"{self.folder}/rig.json", "--board",
                    f"{self.folder}/board.json", "--template", self.folder, "--out", out)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertFalse(os.path.exists(out))


if __name__ == "__main__":
    unittest.main()
