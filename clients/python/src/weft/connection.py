"""What every call shares: the channel, the token, deadlines, repetition, errors."""

from __future__ import annotations

import logging
import os
import secrets
import threading
import time
from typing import Any, Callable, Generic, Optional, TypeVar

import grpc

from weft.channel import Identity, call_metadata, open_channel
from weft.connection_fault import find_connection_fault
from weft.errors import Cancelled, FailedPrecondition, WeftError, explain
from weft.retry import Backoff, RetryPolicy, may_be_repeated

Message = TypeVar("Message")
_log = logging.getLogger("weft")


def new_key() -> str:
    """An idempotency key; it becomes the id of a job, take, session or operation, and sorts by time."""
    return time.strftime("%Y%m%d-%H%M%S-", time.gmtime()) + secrets.token_hex(4)


class Watch(Generic[Message]):
    """Messages of a stream, as an iterator; ends when what is watched has ended.

    A connection that is lost is made again, for as long as the policy says, and the daemon then tells the state anew. Ends
    early by close(), from any thread, or by the end of its `with` block. Errors are those of the call."""

    def __init__(self, connection: Connection, open_stream: Callable[[Optional[float]], Any],
                 fresh: Callable[[Message], Message], timeout_s: Optional[float]) -> None:
        self._connection, self._open_stream, self._fresh = connection, open_stream, fresh
        self._deadline = None if timeout_s is None else time.monotonic() + timeout_s
        self._backoff = Backoff(connection.watching)
        self._call: Any = None
        self._closed = threading.Event()

    def __iter__(self) -> Watch[Message]:
        return self

    def __enter__(self) -> Watch[Message]:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """The rest is not wanted. What is watched goes on."""
        self._closed.set()
        if self._call is not None:
            self._call.cancel()

    def __next__(self) -> Message:
        while not self._closed.is_set():
            try:
                if self._call is None:
                    self._call = self._open_stream(self._left_s())
                    if self._closed.is_set():
                        self._call.cancel()
                message: Message = next(self._call)
            except StopIteration:
                self._closed.set()
            except grpc.RpcError as error:
                self._wait_after(self._connection.explain(error))
            else:
                self._backoff.reset()
                return self._fresh(message)
        raise StopIteration

    def _left_s(self) -> Optional[float]:
        return None if self._deadline is None else max(0.0, self._deadline - time.monotonic())

    def _wait_after(self, error: WeftError) -> None:
        """Raises the error where no further try would help."""
        self._call = None
        if self._closed.is_set():
            return
        # Nobody here gave the call up, so a daemon that ends did.
        lost = isinstance(error, Cancelled) or may_be_repeated(error, harmless=True)
        pause_s = self._backoff.pause_s(error) if lost else None
        if pause_s is None:
            self._closed.set()
            raise error
        _log.warning("%s; trying again in %.1f s", error, pause_s)
        self._closed.wait(pause_s)


class Connection:
    """A channel to one daemon. Any thread may use it; a process that forks needs one of its own."""

    def __init__(self, server: str, identity: Identity, calling: RetryPolicy, watching: RetryPolicy) -> None:
        self.server, self.calling, self.watching = server, calling, watching
        self._identity = identity
        self._metadata = call_metadata(identity)
        self.channel = open_channel(server, identity)
        self._process = os.getpid()

    def close(self) -> None:
        self.channel.close()

    def explain(self, error: grpc.RpcError) -> WeftError:
        """The error of a call; FailedPrecondition, which is not repeated, where something keeps all calls from the daemon."""
        return explain(error, self.server, lambda: find_connection_fault(self.server, self._identity))

    def start(self, method: Callable[..., Any], request: object, timeout_s: Optional[float]) -> Any:
        """One call as it is, without repetition; grpc.RpcError."""
        if os.getpid() != self._process:
            raise FailedPrecondition("a weft.Client does not survive os.fork(): make one in the new process, or let "
                                     'multiprocessing use the start method "spawn"')
        return method(request, timeout=timeout_s, metadata=self._metadata)

    def call(self, method: Callable[..., Any], request: object, answer: type[Message], *, harmless: bool,
             timeout_s: Optional[float] = 60.0) -> Message:
        """The answer. `harmless`: to be done twice is as good as once, so a call whose answer was lost is repeated."""
        backoff = Backoff(self.calling)
        while True:
            try:
                result = self.start(method, request, timeout_s)
                assert isinstance(result, answer)
                return result
            except grpc.RpcError as error:
                failure = self.explain(error)
            self.pause_or_raise(backoff, failure, may_be_repeated(failure, harmless))

    def pause_or_raise(self, backoff: Backoff, failure: WeftError, repeatable: bool) -> None:
        """Waits before the next try, or raises where there is none."""
        pause_s = backoff.pause_s(failure) if repeatable else None
        if pause_s is None:
            raise failure
        _log.info("%s; trying again in %.1f s", failure, pause_s)
        time.sleep(pause_s)

    def watch(self, method: Callable[..., Any], request: object, fresh: Optional[Callable[[Message], Message]] = None,
              timeout_s: Optional[float] = None) -> Watch[Message]:
        """`fresh` takes out of a message what came before the connection was lost."""
        return Watch(self, lambda left_s: self.start(method, request, left_s), fresh or (lambda message: message), timeout_s)
