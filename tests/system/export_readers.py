"""Readers of exported files that share nothing with the program that wrote them: positions as [frames, vertices, 3]."""

import json
import os
import re
import struct

import numpy as np

NUMBERS = {"char": "i1", "uchar": "u1", "int": "<i4", "float": "<f4", "double": "<f8"}
COMPONENTS = {5121: "u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}


def read_ply(path):
    """{element: structured array}; lists are of triangles, with u v of their corners."""
    with open(path, "rb") as file:
        elements = []
        for line in iter(file.readline, b"end_header\n"):
            words = line.decode().split()
            if words[0] == "element":
                elements.append((words[1], int(words[2]), []))
            elif words[:2] == ["property", "list"]:
                elements[-1][2].extend([(words[4] + "_count", NUMBERS[words[2]]),
                                        (words[4], NUMBERS[words[3]], (6 if words[4] == "texcoord" else 3,))])
            elif words[0] == "property":
                elements[-1][2].append((words[2], NUMBERS[words[1]]))
        tables = {}
        for name, rows, fields in elements:
            kind = np.dtype(fields)
            tables[name] = np.frombuffer(file.read(rows * kind.itemsize), dtype=kind)
    return tables


def xyz(vertex, names="xyz"):
    return np.column_stack([vertex[name].astype(np.float64) for name in names])


def read_obj(path):
    """Positions, faces (from 0) and u v of the faces' corners, None without."""
    positions, uv, faces, corners = [], [], [], []
    with open(path, encoding="utf-8") as file:
        for line in file:
            word, *rest = line.split()
            if word == "v":
                positions.append([float(x) for x in rest])
            elif word == "vt":
                uv.append([float(x) for x in rest])
            elif word == "f":
                parts = [corner.split("/") for corner in rest]
                faces.append([int(part[0]) - 1 for part in parts])
                corners.append([int(part[1]) - 1 for part in parts if len(part) > 1])
    return np.array(positions), np.array(faces), np.array(uv)[np.array(corners)] if uv else None


class Glb:
    """A glTF file; `frames()` evaluates the animation at its keys."""

    def __init__(self, path):
        with open(path, "rb") as file:
            data = file.read()
        magic, version, length, json_bytes, kind = struct.unpack_from("<4sIII4s", data)
        if (magic, version, length, kind) != (b"glTF", 2, len(data), b"JSON"):
            raise AssertionError(f"{path}: {magic} {version} {length} {kind}")
        self.json = json.loads(data[20:20 + json_bytes])
        self.binary = data[20 + json_bytes + 8:]
        self.primitive = self.json["meshes"][0]["primitives"][0]

    def array(self, accessor):
        accessor = self.json["accessors"][accessor]
        view = self.json["bufferViews"][accessor["bufferView"]]
        width = WIDTHS[accessor["type"]]
        values = np.frombuffer(self.binary, COMPONENTS[accessor["componentType"]], accessor["count"] * width,
                               view.get("byteOffset", 0) + accessor.get("byteOffset", 0))
        return values.reshape(-1, width) if width > 1 else values

    def attribute(self, name):
        return self.array(self.primitive["attributes"][name])

    def times_s(self):
        return self.array(self.json["animations"][0]["samplers"][0]["input"])

    def frames(self):
        base = self.attribute("POSITION").astype(np.float64)
        targets = [self.array(target["POSITION"]).astype(np.float64) for target in self.primitive.get("targets", [])]
        if not targets:
            return base[np.newaxis]
        weights = self.array(self.json["animations"][0]["samplers"][0]["output"]).reshape(-1, len(targets))
        return np.array([base + sum(w * target for w, target in zip(key, targets)) for key in weights])


def read_mdd(path):
    """Times in seconds and positions."""
    with open(path, "rb") as file:
        frames, points = struct.unpack(">ii", file.read(8))
        times = np.frombuffer(file.read(4 * frames), ">f4")
        values = np.frombuffer(file.read(), ">f4")
    return times, values.reshape(frames, points, 3).astype(np.float64)


def read_pc2(path):
    with open(path, "rb") as file:
        magic, version, points, first, rate, samples = struct.unpack("<12siiffi", file.read(32))
        values = np.frombuffer(file.read(), "<f4")
    if (magic, version, first, rate) != (b"POINTCACHE2\0", 1, 0, 1):
        raise AssertionError(f"{path}: {magic} {version} {first} {rate}")
    return values.reshape(samples, points, 3).astype(np.float64)


def numbers(text):
    return np.array([float(x) for x in re.findall(r"-?[\d.]+(?:e[+-]?\d+)?", text)])


class Usda:
    """The text of a USD file, attribute by attribute."""

    def __init__(self, path):
        with open(path, encoding="utf-8") as file:
            self.text = file.read()

    def setting(self, name):
        return re.search(rf"^    {name} = \"?([^\"\n]+)", self.text, re.MULTILINE).group(1)

    def values(self, name):
        return numbers(re.search(rf" {name} = (\[.*\])", self.text).group(1))

    def samples(self, name, width):
        """{time code: [vertices, width]}"""
        block = re.search(rf" {name}\.timeSamples = {{\n(.*?)\n    }}", self.text, re.DOTALL).group(1)
        return {float(time): numbers(values).reshape(-1, width)
                for time, values in re.findall(r"^ *([\d.]+): (\[.*\]),$", block, re.MULTILINE)}


def meshes_of(result, frames):
    """mesh.ply of each frame."""
    return [read_ply(os.path.join(result, frame, "mesh.ply")) for frame in frames]
