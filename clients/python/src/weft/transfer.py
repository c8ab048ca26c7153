"""Files on their way from a daemon."""

from __future__ import annotations

from typing import IO, Any, Callable

import grpc

from weft import v1
from weft.connection import Connection
from weft.errors import Aborted, DataLoss
from weft.retry import Backoff, may_be_repeated

# A call that sends the file from this offset on; the version is that of the pieces that came before.
OpenTransfer = Callable[[int, str], Any]


class _Transfer:
    """What has arrived of a file."""

    def __init__(self, file: IO[bytes], what: str) -> None:
        self.file, self.what = file, what
        self.restart()

    def restart(self) -> None:
        self.file.seek(0)
        self.file.truncate()
        self.offset, self.expected, self.version = 0, 0, ""

    def take(self, chunk: v1.FileChunk) -> None:
        if self.offset > 0 and not chunk.version:  # a daemon that knows nothing of offsets begins anew
            self.restart()
        self.expected, self.version = chunk.file_bytes, chunk.version
        if chunk.version and chunk.offset != self.offset or self.offset + len(chunk.data) > chunk.file_bytes:
            raise DataLoss(f"{self.what}: bytes arrived that are not those asked for; fetch it again")
        self.file.write(chunk.data)
        self.offset += len(chunk.data)


def receive(connection: Connection, open_transfer: OpenTransfer, file: IO[bytes], what: str) -> None:
    """Writes the file. A transfer that breaks off goes on where it was; one of a file that was written anew begins again.

    DataLoss: fewer bytes arrived than the file has. Errors of the call besides."""
    transfer, backoff = _Transfer(file, what), Backoff(connection.calling)
    while True:
        before = transfer.offset
        call = open_transfer(transfer.offset, transfer.version)
        try:
            for chunk in call:
                transfer.take(chunk)
            break
        except grpc.RpcError as error:
            failure = connection.explain(error)
        finally:
            call.cancel()
        if transfer.offset > before:
            backoff.reset()
        if isinstance(failure, Aborted):
            transfer.restart()
        connection.pause_or_raise(backoff, failure, isinstance(failure, Aborted) or may_be_repeated(failure, harmless=True))
    if transfer.offset != transfer.expected:
        raise DataLoss(f"{what}: {transfer.offset} of {transfer.expected} bytes arrived; fetch it again")
