"""The daemon's library: inputs of jobs for clients that share no folder with it."""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass
from typing import Callable, Iterator, Optional

import grpc

from weft import v1
from weft.connection import Connection
from weft.errors import (Aborted, DataLoss, FailedPrecondition, Internal, NotFound, OutOfRange, WeftError)
from weft.listing import Listing, listing_of_pages
from weft.local_item import LocalItem, has_hash, list_local_item, name_of_path
from weft.retry import Backoff, may_be_repeated
from weft.storage import check_name, folder_below, written_atomically
from weft.transfer import receive
from weft.v1.library_pb2_grpc import LibraryStub

KINDS = {"rig": v1.ITEM_KIND_RIG, "board": v1.ITEM_KIND_BOARD, "template": v1.ITEM_KIND_TEMPLATE, "dump": v1.ITEM_KIND_DUMP,
         "avatar": v1.ITEM_KIND_AVATAR, "garment": v1.ITEM_KIND_GARMENT}
# Called with the bytes done and all of them, perhaps from another thread.
Progress = Callable[[int, int], None]

# Uploads that others finish or change meanwhile, and files that do.
_MEANWHILE = (OutOfRange, Aborted, NotFound, FailedPrecondition, DataLoss)
_PATIENCE_S = 600.0
_PIECE_BYTES = 256 << 10
_MANIFEST_BYTES = 512 << 10


def reference(item: v1.LibraryItem) -> str:
    """How a job names exactly this content."""
    return f"library:sha256:{item.id}"


def kind_of(kind: str) -> v1.ItemKind:
    if kind not in KINDS:
        raise ValueError(f'kind: "{kind}" is none of {", ".join(KINDS)}')
    return KINDS[kind]


@dataclass
class _Upload:
    """One try of an upload."""

    begun: v1.BeginUploadResponse
    item: LocalItem
    progress: Optional[Progress]
    error: Optional[Exception] = None  # of reading here; gRPC hides what an iterator of requests raises

    def requests(self) -> Iterator[v1.WriteFileRequest]:
        done, total = sum(self.begun.received_bytes), self.item.bytes
        try:
            files = zip(self.item.paths, self.item.manifest.files, self.begun.received_bytes, strict=True)
            for path, file, received in files:
                if received >= file.bytes:
                    continue
                with open(path, "rb") as source:
                    source.seek(received)
                    while received < file.bytes:
                        data = source.read(min(_PIECE_BYTES, file.bytes - received))
                        if not data:
                            raise DataLoss(f"{path}: is shorter than when it was listed; upload it when nothing writes it")
                        yield v1.WriteFileRequest(upload_id=self.begun.upload_id, path=file.path, offset=received, data=data)
                        received += len(data)
                        done += len(data)
                        if self.progress:
                            self.progress(done, total)
        except GeneratorExit:
            raise
        except Exception as error:
            self.error = error
            raise


