"""PLY files with any elements and properties, in all three encodings. Debian 12 has no plyfile, and its meshio reads faces with
several lists, such as texcoord, as if each list stood alone."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Optional

import numpy as np

from weft.errors import FormatError
from weft.formats.columns import Array, Column, Table

_TYPES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4", "double": "f8",
          "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4", "float32": "f4",
          "float64": "f8"}
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass
class _Property:
    name: str
    type: str
    count_type: Optional[str] = None  # of lists


@dataclass
class _Element:
    name: str
    rows: int
    properties: list[_Property] = field(default_factory=list)

    @property
    def has_lists(self) -> bool:
        return any(p.count_type for p in self.properties)


def _header(data: bytes, file: str) -> tuple[str, list[_Element], int]:
    """Byte order ("" of ascii), elements, and where the rows begin."""
    end = re.search(rb"(?:^|\n)end_header\r?\n", data[:1 << 20])
    if not data.startswith(b"ply") or end is None:
        raise FormatError(file, "header", 'does not go from "ply" to "end_header"; the file is no PLY file, or truncated')
    order: Optional[str] = None
    elements: list[_Element] = []
    for number, line in enumerate(data[:end.start()].decode("latin-1").splitlines()[1:], 2):
        words = line.split()
        match words:
            case [] | ["comment" | "obj_info", *_]:
                pass
            case ["format", encoding, *_] if encoding in _ORDERS:
                order = _ORDERS[encoding]
            case ["element", name, count] if count.isascii() and count.isdigit() and len(count) < 19:
                elements.append(_Element(name, int(count)))
            case ["property", kind, name] if elements and kind in _TYPES:
                elements[-1].properties.append(_Property(name, _TYPES[kind]))
            case ["property", "list", count, kind, name] if elements and kind in _TYPES and _TYPES.get(count, "f")[0] != "f":
                elements[-1].properties.append(_Property(name, _TYPES[kind], _TYPES[count]))
            case _:
                raise FormatError(file, f"header line {number}", f'"{line[:60]}" is no line of a PLY header')
    if order is None:
        raise FormatError(file, "header", "has no format line")
    _check_unique(elements, file)
    return order, elements, end.end()


def _check_unique(elements: list[_Element], file: str) -> None:
    for kind, names in [("element", [e.name for e in elements]),
                        *((f"element {e.name}, property", [p.name for p in e.properties]) for e in elements)]:
        for name in names:
            if names.count(name) > 1:
                raise FormatError(file, f"{kind} {name}", "occurs twice")


class _Binary:
    """Rows as bytes."""

    def __init__(self, data: bytes, at: int, order: str, file: str) -> None:
        self.data, self.at, self.order, self.file = data, at, order, file

    def element(self, element: _Element) -> dict[str, Column]:
        counts = self._counts_of_row(element) if element.rows else [0 for p in element.properties if p.count_type]
        uniform = self._uniform(element, counts)
        return self._ragged(element) if uniform is None else uniform

    def _truncated(self, element: _Element, name: str, row: int) -> FormatError:
        return FormatError(self.file, f"{element.name} {name}", f"the file ends in row {row} of {element.rows}")

    def _read(self, element: _Element, name: str, row: int, kind: str, count: int = 1) -> Array:
        size = count * np.dtype(kind).itemsize
        if self.at + size > len(self.data):
            raise self._truncated(element, name, row)
        values = np.frombuffer(self.data, self.order + kind, count, self.at)
        self.at += size
        return values

    def _length(self, element: _Element, p: _Property, row: int) -> int:
        assert p.count_type
        length = int(self._read(element, p.name, row, p.count_type)[0])
        if length < 0:
            raise FormatError(self.file, f"{element.name} {p.name}", f"has {length} values in row {row}")
        return length

    def _counts_of_row(self, element: _Element) -> list[int]:
        """Lengths of the lists of the first row, which is not consumed."""
        start, counts = self.at, []
        for p in element.properties:
            if p.count_type:
                counts.append(self._length(element, p, 0))
            self._read(element, p.name, 0, p.type, counts[-1] if p.count_type else 1)
        self.at = start
        return counts

    def _uniform(self, element: _Element, counts: list[int]) -> Optional[dict[str, Column]]:
        """All rows at once, where all lists are as long as those of the first row."""
        lengths, fields = iter(counts), []
        expected = {}
        for i, p in enumerate(element.properties):
            if p.count_type:
                expected[i] = next(lengths)
                fields += [(f"n{i}", self.order + p.count_type), (f"v{i}", self.order + p.type, (expected[i],))]
            else:
                fields.append((f"v{i}", self.order + p.type))
        row = np.dtype(fields)
        if self.at + element.rows * row.itemsize > len(self.data):
            if element.has_lists:
                return None
            raise self._truncated(element, element.properties[0].name, (len(self.data) - self.at) // row.itemsize)
        values = np.frombuffer(self.data, row, element.rows, self.at) if row.itemsize else np.zeros(element.rows, row)
        if any((values[f"n{i}"] != length).any() for i, length in expected.items()):
            return None
        self.at += element.rows * row.itemsize
        # Copies, in the machine's byte order.
        return {p.name: values[f"v{i}"].astype(p.type) for i, p in enumerate(element.properties)}

    def _ragged(self, element: _Element) -> dict[str, Column]:
        found: dict[str, list[Array]] = {p.name: [] for p in element.properties}
        for row in range(element.rows):
            for p in element.properties:
                count = self._length(element, p, row) if p.count_type else 1
                found[p.name].append(self._read(element, p.name, row, p.type, count).astype(p.type))
        return {p.name: found[p.name] if p.count_type else np.concatenate(found[p.name]) for p in element.properties}


class _Ascii:
    """Rows as words."""

    def __init__(self, data: bytes, at: int, file: str) -> None:
        self.words, self.at, self.file = data[at:].split(), 0, file

    def _read(self, element: _Element, p: _Property, row: int, count: int) -> Array:
        words = self.words[self.at:self.at + count]
        if len(words) < count:
            raise FormatError(self.file, f"{element.name} {p.name}", f"the file ends in row {row} of {element.rows}")
        self.at += count
        try:
            return np.array(words).astype(np.float64)
        except ValueError as error:
            shown = b" ".join(words)[:40].decode("latin-1")
            raise FormatError(self.file, f"{element.name} {p.name}", f'is "{shown}" in row {row}, no number') from error

    def element(self, element: _Element) -> dict[str, Column]:
        # A count that the rest of the file cannot hold costs no memory.
        if element.properties and element.rows > len(self.words) - self.at:
            raise FormatError(self.file, f"{element.name} {element.properties[0].name}",
                              f"the file ends before row {element.rows}")
        if not element.has_lists:
            return self._scalars(element)
        found: dict[str, list[Array]] = {p.name: [] for p in element.properties}
        for row in range(element.rows):
            for p in element.properties:
                count = int(self._read(element, p, row, 1)[0]) if p.count_type else 1
                if count < 0:
                    raise FormatError(self.file, f"{element.name} {p.name}", f"has {count} values in row {row}")
                found[p.name].append(self._read(element, p, row, count).astype(p.type))
        return {p.name: _joined(found[p.name]) if p.count_type else np.array(found[p.name], p.type).reshape(-1)
                for p in element.properties}

    def _scalars(self, element: _Element) -> dict[str, Column]:
        width, start = len(element.properties), self.at
        self.at += element.rows * width
        words = self.words[start:self.at]
        if len(words) < element.rows * width:
            raise FormatError(self.file, f"{element.name} {element.properties[len(words) % width].name}",
                              f"the file ends in row {len(words) // width} of {element.rows}")
        return {p.name: _numbers(words[i::width], p, element, self.file) for i, p in enumerate(element.properties)}


def _numbers(words: list[bytes], p: _Property, element: _Element, file: str) -> Array:
    try:
        return np.array(words, dtype="S").astype(np.float64).astype(p.type)
    except ValueError as error:
        raise FormatError(file, f"{element.name} {p.name}", f"holds what is no number ({error})") from error


def _joined(lists: list[Array]) -> Column:
    """One array where all lists have one length."""
    return np.stack(lists) if lists and len({len(values) for values in lists}) == 1 else lists


def parse_ply(data: bytes, file: str) -> dict[str, Table]:
    """The elements by name. FormatError names the file, and the element and property that is to blame."""
    order, elements, start = _header(data, file)
    rows: _Binary | _Ascii = _Binary(data, start, order, file) if order else _Ascii(data, start, file)
    return {element.name: Table(rows.element(element) if element.properties else {}, element.rows, file, element.name)
            for element in elements}
