"""Clouds: the triangulated nodes of the board at one frame."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Optional

import numpy as np

from weft.errors import FormatError
from weft.formats.columns import Array, Table, read_bytes
from weft.formats.pcd import parse_pcd
from weft.formats.ply import parse_ply

_MAX_CELL = 1 << 20
_PLACES = {"xx": (0, 0), "xy": (0, 1), "xz": (0, 2), "yy": (1, 1), "yz": (1, 2), "zz": (2, 2)}


@dataclass(frozen=True)
class Rays:
    """M sights of nodes without a point: the lines on which these nodes lie."""

    origins_mm: Array  # [M, 3], centres of the cameras
    directions: Array  # [M, 3], of length 1
    board_row: Array  # [M], int32
    board_col: Array  # [M], int32
    is_corner: Array  # [M], bool
    sigma_rad: Array  # [M], standard deviation per axis across the ray


@dataclass(frozen=True)
class Cloud:
    """N points. What a file does not have is None; clouds of a job have all. rays: where there are any, in a .ply."""

    positions_mm: Array  # [N, 3]
    board_row: Array  # [N], int32
    board_col: Array  # [N], int32
    is_corner: Array  # [N], bool: a corner between cells, which is the upper left one of its cell; otherwise a centre
    views: Optional[Array] = None  # [N], int32
    sigma_mm: Optional[Array] = None  # [N]
    fold_sigma_mm: Optional[Array] = None  # [N]: the part of sigma_mm that folds cause and neighbours share
    covariance_mm2: Optional[Array] = None  # [N, 3, 3]
    fold_covariance_mm2: Optional[Array] = None  # [N, 3, 3]
    rays: Optional[Rays] = None

    @staticmethod
    def from_ply(data: bytes, file: str = "cloud.ply") -> Cloud:
        elements = parse_ply(data, file)
        if "vertex" not in elements:
            raise FormatError(file, "element vertex", "is missing")
        return _cloud(elements["vertex"], _rays(elements["ray"]) if "ray" in elements else None)

    @staticmethod
    def from_pcd(data: bytes, file: str = "cloud.pcd") -> Cloud:
        return _cloud(parse_pcd(data, file))


def _matrices(table: Table, prefix: str) -> Optional[Array]:
    if f"{prefix}_xx_mm2" not in table.columns:
        return None
    matrices = np.zeros((table.rows, 3, 3))
    for name, (row, col) in _PLACES.items():
        matrices[:, row, col] = matrices[:, col, row] = table.finite(f"{prefix}_{name}_mm2")
    return matrices


def _rays(table: Table) -> Rays:
    return Rays(table.positions(), np.stack([table.finite(axis) for axis in ("dx", "dy", "dz")], axis=1),
                table.whole("board_row", 0, _MAX_CELL, np.int32), table.whole("board_col", 0, _MAX_CELL, np.int32),
                table.whole("kind", 0, 1, bool), table.finite("sigma_rad"))


def _cloud(table: Table, rays: Optional[Rays] = None) -> Cloud:
    kind = table.whole("kind", 0, 1, bool) if "kind" in table.columns else np.zeros(table.rows, bool)
    views = table.whole("views", 0, _MAX_CELL, np.int32) if "views" in table.columns else None
    return Cloud(table.positions(), table.whole("board_row", 0, _MAX_CELL, np.int32),
                 table.whole("board_col", 0, _MAX_CELL, np.int32), kind, views, table.optional("sigma_mm"),
                 table.optional("fold_sigma_mm"), _matrices(table, "cov"), _matrices(table, "fold_cov"), rays)


def read_cloud(path: str | os.PathLike[str]) -> Cloud:
    """A .ply or .pcd. NotFound, PermissionDenied; FormatError names file and field."""
    name = os.fspath(path)
    return Cloud.from_pcd(read_bytes(name), name) if name.lower().endswith(".pcd") else Cloud.from_ply(read_bytes(name), name)
