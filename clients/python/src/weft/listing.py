"""What the daemon lists."""

from __future__ import annotations

from typing import Any, Sequence, TypeVar, overload

from google.protobuf.message import Message

T = TypeVar("T")


class Listing(Sequence[T]):
    """The listed things in their order, as a sequence. Fields of the daemon's `answer` are its attributes, as `warnings`."""

    def __init__(self, answer: Message, field: str) -> None:
        self.answer, self._field = answer, field

    def _items(self) -> Sequence[T]:
        items: Sequence[T] = getattr(self.answer, self._field)
        return items

    @overload
    def __getitem__(self, index: int) -> T: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[T]: ...

    def __getitem__(self, index: int | slice) -> T | Sequence[T]:
        return self._items()[index]

    def __len__(self) -> int:
        return len(self._items())

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name == "answer":
            raise AttributeError(name)
        return getattr(self.answer, name)

    def __repr__(self) -> str:
        return f"Listing({list(self._items())!r})"
