"""Files on this machine that are whole, or not there."""

from __future__ import annotations

import contextlib
import os
import tempfile
from typing import IO, Iterator

from weft.errors import FailedPrecondition, InvalidArgument


@contextlib.contextmanager
def written_atomically(path: str) -> Iterator[IO[bytes]]:
    """A file under a temporary name, which gets its own when the block ends well and its bytes are on the disk."""
    folder = os.path.dirname(path) or "."
    descriptor, temporary = tempfile.mkstemp(prefix=f".{os.path.basename(path)[:100]}.", suffix=".partial", dir=folder)
    try:
        with os.fdopen(descriptor, "w+b") as file:
            yield file
            file.flush()
            os.fchmod(descriptor, 0o666 & ~_umask())
            os.fsync(descriptor)
        os.replace(temporary, path)
    except BaseException:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(temporary)
        raise
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _umask() -> int:
    """That of this process; os.umask() would change it for all threads."""
    with open("/proc/self/status", encoding="ascii", errors="replace") as status:
        for line in status:
            if line.startswith("Umask:"):
                return int(line.split()[1], 8)
    return 0o077


def folder_below(root: str, path: str) -> str:
    """root/path, made where it is missing. `path` comes from a daemon, which must not choose a place elsewhere.

    InvalidArgument: a path that leads out. FailedPrecondition: a link stands there."""
    parts = path.split("/") if path else []
    folder = root
    os.makedirs(root, exist_ok=True)
    for part in parts:
        check_name(part)
        folder = os.path.join(folder, part)
        if os.path.islink(folder):
            raise FailedPrecondition(f"{folder}: is a link; remove it, or choose another folder")
        os.makedirs(folder, exist_ok=True)
    return folder


def check_name(name: str) -> str:
    """The name, which is one; InvalidArgument."""
    if name in ("", ".", "..") or "/" in name or "\0" in name:
        raise InvalidArgument(f'the daemon names a file or frame "{name}", which is no name')
    return name
