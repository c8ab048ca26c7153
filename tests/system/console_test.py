"""The console's server, as browsers and strangers meet it."""

import base64
import hashlib
import http.client
import json
import os
import random
import socket
import struct
import tempfile
import unittest

from daemon_process import DaemonProcess
from studio import read, wait_for, weft


def free_port():
    """A port that stays free while the daemon starts again: below those that connections of other programs are given."""
    while True:
        port = random.randrange(20000, 32000)
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", port))
                return port
            except OSError:
                continue


class Page:
    """What a page of the console does: requests with its origin and its cookie."""

    def __init__(self, port):
        self.port = port
        self.origin = f"http://127.0.0.1:{port}"
        self.cookie = None

    def ask(self, method, path, body=None, **headers):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=30)
        sent = {"Origin": self.origin, **({"Cookie": self.cookie} if self.cookie else {}),
                **({"Content-Type": "application/json"} if body is not None else {}),
                **{name.replace("_", "-"): value for name, value in headers.items()}}
        connection.request(method, path, body, {name: value for name, value in sent.items() if value is not None})
        answer = connection.getresponse()
        content = answer.read()
        connection.close()
        return answer, content

    def call(self, name, request=None):
        answer, content = self.ask("POST", f"/api/{name}", json.dumps(request or {}))
        return answer.status, json.loads(content)

    def log_in(self, token):
        answer, content = self.ask("POST", "/login", json.dumps({"token": token}))
        if answer.status == 200:
            self.cookie = answer.getheader("Set-Cookie").split(";")[0]
        return answer, json.loads(content)


