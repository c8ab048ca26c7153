#!/usr/bin/env python3
"""Evaluates and compares long results with truth: time, memory, size of the pages, and how soon a browser shows them.

Usage: WEFT_BIN=build/dev/bin python3 tests/system/evaluation_load.py [--frames 100 300] [--side 316] [--keep DIR]

The results are made up as in export_load.py, with a truth that three cameras see. Prints a table; goals: a page opens within
2 s and takes less than 40 MB, memory does not grow with the frames. Needs 10 GB in the temporary folder.
"""

import argparse
import json
import os
import shutil
import subprocess
import tempfile
import time

import numpy as np
from export_load import make_faces, make_result
from foreign_readers import MODULES, why_no_node

NODE = np.dtype([("flags", "u1"), ("row", "<u2"), ("col", "<u2"), ("x", "<i4"), ("y", "<i4"), ("pitch", "<u2"), ("facing", "<u2"),
                 ("vertex", "<i4")])


def weft(*words):
    """Seconds, and the most memory that it took, MiB."""
    begin = time.monotonic()
    process = subprocess.Popen([os.path.join(os.environ["WEFT_BIN"], "weft"), "-q", *map(str, words)], stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode not in (0, 1):  # a bad verdict is none of our business
        raise AssertionError(f"weft {words}: exit status {process.returncode}")
    return time.monotonic() - begin, used.ru_maxrss / 1024


def write_plain_mesh(path, positions, faces):
    with open(path, "wb") as file:
        file.write((f"ply\nformat binary_little_endian 1.0\nelement vertex {len(positions)}\nproperty double x\nproperty double y\n"
                    f"property double z\nelement face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n").encode())
        positions.astype("<f8").tofile(file)
        table = np.zeros(len(faces), [("count", "u1"), ("vertices", "<i4", (3,))])
        table["count"], table["vertices"] = 3, faces
        table.tofile(file)


def make_take(folder, frames, side):
    """Template, board and the truth of the sheet in waves, without the noise of results."""
    row, col = np.divmod(np.arange(side * side), side)
    faces = make_faces(side, np.zeros((side * side, 2), np.float32))["vertices"]
    os.makedirs(f"{folder}/truth")
    weft("pattern", "generate", "--rows", side, "--cols", side, "--cell-mm", 2, "--out", f"{folder}/board")
    write_plain_mesh(f"{folder}/rest.ply", np.column_stack([2.0 * col, 2.0 * row, 0 * row]), faces)
    np.savetxt(f"{folder}/cells.txt", np.column_stack([row, col]), "%d")
    weft("template", "import", "--mesh", f"{folder}/rest.ply", "--cells", f"{folder}/cells.txt", "--board",
         f"{folder}/board/board.json", "--out", f"{folder}/template")
    nodes = np.zeros(side * side, NODE)
    nodes["flags"], nodes["row"], nodes["col"], nodes["vertex"] = 2 | 4, row, col, np.arange(side * side)
    nodes["x"], nodes["y"], nodes["pitch"] = 50000 * col, 50000 * row, 5 * 256
    for k in range(frames):
        os.makedirs(f"{folder}/truth/{k:04}")
        mesh = np.column_stack([2 * col + 20 * np.sin(row / 30 + k / 10), 2.0 * row + 500, 1500 + 60 * np.sin(col / 25 + k / 7)])
        write_plain_mesh(f"{folder}/truth/{k:04}/mesh.ply", mesh, faces)
        for camera in ("c00", "c01", "c02"):
            with open(f"{folder}/truth/{k:04}/{camera}.truth", "wb") as file:
                file.write(b"weftvt1\n" + np.uint32(len(nodes)).tobytes())
                nodes.tofile(file)


def name_inputs(result, take):
    with open(f"{result}/job.json", encoding="ascii") as file:
        job = json.load(file)
    job["spec"] = {"dump": take, "board": f"{take}/board/board.json", "garment": f"{take}/template"}
    with open(f"{result}/job.json", "w", encoding="ascii") as file:
        json.dump(job, file)


def opens_in_ms(page):
    """Empty where chromium or the npm packages are missing."""
    if why_no_node() or not shutil.which("chromium"):
        return ""
    script = os.path.join(os.path.dirname(os.path.abspath(__file__)), "readers", "open_page.mjs")
    return subprocess.run(["node", script, page], env={**os.environ, "WEFT_NODE_MODULES": MODULES}, capture_output=True, text=True,
                          check=True, timeout=300).stdout.strip()


def show(what, frames, seconds, peak_mib, page):
    size_mb = os.path.getsize(page) / 1e6
    print(f"{what:10} {frames:4} frames  {seconds:6.1f} s  peak {peak_mib:5.0f} MiB  page {size_mb:5.1f} MB, "
          f"opens in {opens_in_ms(page) or '?'} ms", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, nargs="+", default=[100, 300])
    parser.add_argument("--side", type=int, default=316, help="vertices along a side of the sheet")
    parser.add_argument("--keep", help="folder for the pages")
    options = parser.parse_args()
    for frames in options.frames:
        with tempfile.TemporaryDirectory(prefix="weft evaluation ") as folder:
            take, results = f"{folder}/take", [f"{folder}/a", f"{folder}/b"]
            make_take(take, frames, options.side)
            for seed, result in enumerate(results, 1):
                make_result(result, frames, options.side, seed)
                name_inputs(result, take)
            quick = ["--quick", "--fps", 50, "--out"]
            pages = {"evaluate": [results[0]], "compare": [results[0], "--against", results[1]]}
            for what, words in pages.items():
                seconds, peak_mib = weft("evaluate", *words, *quick, f"{folder}/{what}")
                show(what, frames, seconds, peak_mib, f"{folder}/{what}/report.html")
                if options.keep:
                    os.makedirs(options.keep, exist_ok=True)
                    shutil.copy(f"{folder}/{what}/report.html", f"{options.keep}/{what}-{frames}.html")


if __name__ == "__main__":
    main()
