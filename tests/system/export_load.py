#!/usr/bin/env python3
"""Exports a long sequence in every format: time, memory, and what Blender shows of it.

Usage: WEFT_BIN=build/dev/bin python3 tests/system/export_load.py [--frames 100] [--side 316] [--no-blender]

The result is made up: a sheet of side x side vertices in waves, with noise and a seam. Prints a table. The exit status is 1
when an export fails, or positions in Blender differ by more than 1e-6 of the extent. Needs 10 GB in the temporary folder.
"""

import argparse
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time

import numpy as np
from export_readers import meshes_of, xyz

FORMATS = ["ply", "obj", "glb", "mdd", "pc2", "usda", "npz"]
IN_BLENDER = ["ply", "obj", "glb", "mdd", "pc2"]
IMPORT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "import_in_blender.py")
FPS = 50  # of the scene in IMPORT
Z_UP = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
VERTEX = [("float", "x"), ("float", "y"), ("float", "z"), ("uchar", "state"), ("float", "sigma_mm"), ("int", "views"),
          ("float", "s"), ("float", "t")]
NUMPY = {"float": "<f4", "uchar": "u1", "int": "<i4"}


def make_faces(side, uv):
    """Two triangles a cell; those of the last column lie elsewhere on the print."""
    corner = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    faces = np.concatenate([np.stack([corner, corner + 1, corner + side], 1),
                            np.stack([corner + 1, corner + side + 1, corner + side], 1)]).astype(np.int32)
    table = np.zeros(len(faces), [("count", "u1"), ("vertices", "<i4", (3,)), ("uv_count", "u1"), ("uv", "<f4", (6,))])
    table["count"], table["vertices"], table["uv_count"] = 3, faces, 6
    table["uv"] = uv[faces].reshape(-1, 6)
    table["uv"][(faces % side).max(axis=1) == side - 1] *= 0.5
    return table


def make_result(folder, frames, side):
    os.makedirs(folder)
    with open(f"{folder}/job.json", "w", encoding="ascii") as file:
        json.dump({"id": "waves", "state": "JOB_STATE_DONE"}, file)
    row, col = np.divmod(np.arange(side * side), side)
    uv = np.stack([col / side, 1 - row / side], 1).astype(np.float32)
    faces, random = make_faces(side, uv), np.random.default_rng(1)
    header = (f"ply\nformat binary_little_endian 1.0\nelement vertex {side * side}\n" +
              "".join(f"property {kind} {name}\n" for kind, name in VERTEX) + f"element face {len(faces)}\n"
              "property list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n")
    for k in range(frames):
        vertex = np.zeros(side * side, [(name, NUMPY[kind]) for kind, name in VERTEX])
        vertex["x"], vertex["y"] = 2 * col + 20 * np.sin(row / 30 + k / 10), 2 * row + 500
        vertex["z"] = 1500 + 60 * np.sin(col / 25 + k / 7) + random.normal(0, 0.05, side * side)
        vertex["state"], vertex["views"] = random.integers(0, 3, side * side), random.integers(0, 12, side * side)
        vertex["sigma_mm"], (vertex["s"], vertex["t"]) = random.uniform(0.05, 0.6, side * side), uv.T
        os.makedirs(f"{folder}/{k:04}")
        with open(f"{folder}/{k:04}/mesh.ply", "wb") as file:
            file.write(header.encode())
            vertex.tofile(file)
            faces.tofile(file)
        with open(f"{folder}/{k:04}/report.json", "w", encoding="ascii") as file:
            json.dump({"frame": f"{k:04}", "state": "FRAME_STATE_DONE", "mesh": {"coverage": 0.66}}, file)


def export(folder, form):
    """Whether it passed, its seconds, and its size in MB."""
    begin, out = time.monotonic(), os.path.join(folder, form)
    done = subprocess.run([os.path.join(os.environ["WEFT_BIN"], "weft"), "-q", "export", os.path.join(folder, "result"),
                           "--format", form, "--fps", str(FPS), "--out", out], check=False, stdout=subprocess.DEVNULL)
    seconds = time.monotonic() - begin
    size = sum(os.path.getsize(os.path.join(out, name)) for name in os.listdir(out)) if os.path.isdir(out) else 0
    return done.returncode == 0, seconds, size / 1e6


def show_in_blender(folder):
    """Largest deviation of each format, as a share of the extent."""
    names = sorted(name for name in os.listdir(f"{folder}/result") if name.isdigit())
    subprocess.run(["blender", "--background", "--factory-startup", "--python-exit-code", "1", "--python", IMPORT, "--", folder,
                    *names], check=True, stdout=subprocess.DEVNULL)
    expected = np.array([xyz(mesh["vertex"]) for mesh in meshes_of(f"{folder}/result", names)]) * 1e-3 @ Z_UP.T
    extent = np.ptp(expected, axis=(0, 1)).max()
    deviations = {}
    for form in IN_BLENDER:
        shown = np.load(f"{folder}/{form}.npy", mmap_mode="r")
        deviations[form] = max(np.abs(a[:expected.shape[1]] - b).max() for a, b in zip(shown, expected)) / extent
    return deviations


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=100)
    parser.add_argument("--side", type=int, default=316, help="vertices along a side of the sheet")
    parser.add_argument("--no-blender", action="store_true")
    options = parser.parse_args()
    good = True
    with tempfile.TemporaryDirectory(prefix="weft export ") as folder:
        make_result(f"{folder}/result", options.frames, options.side)
        for form in FORMATS:
            passed, seconds, size_mb = export(folder, form)
            peak_mib = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
            print(f"{form:5} {seconds:6.1f} s  {size_mb:7.0f} MB  peak so far {peak_mib:4.0f} MiB{'' if passed else '  FAILED'}",
                  flush=True)
            good &= passed
        if shutil.which("blender") and not options.no_blender and good:
            for form, share in show_in_blender(folder).items():
                print(f"{form:5} in Blender within {share:.1e} of the extent{'' if share < 1e-6 else '  FAILED'}")
                good &= bool(share < 1e-6)
    print(f"{len(FORMATS)} formats, {options.frames} frames of {options.side ** 2} vertices: {'passed' if good else 'FAILED'}")
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