class Live:
    """A WebSocket by hand (RFC 6455), so that no library mends what the server does."""

    def __init__(self, page, **headers):
        self.socket = socket.create_connection(("127.0.0.1", page.port), timeout=30)
        key = base64.b64encode(os.urandom(16)).decode()
        lines = {"Host": f"127.0.0.1:{page.port}", "Upgrade": "websocket", "Connection": "Upgrade", "Origin": page.origin,
                 "Sec-WebSocket-Key": key, "Sec-WebSocket-Version": "13", "Cookie": page.cookie or "none=1", **headers}
        self.socket.sendall(("GET /live HTTP/1.1\r\n" + "".join(f"{k}: {v}\r\n" for k, v in lines.items()) + "\r\n").encode())
        self.file = self.socket.makefile("rb")
        self.status = int(self.file.readline().split()[1])
        head = {}
        while (line := self.file.readline().strip()):
            name, _, value = line.decode().partition(": ")
            head[name.lower()] = value
        expected = base64.b64encode(hashlib.sha1((key + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11").encode()).digest()).decode()
        self.open = self.status == 101 and head.get("sec-websocket-accept") == expected

    def send(self, text):
        data, mask = text.encode(), os.urandom(4)
        assert len(data) < 126
        self.socket.sendall(struct.pack("BB", 0x81, 0x80 | len(data)) + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(data)))

    def receive(self):
        """The next text; None at the end."""
        while True:
            head = self.file.read(2)
            if len(head) < 2:
                return None
            length = head[1] & 127
            if length >= 126:
                length = int.from_bytes(self.file.read(2 if length == 126 else 8), "big")
            data = self.file.read(length)
            if head[0] & 15 == 1:
                return data.decode()
            if head[0] & 15 == 8:
                return None

    def end_of(self, number):
        while (text := self.receive()) is not None:
            line, _, rest = text.partition("\n")
            if line == f"{number} end":
                return json.loads(rest)
        return None

    def close(self):
        self.file.close()
        self.socket.close()


class Console(DaemonProcess, unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="weft console ")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        os.mkdir(self.path("state"), mode=0o700)
        self.viewer = self.new_token("anna", "viewer")
        self.operator = self.new_token("bert", "operator")
        self.port = free_port()
        self.begin()

    def begin(self):
        self.start_plainly("--console", f"127.0.0.1:{self.port}", "--workers", "1")

    def new_token(self, name, role):
        return weft("access", "token", name, "--role", role, "--state", self.path("state"), check=0).stdout.strip()

    def page(self, token=None):
        page = Page(self.port)
        if token:
            self.assertEqual(page.log_in(token)[0].status, 200)
        return page

    def test_a_token_is_exchanged_for_a_cookie_once(self):
        page = Page(self.port)
        self.assertEqual(page.ask("GET", "/session")[0].status, 401)
        answer, user = page.log_in(self.viewer)
        self.assertEqual(answer.status, 200)
        cookie = answer.getheader("Set-Cookie")
        for part in ("HttpOnly", "SameSite=Strict", "Path=/"):
            self.assertIn(part, cookie)
        self.assertNotIn(self.viewer, cookie)
        self.assertIn("(anna)", user["caller"])
        self.assertEqual(json.loads(page.ask("GET", "/session")[1])["role"], user["role"])
        # The next daemon knows the browser; what is on the disk lets nobody in.
        self.stop()
        self.assertNotIn(page.cookie.split("=")[1], read(self.path("state", "console.json")))
        self.begin()
        self.assertEqual(page.ask("GET", "/session")[0].status, 200)
        self.assertEqual(page.ask("POST", "/logout", "{}")[0].status, 200)
        self.assertEqual(page.ask("GET", "/session")[0].status, 401)
        # Nothing that was said shows the token.
        for text in (self.log(), read(self.path("state", "audit.log"))):
            self.assertNotIn(self.viewer, text)

    def test_calls_have_the_roles_limits_and_errors_of_the_api(self):
        viewer, operator = self.page(self.viewer), self.page(self.operator)
        status, info = viewer.call("Server/GetServerInfo")
        self.assertEqual((status, info["version"]), (200, self.version()))
        self.assertEqual(viewer.call("Jobs/ListJobs")[0], 200)
        status, error = viewer.call("Jobs/CancelJob", {"job_id": "j1"})
        self.assertEqual((status, error["code"]), (403, "PERMISSION_DENIED"))
        status, error = operator.call("Jobs/CancelJob", {"job_id": "j1"})
        self.assertEqual((status, error["code"]), (404, "NOT_FOUND"))
        status, error = viewer.call("Jobs/ListJobs", {"nothing_like_it": 1})
        self.assertEqual((status, error["code"]), (400, "INVALID_ARGUMENT"))
        self.assertIn("nothing_like_it", error["message"])
        self.assertEqual(viewer.call("Jobs/MakeCoffee")[0], 404)
        self.assertEqual(viewer.call("Jobs/WatchJob", {"job_id": "j1"})[0], 404)
        answer, content = viewer.ask("GET", "/file/Jobs/FetchResult?job_id=j1&kind=RESULT_KIND_JOB_REPORT")
        self.assertEqual(answer.status, 404, content)
        # The audit log tells who it was, and from where.
        self.assertRegex(read(self.path("state", "audit.log")), r"anna.*CancelJob|CancelJob.*anna")

    def version(self):
        return weft("--version", check=0).stdout.split()[-1]

    def test_pages_of_other_sites_are_refused(self):
        page = self.page(self.operator)
        for headers, status in (({"Origin": "http://evil.example"}, 403), ({"Origin": None}, 403), ({"Origin": "null"}, 403),
                                ({"Host": "evil.example"}, 421), ({"Host": f"evil.example:{self.port}"}, 421),
                                ({"Sec_Fetch_Site": "cross-site"}, 403), ({"Sec_Fetch_Site": "same-site"}, 403),
                                ({"Content_Type": "text/plain"}, 415)):
            answer, content = page.ask("POST", "/api/Jobs/ListJobs", "{}", **headers)
            self.assertEqual(answer.status, status, (headers, content))
        self.assertEqual(page.ask("GET", "/session", Origin=None, Sec_Fetch_Site="same-origin")[0].status, 200)
        live = Live(page, Origin="http://evil.example")
        self.addCleanup(live.close)
        self.assertEqual(live.status, 403)

    def test_every_answer_forbids_content_from_elsewhere(self):
        for answer, _ in (self.page().ask("GET", "/"), self.page().ask("GET", "/session"), self.page().ask("GET", "/none")):
            policy = answer.getheader("Content-Security-Policy")
            self.assertIn("default-src 'none'", policy)
            self.assertNotIn("unsafe-inline", policy)
            self.assertEqual(answer.getheader("X-Content-Type-Options"), "nosniff")

    def test_wrong_tokens_are_counted_and_recorded(self):
        page = Page(self.port)
        slip = self.viewer[:-1] + ("0" if self.viewer[-1] != "0" else "1")
        statuses = [page.log_in(slip)[0].status for _ in range(12)]
        self.assertEqual(statuses[:10], [401] * 10)
        self.assertEqual(statuses[11], 429)
        audit = read(self.path("state", "audit.log"))
        self.assertIn("POST /login", audit)
        self.assertNotIn(slip, audit + self.log())

    def test_a_revoked_token_ends_its_sessions_and_sockets(self):
        page = self.page(self.viewer)
        live = Live(page)
        self.addCleanup(live.close)
        self.assertTrue(live.open)
        tokens = json.loads(weft("access", "list", "--json", "--state", self.path("state"), check=0).stdout)["tokens"]
        weft("access", "revoke", next(t["id"] for t in tokens if t["name"] == "anna"), "--state", self.path("state"), check=0)
        wait_for(lambda: page.ask("GET", "/session")[0].status == 401, "the session to end")
        self.assertEqual(live.end_of(0)["code"], "UNAUTHENTICATED")
        self.assertIsNone(live.receive())

    def test_streams_come_over_one_socket(self):
        stranger = Live(Page(self.port))
        self.addCleanup(stranger.close)
        self.assertEqual(stranger.status, 401)
        live = Live(self.page(self.viewer))
        self.addCleanup(live.close)
        self.assertTrue(live.open)
        self.assertTrue(live.receive().startswith("0 alive\n"))
        live.send('1 Jobs.WatchJob\n{"job_id": "j1"}')
        self.assertEqual(live.end_of(1)["code"], "NOT_FOUND")
        live.send("2 Jobs.MakeCoffee\n{}")
        self.assertEqual(live.end_of(2)["code"], "UNIMPLEMENTED")
        live.send("3 Jobs.WatchJob\n{not json")
        self.assertEqual(live.end_of(3)["code"], "INVALID_ARGUMENT")
        live.send("no number")
        self.assertEqual(live.end_of(0)["code"], "INVALID_ARGUMENT")

    def test_requests_that_cannot_be_end_without_harm(self):
        page = self.page(self.viewer)
        for path in ("/../etc/passwd", "/%2e%2e/etc/passwd", "/file/%00", "/a//b", "/%zz", "/" + "a" * 3000):
            self.assertEqual(page.ask("GET", path)[0].status, 400, path)
        self.assertEqual(page.ask("DELETE", "/session")[0].status, 405)
        for raw in (b"GARBAGE\r\n\r\n", b"GET / HTTP/1.1\r\nHost: " + b"a" * 40000 + b"\r\n\r\n",
                    b"POST /login HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 99999999999\r\n\r\n", b"\x16\x03\x01\x00"):
            with socket.create_connection(("127.0.0.1", self.port), timeout=30) as stranger:
                try:
                    stranger.sendall(raw)
                    stranger.shutdown(socket.SHUT_WR)
                    while stranger.recv(65536):
                        pass
                except OSError:
                    pass
        try:
            status = page.ask("POST", "/api/Jobs/ListJobs", "x" * (2 << 20))[0].status
            self.assertGreaterEqual(status, 400)
        except (ConnectionError, http.client.HTTPException):
            pass
        self.assertEqual(page.ask("GET", "/session")[0].status, 200)

    def test_files_come_whole_and_in_ranges(self):
        board = self.path("board")
        weft("pattern", "generate", "--rows", 12, "--cols", 12, "--cell-mm", 5, "--out", board, check=0)
        weft("library", "upload", "board", os.path.join(board, "board.json"), "--name", "b", "--server", self.addresses[0], check=0)
        page = self.page(self.viewer)
        target = "/file/Library/FetchFile?kind=ITEM_KIND_BOARD&item=b&path=board.png"
        answer, whole = page.ask("GET", target)
        tag = answer.getheader("ETag")
        self.assertEqual((answer.status, answer.getheader("Content-Type")), (200, "image/png"))
        self.assertEqual(whole, read(os.path.join(board, "board.png"), "rb"))
        self.assertIn("sandbox", answer.getheader("Content-Security-Policy"))
        size = len(whole)
        for text, first, end in (("bytes=10-19", 10, 20), ("bytes=10-", 10, size), (f"bytes=0-{size + 5}", 0, size),
                                 ("bytes=5-9223372036854775807", 5, size)):
            answer, part = page.ask("GET", target, Range=text, If_Range=tag)
            self.assertEqual((answer.status, part), (206, whole[first:end]), text)
            self.assertEqual(answer.getheader("Content-Range"), f"bytes {first}-{end - 1}/{size}")
        self.assertEqual(page.ask("GET", target, Range=f"bytes={size + 1}-", If_Range=tag)[0].status, 416)
        # Nobody knows what file a rest is of that names no version.
        answer, content = page.ask("GET", target, Range="bytes=10-19")
        self.assertEqual((answer.status, content), (200, whole))
        self.assertEqual(page.ask("GET", target, Range="bytes=10-19", If_Range='"another"')[0].status, 409)
        self.assertIn("attachment", page.ask("GET", target + "&save_as=b.png")[0].getheader("Content-Disposition"))
        self.assertEqual(page.ask("HEAD", target)[1], b"")

    def test_half_requests_of_a_few_addresses_shut_nobody_out(self):
        page = self.page(self.viewer)
        held = []
        for number in range(21, 24):
            for _ in range(96):
                stranger = socket.create_connection(("127.0.0.1", self.port), timeout=30, source_address=(f"127.0.0.{number}", 0))
                stranger.sendall(b"GET / HT")
                held.append(stranger)
        for _ in range(12):
            self.assertEqual(page.ask("GET", "/session")[0].status, 200)
        self.assertEqual(Page(self.port).log_in(self.viewer)[0].status, 200)
        # A request that does not end is given up soon.
        for stranger in (held[0], held[-1]):
            stranger.settimeout(10)
            try:
                self.assertEqual(stranger.recv(1), b"")
            except ConnectionResetError:
                pass
        for stranger in held:
            stranger.close()

    def test_one_address_cannot_hold_all_connections(self):
        page = self.page(self.viewer)
        held = [socket.create_connection(("127.0.0.1", self.port), timeout=30) for _ in range(90)]
        self.assertEqual(page.ask("GET", "/session")[0].status, 200)
        held += [socket.create_connection(("127.0.0.1", self.port), timeout=30) for _ in range(20)]
        # Those beyond the limit are closed at once.
        held[-1].settimeout(10)
        self.assertEqual(held[-1].recv(1), b"")
        for connection in held:
            connection.close()
        wait_for(lambda: page.ask("GET", "/session")[0].status == 200, "room again")

    def test_without_pages_the_root_says_so(self):
        self.stop()
        self.start_plainly("--console", f"127.0.0.1:{self.port}", "--workers", "1", "--console-files", "")
        answer, content = Page(self.port).ask("GET", "/")
        self.assertEqual(answer.status, 404)
        self.assertIn(b"--console-files", content)
        os.makedirs(self.path("pages", "assets"))
        with open(self.path("pages", "index.html"), "w") as file:
            file.write("<!doctype html><title>Weft</title>" + "x" * 5000)
        with open(self.path("pages", "assets", "main-1a2b3c4d.js"), "w") as file:
            file.write("1;")
        self.stop()
        self.start_plainly("--console", f"127.0.0.1:{self.port}", "--workers", "1", "--console-files", self.path("pages"))
        answer, content = Page(self.port).ask("GET", "/", Accept_Encoding="gzip")
        self.assertEqual((answer.status, answer.getheader("Content-Encoding")), (200, "gzip"))
        again, content = Page(self.port).ask("GET", "/", If_None_Match=answer.getheader("ETag"))
        self.assertEqual((again.status, content), (304, b""))
        answer, content = Page(self.port).ask("GET", "/assets/main-1a2b3c4d.js")
        self.assertEqual((answer.status, content), (200, b"1;"))
        self.assertIn("immutable", answer.getheader("Cache-Control"))
        self.assertIn("javascript", answer.getheader("Content-Type"))


if __name__ == "__main__":
    unittest.main()
