#!/usr/bin/env python3
"""Reads the meshes of a result with nothing but Python's own library.

Usage: read_mesh.py RESULT

Prints a line per frame: how far the cloth moved since the frame before, and how much of it was seen. RESULT is the folder
that `weft register` wrote. As a module: read_ply(path) gives {element: {property: [values]}}, with a tuple for each value
of a list property; numpy.column_stack([v["x"], v["y"], v["z"]]) makes an array of v = read_ply(path)["vertex"].
"""

import math
import os
import struct
import sys

TYPES = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I", "float": "f", "double": "d"}


def read_header(file):
    """[(element, rows, [(property, its type, None or the type of its count)])]"""
    elements = []
    if file.readline() != b"ply\n" or file.readline() != b"format binary_little_endian 1.0\n":
        raise ValueError(f"{file.name}: not a PLY file as Weft writes it")
    for line in iter(file.readline, b"end_header\n"):
        words = line.decode().split()
        if not words:
            raise ValueError(f"{file.name}: the header has no end")
        if words[0] == "element":
            elements.append((words[1], int(words[2]), []))
        elif words[:2] == ["property", "list"]:
            elements[-1][2].append((words[4], TYPES[words[3]], TYPES[words[2]]))
        elif words[0] == "property":
            elements[-1][2].append((words[2], TYPES[words[1]], None))
    return elements


def read_ply(path):
    with open(path, "rb") as file:
        elements = read_header(file)
        data = file.read()
    ply, at = {}, 0
    for element, rows, properties in elements:
        if all(count is None for _, _, count in properties):
            row = struct.Struct("<" + "".join(kind for _, kind, _ in properties))
            columns = list(zip(*row.iter_unpack(data[at:at + rows * row.size]))) or [()] * len(properties)
            at += rows * row.size
        else:
            columns = [[] for _ in properties]
            for _ in range(rows):
                for column, (_, kind, count_kind) in zip(columns, properties):
                    length, is_list = 1, count_kind is not None
                    if is_list:
                        length, = struct.unpack_from("<" + count_kind, data, at)
                        at += struct.calcsize(count_kind)
                    values = struct.unpack_from(f"<{length}{kind}", data, at)
                    at += struct.calcsize(f"<{length}{kind}")
                    column.append(values if is_list else values[0])
        ply[element] = {name: list(column) for (name, _, _), column in zip(properties, columns)}
    return ply


def frames(result):
    """The frames of a result that have a mesh, in their order."""
    names = [name for name in os.listdir(result) if os.path.exists(os.path.join(result, name, "mesh.ply"))]
    return sorted(names, key=lambda name: (len(name), name))


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    before = None
    for name in frames(sys.argv[1]):
        vertex = read_ply(os.path.join(sys.argv[1], name, "mesh.ply"))["vertex"]
        places_mm = list(zip(vertex["x"], vertex["y"], vertex["z"]))
        seen = sum(state in (1, 2) for state in vertex["state"]) / len(places_mm)
        moved_mm = sum(map(math.dist, places_mm, before)) / len(places_mm) if before else 0
        print(f"{name}: {len(places_mm)} vertices, {seen:.1%} seen, moved {moved_mm:.2f} mm in the mean")
        before = places_mm


if __name__ == "__main__":
    main()
