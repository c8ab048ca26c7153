"""Versions of the algorithms: results that change have a new version, and a resumed job does what differs again.

    algorithms_test.py           the tests
    algorithms_test.py --write   writes the hashes of today's results to tests/data/algorithms/hashes.json

The hashes are those of the results of a small take, as exact as result files are: positions in images to 1e-4 px, in
space in single precision. All builds of the kernels (WEFT_INSTRUCTIONS) give the same, and so do -O2 and -O3 of gcc 12
on x86-64, since neither contracts nor reorders floating point. Another compiler or processor family may not: there,
compare with a build of the version before.
"""

import hashlib
import json
import os
import re
import struct
import sys
import tarfile
import tempfile
import unittest

from studio import StudioTest, read, results, weft, write

DATA = os.path.join(os.environ["WEFT_SOURCE"], "tests", "data", "algorithms")
HASHES = os.path.join(DATA, "hashes.json")
STAGES = ["decode", "triangulate", "second_pass", "align", "refine", "drive"]
# Where what a stage computes depends on fewer than all stages above it.
DEPENDS_ON = {"drive": {"decode", "drive"}}
FORMATS = {"float": "f", "double": "d", "int": "i", "uint": "I", "uchar": "B", "char": "b", "short": "h", "ushort": "H"}
# What a stage decides; further columns and properties may be added without being a change of results.
CSV_COLUMNS = ["image", "x_px", "y_px", "board_row", "board_col", "kind", "confidence", "sigma_px"]
CLOUD_COLUMNS = ["x", "y", "z", "board_row", "board_col", "kind", "views", "sigma_mm", "fold_sigma_mm"]
MESH_COLUMNS = ["x", "y", "z", "state", "sigma_mm", "views"]
MORE_VERSIONS = 7  # added to a version to make it another one


def csv_values(path):
    lines = [line.split(",") for line in read(path).splitlines()]
    columns = [lines[0].index(name) for name in CSV_COLUMNS]
    return repr([[line[c] for c in columns] for line in lines[1:]])


def ply_values(path, names):
    """The named columns of the vertices; all of what follows them in a cloud, its rays, as it is."""
    header, body = read(path, "rb").split(b"end_header\n", 1)
    header = header.decode()
    rows = int(re.search(r"element vertex (\d+)", header).group(1))
    properties = re.findall(r"property (\w+) (\w+)$", header.split("element vertex")[1].split("element")[0], re.MULTILINE)
    row = struct.Struct("<" + "".join(FORMATS[kind] for kind, _ in properties))
    columns = [[name for _, name in properties].index(name) for name in names]
    values = [[values[c] for c in columns] for values in row.iter_unpack(body[:rows * row.size])]
    return repr(values) + (repr(body[rows * row.size:]) if "element ray" in header else "")


def hash_of(out, file):
    digest = hashlib.sha256()
    for frame in sorted(name for name in os.listdir(out) if name.isdigit()):
        path = os.path.join(out, frame, file)
        columns = CLOUD_COLUMNS if file == "cloud.ply" else MESH_COLUMNS
        digest.update((csv_values(path) if file.endswith(".csv") else ply_values(path, columns)).encode())
    return digest.hexdigest()[:16]


def unpack(folder):
    """The take and an avatar of its garment. recipe.txt in each says how it was made."""
    for name in ("take", "avatar"):
        if not os.path.exists(os.path.join(folder, name)):
            with tarfile.open(os.path.join(DATA, f"{name}.tar.xz")) as archive:
                archive.extractall(os.path.join(folder, name))


def drive(folder, out, **keywords):
    take = os.path.join(folder, "take")
    return weft("avatar", "drive", take, "--avatar", f"{folder}/avatar/tube.avatar", "--rig", f"{take}/rig.json", "--board",
                f"{take}/board.json", "--template", f"{take}/template", "--out", out, check=0, **keywords)


