"""Exported files as programs of others read them: npm packages (readers/package.json) and assimp."""

import json
import os
import shutil
import subprocess

import numpy as np
from export_readers import read_ply, xyz

HERE = os.path.dirname(os.path.abspath(__file__))
LONG_S = 600
# As docs/developers-guide.md installs them.
MODULES = os.environ.get("WEFT_NODE_MODULES",
                         os.path.join(os.path.dirname(os.path.dirname(HERE)), "build", "readers", "node_modules"))


def why_no_node():
    """Empty where the npm packages can be used."""
    if not shutil.which("node"):
        return "node is not installed"
    with open(os.path.join(HERE, "readers", "package.json"), encoding="utf-8") as file:
        wanted = json.load(file)["dependencies"]
    missing = [name for name in wanted if not os.path.isdir(os.path.join(MODULES, name))]
    return f"{MODULES} lacks {', '.join(missing)}; see docs/developers-guide.md" if missing else ""


def in_node(reader, path, folder):
    """What readers/read_export.mjs tells of a file; arrays of it by name."""
    os.makedirs(folder, exist_ok=True)
    done = subprocess.run(["node", "--max-old-space-size=12000", os.path.join(HERE, "readers", "read_export.mjs"), reader, path,
                           folder], env={**os.environ, "WEFT_NODE_MODULES": MODULES}, capture_output=True, text=True,
                          timeout=LONG_S, check=False)
    if done.returncode:
        raise AssertionError(f"{reader} {path}: {done.stderr[-2000:]}")
    told = json.loads(done.stdout)
    for name, array in told.pop("arrays", {}).items():
        told[name] = np.memmap(os.path.join(folder, f"{name}.{array['type']}"), "<" + array["type"], "r",
                               shape=tuple(array["shape"]))
    return told


def in_assimp(path, folder):
    """Positions and u v of the corners of the faces, [faces, 3, 3 and 2]."""
    os.makedirs(folder, exist_ok=True)
    out = os.path.join(folder, "assimp.ply")
    subprocess.run(["assimp", "export", path, out, "-fplyb"], stdout=subprocess.DEVNULL, timeout=LONG_S, check=True)
    tables = read_ply(out)
    faces = tables["face"]["vertex_index"]
    uv = np.column_stack([tables["vertex"]["s"], tables["vertex"]["t"]])[faces] if "s" in tables["vertex"].dtype.names else None
    return xyz(tables["vertex"])[faces], uv


def meshopt_allowance(displacements):
    """What --meshopt may round off displacements in metres, [frames, vertices, 3]: 2^-17 m, 2^-16 of longer ones."""
    return np.maximum(2.0**-17, 2.0**-16 * np.abs(displacements).max(axis=2, keepdims=True))
