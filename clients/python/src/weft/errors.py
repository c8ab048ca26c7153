"""What goes wrong, by category. Every error of this package is a WeftError."""

from __future__ import annotations

import re
from typing import Callable, Iterable, Optional

import grpc

from weft import v1


class WeftError(Exception):
    """Its text is the daemon's message. Subclasses are the categories of gRPC, named as there."""

    def __init__(self, message: str, *, field: str = "", remedy: str = "", retry_after_s: Optional[float] = None) -> None:
        super().__init__(message)
        self.message = message
        self.field = field  # of the request, e.g. "spec.rig"; empty where no field is to blame
        self.remedy = remedy  # what to do about it; may be empty
        self.retry_after_s = retry_after_s  # when the daemon wants to be asked again; negative: never; None: it did not say


class Cancelled(WeftError):
    """The call was given up."""


class Unknown(WeftError):
    """An error without a category."""


class InvalidArgument(WeftError):
    """The request is wrong, whatever the daemon's state."""


class DeadlineExceeded(WeftError):
    """No answer came in time; the daemon may have done the work."""


class NotFound(WeftError):
    """No such job, take, item, frame or file."""


class AlreadyExists(WeftError):
    """Another request was made with this idempotency key."""


class PermissionDenied(WeftError):
    """The role of the client, or the folders of the daemon, do not allow it."""


class ResourceExhausted(WeftError):
    """A disk is full, or the daemon has too much to do; then retry_after_s is set."""


class FailedPrecondition(WeftError):
    """Not in this state: cameras that others use, inputs whose hashes do not fit."""


class Aborted(WeftError):
    """Something else happened meanwhile."""


class OutOfRange(WeftError):
    """Beyond the end of a file."""


class Unimplemented(WeftError):
    """The daemon does not know the call; it is of another version, or no weftd."""


class Internal(WeftError):
    """A fault of the daemon."""


class Unavailable(WeftError):
    """No daemon answers."""


class DataLoss(WeftError):
    """Bytes arrived damaged, or are lost."""


class Unauthenticated(WeftError):
    """The daemon does not know the client: it needs a token or a certificate."""


class FormatError(WeftError, ValueError):
    """A file that is not what it should be. Its text is "FILE: FIELD: PROBLEM"."""

    def __init__(self, file: str, field: str, problem: str) -> None:
        super().__init__(": ".join(part for part in (file, field, problem) if part), field=field)
        self.file = file


_CATEGORIES: dict[grpc.StatusCode, type[WeftError]] = {
    grpc.StatusCode.CANCELLED: Cancelled,
    grpc.StatusCode.UNKNOWN: Unknown,
    grpc.StatusCode.INVALID_ARGUMENT: InvalidArgument,
    grpc.StatusCode.DEADLINE_EXCEEDED: DeadlineExceeded,
    grpc.StatusCode.NOT_FOUND: NotFound,
    grpc.StatusCode.ALREADY_EXISTS: AlreadyExists,
    grpc.StatusCode.PERMISSION_DENIED: PermissionDenied,
    grpc.StatusCode.RESOURCE_EXHAUSTED: ResourceExhausted,
    grpc.StatusCode.FAILED_PRECONDITION: FailedPrecondition,
    grpc.StatusCode.ABORTED: Aborted,
    grpc.StatusCode.OUT_OF_RANGE: OutOfRange,
    grpc.StatusCode.UNIMPLEMENTED: Unimplemented,
    grpc.StatusCode.INTERNAL: Internal,
    grpc.StatusCode.UNAVAILABLE: Unavailable,
    grpc.StatusCode.DATA_LOSS: DataLoss,
    grpc.StatusCode.UNAUTHENTICATED: Unauthenticated,
}
_RETRY_AFTER = ("retry-after-ms", "grpc-retry-pushback-ms")
# How a daemon on gRPC 1.51 says it, which sends no metadata with what it refuses early (services/server/rpc/retry_after.h).
_RETRY_WORDS = re.compile(r"; retry after ([0-9]{1,12}) ms$")
_STATUS_DETAILS = "grpc-status-details-bin"


def retry_after_s(message: str, metadata: Iterable[tuple[str, str | bytes]]) -> Optional[float]:
    """What message or trailing metadata of an error say; in these, what is no number of milliseconds is never, as gRPC has it."""
    if words := _RETRY_WORDS.search(message):
        return int(words.group(1)) / 1000
    for key, value in metadata:
        if key in _RETRY_AFTER:
            text = value.decode("ascii", "replace") if isinstance(value, bytes) else value
            return int(text) / 1000 if text.isascii() and text.isdigit() else -1.0
    return None


def _detail(metadata: Iterable[tuple[str, str | bytes]]) -> v1.ErrorDetail:
    detail = v1.ErrorDetail()
    for key, value in metadata:
        if key == _STATUS_DETAILS and isinstance(value, bytes):
            try:
                for packed in v1.RpcStatus.FromString(value).details:
                    packed.Unpack(detail)
            except Exception:  # of protobuf's C or Python code: it is no status, and the message stands without it
                return v1.ErrorDetail()
    return detail


def explain(error: grpc.RpcError, server: str, find_fault: Callable[[], str] = lambda: "") -> WeftError:
    """The error of a call to this server. `find_fault` looks for what keeps calls from it where no daemon answers; it may be slow."""
    metadata = tuple(error.trailing_metadata() or ())
    detail = _detail(metadata)
    message = error.details() or error.code().name
    pause_s = retry_after_s(message, metadata)
    if error.code() == grpc.StatusCode.UNAVAILABLE and pause_s is None and "shutting down" not in message:
        if fault := find_fault():
            return FailedPrecondition(f"no call reaches the daemon at {server}: {fault}")
        remedy = f"start it with `weftd --listen {server} --state DIR --allow-path DIR`"
        message = f"no daemon answers at {server}: {message}; {remedy}"
    return _CATEGORIES.get(error.code(), Unknown)(message, field=detail.field, remedy=detail.remedy,
                                                  retry_after_s=pause_s)
