"""Takes that the daemon records."""

from __future__ import annotations

from typing import Optional

from weft import v1
from weft.connection import Connection, Watch, new_key
from weft.listing import USUAL_LIMIT, Listing, listing_of_pages
from weft.v1.takes_pb2_grpc import TakesStub


class _NewEvents:
    """A connection that was made again tells the newest events once more; these are taken out."""

    def __init__(self) -> None:
        self._seen: dict[bytes, None] = {}

    def __call__(self, take: v1.RecordedTake) -> v1.RecordedTake:
        keys = [event.SerializeToString(deterministic=True) for event in take.events]
        fresh = [event for event, key in zip(take.events, keys, strict=True) if key not in self._seen]
        self._seen.update(dict.fromkeys(keys))
        for oldest in list(self._seen)[:max(0, len(self._seen) - 1000)]:
            del self._seen[oldest]
        if len(fresh) < len(keys):
            copies = [v1.TakeEvent.FromString(event.SerializeToString()) for event in fresh]
            del take.events[:]
            take.events.extend(copies)
        return take


class Takes:
    """Starts, stops, watches and keeps takes. A take goes on when this client, or the daemon, ends."""

    def __init__(self, connection: Connection) -> None:
        self._connection, self._stub = connection, TakesStub(connection.channel)

    def start(self, *, session: Optional[v1.Session] = None, lease: str = "", seconds: float = 0, no_disk_test: bool = False,
              idempotency_key: str = "") -> v1.RecordedTake:
        """Records the cameras of a session.json, or those of a capture session by its lease; 0 seconds: until stop().

        Returns when the recorder runs; watch() tells whether its cameras open. FailedPrecondition: others use a camera."""
        recording = v1.RecorderRequest(session=session, seconds=seconds, no_disk_test=no_disk_test)
        request = v1.StartTakeRequest(recording=recording, lease=lease, idempotency_key=idempotency_key or new_key())
        return self._connection.call(self._stub.StartTake, request, v1.RecordedTake, harmless=True)

    def stop(self, take_id: str) -> v1.RecordedTake:
        """Asks for the end, and returns at once; watch() ends when the take is closed."""
        return self._connection.call(self._stub.StopTake, v1.StopTakeRequest(take_id=take_id), v1.RecordedTake, harmless=True)

    def get(self, take_id: str) -> v1.RecordedTake:
        return self._connection.call(self._stub.GetTake, v1.GetTakeRequest(take_id=take_id), v1.RecordedTake, harmless=True)

    def list(self, limit: int = 100, trash: bool = False, words: str = "") -> Listing[v1.RecordedTake]:
        """The newest first; those in the trash instead where asked for. `words`: those alone in whose slate, name, notes, id or
        timecode all of them stand, whatever their case."""
        def page(request: v1.ListTakesRequest) -> v1.ListTakesResponse:
            return self._connection.call(self._stub.ListTakes, request, v1.ListTakesResponse, harmless=True)

        return listing_of_pages(page, v1.ListTakesRequest(trash=trash, words=words), "takes", limit or USUAL_LIMIT)

    def describe(self, take_id: str, slate: str = "", notes: str = "", name: Optional[str] = None) -> v1.RecordedTake:
        """Replaces slate and notes, and the name where one is given; also while the take is recorded."""
        request = v1.DescribeTakeRequest(take_id=take_id, slate=slate, notes=notes, name=name)
        return self._connection.call(self._stub.DescribeTake, request, v1.RecordedTake, harmless=True)

    def watch(self, take_id: str, timeout_s: Optional[float] = None) -> Watch[v1.RecordedTake]:
        """The state now, then every change, at most four times a second, until the recorder has ended. `events` has what
        happened since the message before, each event once, also after a lost connection."""
        return self._connection.watch(self._stub.WatchTake, v1.WatchTakeRequest(take_id=take_id), _NewEvents(), timeout_s)

    def wait(self, take_id: str, timeout_s: Optional[float] = None) -> v1.RecordedTake:
        """The take when its recorder has ended. DeadlineExceeded: it has not."""
        with self.watch(take_id, timeout_s) as states:
            for _ in states:
                pass
        return self.get(take_id)

    def pin(self, take_id: str, pinned: bool = True) -> v1.RecordedTake:
        """A pinned take is neither deleted nor cleared away."""
        return self._connection.call(self._stub.PinTake, v1.PinTakeRequest(take_id=take_id, pinned=pinned), v1.RecordedTake,
                                     harmless=True)

    def delete(self, take_id: str) -> v1.RecordedTake:
        """Moves it to the trash."""
        return self._connection.call(self._stub.DeleteTake, v1.DeleteTakeRequest(take_id=take_id), v1.RecordedTake,
                                     harmless=False)

    def restore(self, take_id: str) -> v1.RecordedTake:
        """Brings it back from the trash."""
        return self._connection.call(self._stub.RestoreTake, v1.RestoreTakeRequest(take_id=take_id), v1.RecordedTake,
                                     harmless=False)

    def empty_trash(self, take_id: str) -> v1.EmptyTrashResponse:
        """Removes a take in the trash for good."""
        if not take_id:
            raise ValueError("take_id: must not be empty; empty_all_trash() removes every take in the trash")
        return self._empty(take_id)

    def empty_all_trash(self) -> v1.EmptyTrashResponse:
        return self._empty("")

    def _empty(self, take_id: str) -> v1.EmptyTrashResponse:
        return self._connection.call(self._stub.EmptyTrash, v1.EmptyTrashRequest(take_id=take_id), v1.EmptyTrashResponse,
                                     harmless=False, timeout_s=600.0)
