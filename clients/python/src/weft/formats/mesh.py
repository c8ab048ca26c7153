"""Triangle meshes."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Optional

import numpy as np

from weft.errors import FormatError, NotFound
from weft.formats.columns import Array, Table, read_bytes
from weft.formats.messages import read_export
from weft.formats.ply import parse_ply


class VertexState(IntEnum):
    INFERRED = 0
    OBSERVED = 1  # by three or more cameras
    TWO_VIEW = 2
    BRIDGED = 3
    DRIVEN = 4  # by what an avatar learnt, and at most one camera


EXPORTED = b"written by weft export"  # in the first lines of such files
_HEAD_BYTES = 256


@dataclass(frozen=True)
class ExportPlace:
    """Where an export puts what is in the rig's world: what undoes it."""

    export_from_world: Array  # [4, 4]

    def __post_init__(self) -> None:
        matrix = self.export_from_world
        if matrix.shape != (4, 4) or not np.isfinite(matrix).all() or not self.unit_per_mm > 0:
            raise ValueError("is no transform of 16 finite numbers that keeps shapes")

    @property
    def unit_per_mm(self) -> float:
        return float(np.cbrt(abs(np.linalg.det(self.export_from_world[:3, :3]))))

    def mesh_mm(self, mesh: Mesh, sigma: Optional[Array]) -> Mesh:
        """The mesh in the rig's world, in mm; `sigma` is in the export's unit."""
        moved = mesh.vertices_mm.astype(np.float64) - self.export_from_world[:3, 3]
        vertices_mm = np.linalg.solve(self.export_from_world[:3, :3], moved.T).T
        return replace(mesh, vertices_mm=vertices_mm.astype(mesh.vertices_mm.dtype),
                       sigma_mm=None if sigma is None else (sigma / self.unit_per_mm).astype(sigma.dtype))


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
    def from_ply(data: bytes, file: str = "mesh.ply", place: Optional[ExportPlace] = None) -> Mesh:
        """`place`: that of the export which the file is of; FormatError without it."""
        _check_place(data, file, place)
        elements = parse_ply(data, file)
        vertex = _element(elements, "vertex", file)
        positions = vertex.positions()
        texture = [vertex.optional(name) for name in "st"]
        mesh = Mesh(positions, _faces(_element(elements, "face", file), len(positions)),
                    vertex.whole("state", 0, max(VertexState), np.uint8) if "state" in vertex.columns else None,
                    vertex.optional("sigma_mm"),
                    vertex.whole("views", 0, 1_000_000, np.int32) if "views" in vertex.columns else None,
                    None if texture[0] is None or texture[1] is None else np.stack([texture[0], texture[1]], axis=1))
        return mesh if place is None else place.mesh_mm(mesh, vertex.optional("sigma"))

    @staticmethod
    def from_obj(data: bytes, file: str = "mesh.obj", place: Optional[ExportPlace] = None) -> Mesh:
        """Vertices and faces of an OBJ file, whose polygons are cut into triangles. Texture only where each vertex has one. `place`
        as in from_ply."""
        _check_place(data, file, place)
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
                    for vertex, at in corners:
                        texture_of[vertex] = at if texture_of.get(vertex, at) == at else -1
            except ValueError as error:
                raise FormatError(file, f"line {number}, {words[0]}", str(error)) from error
        positions = np.array(vertices, np.float64).reshape(-1, 3)
        if not np.isfinite(positions).all():
            raise FormatError(file, "v", "holds what is no finite number")
        places = [texture_of.get(vertex, -1) for vertex in range(len(vertices))]
        texture = np.array(coordinates)[places] if places and min(places) >= 0 else None
        mesh = Mesh(positions, np.array(faces, np.int32).reshape(-1, 3), texture=texture)
        return mesh if place is None else place.mesh_mm(mesh, None)


def _check_place(data: bytes, file: str, place: Optional[ExportPlace]) -> None:
    if place is None and EXPORTED in data[:_HEAD_BYTES]:
        raise FormatError(file, "header", "is of `weft export`, whose units and axes stand in export.json; use read_mesh")


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


def _place_of(file: str) -> ExportPlace:
    """By export.json beside an exported file."""
    beside = os.path.join(os.path.dirname(file), "export.json")
    try:
        export = read_export(beside)
    except NotFound as error:
        raise FormatError(file, "header", f"is of `weft export`; {beside} is missing, which has its units and axes") from error
    try:
        return ExportPlace(np.array(export.transform.export_from_world, np.float64).reshape(4, 4))
    except ValueError as error:
        raise FormatError(beside, "export_from_world", "is no transform of 16 finite numbers that keeps shapes") from error


def read_mesh(path: str | os.PathLike[str]) -> Mesh:
    """A .ply or .obj. Of an export: in mm and the rig's world again, by the export.json beside it. NotFound, PermissionDenied;
    FormatError names file and field."""
    name = os.fspath(path)
    data = read_bytes(name)
    place = _place_of(name) if EXPORTED in data[:_HEAD_BYTES] else None
    return Mesh.from_obj(data, name, place) if name.lower().endswith(".obj") else Mesh.from_ply(data, name, place)