def measure(folder, instructions):
    """Version and hash of every stage, with kernels of these instructions at the most."""
    take, once, twice, driven = (os.path.join(folder, name) for name in (
        "take", f"once {instructions}", f"twice {instructions}", f"driven {instructions}"))
    unpack(folder)
    environment = {**os.environ, "WEFT_INSTRUCTIONS": instructions}
    for out, more in ((once, ["--single-pass"]), (twice, [])):
        weft("register", take, "--rig", f"{take}/rig.json", "--board", f"{take}/board.json", "--template",
             f"{take}/template", "--out", out, "--observations", *more, check=0, env=environment)
    drive(folder, driven, env=environment)
    hashes = {"decode": hash_of(once, "observations.csv"), "triangulate": hash_of(once, "cloud.ply"),
              "second_pass": hash_of(twice, "observations.csv") + hash_of(twice, "cloud.ply"),
              "align": hash_of(twice, "unrefined.ply"), "refine": hash_of(twice, "mesh.ply"),
              "drive": hash_of(driven, "mesh.ply")}
    versions = {}
    for out in (twice, driven):
        report = json.loads(read(f"{out}/0001/report.json"))
        versions |= {key["stage"]: key["version"] for key in report["keys"]}
    return {stage: {"version": versions[stage], "hash": hashes[stage]} for stage in STAGES}


def complaint(committed, measured):
    """What is to be done about results that are not those of the committed hashes; empty where they are."""
    how = ("then write the new hashes with `WEFT_BIN=build/dev/bin WEFT_SOURCE=. python3 tests/system/algorithms_test.py --write` "
           "and add a line to CHANGELOG.md")
    raised = set()
    for stage in STAGES:
        was, now = committed.get(stage, {}), measured[stage]
        if was.get("version") != now["version"]:
            raised.add(stage)
        if was.get("hash") != now["hash"] and not raised & DEPENDS_ON.get(stage, raised):
            return (f"the results of {stage} changed, and its version is still {now['version']}. If that is wanted, raise the "
                    f"version of {stage} in services/work/pipeline/algorithm_versions.h, so that resumed jobs do not mix results; "
                    f"{how}.")
    if raised:
        return f"a version was raised, and the hashes are still those of the one before: {how}."
    return ""


class Hashes(unittest.TestCase):
    def test_results_that_change_have_a_new_version(self):
        with tempfile.TemporaryDirectory(prefix="weft algorithms ") as folder:
            measured = {instructions: measure(folder, instructions) for instructions in ("baseline", "avx2", "avx512")}
        for instructions in ("avx2", "avx512"):
            self.assertEqual(measured[instructions], measured["baseline"], f"kernels for {instructions}")
        text = complaint(json.loads(read(HASHES)), measured["baseline"])
        self.assertFalse(text, text)

    def test_complaints_name_the_first_stage_and_what_to_do(self):
        def of(versions, hashes):
            return {stage: {"version": v, "hash": h} for stage, v, h in zip(STAGES, versions, hashes)}
        before = of([1, 1, 1, 1, 1, 1], "abcdef")
        self.assertEqual(complaint(before, before), "")
        text = complaint(before, of([1, 1, 1, 1, 1, 1], "abcxyf"))
        self.assertIn("the results of align changed, and its version is still 1", text)
        self.assertIn("algorithm_versions.h", text)
        self.assertIn("--write", text)
        self.assertIn("CHANGELOG.md", text)
        # What follows from a stage with a new version may change, what comes before may not.
        self.assertIn("a version was raised", complaint(before, of([1, 2, 1, 1, 1, 1], "avwxyf")))
        self.assertIn("a version was raised", complaint(before, of([2, 1, 1, 1, 1, 1], "uvwxyz")))
        # Driving depends on decoding alone.
        self.assertIn("results of drive changed", complaint(before, of([1, 2, 1, 1, 1, 1], "avwxyz")))
        self.assertIn("results of decode changed", complaint(before, of([1, 2, 1, 1, 1, 1], "uvwxyf")))


