"""What the daemon lists."""

from __future__ import annotations

from typing import Any, Callable, Sequence, TypeVar, overload

from google.protobuf.message import Message

T = TypeVar("T")
Request = TypeVar("Request", bound=Message)
Answer = TypeVar("Answer", bound=Message)


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


USUAL_LIMIT = 100  # of the daemon, where nobody says how many


def listing_of_pages(call: Callable[[Request], Answer], request: Request, field: str, most: int = 0) -> Listing[Any]:
    """The pages of a list as one: the first `most` entries, or all where it is 0."""
    asked: Any = request
    asked.limit = most
    answer: Any = call(request)
    while answer.next_page_token and (most == 0 or len(getattr(answer, field)) < most):
        asked.page_token = answer.next_page_token
        asked.limit = most - len(getattr(answer, field)) if most else 0
        page: Any = call(request)
        answer.MergeFrom(page)
        answer.next_page_token = page.next_page_token
    return Listing(answer, field)
