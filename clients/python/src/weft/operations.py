"""Operations: commands of `weft` that the daemon runs."""

from __future__ import annotations

import os
from typing import Optional, Sequence

from weft import v1
from weft.connection import Connection, Watch, new_key
from weft.library import Progress
from weft.listing import USUAL_LIMIT, Listing, listing_of_pages
from weft.named import Words, pairs
from weft.storage import check_name, folder_below, written_atomically
from weft.transfer import receive
from weft.v1.operations_pb2_grpc import OperationsStub


def operation_spec(command: str, inputs: Words, options: Optional[Words] = None, out_name: str = "") -> v1.OperationSpec:
    """For example `operation_spec("evaluate", {"result": "job:ID"}, {"no-truth": ""}, "evaluation")`."""
    return v1.OperationSpec(command=command, out_name=out_name,
                            inputs=[v1.OperationInput(name=name, value=value) for name, value in pairs(inputs)],
                            options=[v1.OperationOption(name=name, value=value) for name, value in pairs(options or {})])


class Operations:
    """Starts, watches, cancels and deletes operations, and fetches what they wrote."""

    def __init__(self, connection: Connection) -> None:
        self._connection, self._stub = connection, OperationsStub(connection.channel)

    def start(self, spec: v1.OperationSpec, *, idempotency_key: str = "") -> v1.Operation:
        request = v1.StartOperationRequest(spec=spec, idempotency_key=idempotency_key or new_key())
        return self._connection.call(self._stub.StartOperation, request, v1.Operation, harmless=True)

    def get(self, operation_id: str) -> v1.Operation:
        return self._connection.call(self._stub.GetOperation, v1.GetOperationRequest(operation_id=operation_id), v1.Operation,
                                     harmless=True)

    def list(self, limit: int = 100) -> Listing[v1.Operation]:
        """The newest first, without inputs, options and output, which get() has."""
        def page(request: v1.ListOperationsRequest) -> v1.ListOperationsResponse:
            return self._connection.call(self._stub.ListOperations, request, v1.ListOperationsResponse, harmless=True)

        return listing_of_pages(page, v1.ListOperationsRequest(), "operations", limit or USUAL_LIMIT)

    def cancel(self, operation_id: str) -> v1.Operation:
        return self._connection.call(self._stub.CancelOperation, v1.CancelOperationRequest(operation_id=operation_id),
                                     v1.Operation, harmless=True)

    def delete(self, operation_id: str) -> v1.Operation:
        """Removes one that has ended, with the files that it wrote; a take that it made stays. PermissionDenied: it is
        somebody else's."""
        return self._connection.call(self._stub.DeleteOperation, v1.DeleteOperationRequest(operation_id=operation_id),
                                     v1.Operation, harmless=False)

    def watch(self, operation_id: str, timeout_s: Optional[float] = None) -> Watch[v1.Operation]:
        """The state now, then every change, until it has ended. It begins anew where the daemon was killed."""
        return self._connection.watch(self._stub.WatchOperation, v1.WatchOperationRequest(operation_id=operation_id),
                                      timeout_s=timeout_s)

    def wait(self, operation_id: str, timeout_s: Optional[float] = None) -> v1.Operation:
        """When it has ended; `state` and `exit_status` say how. DeadlineExceeded: it has not."""
        with self.watch(operation_id, timeout_s) as states:
            for _ in states:
                pass
        return self.get(operation_id)

    def files(self, operation_id: str) -> Sequence[v1.OperationFile]:
        """What it wrote; it must be done."""
        def page(request: v1.ListOperationFilesRequest) -> v1.ListOperationFilesResponse:
            return self._connection.call(self._stub.ListOperationFiles, request, v1.ListOperationFilesResponse, harmless=True)

        return list(listing_of_pages(page, v1.ListOperationFilesRequest(operation_id=operation_id), "files"))

    def fetch(self, operation_id: str, folder: str | os.PathLike[str], progress: Optional[Progress] = None) -> Sequence[str]:
        """Writes everything that it wrote below `folder`; the paths."""
        files, paths = self.files(operation_id), []
        for done, file in enumerate(files, 1):
            below, _, name = file.path.rpartition("/")
            paths.append(os.path.join(folder_below(os.fspath(folder), below), check_name(name)))
            self._fetch_file(operation_id, file.path, paths[-1])
            if progress:
                progress(done, len(files))
        return paths

    def _fetch_file(self, operation_id: str, path: str, target: str) -> None:
        request = v1.FetchOperationFileRequest(operation_id=operation_id, path=path)

        def open_transfer(offset: int, version: str) -> object:
            request.offset, request.version = offset, version
            return self._connection.start(self._stub.FetchOperationFile, request, None)

        with written_atomically(target) as file:
            receive(self._connection, open_transfer, file, target)
