"""Inputs and options of work by name."""

from __future__ import annotations

from typing import Mapping, Sequence, Union

Words = Mapping[str, Union[str, Sequence[str]]]


def pairs(words: Words) -> list[tuple[str, str]]:
    """Each name with each of its values."""
    return [(name, value) for name, values in words.items() for value in ([values] if isinstance(values, str) else values)]
