"""The client of a daemon."""

from __future__ import annotations

from typing import Optional

from weft import v1
from weft.cameras import Cameras
from weft.channel import Identity, server_of
from weft.connection import Connection
from weft.jobs import Jobs
from weft.library import Library
from weft.operations import Operations
from weft.retry import RetryPolicy
from weft.sessions import Sessions
from weft.takes import Takes
from weft.v1.server_pb2_grpc import ServerStub


class Client:
    """A connection to one daemon, with a member per service. Any thread may use it. It does not survive os.fork().

    `server` is HOST:PORT or unix:PATH, by default WEFT_SERVER; `identity` by default what WEFT_TOKEN_FILE, WEFT_TLS_CA,
    WEFT_TLS_CERT and WEFT_TLS_KEY say. Nothing is asked of the daemon until the first call. Calls whose repetition does no
    harm are repeated as `calling` says while no daemon answers; watches and their connection, as `watching` says."""

    def __init__(self, server: Optional[str] = None, *, identity: Optional[Identity] = None,
                 calling: RetryPolicy = RetryPolicy(), watching: RetryPolicy = RetryPolicy(patience_s=600.0)) -> None:
        self._connection = Connection(server_of(server), identity or Identity.from_environment(), calling, watching)
        self.library = Library(self._connection)
        self.jobs = Jobs(self._connection, self.library)
        self.takes = Takes(self._connection)
        self.sessions = Sessions(self._connection)
        self.cameras = Cameras(self._connection)
        self.operations = Operations(self._connection)
        self._server = ServerStub(self._connection.channel)

    @property
    def server(self) -> str:
        return self._connection.server

    def server_info(self) -> v1.ServerInfo:
        """Version, workers, jobs and warnings of the daemon."""
        return self._connection.call(self._server.GetServerInfo, v1.GetServerInfoRequest(), v1.ServerInfo, harmless=True)

    def rehearse_retention(self, rules: Optional[v1.RetentionRules] = None, ahead_days: float = 0.0) -> v1.RetentionRehearsal:
        """What the daemon would remove by itself within so many days, by its rules or these; nothing is removed."""
        request = v1.RehearseRetentionRequest(rules=rules, ahead_days=ahead_days)
        return self._connection.call(self._server.RehearseRetention, request, v1.RetentionRehearsal, harmless=True)

    def close(self) -> None:
        """Ends all calls. Jobs, takes and operations go on."""
        self._connection.close()

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
