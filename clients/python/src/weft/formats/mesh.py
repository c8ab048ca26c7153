"""Triangle meshes."""

from __future__ import annotations

import os
from dataclasses import dataclass
from enum import IntEnum
from typing import Optional

import numpy as np

from weft.errors import FormatError
from weft.formats.columns import Array, Table, read_bytes
from weft.formats.ply import parse_ply


class VertexState(IntEnum):
    INFERRED = 0
    OBSERVED = 1  # by three or more cameras
    TWO_VIEW = 2
    BRIDGED = 3
    DRIVEN = 4  # by what an avatar learnt, and at most one camera


@dataclass(frozen=True)
class Mesh:
    """V vertices and F faces. What a file does not have is None; meshes of a job have all but, perhaps, the texture."""

    vertices_mm: Array  # [V, 3]
    faces: Array  # [F, 3], int32
    state: Optional[Array] = None  # [V], uint8: VertexState
    sigma_mm: Optional[Array] = None  # [V]: standard deviation of an observed vertex
    views: Optional[Array] = None  # [V], int32: cameras that measured the vertex
    texture: Optional[Array] = None  # [V, 2]: s t, from 0 to 1, t upwards

    @property
    def observed(self) -> Array:
        """[V], bool: measured by three or more cameras."""
        if self.state is None:
            raise ValueError("state: this mesh has none; it is no result of a registration")
        return np.asarray(self.state == VertexState.OBSERVED)

    @staticmethod
    def from_ply(data: bytes, file: str = "mesh.ply") -> Mesh:
        elements = parse_ply(data, file)
        vertex = _element(elements, "vertex", file)
        positions = vertex.positions()
        texture = [vertex.optional(name) for name in "st"]
        return Mesh(positions, _faces(_element(elements, "face", file), len(positions)),
                    vertex.whole("state", 0, max(VertexState), np.uint8) if "state" in vertex.columns else None,
                    vertex.optional("sigma_mm"),
                    vertex.whole("views", 0, 1_000_000, np.int32) if "views" in vertex.columns else None,
                    None if texture[0] is None or texture[1] is None else np.stack([texture[0], texture[1]], axis=1))

    @staticmethod
    def from_obj(data: bytes, file: str = "mesh.obj") -> Mesh:
        """Vertices and faces of an OBJ file, whose polygons are cut into triangles. Texture only where each vertex has one."""
        vertices, coordinates, faces = [], [], []
        texture_of: dict[int, int] = {}
        for number, line in enumerate(data.decode("utf-8", "replace").replace("\\\n", " ").splitlines(), 1):
            words = line.split("#", 1)[0].split()
            if not words:
                continue
            try:
                if words[0] == "v":
                    vertices.append([float(word) for word in _at_least(words[1:], 3)[:3]])
                elif words[0] == "vt":
                    coordinates.append([float(word) for word in _at_least(words[1:], 2)[:2]])
                elif words[0] == "f":
                    corners = [_corner(word, len(vertices), len(coordinates)) for word in _at_least(words[1:], 3)]
                    faces += [[corners[0][0], a[0], b[0]] for a, b in zip(corners[1:], corners[2:], strict=False)]
                    for vertex, place in corners:
                        texture_of[vertex] = place if texture_of.get(vertex, place) == place else -1
            except ValueError as error:
                raise FormatError(file, f"line {number}, {words[0]}", str(error)) from error
        positions = np.array(vertices, np.float64).reshape(-1, 3)
        if not np.isfinite(positions).all():
            raise FormatError(file, "v", "holds what is no finite number")
        places = [texture_of.get(vertex, -1) for vertex in range(len(vertices))]
        texture = np.array(coordinates)[places] if places and min(places) >= 0 else None
        return Mesh(positions, np.array(faces, np.int32).reshape(-1, 3), texture=texture)


def _at_least(words: list[str], count: int) -> list[str]:
    if len(words) < count:
        raise ValueError(f"has {len(words)} values, at least {count} are expected")
    return words


def _corner(word: str, vertices: int, coordinates: int) -> tuple[int, int]:
    """Vertex and texture coordinate (-1: none) of a face's corner, counted from 0."""
    def counted(text: str, count: int, what: str) -> int:
        index = int(text)
        if not 0 < abs(index) <= count:
            raise ValueError(f"names {what} {index}, the file has {count} so far")
        return index - 1 if index > 0 else count + index
    parts = word.split("/")
    return (counted(parts[0], vertices, "vertex"),
            counted(parts[1], coordinates, "texture coordinate") if len(parts) > 1 and parts[1] else -1)


def _element(elements: dict[str, Table], name: str, file: str) -> Table:
    if name not in elements:
        raise FormatError(file, f"element {name}", "is missing")
    return elements[name]


def _faces(face: Table, vertices: int) -> Array:
    name = "vertex_indices" if "vertex_indices" in face.columns else "vertex_index"
    indices = face.columns.get(name)
    if indices is None:
        raise face.error("vertex_indices", "is missing")
    if face.rows == 0:
        return np.zeros((0, 3), np.int32)
    if not isinstance(indices, np.ndarray) or indices.ndim != 2 or indices.shape[1] != 3:
        raise face.error(name, "has faces that are no triangles; triangulate the mesh first")
    bad = np.argwhere((indices < 0) | (indices >= vertices))
    if bad.size:
        raise face.error(name, f"names vertex {indices[tuple(bad[0])]} in row {bad[0][0]}, the file has {vertices} vertices")
    return indices.astype(np.int32)


def read_mesh(path: str | os.PathLike[str]) -> Mesh:
    """A .ply or .obj. NotFound, PermissionDenied; FormatError names file and field."""
    name = os.fspath(path)
    return Mesh.from_obj(read_bytes(name), name) if name.lower().endswith(".obj") else Mesh.from_ply(read_bytes(name), name)
