"""HTTP/2 frames byte by byte (RFC 9113), for clients that no library would be."""

import os
import socket
import struct

PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
DATA, HEADERS, RST_STREAM, SETTINGS, PING, WINDOW_UPDATE, CONTINUATION = 0, 1, 3, 4, 6, 8, 9
END_STREAM, END_HEADERS = 1, 4
INITIAL_WINDOW_SIZE = 4
CANCEL = struct.pack(">I", 8)


def frame(kind, flags, stream, payload=b""):
    return struct.pack(">I", len(payload))[1:] + bytes([kind, flags]) + struct.pack(">I", stream) + payload


def settings(**values):
    numbers = {"initial_window_size": INITIAL_WINDOW_SIZE}
    return frame(SETTINGS, 0, 0, b"".join(struct.pack(">HI", numbers[name], value) for name, value in values.items()))


def _text(text):
    """A string literal without Huffman (RFC 7541, 5.2), shorter than 16 kB."""
    data = text.encode()
    if len(data) < 127:
        return bytes([len(data)]) + data
    rest = len(data) - 127
    return bytes([127, *([rest] if rest < 128 else [rest % 128 + 128, rest // 128])]) + data


def header_block(path, token=None, more=()):
    fields = [(":method", "POST"), (":scheme", "http"), (":path", path), (":authority", "localhost"), ("te", "trailers"),
              ("content-type", "application/grpc"), *([("authorization", f"Bearer {token}")] if token else []), *more]
    return b"".join(b"\0" + _text(name) + _text(value) for name, value in fields)


def message(data):
    return struct.pack(">BI", 0, len(data)) + data


def field(number, data):
    """A field of bytes or text of a protobuf message, shorter than 16 kB."""
    data = data.encode() if isinstance(data, str) else data
    length = [len(data)] if len(data) < 128 else [len(data) % 128 + 128, len(data) // 128]
    return bytes([number << 3 | 2, *length]) + data


def call(stream, path, data, token=None):
    """The frames of a call with one message."""
    return (frame(HEADERS, END_HEADERS, stream, header_block(path, token)) +
            frame(DATA, END_STREAM, stream, message(data)))


def connect(address, hello=PREFACE + settings()):
    """To "unix:PATH" or HOST:PORT."""
    if address.startswith("unix:"):
        connection = socket.socket(socket.AF_UNIX)
        connection.connect(address[5:])
    else:
        host, port = address.rsplit(":", 1)
        connection = socket.create_connection((host, int(port)), timeout=10)
    connection.sendall(hello)
    return connection


def noise(size):
    return os.urandom(size)


def send_packed(address, method, token, encoding, data):
    """A call with a message that says it is compressed; what is answered until there is silence."""
    with connect(address) as connection:
        connection.sendall(frame(HEADERS, END_HEADERS, 1, header_block(method, token, [("grpc-encoding", encoding)])))
        packed = struct.pack(">BI", 1, len(data)) + data
        pieces = [packed[at:at + 16000] for at in range(0, len(packed), 16000)]
        said = b""
        connection.settimeout(2)
        try:
            for piece in pieces:
                connection.sendall(frame(DATA, END_STREAM if piece is pieces[-1] else 0, 1, piece))
            while part := connection.recv(65536):
                said += part
        except OSError:
            pass
    return said