class Resume(StudioTest):
    def report(self, frame):
        return f"{self.out}/{frame}/report.json"

    def pretend_other_version(self, stage):
        """Makes the results those of another version of the stage; returns its real one."""
        for frame in self.frames:
            report = json.loads(read(self.report(frame)))
            key = next(key for key in report["keys"] if key["stage"] == stage)
            key["version"] += MORE_VERSIONS
            write(self.report(frame), json.dumps(report))
        return key["version"] - MORE_VERSIONS

    def written(self):
        """When the files of the frames were written."""
        return {os.path.join(frame, name): os.stat(os.path.join(self.out, frame, name)).st_mtime_ns
                for frame in self.frames for name in os.listdir(os.path.join(self.out, frame)) if name != "report.json"}

    def test_does_exactly_the_stages_again_that_differ(self):
        self.register("--observations", check=0)
        whole = results(self.out)
        images = [self.image(0, camera) for camera in range(len(self.images))]
        for stage, first, redone in (("refine", "refine", {"mesh.ply", "unrefined.ply"}),
                                     ("align", "align", {"mesh.ply", "unrefined.ply"}),
                                     ("second_pass", "decode", {"mesh.ply", "unrefined.ply", "cloud.ply", "observations.csv"}),
                                     ("decode", "decode", {"mesh.ply", "unrefined.ply", "cloud.ply", "observations.csv"})):
            before = self.written()
            decoded = [time["time_ms"] for time in json.loads(read(self.report(self.frames[0])))["stages"]
                       if time["stage"] == "decode"]
            version = self.pretend_other_version(stage)
            done = self.register("--observations", check=0)
            self.assertIn(f"results of an earlier run are computed again from {first} on, since {stage} has version {version}, "
                          f"was {version + MORE_VERSIONS}", done.stderr)
            self.assertEqual(done.stderr.count("of an earlier run"), 1, done.stderr)
            after = self.written()
            self.assertEqual({os.path.basename(path) for path in after if after[path] != before[path]}, redone, stage)
            self.assertEqual(results(self.out), whole, stage)
            again = [time["time_ms"] for time in json.loads(read(self.report(self.frames[0])))["stages"]
                     if time["stage"] == "decode"]
            self.assertEqual(again == decoded, first != "decode", "times of stages that are kept stay")
            warnings = json.loads(read(f"{self.out}/job.json"))["warnings"]
            self.assertEqual(len(warnings), 1, warnings)
            self.assertIn(f"3 frames of an earlier run were computed again from {first} on", warnings[0])
        before = self.written()
        done = self.register("--observations", check=0)
        self.assertIn("3 kept from an earlier run", done.stdout)
        self.assertEqual(self.written(), before)
        self.assertTrue(all(map(os.path.exists, images)))

    def test_a_change_of_options_keeps_what_it_does_not_change(self):
        self.register("--observations", "--frames-alone", check=0)
        before = self.written()
        other = ("--observations", "--set", "alignment.continuation_rings=0")
        self.register(*other, check=0)
        after = self.written()
        kept = {path for path in before if after[path] == before[path]}
        self.assertEqual({os.path.basename(path) for path in kept}, {"cloud.ply", "observations.csv"})
        fresh = self.path("fresh")
        self.register(*other, check=0, out=fresh)
        self.assertEqual(results(self.out), results(fresh))


class DriveResume(unittest.TestCase):
    """A drive that is resumed starts again where decoding or driving has another version than before."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="weft algorithms ")
        self.addCleanup(folder.cleanup)
        self.folder, self.out = folder.name, os.path.join(folder.name, "driven")
        unpack(self.folder)
        drive(self.folder, self.out)
        self.frames = sorted(name for name in os.listdir(self.out) if name.isdigit())

    def reports(self):
        return {frame: json.loads(read(f"{self.out}/{frame}/report.json")) for frame in self.frames}

    def written(self):
        return {frame: os.stat(f"{self.out}/{frame}/mesh.ply").st_mtime_ns for frame in self.frames}

    def test_keys_name_all_stages_whose_code_ran(self):
        for frame, report in self.reports().items():
            keys = {key["stage"] for key in report["keys"]}
            self.assertEqual(keys, {"decode", "drive"}, frame)
            # Steps of driving have times of their own.
            self.assertLessEqual({time["stage"] for time in report["stages"]} & set(STAGES), keys, frame)

    def test_starts_again_over_another_version(self):
        whole, before = hash_of(self.out, "mesh.ply"), self.written()
        drive(self.folder, self.out)
        self.assertEqual(self.written(), before, "frames of the same versions are kept")
        for stage in ("decode", "drive"):
            for frame, report in self.reports().items():
                key = next(key for key in report["keys"] if key["stage"] == stage)
                key["version"] -= 1
                write(f"{self.out}/{frame}/report.json", json.dumps(report))
            drive(self.folder, self.out)
            after = self.written()
            self.assertFalse([frame for frame in self.frames if after[frame] == before[frame]], stage)
            self.assertEqual(hash_of(self.out, "mesh.ply"), whole)
            before = after


def write_hashes():
    with tempfile.TemporaryDirectory(prefix="weft algorithms ") as folder:
        measured = [measure(folder, instructions) for instructions in ("baseline", "avx2", "avx512")]
    if measured.count(measured[0]) != len(measured):
        sys.exit(f"kernels for baseline, avx2 and avx512 give different results: {measured}")
    write(HASHES, json.dumps(measured[0], indent=2) + "\n")


if __name__ == "__main__":
    if sys.argv[1:] == ["--write"]:
        write_hashes()
    else:
        unittest.main()
