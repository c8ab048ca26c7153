"""Capture sessions: who works with which cameras."""

from __future__ import annotations

import contextlib
import threading
from typing import Iterator, Optional

from weft import v1
from weft.connection import Connection, new_key
from weft.errors import Unavailable, WeftError
from weft.listing import USUAL_LIMIT, Listing, listing_of_pages
from weft.v1.sessions_pb2_grpc import SessionsStub


class Sessions:
    """Opens, renews and closes sessions."""

    def __init__(self, connection: Connection) -> None:
        self._connection, self._stub = connection, SessionsStub(connection.channel)

    def open(self, request: v1.OpenSessionRequest) -> v1.CaptureSession:
        """Reserves cameras. The answer alone has the lease, the secret that proves the owner to the other calls.

        FailedPrecondition: somebody else uses a camera; `take_over` of the request ends their session."""
        keyed = v1.OpenSessionRequest()
        keyed.CopyFrom(request)
        keyed.idempotency_key = request.idempotency_key or new_key()
        return self._connection.call(self._stub.OpenSession, keyed, v1.CaptureSession, harmless=True)

    def renew(self, lease: str) -> v1.CaptureSession:
        """The lease lasts its whole time again."""
        return self._connection.call(self._stub.RenewSession, v1.RenewSessionRequest(lease=lease), v1.CaptureSession,
                                     harmless=True)

    def close(self, lease: str) -> v1.CaptureSession:
        """Frees the cameras. A take that runs goes on."""
        return self._connection.call(self._stub.CloseSession, v1.CloseSessionRequest(lease=lease), v1.CaptureSession,
                                     harmless=True)

    def get(self, session_id: str) -> v1.CaptureSession:
        return self._connection.call(self._stub.GetSession, v1.GetSessionRequest(session_id=session_id), v1.CaptureSession,
                                     harmless=True)

    def list(self, limit: int = 100) -> Listing[v1.CaptureSession]:
        """The newest first."""
        def page(request: v1.ListSessionsRequest) -> v1.ListSessionsResponse:
            return self._connection.call(self._stub.ListSessions, request, v1.ListSessionsResponse, harmless=True)

        return listing_of_pages(page, v1.ListSessionsRequest(), "sessions", limit or USUAL_LIMIT)

    @contextlib.contextmanager
    def hold(self, request: v1.OpenSessionRequest) -> Iterator[v1.CaptureSession]:
        """A session for a `with` block: a thread renews its lease, and the end of the block closes it. Where the session was
        lost meanwhile, the end of a block that went well raises why."""
        session = self.open(request)
        over = threading.Event()
        lost: list[WeftError] = []

        def renew() -> None:
            while not over.wait(session.lease_s / 3):
                try:
                    self.renew(session.lease)
                except Unavailable:
                    continue  # a daemon that is back within the lease still knows the session
                except WeftError as error:
                    lost.append(error)
                    return

        renewer = threading.Thread(target=renew, name="weft-lease", daemon=True)
        renewer.start()
        failure: Optional[BaseException] = None
        try:
            yield session
        except BaseException as error:
            failure = error
            raise
        finally:
            over.set()
            renewer.join()
            if lost and failure is None:
                raise lost[0]
            if not lost:
                with contextlib.suppress(*([WeftError] if failure else [])):
                    self.close(session.lease)
