"""When a call is made again, and after how long."""

from __future__ import annotations

import random
from dataclasses import dataclass
from typing import Callable, Optional

from weft.errors import ResourceExhausted, Unavailable, WeftError


@dataclass(frozen=True)
class RetryPolicy:
    """Pauses between tries grow by `factor` from `first_pause_s` to `longest_pause_s`; a random share of each, up to
    `jitter`, is left out, so that many clients do not come back at once. After `patience_s` of pauses the error counts, and
    after `busy_patience_s` of those that a busy daemon asks for."""

    first_pause_s: float = 0.2
    factor: float = 2.0
    longest_pause_s: float = 5.0
    jitter: float = 0.5
    patience_s: float = 20.0
    busy_patience_s: float = 60.0

    def __post_init__(self) -> None:
        if not (self.first_pause_s > 0 and self.factor >= 1 and self.longest_pause_s >= self.first_pause_s
                and 0 <= self.jitter <= 1 and self.patience_s >= 0 and self.busy_patience_s >= 0):
            raise ValueError(f"{self}: pauses must be positive and not shrink, jitter from 0 to 1")


def may_be_repeated(error: WeftError, harmless: bool) -> bool:
    """Whether the same call may be made again. A call that is not `harmless` is repeated only where the daemon says when,
    since only then it surely did nothing. A full disk, which names no time, is not asked again."""
    if not isinstance(error, (ResourceExhausted, Unavailable)):
        return False
    if error.retry_after_s is not None:
        return error.retry_after_s >= 0
    return harmless and isinstance(error, Unavailable)


class Backoff:
    """The pauses of one call. Not for several threads at once."""

    def __init__(self, policy: RetryPolicy, uniform: Callable[[], float] = random.random) -> None:
        self._policy, self._uniform = policy, uniform
        self.reset()

    def reset(self) -> None:
        """Something got through: begins anew."""
        self._next_s = self._policy.first_pause_s
        self._left_s = self._policy.patience_s
        self._busy_left_s = self._policy.busy_patience_s

    def pause_s(self, error: WeftError) -> Optional[float]:
        """How long to wait before the next try, at least as long as the daemon asks for. None: give up."""
        if error.retry_after_s is not None:
            # Those that were refused together come back apart.
            spread_s = self._policy.first_pause_s + self._policy.jitter * error.retry_after_s
            pause_s = error.retry_after_s + spread_s * self._uniform()
            self._busy_left_s -= pause_s
            return pause_s if self._busy_left_s >= 0 else None
        pause_s = self._next_s * (1 - self._policy.jitter * self._uniform())
        self._next_s = min(self._next_s * self._policy.factor, self._policy.longest_pause_s)
        self._left_s -= pause_s
        return pause_s if self._left_s >= 0 else None
