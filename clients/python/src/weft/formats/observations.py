"""Observations: nodes of the board at positions in the cameras' images."""

from __future__ import annotations

import csv
import io
import os
from dataclasses import dataclass
from typing import Optional

import numpy as np

from weft.errors import FormatError
from weft.formats.columns import Array, Table, read_bytes

_NUMBERS = ("x_px", "y_px", "board_row", "board_col", "confidence")
_KINDS = {"center": False, "corner": True}
_MAX_CELL = 1 << 20


@dataclass(frozen=True)
class Observations:
    """N observations of all cameras of a frame."""

    cameras: tuple[str, ...]
    camera: Array  # [N], int32: which of `cameras`
    positions_px: Array  # [N, 2]; (0, 0) is the centre of the top-left pixel
    board_row: Array  # [N], int32
    board_col: Array  # [N], int32
    is_corner: Array  # [N], bool; otherwise the centre of a cell
    confidence: Array  # [N], 0 to 1
    sigma_px: Optional[Array] = None  # [N], of x and of y; None in files up to version 0.1.2

    def of_camera(self, camera: str) -> Array:
        """[N], bool: which observations are of this camera."""
        if camera not in self.cameras:
            raise KeyError(camera)
        return np.asarray(self.camera == self.cameras.index(camera))

    @staticmethod
    def from_csv(data: bytes, file: str = "observations.csv") -> Observations:
        try:
            rows = list(csv.reader(io.StringIO(data.decode("utf-8"), newline=""), strict=True))
        except (UnicodeDecodeError, csv.Error) as error:
            raise FormatError(file, "", f"is no CSV text ({error})") from error
        head = rows.pop(0) if rows else []
        for name in ("image", "kind", *_NUMBERS):
            if head.count(name) != 1:
                raise FormatError(file, f"column {name}", "is missing" if name not in head else "occurs twice")
        for line, row in enumerate(rows, 2):
            if len(row) != len(head):
                raise FormatError(file, f"line {line}", f"has {len(row)} values, the heading {len(head)}")
        columns = dict(zip(head, zip(*rows, strict=True) if rows else ((),) * len(head), strict=True))
        names = [*_NUMBERS, *(["sigma_px"] if "sigma_px" in head else [])]
        numbers = Table({name: _numbers(columns[name], name, file) for name in names}, len(rows), file, "column")
        cameras = tuple(dict.fromkeys(columns["image"]))
        place = {camera: i for i, camera in enumerate(cameras)}
        for line, kind in enumerate(columns["kind"], 2):
            if kind not in _KINDS:
                raise FormatError(file, f"line {line}, column kind", f'is "{kind[:40]}", expected center or corner')
        return Observations(
            cameras, np.array([place[image] for image in columns["image"]], np.int32),
            np.stack([numbers.finite("x_px"), numbers.finite("y_px")], axis=1),
            numbers.whole("board_row", 0, _MAX_CELL, np.int32), numbers.whole("board_col", 0, _MAX_CELL, np.int32),
            np.array([_KINDS[kind] for kind in columns["kind"]], bool), numbers.finite("confidence"),
            numbers.finite("sigma_px") if "sigma_px" in head else None)


def _numbers(words: tuple[str, ...], name: str, file: str) -> Array:
    try:
        return np.array(words, dtype=str).astype(np.float64) if words else np.zeros(0)
    except ValueError:
        pass
    for line, word in enumerate(words, 2):
        try:
            float(word)
        except ValueError as error:
            raise FormatError(file, f"line {line}, column {name}", f'is "{word[:40]}", no number') from error
    raise FormatError(file, f"column {name}", "holds what is no number")


def read_observations(path: str | os.PathLike[str]) -> Observations:
    """NotFound, PermissionDenied; FormatError names file, line and column."""
    return Observations.from_csv(read_bytes(path), os.fspath(path))
