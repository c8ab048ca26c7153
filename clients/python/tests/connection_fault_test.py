"""What keeps calls from a daemon is named: certificates of every kind, made by openssl, shown by servers of this process."""

import contextlib
import os
import socket
import ssl
import subprocess
import tempfile
import threading
import unittest

import weft
from weft.connection_fault import find_connection_fault

CA_CONFIG = """[ca]
default_ca = own
[own]
database = {folder}/index.txt
serial = {folder}/serial
new_certs_dir = {folder}
default_md = sha256
policy = any
unique_subject = no
copy_extensions = copy
[any]
commonName = supplied
"""


class Authority:
    """Signs certificates of any time and name."""

    def __init__(self, folder):
        self.folder = folder
        os.makedirs(folder)
        self.certificate = os.path.join(folder, "authority.pem")
        self.key = os.path.join(folder, "authority.key")
        self.config = os.path.join(folder, "ca.conf")
        for name, text in (("ca.conf", CA_CONFIG.format(folder=folder)), ("index.txt", ""), ("serial", "01\n")):
            with open(os.path.join(folder, name), "w", encoding="ascii") as file:
                file.write(text)
        self.openssl("req", "-x509", "-newkey", "rsa:2048", "-nodes", "-keyout", self.key, "-out", self.certificate, "-days", "30",
                     "-subj", "/CN=authority")

    def openssl(self, *arguments):
        subprocess.run(["openssl", *arguments], check=True, capture_output=True, cwd=self.folder)

    def sign(self, name, alternatives, start="20200101000000Z", end="20400101000000Z"):
        """Certificate and key of a server."""
        request, key, certificate = (os.path.join(self.folder, f"{name}.{kind}") for kind in ("csr", "key", "pem"))
        self.openssl("req", "-new", "-newkey", "rsa:2048", "-nodes", "-keyout", key, "-out", request, "-subj", f"/CN={name}",
                     "-addext", f"subjectAltName={alternatives}")
        self.openssl("ca", "-batch", "-config", self.config, "-cert", self.certificate, "-keyfile", self.key, "-in", request,
                     "-out", certificate, "-startdate", start, "-enddate", end, "-notext")
        return certificate, key


@contextlib.contextmanager
def server(certificate=None):
    """The port of a server of TLS, or of one that answers in plain HTTP."""
    context = None
    if certificate:
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.set_alpn_protocols(["h2"])
        context.load_cert_chain(*certificate)
    with socket.create_server(("127.0.0.1", 0)) as listening:
        def serve():
            while True:
                try:
                    plain, _ = listening.accept()
                except OSError:
                    return
                with plain, contextlib.suppress(OSError):
                    if context is None:
                        plain.sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n")
                    else:
                        with context.wrap_socket(plain, server_side=True) as session:
                            session.recv(1)

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        yield listening.getsockname()[1]
        listening.shutdown(socket.SHUT_RDWR)
        thread.join()


class ConnectionFaultTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="weft faults ")
        cls.addClassCleanup(folder.cleanup)
        cls.studio = Authority(os.path.join(folder.name, "studio"))
        cls.foreign = Authority(os.path.join(folder.name, "foreign"))

    def fault(self, certificate, authority=None, host="127.0.0.1"):
        with server(certificate) as port:
            return find_connection_fault(f"{host}:{port}", weft.Identity(authority=authority or ""))

    def test_names_what_is_wrong_with_a_certificate(self):
        authority = self.studio.certificate
        self.assertEqual(self.fault(self.studio.sign("good", "IP:127.0.0.1"), authority), "")
        expired = self.studio.sign("expired", "IP:127.0.0.1", end="20210203040506Z")
        self.assertIn("expired on Feb  3 04:05:06 2021 GMT; renew", self.fault(expired, authority))
        later = self.studio.sign("later", "IP:127.0.0.1", start="20390203040506Z")
        self.assertIn("valid from Feb  3 04:05:06 2039 GMT on; compare the clocks", self.fault(later, authority))
        beyond = self.studio.sign("beyond", "IP:127.0.0.1", start="20510203040506Z", end="20520101000000Z")
        self.assertIn("valid from Feb  3 04:05:06 2051 GMT", self.fault(beyond, authority))
        other = self.studio.sign("other", "DNS:studio.example,IP:192.0.2.1")
        self.assertIn("for studio.example, an address, not for 127.0.0.1", self.fault(other, authority))
        self.assertIn("not for localhost", self.fault(other, authority, host="localhost"))
        self.assertIn("set WEFT_TLS_CA", self.fault(self.foreign.sign("foreign", "IP:127.0.0.1"), authority))

    def test_names_tls_on_one_side_alone(self):
        self.assertIn("speaks no TLS; start weftd there with --tls-cert", self.fault(None, self.studio.certificate))
        self.assertIn("speaks TLS; set WEFT_TLS_CA", self.fault(self.studio.sign("own", "IP:127.0.0.1")))

    def test_says_nothing_where_nothing_is_wrong_or_nobody_listens(self):
        self.assertEqual(self.fault(None), "")
        with socket.create_server(("127.0.0.1", 0)) as listening:
            port = listening.getsockname()[1]
        self.assertEqual(find_connection_fault(f"127.0.0.1:{port}", weft.Identity(authority=self.studio.certificate)), "")
        self.assertEqual(find_connection_fault("unix:/nowhere", weft.Identity()), "")

    def test_calls_fail_at_once_with_these_words(self):
        expired = self.studio.sign("old", "IP:127.0.0.1", end="20210203040506Z")
        with server(expired) as port, weft.Client(f"127.0.0.1:{port}",
                                                  identity=weft.Identity(authority=self.studio.certificate)) as client:
            with self.assertRaisesRegex(weft.FailedPrecondition, "no call reaches the daemon at .*: its certificate expired"):
                client.server_info()

    def test_refuses_addresses_of_pages(self):
        with self.assertRaisesRegex(weft.InvalidArgument, 'give "studio:7411"'):
            weft.Client("http://studio:7411")


if __name__ == "__main__":
    unittest.main()
