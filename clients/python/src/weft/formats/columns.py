"""Columns of a table in a file, checked."""

from __future__ import annotations

import os
from typing import Any, Mapping, Optional, Sequence

import numpy as np
import numpy.typing as npt

from weft.errors import FormatError, NotFound, PermissionDenied

Array = npt.NDArray[Any]
# A row per value; a column of lists of one length has two axes, one of lists of several lengths is a sequence.
Column = Array | Sequence[Array]


def read_bytes(path: str | os.PathLike[str]) -> bytes:
    """NotFound, PermissionDenied; the file is named."""
    try:
        with open(path, "rb") as file:
            return file.read()
    except PermissionError as error:
        raise PermissionDenied(f"{os.fspath(path)}: {error.strerror}") from error
    except OSError as error:
        raise NotFound(f"{os.fspath(path)}: {error.strerror}") from error


class Table:
    """The columns of an element by name. `label` says what a row is, for errors."""

    def __init__(self, columns: Mapping[str, Column], rows: int, file: str, label: str) -> None:
        self.columns, self.rows, self.file, self.label = columns, rows, file, label

    def error(self, name: str, problem: str) -> FormatError:
        return FormatError(self.file, f"{self.label} {name}", problem)

    def scalar(self, name: str) -> Array:
        column = self.columns.get(name)
        if column is None:
            raise self.error(name, "is missing")
        if not isinstance(column, np.ndarray) or column.ndim != 1:
            raise self.error(name, "is a list, one number is expected")
        return column

    def optional(self, name: str) -> Optional[Array]:
        return self.scalar(name) if name in self.columns else None

    def finite(self, name: str) -> Array:
        """FormatError names the first row whose value is no number."""
        column = self.scalar(name)
        bad = np.flatnonzero(~np.isfinite(column))
        if bad.size:
            raise self.error(name, f"is {column[bad[0]]} in row {bad[0]}, expected a finite number")
        return column

    def whole(self, name: str, least: int, most: int, dtype: npt.DTypeLike) -> Array:
        """Whole numbers in a range."""
        column = self.finite(name)
        bad = np.flatnonzero((column < least) | (column > most) | (column != np.floor(column)))
        if bad.size:
            raise self.error(name, f"is {column[bad[0]]} in row {bad[0]}, expected a whole number from {least} to {most}")
        return column.astype(dtype)

    def positions(self) -> Array:
        """x y z, [rows, 3]."""
        return np.stack([self.finite(axis) for axis in "xyz"], axis=1)
