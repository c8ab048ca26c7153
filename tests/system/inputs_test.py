"""What users hand in: damaged and foreign images, names of frames, rigs, boards and templates that do not fit."""

import json
import os
import random
import re
import shutil
import struct
import subprocess
import tempfile
import unittest
import zlib

from studio import BIN, LONG_S, StudioTest, page_data, read, weft, write


def peak_mib(*arguments):
    """Runs `weft`; what it printed, and the most memory that it took."""
    process = subprocess.Popen([os.path.join(BIN, "weft"), *map(str, arguments)], stdout=subprocess.PIPE,
                               stderr=subprocess.STDOUT, text=True)
    text = process.stdout.read()
    process.stdout.close()
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return process.returncode, text, usage.ru_maxrss / 1024


def bomb(side):
    """A small PNG of side x side grey zeros."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    packer = zlib.compressobj(1)
    rows = bytes(100 * (side + 1))
    data = b"".join(packer.compress(rows) for _ in range(side // 100)) + packer.flush()
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", side, side, 8, 0, 0, 0, 0)) +
            chunk(b"IDAT", data) + chunk(b"IEND", b""))


def bmp(width, height):
    """A white BMP with 24 bits."""
    pixels = b"\xff" * (height * (3 * width + 3) // 4 * 4)
    return (b"BM" + struct.pack("<IHHI", 54 + len(pixels), 0, 0, 54) +
            struct.pack("<IiiHHIIiiII", 40, width, height, 1, 24, 0, len(pixels), 2835, 2835, 0, 0) + pixels)


class Images(StudioTest):
    def frame_report(self, frame):
        return json.loads(read(os.path.join(self.out, self.frames[frame], "report.json")))

    def missing(self, frame):
        return {view["camera"]: view["missing_reason"] for view in self.frame_report(frame)["views"]
                if view["missing_reason"]}

    def test_picture_that_would_fill_the_memory_is_refused_by_its_header(self):
        path = self.path("zeros.png")
        write(path, bomb(20000))
        status, text, mib = peak_mib("decode", path, "--board", f"{self.take}/board.json", "--out", self.path("o.csv"))
        self.assertEqual(status, 2, text)
        self.assertIn(f"{path}: image is 20000x20000", text)
        self.assertLess(mib, 300)
        shutil.copy(path, self.image(0, 2))
        status, text, mib = peak_mib(*self.register_arguments(), "--frames", "0000", "--threads", "1")
        self.assertEqual(status, 0, text)
        self.assertIn("image is 20000x20000, the rig says 192x256", self.missing(0)["c02"])
        self.assertLess(mib, 500)

    def test_half_a_jpeg_with_an_end_marker_is_no_image(self):
        jpeg = self.path("jpeg")
        weft("simulate", "--preset", "tiny", "--frames", "1", "--image-format", "jpg", "--out", jpeg, check=0)
        image = os.path.join(jpeg, "0000", "c03.jpg")
        whole = read(image, "rb")
        write(image, whole[:len(whole) // 2] + b"\xff\xd9")
        self.register(check=0, dump=jpeg, rig=f"{jpeg}/rig.json", board=f"{jpeg}/board.json",
                      template=f"{jpeg}/template")
        self.assertEqual(self.frame_report(0)["state"], "FRAME_STATE_DEGRADED")
        self.assertIn(f"{image}: the JPEG image is damaged or truncated", self.missing(0)["c03"])

    def test_frames_that_were_not_asked_for_are_not_in_the_report(self):
        for camera in range(2, len(self.images)):
            os.remove(self.image(0, camera))
        done = self.register("--frames-alone")
        self.assertEqual(done.returncode, 1)
        self.register("--frames-alone", "--frames", "1:3", check=0)
        page = page_data(os.path.join(self.out, "report.html"))["job"]
        self.assertIn("2 of 2 frames registered", page["headline"])
        self.assertNotIn("triangulation needs 3", str(page))
        self.assertEqual([frame["frame"] for frame in page["frames"]], self.frames[1:])

    def test_formats_that_are_not_promised_are_refused_whatever_their_name(self):
        write(self.image(0, 1), bmp(192, 256))
        self.register("--frames", "0:1", check=0)
        self.assertIn("not a PNG, JPEG or TIFF image", self.missing(0)["c01"])

    def test_texts_of_files_neither_steer_a_terminal_nor_fill_it(self):
        evil = "\x1b]0;owned\x07\x1b[2J\x9b" + "A" * 5000
        inputs = {"--rig": f"{self.take}/rig.json", "--board": f"{self.take}/board.json", "--template": f"{self.take}/template"}
        contents = {"rig.json": f'{{"cameras": [{{"id": "{evil}", "width_px": "{evil}"}}]}}', "KRT": f"{evil}\n{evil} 1 2\n",
                    "board.json": f'{{"{evil}": 1}}', "cameras.txt": f"1 {evil} 100 100 1 2 3\n", "rig.yml": f"%YAML:1.0\n{evil}: [\n"}
        for name, content in contents.items():
            path = self.path(name)
            write(path, content.encode("latin-1"))
            option = "--board" if name.startswith("board") else "--rig"
            arguments = [part for pair in {**inputs, option: path}.items() for part in pair]
            done = subprocess.run([os.path.join(BIN, "weft"), "register", self.take, *arguments, "--out", self.out], capture_output=True,
                                  timeout=LONG_S, check=False)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assert_plain(done.stderr)
        config = self.path("weftd.txtpb")
        write(config, f'state: "{evil}\n'.encode("latin-1"))
        done = subprocess.run([os.path.join(BIN, "weftd"), "--config", config], capture_output=True, timeout=LONG_S, check=False)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assert_plain(done.stderr)

    def assert_plain(self, text):
        self.assertLess(len(text), 3000, text[:200])
        self.assertEqual(re.findall(rb"[\x00-\x09\x0b-\x1f\x7f]|\xc2[\x80-\x9f]", text), [], text[:300])

    def test_table_with_rows_of_nothing_is_named(self):
        os.mkdir(self.path("scans"))
        path = self.path("scans", "0000.ply")
        write(path, b"ply\nformat binary_little_endian 1.0\nelement vertex 1000000000000000000\nend_header\n")
        done = self.register("--frames", "0:1", "--scans", self.path("scans"))
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn(f"{path}: element vertex", done.stderr)

    def test_grey_mosaics_are_recognized_and_read_on_request(self):
        raw = self.path("raw")
        weft("simulate", "--preset", "tiny", "--frames", "1", "--readout", "mosaic", "--width-px", "384", "--height-px",
             "512", "--out", raw, check=0)
        paths = {"dump": raw, "rig": f"{raw}/rig.json", "board": f"{raw}/board.json", "template": f"{raw}/template"}
        done = self.register(**paths)
        self.assertEqual(done.returncode, 1)
        self.assertIn("looks like a Bayer mosaic; name its order with --mosaic", done.stdout)
        done = self.register("--mosaic", "bayer_rg8", check=0, **paths)
        self.assertIn("1 of 1 frame registered", done.stdout)
        done = self.register("--mosaic", "rgb8", **paths)
        self.assertEqual(done.returncode, 2)
        self.assertIn("bayer_gb8", done.stderr)
        done = weft("template", "build", raw, "--rig", f"{raw}/rig.json", "--board", f"{raw}/board.json", "--mosaic",
                    "bayer_rg8", "--out", self.path("built"))
        self.assertNotIn("usable image", done.stderr)
        self.assertTrue(os.path.exists(self.path("built", "clouds", "0000.ply")), done.stderr)


class Frames(StudioTest):
    def setUp(self):
        super().setUp()
        for old, new in (("0000", "0010"), ("0001", "0011"), ("0002", "0015")):
            os.rename(f"{self.take}/{old}", f"{self.take}/{new}")
        self.frames = ["0010", "0011", "0015"]

    def registered(self):
        return sorted(name for name in os.listdir(self.out) if name.isdigit())

    def decode(self, *more):
        return weft("decode", self.take, "--board", f"{self.take}/board.json", "--out", self.path("o.csv"), *more)

    def test_all_commands_name_frames_alike(self):
        self.register("--frames", "0011:0015", check=0)
        self.assertEqual(self.registered(), ["0011"])
        self.register("--frames", "15", check=0)
        self.assertEqual(self.registered(), ["0011", "0015"])
        for frames in ("0011", "11:12", "11:15"):
            self.assertEqual(self.decode("--frames", frames).returncode, 0)
            rows = read(self.path("o.csv")).splitlines()[1:]
            self.assertEqual({row.split(",")[0] for row in rows}, {f"c{i:02}" for i in range(12)})
        self.assertEqual(self.decode("--frame", "0011").returncode, 0)  # as it was called
        self.assertEqual(self.decode("--frames", "10:12").returncode, 0)
        names = {row.split(",")[0] for row in read(self.path("o.csv")).splitlines()[1:]}
        self.assertEqual(len(names), 24)
        self.assertIn("0010/c00", names)
        recorded = self.path("recorded")
        weft("take", "import", self.take, "--out", recorded, check=0)
        weft("take", "trim", recorded, "--frames", "11:15", "--out", self.path("one"), check=0)
        weft("take", "trim", recorded, "--sets", "11:15", "--out", self.path("same"), check=0)
        self.assertEqual(json.loads(weft("take", "trim", recorded, "--frames", "15", "--out", self.path("last"), "--json",
                                         check=0).stdout)["sets"], "1")

    def test_errors_list_what_is_there(self):
        there = f"is not in {self.take}; it has 3 frames, 0010 to 0015"
        for done in (self.register("--frames", "0099"), self.decode("--frames", "0099"),
                     weft("template", "build", self.take, "--rig", f"{self.take}/rig.json", "--board",
                          f"{self.take}/board.json", "--frames", "0099", "--out", self.path("built"))):
            self.assertEqual(done.returncode, 2, done.stdout + done.stderr)
            self.assertIn(f"frame 0099 {there}", done.stderr)


class Misfits(StudioTest):
    def assert_bad(self, done, fact):
        """Exit status 1, the verdict first, and the same in job.json."""
        self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
        self.assertTrue(done.stdout.startswith("bad: "), done.stdout)
        self.assertIn(fact, done.stdout)
        verdict = json.loads(read(f"{self.out}/job.json"))["verdict"]
        self.assertEqual(verdict["grade"], "GRADE_BAD")
        self.assertIn(fact, verdict["reason"])
        self.assertTrue(verdict["remedy"])

    def edit_rig(self, change):
        path = self.path("rig.json")
        rig = json.loads(read(f"{self.take}/rig.json"))
        rig.pop("hash", None)
        change(rig["cameras"])
        write(path, json.dumps(rig))
        return path

    def test_good_take(self):
        done = self.register(check=0)
        self.assertRegex(done.stdout, r"^good: 3 of 3 frames registered, [\d.]+ % of the cells observed\n")
        verdict = json.loads(read(f"{self.out}/job.json"))["verdict"]
        self.assertEqual(verdict["grade"], "GRADE_GOOD")
        self.assertTrue(all(check["limits"] for check in verdict["checks"]))

    def test_rig_of_another_take(self):
        def move(cameras):
            for camera, noise in zip(cameras, range(len(cameras))):
                camera["translation_mm"] = [t + random.Random(noise).gauss(0, 15) for t in camera["translation_mm"]]
        self.assert_bad(self.register("--frames", "0:1", rig=self.edit_rig(move)), "is it the rig of this take?")

    def test_rig_that_is_wrong_in_half_of_its_cameras(self):
        def move(cameras):
            for camera, noise in zip(cameras[:6], range(6)):
                camera["translation_mm"] = [t + random.Random(noise).gauss(0, 5) for t in camera["translation_mm"]]
        self.assert_bad(self.register("--frames", "0:1", rig=self.edit_rig(move)), "is it the rig of this take?")

    def test_board_of_another_cloth(self):
        other = self.path("other")
        weft("pattern", "generate", "--rows", "24", "--cols", "48", "--cell-mm", "3", "--seed", "99", "--out", other, check=0)
        weft("template", "import", "--mesh", f"{self.take}/template/mesh.ply", "--cells",
             f"{self.take}/template/cells.txt", "--board", f"{other}/board.json", "--out", self.path("sewn"), check=0)
        self.assert_bad(self.register("--frames", "0:1", board=f"{other}/board.json", template=self.path("sewn")),
                        "is it the right board?")
        done = weft("decode", self.take, "--frames", "0:1", "--board", f"{other}/board.json", "--out", self.path("o.csv"))
        self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
        self.assertIn("is it the right board?", done.stdout)

    def test_template_of_another_part_of_the_board(self):
        # Two cells of what is seen, and the rest of the garment from elsewhere.
        lines = read(f"{self.take}/template/cells.txt").splitlines()
        kept = [line if line in ("0 0", "0 1", "1 0") else "-1 -1" for line in lines]
        write(self.path("cells.txt"), "\n".join(kept) + "\n")
        weft("template", "import", "--mesh", f"{self.take}/template/mesh.ply", "--cells", self.path("cells.txt"),
             "--board", f"{self.take}/board.json", "--out", self.path("part"), check=0)
        self.assert_bad(self.register("--frames", "0:1", template=self.path("part")),
                        "is it the template of another part of the board?")

    def test_cameras_that_the_rig_lacks_are_one_line(self):
        done = self.register("--frames", "0:1", rig=self.edit_rig(lambda cameras: cameras.__delitem__(slice(6, 12))))
        warnings = [line for line in done.stderr.splitlines() if line.startswith("weft: warning: ")]
        self.assertEqual(len(warnings), 1, done.stderr)
        self.assertIn(f"6 of 12 cameras of {self.take} are not in the rig: c06, c07", warnings[0])
        self.assertIn("is it the rig of this take?", warnings[0])


class Words(unittest.TestCase):
    def commands(self, *path):
        text = weft(*path, "--help", check=0).stdout
        yield path, text
        section = re.search(r"^(?:Subcommands|Commands):\n(.*?)(?:\n\n|\Z)", text, re.S | re.M)
        for name in re.findall(r"^  ([a-z]+)(?:  |$)", section.group(1), re.M) if section else []:
            yield from self.commands(*path, name)

    def test_help_shows_no_empty_defaults(self):
        pages = list(self.commands())
        self.assertGreater(len(pages), 30)
        for path, text in pages:
            self.assertNotIn("default []", text, path)

    def test_help_tells_the_values_of_options(self):
        text = " ".join(weft("simulate", "--help", check=0).stdout.split())
        for option, values in (("--garment", "sheet, tube, skirt, tshirt"), ("--motion", "breathing, twist, jogging")):
            self.assertRegex(text, rf"{option} NAME[^-]*: {values}")
        text = " ".join(weft("rig", "calibrate", "--help", check=0).stdout.split())
        self.assertRegex(text, r"--scale .*: tags, bar")

    def test_the_environments_daemon_is_that_of_every_command(self):
        for arguments in (("job", "list"), ("take", "list"), ("camera", "list"), ("library", "list"), ("operation", "list"),
                          ("session", "list"), ("evaluate", "nowhere"), ("take", "info", "nowhere")):
            done = subprocess.run([os.path.join(BIN, "weft"), *arguments], env={**os.environ, "WEFT_SERVER": "127.0.0.1:1"},
                                  capture_output=True, text=True, timeout=LONG_S, check=False)
            self.assertIn("no daemon answers at 127.0.0.1:1", done.stderr, arguments)

    def test_slips_of_the_keyboard_are_understood(self):
        for arguments, meant in ((("regster",), "register"), (("register", "--templat", "x"), "--template"),
                                 (("take", "imprt"), "import")):
            self.assertIn(f"did you mean {meant}?", weft(*arguments, check=2).stderr)
        done = weft("take", "record", "--session", "nowhere.json", "--out", "nowhere", "--seconds", "-2", check=2)
        self.assertIn("-2 is negative", done.stderr)

    def test_files_of_another_kind_are_named(self):
        with tempfile.TemporaryDirectory(prefix="weft test ") as folder:
            weft("simulate", "--preset", "tiny", "--frames", 1, "--out", f"{folder}/take", check=0)
            rig, board = f"{folder}/take/rig.json", f"{folder}/take/board.json"
            for wrong, words in ((("--rig", board, "--board", board), "this is a board (board.json), and a rig (rig.json) is wanted"),
                                 (("--rig", rig, "--board", rig), "this is a rig (rig.json), and a board (board.json) is wanted")):
                done = weft("register", f"{folder}/take", *wrong, "--template", f"{folder}/take/template", "--out", f"{folder}/r",
                            check=2)
                self.assertIn(words, done.stderr)
            typo = ("--out", f"{folder}/typo/new")
            for command in (("take", "import", f"{folder}/take"), ("rig", "calibrate", f"{folder}/take", "--target", rig),
                            ("decode", f"{folder}/take/0000/c00.png", "--board", board)):
                done = weft(*command, *typo, check=2)
                self.assertIn(f"the folder {folder}/typo is missing", done.stderr)
                self.assertFalse(os.path.exists(f"{folder}/typo"))
            done = weft("simulate", "--preset", "tiny", "--frames", 1, *typo, check=0)
            self.assertIn(f"the folder {folder}/typo is missing", done.stderr)
            # A folder of something else is no place for a template.
            done = weft("template", "import", "--mesh", f"{folder}/take/template/mesh.ply", "--cells",
                        f"{folder}/take/template/cells.txt", "--board", board, "--out", f"{folder}/take", check=2)
            self.assertIn("a folder of something else", done.stderr)
            self.assertFalse(os.path.exists(f"{folder}/take/template.json"))
            # Another board at the place of one that may be sewn already.
            weft("pattern", "generate", "--rows", 20, "--cols", 20, "--out", f"{folder}/b", check=0)
            first = read(f"{folder}/b/board.json")
            done = weft("pattern", "generate", "--rows", 22, "--cols", 20, "--out", f"{folder}/b", check=2)
            self.assertIn("--force", done.stderr)
            self.assertEqual(read(f"{folder}/b/board.json"), first)

    def test_messages_name_a_camera_once(self):
        with tempfile.TemporaryDirectory(prefix="weft test ") as folder:
            session = os.path.join(folder, "session.json")
            write(session, json.dumps({"cameras": [{"id": "c01", "v4l2": {"device": "nothing of this name"}}]}))
            # In a network of its own: no camera is asked, and none answers.
            done = subprocess.run(["unshare", "-rn", os.path.join(BIN, "weft"), "doctor", "--session", session, "--dir",
                                   folder, "--disk-test-gib", "0.01"], capture_output=True, text=True, timeout=LONG_S,
                                  check=False)
        self.assertIn("no V4L2 camera is called nothing of this name", done.stdout)
        self.assertNotRegex(done.stdout + done.stderr, "camera c01:? +camera c01:")

    def test_video_without_an_ending(self):
        done = weft("take", "export", "/nowhere", "--format", "proxy", "--out", "/tmp/nothing")
        self.assertEqual(done.returncode, 2)
        self.assertIn("end the name in .mp4 or .mkv", done.stderr)


if __name__ == "__main__":
    unittest.main()
