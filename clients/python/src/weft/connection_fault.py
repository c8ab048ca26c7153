"""Why a daemon cannot be spoken with, in the words of the C++ client (services/tools/client/connection_fault.h)."""

from __future__ import annotations

import re
import socket
import ssl
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Optional

from weft.channel import Identity, host_of, uses_tls

_TIMEOUT_S = 3.0
# X509_V_ERR_ of OpenSSL, which the module ssl has no names for.
_NOT_YET_VALID, _EXPIRED = 9, 10
_UNKNOWN_AUTHORITY = (2, 18, 19, 20, 21)
_OTHER_NAME = (62, 64)
# Both times of a certificate, DER: the module ssl decodes only certificates that it trusts.
_VALIDITY = re.compile(rb"\x30[\x1e\x20\x22](?:\x17\x0d|\x18\x0f)([0-9]{12,14})Z(?:\x17\x0d|\x18\x0f)([0-9]{12,14})Z")


def find_connection_fault(server: str, identity: Identity) -> str:
    """What is wrong between this client and HOST:PORT beyond that nothing listens there, with its remedy: TLS on one side
    alone, or a certificate that expired, is not valid yet, is for another name, or that no authority known here vouches for.

    Empty: nothing of it was found. Connects without a call, for a few seconds at the most: texts of gRPC tell these apart in no
    stable words. Raises nothing of the network."""
    if server.startswith("unix:"):
        return ""
    host, port = host_of(server), int(server.rpartition(":")[2])
    tls = uses_tls(host, identity)
    host = host.strip("[]")
    try:
        return _fault_of_tls(host, port, identity) if tls else _fault_of_plain(host, port)
    except OSError:  # nothing listens, or it went away meanwhile
        return ""


def _fault_of_plain(host: str, port: int) -> str:
    if _handshake(host, port, _trusting()) is None:
        return ""
    return "what listens there speaks TLS; set WEFT_TLS_CA to the certificate of its authority"


def _fault_of_tls(host: str, port: int, identity: Identity) -> str:
    seen = _handshake(host, port, _trusting())
    if seen is None:
        return ("what listens there speaks no TLS; start weftd there with --tls-cert and --tls-key"
                + (", or unset WEFT_TLS_CA where both run on one machine" if identity.authority else ""))
    checking = ssl.create_default_context(cafile=identity.authority or None)
    try:
        _handshake(host, port, checking)
    except ssl.SSLCertVerificationError as error:
        if error.verify_code not in _OTHER_NAME:
            return _words_for(error, _VALIDITY.search(seen.der))
        checking.check_hostname = False
        named = _handshake(host, port, checking)
        return (f"its certificate is for {_names_in(named.fields if named else {})}, not for {host}; connect by a name that it has, "
                "or have it made for this one, too")
    return ""


@dataclass(frozen=True)
class _Certificate:
    der: bytes
    fields: dict[str, Any]  # empty where it was not verified


def _trusting() -> ssl.SSLContext:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE  # who it is gets looked at afterwards
    return context


def _handshake(host: str, port: int, context: ssl.SSLContext) -> Optional[_Certificate]:
    """Of whoever listens; None where no TLS is spoken. SSLCertVerificationError; other OSErrors where nobody answers in time."""
    with socket.create_connection((host, port), timeout=_TIMEOUT_S) as plain:
        try:
            with context.wrap_socket(plain, server_hostname=host) as session:
                return _Certificate(session.getpeercert(binary_form=True) or b"", dict(session.getpeercert() or {}))
        except (ssl.SSLCertVerificationError, TimeoutError):
            raise
        except (ssl.SSLError, ConnectionError):
            return None


def _words_for(error: ssl.SSLCertVerificationError, validity: Optional[re.Match[bytes]]) -> str:
    begin, end = (_when(time) for time in validity.groups()) if validity else ("some time", "some time")
    if error.verify_code == _EXPIRED:
        return f"its certificate expired on {end}; renew the file of weftd --tls-cert there"
    if error.verify_code == _NOT_YET_VALID:
        return f"its certificate is valid from {begin} on; compare the clocks of both machines"
    if error.verify_code in _UNKNOWN_AUTHORITY:
        return "no authority that is known here vouches for its certificate; set WEFT_TLS_CA to the authority's certificate"
    return f"its certificate is refused: {error.verify_message}"


def _when(time: bytes) -> str:
    """UTCTime has two digits of the year, GeneralizedTime four."""
    text = time.decode()
    return datetime.strptime(text, "%y%m%d%H%M%S" if len(text) == 12 else "%Y%m%d%H%M%S").strftime("%b %e %H:%M:%S %Y GMT")


def _names_in(fields: dict[str, Any]) -> str:
    names = [name if kind == "DNS" else "an address" for kind, name in fields.get("subjectAltName", ()) if kind in ("DNS", "IP Address")]
    return ", ".join(names) or "no name"
