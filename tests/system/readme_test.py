"""The commands of the README do what it says."""

import json
import os
import re
import shlex
import subprocess
import tempfile
import unittest

from studio import BIN, LONG_S, StudioTest, read, weft, write

SOURCE = os.environ["WEFT_SOURCE"]


def commands_below(heading):
    """Lines of the first code block below a heading of the README."""
    text = read(os.path.join(SOURCE, "README.md"))
    block = text.split(f"## {heading}\n", 1)[1].split("```")[1]
    return block.strip().splitlines()


def krt_of(rig):
    """A rig in the text format of the paper."""
    blocks = []
    for camera in rig["cameras"]:
        rotation, translation = camera["rotation"], camera["translation_mm"]
        blocks.append("\n".join([
            camera["id"],
            f"{camera['fx_px']!r} 0 {camera['cx_px']!r}", f"0 {camera['fy_px']!r} {camera['cy_px']!r}", "0 0 1",
            " ".join(repr(k) for k in camera["distortion"][:5]),
            *(" ".join(repr(x) for x in (*rotation[3 * row:3 * row + 3], translation[row])) for row in range(3)),
            ""]))
    return "\n".join(blocks)


class ConsoleTour(unittest.TestCase):
    """Its steps are those of tests, so they run as long as those do."""

    def test_every_picture_is_one_that_the_tests_of_the_console_look_at(self):
        shown = re.findall(r"\(pictures/console/([a-z-]+)\.webp\)", read(os.path.join(SOURCE, "docs", "console-tour.md")))
        tests = "".join(read(os.path.join(SOURCE, "tests", "system", f"console_{name}_test.py")) for name in ("story", "work"))
        self.assertLessEqual(set(shown), set(re.findall(r'self\.look\(page, "([a-z-]+)"\)', tests)))
        folder = os.path.join(SOURCE, "docs", "pictures", "console")
        self.assertEqual({f"{name}.webp" for name in shown}, set(os.listdir(folder)))
        self.assertLess(sum(os.path.getsize(os.path.join(folder, name)) for name in os.listdir(folder)), 1e6)


class OwnRecording(StudioTest):
    def test_every_command_works_as_written(self):
        rig = json.loads(read(f"{self.take}/rig.json"))
        write(self.path("KRT"), krt_of(rig))
        for given, name in (("template/mesh.ply", "shirt.ply"), ("template/cells.txt", "vertex_to_cell.txt"),
                            ("board.png", "board.png")):
            os.rename(f"{self.take}/{given}", self.path(name))
        os.rename(self.take, self.path("DUMP"))
        camera = rig["cameras"][0]
        environment = {**os.environ, "PATH": f"{BIN}:{os.environ['PATH']}"}
        for line in commands_below("Your own recording"):
            words = shlex.split(line)
            for option, size in (("--width-px", camera["width_px"]), ("--height-px", camera["height_px"])):
                if option in words:
                    words[words.index(option) + 1] = str(size)
            done = subprocess.run(words, cwd=self.folder, env=environment, capture_output=True, text=True,
                                  timeout=LONG_S, check=False)
            self.assertEqual(done.returncode, 0, f"{line}\n{done.stdout}{done.stderr}")
        for frame in self.frames:
            for name in ("mesh.ply", "cloud.ply", "report.json"):
                self.assertTrue(os.path.exists(self.path("result", frame, name)), name)
        self.assertTrue(os.path.exists(self.path("result", "report.html")))


class QuickStart(unittest.TestCase):
    def test_registers_cloth_and_prints_what_the_readme_shows(self):
        with tempfile.TemporaryDirectory(prefix="weft quick start ") as folder:
            done = subprocess.run([os.path.join(SOURCE, "deploy", "quickstart.sh"), os.path.join(folder, "out")],
                                  env={**os.environ, "WEFT_BUILD_DIR": os.path.dirname(BIN)}, capture_output=True,
                                  text=True, timeout=2 * LONG_S, check=False)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            live = [name for name in os.listdir(f"{folder}/out/live") if name.isdigit()]
            self.assertGreater(len(live), 5, done.stdout)
            self.assertRegex(done.stderr, r"(?m)^0\d\d\d    (done|degraded) .* after its recording$")
            self.assertRegex(done.stdout, r"(?m)^\S+  ended .* \d+ sets,")
            frames = [name for name in os.listdir(f"{folder}/out/result") if name.isdigit()]
            self.assertGreater(len(frames), 1)
            for frame in frames:
                self.assertTrue(os.path.exists(f"{folder}/out/result/{frame}/mesh.ply"))
            self.assertTrue(os.path.exists(f"{folder}/out/result/report.html"))
            total = json.loads(weft("evaluate", f"{folder}/out/result", "--truth", f"{folder}/out/take/truth", "--json", "--quick",
                                    check=0).stdout)["total"]
            self.assertGreater(total["centers"]["precision"], 0.995)
            centers = total["centers"]
            self.assertEqual(centers["observations"] - centers["right"],
                             centers["out_of_sight"] + centers["wrong_px"]["count"])
            self.assertRegex(done.stdout, r" \d+ wrong ones: \d+ of cells out of sight, the others off by [0-9.]+ px")
            self.assertGreater(total["centers"]["recall"], 0.9)
            self.assertLess(total["centers"]["error_px"]["median"], 0.2)
            self.assertGreater(total["cloud"]["coverage"], 0.95)
            self.assertLess(total["cloud"]["error_mm"]["median"], 0.15)
            self.assertLess(total["mesh"]["visible_mm"]["mean"], 0.3)
            self.assertEqual(total["measures"]["self_intersecting_pairs"], 0)
            shown = re.sub(r"[0-9]", "0", done.stdout)
            text = read(os.path.join(SOURCE, "README.md"))
            for heading in re.findall(r"^== .*", text, re.MULTILINE):
                self.assertIn(re.sub(r"[0-9]", "0", heading), shown)


if __name__ == "__main__":
    unittest.main()
