"""Channels to a daemon, by the rules of the C++ client (services/tools/client/channel.h)."""

from __future__ import annotations

import ipaddress
import os
from dataclasses import dataclass
from typing import Optional

import grpc

from weft.errors import InvalidArgument, NotFound, PermissionDenied

_UNIX = "unix:"
_OPTIONS = (
    ("grpc.max_receive_message_length", 64 << 20),
    ("grpc.initial_reconnect_backoff_ms", 200),
    ("grpc.max_reconnect_backoff_ms", 1000),
    # Notices a daemon whose machine went away while something is watched.
    ("grpc.keepalive_time_ms", 60_000),
    ("grpc.keepalive_timeout_ms", 20_000),
    ("grpc.enable_http_proxy", 0),
    # Two clients of one process may have different tokens.
    ("grpc.use_local_subchannel_pool", 1),
)


@dataclass(frozen=True)
class Identity:
    """How a client shows who it is. Files, so that no secret stands in scripts or logs; empty: none."""

    token_file: str = ""
    authority: str = ""  # certificates that vouch for the daemon, PEM; empty: those of this machine
    certificate: str = ""  # the client's own, PEM
    key: str = ""  # of the certificate, PEM

    @staticmethod
    def from_environment() -> Identity:
        """WEFT_TOKEN_FILE, WEFT_TLS_CA, WEFT_TLS_CERT and WEFT_TLS_KEY."""
        return Identity(*(os.environ.get(name, "") for name in
                          ("WEFT_TOKEN_FILE", "WEFT_TLS_CA", "WEFT_TLS_CERT", "WEFT_TLS_KEY")))


def server_of(server: Optional[str]) -> str:
    """The address that is meant: WEFT_SERVER where none is given."""
    chosen = server or os.environ.get("WEFT_SERVER", "")
    if not chosen:
        raise InvalidArgument("server: give HOST:PORT or unix:PATH, or set WEFT_SERVER", field="server")
    return chosen


def host_of(server: str) -> str:
    """The host of HOST:PORT; InvalidArgument."""
    if "://" in server:
        address = server.partition("://")[2]
        raise InvalidArgument(f'server: "{server}" is the address of a page; give "{address}" with the port of weftd --listen',
                              field="server")
    host, colon, port = server.rpartition(":")
    if colon and host and port.isascii() and port.isdigit() and 0 < int(port) < 65536:
        return host
    raise InvalidArgument(f'server: "{server}" is not HOST:PORT or unix:PATH, for example 127.0.0.1:7411', field="server")


def _is_this_machine(host: str) -> bool:
    """An address of the loopback, and not a name that begins like one."""
    if host in ("localhost", "[::1]"):
        return True
    try:
        return ipaddress.IPv4Address(host).is_loopback
    except ValueError:
        return False


def uses_tls(host: str, identity: Identity) -> bool:
    """What leaves this machine is TLS, and so is all where an authority is named."""
    return not _is_this_machine(host) or bool(identity.authority)


def _read(variable: str, path: str) -> Optional[bytes]:
    if not path:
        return None
    try:
        with open(path, "rb") as file:
            return file.read(1 << 20)
    except PermissionError as error:
        raise PermissionDenied(f"{variable}: {path}: {error.strerror}", field=variable) from error
    except OSError as error:
        raise NotFound(f"{variable}: {path}: {error.strerror}", field=variable) from error


def _tls(identity: Identity) -> grpc.ChannelCredentials:
    if bool(identity.certificate) != bool(identity.key):
        raise InvalidArgument("WEFT_TLS_CERT and WEFT_TLS_KEY: a certificate needs its key; set both", field="WEFT_TLS_CERT")
    return grpc.ssl_channel_credentials(root_certificates=_read("WEFT_TLS_CA", identity.authority),
                                        certificate_chain=_read("WEFT_TLS_CERT", identity.certificate),
                                        private_key=_read("WEFT_TLS_KEY", identity.key))


def call_metadata(identity: Identity) -> tuple[tuple[str, str], ...]:
    """What every call carries. gRPC's own call credentials need TLS, which a socket on this machine has not."""
    token = (_read("WEFT_TOKEN_FILE", identity.token_file) or b"").decode("latin-1").strip()
    if not token.isascii() or not token.isprintable():
        raise InvalidArgument(f"WEFT_TOKEN_FILE: {identity.token_file}: holds no token", field="WEFT_TOKEN_FILE")
    return (("authorization", f"Bearer {token}"),) if token else ()


def open_channel(server: str, identity: Identity) -> grpc.Channel:
    """To "unix:PATH" or HOST:PORT, with TLS as `uses_tls` says.

    InvalidArgument: not an address, or a certificate without its key. NotFound, PermissionDenied: a file of the identity."""
    if not server.startswith(_UNIX):
        if uses_tls(host_of(server), identity):
            return grpc.secure_channel(server, _tls(identity), options=_OPTIONS)
    return grpc.insecure_channel(server, options=_OPTIONS)
