"""PCD files, ascii and binary, as weft writes them. Debian's python3-pcl would bring all of the Point Cloud Library."""

from __future__ import annotations

import io
import re

import numpy as np

from weft.errors import FormatError
from weft.formats.columns import Table

_LISTS = ("FIELDS", "SIZE", "TYPE", "COUNT")
_TYPES = {("F", "4"): "<f4", ("F", "8"): "<f8", **{(letter, size): f"<{letter.lower()}{size}"
                                                    for letter in "IU" for size in ("1", "2", "4", "8")}}
_COMPRESSED = "pcl_convert_pcd_ascii_binary FILE FILE 1 makes it binary"


def _header(data: bytes, file: str) -> tuple[dict[str, list[str]], int]:
    """Words by keyword, and where the points begin."""
    end = re.search(rb"^DATA[^\n]*\n", data[:1 << 20], re.MULTILINE)
    if end is None:
        raise FormatError(file, "header", "has no line DATA; the file is no PCD file, or truncated")
    header = {}
    for line in data[:end.end()].decode("latin-1").splitlines():
        words = line.split("#", 1)[0].split()
        if words:
            header[words[0]] = words[1:]
    return header, end.end()


def _row_type(header: dict[str, list[str]], file: str) -> np.dtype[np.void]:
    for key in ("FIELDS", "SIZE", "TYPE"):
        if key not in header:
            raise FormatError(file, f"header {key}", "is missing")
    header.setdefault("COUNT", ["1"] * len(header["FIELDS"]))
    lengths = {key: len(header[key]) for key in _LISTS}
    if len(set(lengths.values())) != 1 or not header["FIELDS"]:
        raise FormatError(file, "header FIELDS", f"SIZE, TYPE and COUNT must be as long; they have {lengths}")
    if len(set(header["FIELDS"])) != len(header["FIELDS"]):
        raise FormatError(file, "header FIELDS", "names a field twice")
    kinds = list(zip(header["TYPE"], header["SIZE"], strict=True))
    for name, count, kind in zip(header["FIELDS"], header["COUNT"], kinds, strict=True):
        if count != "1":
            raise FormatError(file, f"field {name}", f"has COUNT {count}; only fields of one number a point are read")
        if kind not in _TYPES:
            raise FormatError(file, f"field {name}", f"has unknown type {' '.join(kind)}")
    return np.dtype([(name, _TYPES[kind]) for name, kind in zip(header["FIELDS"], kinds, strict=True)])


def parse_pcd(data: bytes, file: str) -> Table:
    """The points, without those whose x, y or z is not finite. FormatError names the file, and the field to blame."""
    header, start = _header(data, file)
    row = _row_type(header, file)
    points = "".join(header.get("POINTS", []))
    if not (points.isascii() and points.isdigit() and len(points) < 16):
        raise FormatError(file, "header POINTS", f'is "{points[:40]}", expected the number of points')
    rows, encoding = int(points), "".join(header["DATA"])
    if encoding == "binary_compressed":
        raise FormatError(file, "header DATA", f"is binary_compressed, which is not read here; {_COMPRESSED}")
    if encoding == "binary":
        if start + rows * row.itemsize > len(data):
            there = (len(data) - start) // row.itemsize
            raise FormatError(file, "header POINTS", f"announces {rows} points, the file has {there}")
        values = np.frombuffer(data, row, rows, start)
    elif encoding == "ascii":
        values = _ascii(data[start:], row, rows, file)
    else:
        raise FormatError(file, "header DATA", f'is "{encoding[:40]}", expected ascii or binary')
    names = row.names or ()
    kept = np.ones(rows, bool)
    for axis in "xyz":
        if axis in names:
            kept &= np.isfinite(values[axis])
    values = values[kept]
    return Table({name: values[name].astype(values[name].dtype.newbyteorder("=")) for name in names}, len(values), file, "field")


def _ascii(text: bytes, row: np.dtype[np.void], rows: int, file: str) -> np.ndarray[tuple[int], np.dtype[np.void]]:
    names, lines = row.names or (), text.count(b"\n") + 1
    if rows == 0:
        return np.zeros(0, row)
    try:
        table = np.loadtxt(io.BytesIO(text), np.float64, ndmin=2, max_rows=min(rows, lines))
    except ValueError as error:
        raise FormatError(file, "points", str(error)) from error
    if table.shape != (rows, len(names)):
        raise FormatError(file, "header POINTS", f"announces {rows} points of {len(names)} fields, the file has {table.shape}")
    values = np.zeros(rows, row)
    for i, name in enumerate(names):
        values[name] = table[:, i]
    return values
