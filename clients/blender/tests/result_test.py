"""The files of a result as the add-on reads them: times and colours. Needs no Blender."""

import os
import re
import sys
import tempfile
import unittest

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.dirname(HERE))
import weft_result  # noqa: E402

SOURCE = os.path.join(HERE, "..", "..", "..")


def source(*path):
    with open(os.path.join(SOURCE, *path), encoding="utf-8") as file:
        return file.read()


class Sequences(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="weft test ")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def write(self, *names):
        for name in names:
            with open(os.path.join(self.folder, name), "wb"):
                pass

    def test_begins_where_the_first_picture_is(self):
        self.write("0004.png", "0006.png", "notes.txt")
        first = os.path.join(self.folder, "0004.png")
        self.assertEqual(weft_result.sequence_of(self.folder, ["0004", "0005", "0006"], [0, 1, 2]), (first, 4))
        # The first frame of the result has no picture: what counts is where the scene begins.
        self.assertEqual(weft_result.sequence_of(self.folder, ["0002", "0004", "0006"], [0, 2, 4]), (first, 2))

    def test_none_where_there_is_none(self):
        self.assertIsNone(weft_result.sequence_of(os.path.join(self.folder, "c09"), ["0000"], [0]))
        self.write("0007.png", "0000.txt")
        self.assertIsNone(weft_result.sequence_of(self.folder, ["0000"], [0]))

    def test_refuses_numbers_that_do_not_go_on_as_the_scene(self):
        self.write("0000.jpg", "0002.jpg", "left.jpg")
        for names, at in ((["0000", "0002"], [0, 1]), (["left", "0000"], [0, 1])):
            with self.assertRaisesRegex(weft_result.ResultError, "not numbered as the scene's"):
                weft_result.sequence_of(self.folder, names, at)


class Times(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="weft test ")
        self.addCleanup(folder.cleanup)
        self.dump = folder.name

    def test_a_recorded_take_tells_its_rate_and_names_frames_by_sets(self):
        os.makedirs(os.path.join(self.dump, "streams"))
        # Of each chunk: position, offset, frame set, device time, host time, bytes, checksum, 1 without a frame, checksum.
        records = [[0] * 9] + [[k, 0, frame_set, 7 + frame_set * 100_000_000 // 3, 0, 0, 0, frame_set == 6, 0]
                               for k, frame_set in enumerate([0, 1, 2, 6, 7, 23])]
        np.array(records, dtype="<i8").tofile(os.path.join(self.dump, "streams", "c00.index"))
        self.assertEqual(weft_result.take_times(self.dump), (30.0, True))
        self.assertEqual(weft_result.frame_numbers(["0000", "0006", "0023"], True), [0, 6, 23])
        self.assertEqual(weft_result.frame_numbers(["0004", "0006"], True), [0, 2])

    def test_a_folder_of_pictures_may_tell_its_rate(self):
        self.assertEqual(weft_result.take_times(self.dump), (0.0, False))
        self.assertEqual(weft_result.take_times(""), (0.0, False))
        os.makedirs(os.path.join(self.dump, "truth"))
        with open(os.path.join(self.dump, "truth", "pictures.csv"), "w", encoding="utf-8") as file:
            file.write("frame,camera,mid_exposure_ns,lost\n0000,a,5,0\n0000,b,6,0\n0001,a,33366672,0\n0001,b,9,0\n")
        rate, by_set = weft_result.take_times(self.dump)
        self.assertAlmostEqual(rate, 30 / 1.001, places=12)
        self.assertFalse(by_set)
        # Their names are no numbers of frame sets.
        self.assertEqual(weft_result.frame_numbers(["0000", "0006", "0023"], False), [0, 1, 2])
        self.assertEqual(weft_result.frame_numbers(["a", "b"], True), [0, 1])


class Colors(unittest.TestCase):
    """One table for the reports, the console and Blender."""

    def test_states_have_the_colours_of_the_reports(self):
        text = source("services", "results", "report", "mesh_colors.cpp")
        body = text[text.index("StateColor("):]
        rows = re.findall(r"return \{(.*?)\};", body)[:5]
        found = [tuple(float(value) for value in re.findall(r"([\d.]+)f", row)) for row in rows]
        observed, two_view, bridged, driven, inferred = found
        self.assertEqual(weft_result.STATE_COLORS, [inferred, observed, two_view, bridged, driven])

    def test_states_have_the_colours_of_the_console(self):
        text = source("console", "src", "player", "colors.ts")
        rows = re.findall(r"\[(\d+), (\d+), (\d+)\]", text[text.index("STATE_COLORS"):])[:5]
        for row, color in zip(rows, weft_result.STATE_COLORS, strict=True):
            np.testing.assert_allclose([int(value) for value in row], 255 * np.array(color), atol=1)

    def test_nodes_take_linear_values(self):
        # sRGB 0.5 is 0.2140 (IEC 61966-2-1).
        np.testing.assert_allclose(weft_result.linear((0.0, 0.5, 1.0)), (0, 0.21404114, 1, 1), rtol=1e-6)
        low, high = weft_result.map_color(0.0), weft_result.map_color(1.0)
        self.assertLess(sum(low[:3]), sum(high[:3]))


if __name__ == "__main__":
    unittest.main()
