"""Every door of weftd that other machines reach: which TLS it speaks."""

import os
import re
import socket
import ssl
import subprocess
import unittest

from daemon_process import DaemonProcess
from studio import LONG_S, StudioTest, wait_for

V = ssl.TLSVersion
OLD = [("TLS 1.0", V.TLSv1, V.TLSv1, "ALL"), ("TLS 1.1", V.TLSv1_1, V.TLSv1_1, "ALL"),
       ("CBC", V.TLSv1_2, V.TLSv1_2, "ECDHE-ECDSA-AES128-SHA:ECDHE-ECDSA-AES256-SHA384:ECDHE-RSA-AES128-SHA:ECDHE-RSA-AES128-SHA256"),
       ("no forward secrecy", V.TLSv1_2, V.TLSv1_2, "AES128-SHA:AES256-GCM-SHA384:AES128-GCM-SHA256"),
       ("CCM", V.TLSv1_2, V.TLSv1_2, "ECDHE-ECDSA-AES128-CCM8:ECDHE-ECDSA-AES128-CCM")]
NEW = [("TLS 1.3", V.TLSv1_3, V.TLSv1_3, None), ("TLS 1.2, AES", V.TLSv1_2, V.TLSv1_2, "ECDHE+AESGCM"),
       ("TLS 1.2, ChaCha", V.TLSv1_2, V.TLSv1_2, "ECDHE+CHACHA20")]
CHACHA_IS_NOT_FOR_GRPC = "TLS 1.2, ChaCha"  # of its version 1.51


class Doors(DaemonProcess, StudioTest):
    KINDS = {"rsa": ["-newkey", "rsa:2048"], "ec": ["-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256"]}

    def make_certificate(self, kind):
        key, certificate = self.path(f"{kind}.key"), self.path(f"{kind}.crt")
        subprocess.run(["openssl", "req", "-x509", *self.KINDS[kind], "-nodes", "-keyout", key, "-out", certificate, "-days",
                        "2", "-subj", "/CN=studio", "-addext", "subjectAltName=IP:127.0.0.1"], check=True,
                       capture_output=True, timeout=LONG_S)
        os.chmod(key, 0o600)
        return ["--tls-cert", certificate, "--tls-key", key]

    def shakes_hands(self, port, least, most, ciphers):
        """What a client that knows nothing else agrees on with the server; None where they do not agree."""
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
        context.set_alpn_protocols(["h2", "http/1.1"])
        if ciphers:
            context.set_ciphers(ciphers + ":@SECLEVEL=0")
        context.minimum_version, context.maximum_version = least, most
        with socket.create_connection(("127.0.0.1", port), timeout=LONG_S) as plain:
            try:
                with context.wrap_socket(plain) as stream:
                    return stream.version(), stream.cipher()[0]
            except (ssl.SSLError, ConnectionError):
                return None

    def test_doors_speak_new_tls_alone(self):
        pages = self.path("pages")
        os.mkdir(pages)
        with open(os.path.join(pages, "index.html"), "w", encoding="utf-8") as file:
            file.write("<html></html>")
        for kind in self.KINDS:
            self.start("--listen", "0.0.0.0:0", "--metrics", "0.0.0.0:0", "--console", "0.0.0.0:0", "--console-files", pages,
                       "--state", self.path("state"), "--allow-path", self.folder, *self.make_certificate(kind),
                       environment={"GRPC_SSL_CIPHER_SUITES": "ALL:@SECLEVEL=0"})
            log = wait_for(lambda: "console at " in self.log() and self.log(), "the addresses")
            os.remove(self.path("weftd.log"))
            doors = {"calls": int(self.addresses[0].rsplit(":", 1)[1])}
            for name in ("metrics", "console"):
                doors[name] = int(re.search(rf"{name} at (?:https?://)?[^/\s]*:(\d+)", log).group(1))
            for door, port in doors.items():
                for what, *offer in NEW:
                    if door == "calls" and what == CHACHA_IS_NOT_FOR_GRPC:
                        continue
                    version, cipher = self.shakes_hands(port, *offer) or (None, "")
                    self.assertEqual(version, "TLSv1.3" if what == "TLS 1.3" else "TLSv1.2", (kind, door, what))
                    self.assertRegex(cipher, "GCM|CHACHA20", (kind, door, what))
                for what, *offer in OLD:
                    self.assertIsNone(self.shakes_hands(port, *offer), (kind, door, what))
            self.stop()


if __name__ == "__main__":
    unittest.main()
