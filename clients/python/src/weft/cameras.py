"""Cameras of the daemon's machine and network."""

from __future__ import annotations

from typing import Iterator, Optional, Sequence

import grpc

from weft import v1
from weft.connection import Connection
from weft.retry import Backoff, may_be_repeated
from weft.v1.cameras_pb2_grpc import CamerasStub


class Cameras:
    """Lists cameras, and shows what they see."""

    def __init__(self, connection: Connection) -> None:
        self._connection, self._stub = connection, CamerasStub(connection.channel)

    def list(self) -> Sequence[v1.ListedCamera]:
        """Those that answer, with who uses them. Takes about a second."""
        answer = self._connection.call(self._stub.ListCameras, v1.ListCamerasRequest(), v1.CameraList, harmless=True)
        return list(answer.cameras)

    def look(self, *, cameras: Optional[v1.Session] = None, lease: str = "", take_id: str = "", camera_id: str = "",
             width_px: int = 0) -> Iterator[v1.CameraLook]:
        """A JPEG per camera with its settings: of free cameras, which are opened for a moment, of a capture session, or of a
        take. Give one of the three; `camera_id`: this camera alone."""
        request = v1.LookAtCamerasRequest(cameras=cameras, lease=lease, take_id=take_id, camera_id=camera_id, width_px=width_px)
        backoff = Backoff(self._connection.calling)
        while True:
            call = self._connection.start(self._stub.LookAtCameras, request, 120.0)
            try:
                yield from call
                return
            except grpc.RpcError as error:
                failure = self._connection.explain(error)
            finally:
                call.cancel()
            self._connection.pause_or_raise(backoff, failure, may_be_repeated(failure, harmless=False))
