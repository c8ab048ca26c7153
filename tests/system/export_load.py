#!/usr/bin/env python3
"""Exports a long sequence in every format: time, memory, and what other programs read of it.

Usage: WEFT_BIN=build/dev/bin python3 tests/system/export_load.py [--frames 100] [--side 316] [--no-blender] [--no-readers]

The result is made up: a sheet of side x side vertices in waves, with noise and a seam. Prints a table. The exit status is 1
when an export fails, or positions in Blender or in another reader (foreign_readers.py) differ by more than 1e-6 of the
extent; those of a compressed glb, by more than its rounding. Needs 10 GB in the temporary folder.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time

import numpy as np
from export_readers import meshes_of, xyz
from foreign_readers import in_assimp, in_node, meshopt_allowance, why_no_node

# By folder: the arguments of the export.
EXPORTS = {"ply": ["ply"], "obj": ["obj"], "glb": ["glb"], "meshopt": ["glb", "--meshopt"], "mdd": ["mdd"], "pc2": ["pc2"],
           "usda": ["usda"], "usda-points": ["usda", "--attributes", "none"], "npz": ["npz"],
           "coarse": ["glb", "--max-vertices", "5000"], "maps": ["png", "--max-vertices", "5000", "--normal-map", "1024"]}
IN_BLENDER = ["ply", "obj", "glb", "mdd", "pc2"]
IMPORT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "import_in_blender.py")
FPS = 50  # of the scene in IMPORT
Y_UP = np.diag([1.0, -1.0, -1.0])
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


def make_result(folder, frames, side, seed=1):
    os.makedirs(folder)
    with open(f"{folder}/job.json", "w", encoding="ascii") as file:
        json.dump({"id": "waves", "state": "JOB_STATE_DONE"}, file)
    row, col = np.divmod(np.arange(side * side), side)
    uv = np.stack([col / side, 1 - row / side], 1).astype(np.float32)
    faces, random = make_faces(side, uv), np.random.default_rng(seed)
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


def export(folder, name):
    """Whether it passed, its seconds, its size in MB, and the most memory that it took, MiB."""
    begin, out = time.monotonic(), os.path.join(folder, name)
    process = subprocess.Popen([os.path.join(os.environ["WEFT_BIN"], "weft"), "-q", "export", os.path.join(folder, "result"),
                                "--format", *EXPORTS[name], "--fps", str(FPS), "--out", out], stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    seconds = time.monotonic() - begin
    size = sum(os.path.getsize(os.path.join(out, name)) for name in os.listdir(out)) if os.path.isdir(out) else 0
    return process.returncode == 0, seconds, size / 1e6, used.ru_maxrss / 1024


class Truth:
    """Positions of all frames, metres."""

    def __init__(self, folder):
        self.names = sorted(name for name in os.listdir(f"{folder}/result") if name.isdigit())
        meshes = meshes_of(f"{folder}/result", self.names)
        self.world_m = np.array([1e-3 * xyz(mesh["vertex"]) for mesh in meshes])
        self.faces = meshes[0]["face"]["vertex_indices"]
        self.extent = np.ptp(self.world_m, axis=(0, 1)).max()

    def share_off(self, shown, rotation):
        """Largest deviation as a share of the extent; copies of vertices come last."""
        return max(np.abs(a[:self.world_m.shape[1]] - b @ rotation.T).max() for a, b in zip(shown, self.world_m)) / self.extent


def show_in_blender(folder, truth):
    """(reader, share of the extent, allowed)"""
    subprocess.run(["blender", "--background", "--factory-startup", "--python-exit-code", "1", "--python", IMPORT, "--", folder,
                    *truth.names], check=True, stdout=subprocess.DEVNULL)
    for form in IN_BLENDER:
        yield f"{form} in Blender", truth.share_off(np.load(f"{folder}/{form}.npy", mmap_mode="r"), Z_UP), 1e-6


def show_in_node(folder, truth):
    for name in ("glb", "meshopt"):
        told = in_node("validate", f"{folder}/{name}/garment.glb", f"{folder}/told")
        yield f"{name}: {told['errors']} errors, {told['warnings']} warnings", float(told["errors"] + told["warnings"]), 0.5
        read = in_node("gltf", f"{folder}/{name}/garment.glb", f"{folder}/told")
        rounded = 0 if name == "glb" else meshopt_allowance(truth.world_m - truth.world_m[0]).max() / truth.extent
        yield f"{name} in three.js", truth.share_off(read["positions"], Y_UP), 1e-6 + rounded
    read = in_node("usda", f"{folder}/usda-points/garment.usda", f"{folder}/told")
    yield "usda in three.js", truth.share_off(read["points"].reshape(truth.world_m.shape), Y_UP), 1e-6
    read = in_node("tinyusdz", f"{folder}/usda-points/garment.usda", f"{folder}/told")
    yield "usda in TinyUSDZ, frame 0", truth.share_off(read["points"][np.newaxis], Y_UP), 1e-6


def show_in_assimp(folder, truth):
    for form, rotation in (("ply", Z_UP), ("obj", Y_UP), ("glb", Y_UP)):
        name = f"{truth.names[0]}.{form}" if form != "glb" else "garment.glb"
        read, _ = in_assimp(f"{folder}/{form}/{name}", f"{folder}/told")
        expected = truth.world_m[0][truth.faces] @ rotation.T
        yield f"{form} in assimp, frame 0", np.abs(read - expected).max() / truth.extent, 1e-6


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=100)
    parser.add_argument("--side", type=int, default=316, help="vertices along a side of the sheet")
    parser.add_argument("--no-blender", action="store_true")
    parser.add_argument("--no-readers", action="store_true", help="neither npm's readers nor assimp")
    options = parser.parse_args()
    good = True
    with tempfile.TemporaryDirectory(prefix="weft export ") as folder:
        make_result(f"{folder}/result", options.frames, options.side)
        for name in EXPORTS:
            passed, seconds, size_mb, peak_mib = export(folder, name)
            print(f"{name:11} {seconds:6.1f} s  {size_mb:7.0f} MB  peak {peak_mib:4.0f} MiB{'' if passed else '  FAILED'}", flush=True)
            good &= passed
        shows = []
        if shutil.which("blender") and not options.no_blender:
            shows.append(show_in_blender)
        if not options.no_readers and not why_no_node():
            shows.append(show_in_node)
        if not options.no_readers and shutil.which("assimp"):
            shows.append(show_in_assimp)
        truth = Truth(folder) if good and shows else None
        for show in shows if good else []:
            for reader, share, allowed in show(folder, truth):
                print(f"{reader:29} {share:.1e} (at most {allowed:.1e}){'' if share < allowed else '  FAILED'}", flush=True)
                good &= bool(share < allowed)
    print(f"{len(EXPORTS)} exports, {options.frames} frames of {options.side ** 2} vertices: {'passed' if good else 'FAILED'}")
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