class Library:
    """Uploads, lists, fetches and deletes items. `kind` is "rig", "board", "template", "dump" or "avatar"; an item
    is named NAME (its newest version), NAME@VERSION or sha256:HEX."""

    def __init__(self, connection: Connection) -> None:
        self._connection, self._stub = connection, LibraryStub(connection.channel)

    def upload(self, kind: str, path: str | os.PathLike[str], name: str = "",
               progress: Optional[Progress] = None) -> v1.LibraryItem:
        """Sends a rig.json, a board, or the folder of a template, dump or avatar, or a garment's OBJ or PLY; `name`: by default that of the file or folder.

        Content that is there is not sent again. A broken upload goes on where it was, here or when it is called again.
        InvalidArgument: no reader accepts the content; it names file and field."""
        item_kind = kind_of(kind)
        local = list_local_item(item_kind, os.fspath(path))
        chosen = name or name_of_path(os.fspath(path))
        backoff, most, losses = Backoff(self._connection.calling), 0, 0
        while True:
            begun: Optional[v1.BeginUploadResponse] = None
            try:
                begun = self._begin(item_kind, chosen, local)
                return begun.item if begun.HasField("item") else self._send(begun, local, progress)
            except WeftError as error:
                failure = error
            received = sum(begun.received_bytes) if begun else 0
            losses += isinstance(failure, DataLoss)
            if received > most:
                backoff.reset()
                most = received
            meanwhile = begun is not None and isinstance(failure, _MEANWHILE)
            repeatable = losses < 2 and (meanwhile or may_be_repeated(failure, harmless=True))
            self._connection.pause_or_raise(backoff, failure, repeatable)

    def _begin(self, kind: v1.ItemKind, name: str, local: LocalItem) -> v1.BeginUploadResponse:
        messages = [v1.BeginUploadRequest(kind=kind, name=name)]
        room = _MANIFEST_BYTES
        for file in local.manifest.files:
            if file.ByteSize() > room:
                messages.append(v1.BeginUploadRequest())
                room = _MANIFEST_BYTES
            room -= file.ByteSize()
            messages[-1].manifest.files.append(file)
        try:
            response = self._connection.start(self._stub.BeginUpload, iter(messages), _PATIENCE_S)
            assert isinstance(response, v1.BeginUploadResponse)
            return response
        except grpc.RpcError as error:
            raise self._connection.explain(error) from error

    def _send(self, begun: v1.BeginUploadResponse, local: LocalItem, progress: Optional[Progress]) -> v1.LibraryItem:
        if len(begun.received_bytes) != len(local.paths):
            raise Internal(f"the daemon at {self._connection.server} counts other files than were named")
        if sum(begun.received_bytes) < local.bytes:
            upload = _Upload(begun, local, progress)
            try:
                self._connection.start(self._stub.WriteFile, upload.requests(), None)
            except grpc.RpcError as error:
                if upload.error:
                    raise upload.error from None
                raise self._connection.explain(error) from error
        # No deadline: a large dump takes its time to be checked.
        return self._connection.call(self._stub.FinishUpload, v1.FinishUploadRequest(upload_id=begun.upload_id),
                                     v1.LibraryItem, harmless=True, timeout_s=None)

    def list(self, kind: str = "") -> Listing[v1.LibraryItem]:
        """All items, or those of a kind, and which of them are damaged."""
        def page(request: v1.ListItemsRequest) -> v1.ListItemsResponse:
            return self._connection.call(self._stub.ListItems, request, v1.ListItemsResponse, harmless=True, timeout_s=_PATIENCE_S)

        return listing_of_pages(page, v1.ListItemsRequest(kind=kind_of(kind)) if kind else v1.ListItemsRequest(), "items")

    def get(self, kind: str, item: str) -> v1.LibraryItem:
        """With its manifest."""
        return self._connection.call(self._stub.GetItem, v1.GetItemRequest(kind=kind_of(kind), item=item), v1.LibraryItem,
                                     harmless=True, timeout_s=_PATIENCE_S)

    def fetch(self, kind: str, item: str, folder: str | os.PathLike[str], progress: Optional[Progress] = None) -> v1.LibraryItem:
        """Writes all files of an item below `folder`, which is made where it is missing. Files that are there with the right
        bytes are kept. DataLoss: other bytes arrived than the item has."""
        found, root, done = self.get(kind, item), os.fspath(folder), 0
        total = sum(file.bytes for file in found.manifest.files)
        for file in found.manifest.files:
            below, _, name = file.path.rpartition("/")
            path = os.path.join(folder_below(root, below), check_name(name))
            if not has_hash(path, file.sha256):
                self._fetch_file(found, file, path)
            done += file.bytes
            if progress:
                progress(done, total)
        return found

    def _fetch_file(self, item: v1.LibraryItem, file: v1.ItemFile, path: str) -> None:
        request = v1.FetchFileRequest(kind=item.kind, item=f"sha256:{item.id}", path=file.path)

        def open_transfer(offset: int, version: str) -> object:
            request.offset, request.version = offset, version
            return self._connection.start(self._stub.FetchFile, request, None)

        with written_atomically(path) as target:
            receive(self._connection, open_transfer, target, path)
            target.seek(0)
            if hashlib.file_digest(target, "sha256").hexdigest() != file.sha256:  # type: ignore[arg-type]
                raise DataLoss(f"{path}: other bytes arrived than the item has; get it again")

    def delete(self, kind: str, item: str) -> v1.DeleteItemResponse:
        """NAME deletes the newest version, so the call is never repeated. FailedPrecondition: an unfinished job uses it."""
        return self._connection.call(self._stub.DeleteItem, v1.DeleteItemRequest(kind=kind_of(kind), item=item),
                                     v1.DeleteItemResponse, harmless=False, timeout_s=_PATIENCE_S)
