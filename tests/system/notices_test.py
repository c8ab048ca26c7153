"""Ends of takes and jobs, told to a program and to a server that is not always there."""

import hashlib
import hmac
import http.server
import json
import os
import signal
import ssl
import subprocess
import threading
import unittest

from daemon_process import DaemonProcess
from live_studio import enter_network, set_up_network
from studio import BIN, LONG_S, StudioTest, processes_of, read, wait_for, weft, write

SECRET = "0123456789abcdef0123456789abcdef"
PROGRAM = """#!/bin/sh
# Keeps each notice, once the test lets it.
echo begun >> "{folder}/runs"
while [ -e "{folder}/hold" ]; do sleep 0.05; done
cat > "{folder}/notices/$$.part"
mv "{folder}/notices/$$.part" "{folder}/notices/$$.json"
"""


def setUpModule():
    set_up_network([])


class Server:
    """Answers as it is told, with 200 in the end; keeps what it answered so."""

    def __init__(self, answers=(), port=0, tls=None, location=None, echoes=False):
        self.taken, self.refused, answers = [], [], list(answers)
        case = self

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_POST(self):
                body = self.rfile.read(int(self.headers["Content-Length"]))
                status = answers.pop(0) if answers else 200
                (case.taken if status == 200 else case.refused).append((self.path, dict(self.headers), body))
                self.send_response(status)
                if location:
                    self.send_header("Location", location)
                self.end_headers()
                if echoes:
                    self.wfile.write(b"see " + self.path[-24:-4].encode())

            def log_message(self, *_):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", port), Handler)
        if tls:
            context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            context.load_cert_chain(*tls)
            self.server.socket = context.wrap_socket(self.server.socket, server_side=True)
        self.port = self.server.server_port
        self.thread = threading.Thread(target=self.server.serve_forever)
        self.thread.start()

    def close(self):
        self.server.shutdown()
        self.thread.join()
        self.server.server_close()

    def notices(self):
        return [json.loads(body) for _, _, body in self.taken]


class Notices(DaemonProcess, StudioTest):
    def setUp(self):
        super().setUp()
        self.addCleanup(self.kill_recorders)
        os.mkdir(self.path("notices"))
        self.program, self.secret = self.path("tell it"), self.path("secret")
        write(self.program, PROGRAM.format(folder=self.folder))
        os.chmod(self.program, 0o755)
        write(self.secret, SECRET + "\n")
        os.chmod(self.secret, 0o600)

    def kill_recorders(self):
        for process in processes_of(self.folder, "weft-recorder"):
            os.kill(process, signal.SIGKILL)

    def serve(self, *answers, **options):
        server = Server(answers, **options)
        self.addCleanup(server.close)
        return server

    def run_process(self, *command, **options):
        process = subprocess.Popen([os.path.join(BIN, command[0]), *map(str, command[1:])], **options)
        self.addCleanup(self.end, process)
        return process

    @staticmethod
    def end(process):
        process.kill()
        process.wait()
        if process.stdout:
            process.stdout.close()

    def start_daemon(self, *more):
        self.start_plainly("--workers", 1, *more)
        self.server = self.addresses[0]

    def end_a_job(self):
        """Its id."""
        done = self.register("--server", self.server, "--frames", "0:1", "--json", check=0)
        return json.loads(done.stdout)["id"]

    def start_take(self):
        cameras = self.run_process("weft", "camera", "fake", "--pictures", self.take, "--fps", 5, "--session",
                                   self.path("session.json"), stdout=subprocess.PIPE, text=True)
        cameras.stdout.readline()
        session = {**json.loads(read(self.path("session.json"))), "max_wait_ms": 5000}
        write(self.path("session.json"), json.dumps(session))
        return weft("take", "start", "--server", self.server, "--session", self.path("session.json"), "--no-disk-test",
                    check=0).stdout.strip()

    def told_program(self):
        folder = self.path("notices")
        return [json.loads(read(os.path.join(folder, name))) for name in os.listdir(folder) if name.endswith(".json")]

    def waiting(self):
        return [name for kind in ("command", "url") for name in os.listdir(self.path("state", "notices", kind))]

    def test_program_and_server_are_told_of_jobs_and_takes(self):
        server = self.serve(503, 500)
        self.start_daemon("--on-end-command", self.program, "--on-end-url", f"http://127.0.0.1:{server.port}/ended?by=weft",
                          "--on-end-secret", self.secret)
        job = self.end_a_job()
        wait_for(lambda: server.taken and self.told_program(), "the job's notices")
        self.assertEqual(self.told_program(), server.notices())
        notice = server.notices()[0]
        self.assertEqual((notice["job"]["id"], notice["job"]["state"]), (job, "JOB_STATE_DONE"))
        self.assertNotIn("take", notice)
        path, headers, body = server.taken[0]
        self.assertEqual((path, headers["Content-Type"]), ("/ended?by=weft", "application/json"))
        self.assertEqual(headers["X-Weft-Signature"],
                         "sha256=" + hmac.new(SECRET.encode(), body, hashlib.sha256).hexdigest())
        self.assertEqual([refused[2] for refused in server.refused], [body, body])
        self.assertIn("answers 503", self.log())

        take = self.start_take()
        weft("take", "stop", take, "--server", self.server, check=0)
        wait_for(lambda: len(server.taken) == 2 and len(self.told_program()) == 2, "the take's notices")
        notice = server.notices()[1]
        self.assertEqual((notice["take"]["id"], notice["take"]["state"]["phase"]), (take, "RECORDER_PHASE_ENDED"))
        wait_for(lambda: not self.waiting(), "delivered notices to go")

    def test_what_was_not_delivered_is_after_a_kill(self):
        server = self.serve()
        server_port, closed = server.port, f"http://127.0.0.1:{server.port}/"
        server.server.server_close()  # nobody listens there
        options = ["--on-end-command", self.program, "--on-end-url", closed]
        write(self.path("hold"), "")
        self.start_daemon(*options)
        take = self.start_take()
        job = self.end_a_job()
        wait_for(lambda: os.path.exists(self.path("runs")) and "notice" in self.log(), "first tries")
        self.kill_daemon()
        self.assertEqual(self.told_program(), [])
        self.assertEqual(len(self.waiting()), 2)
        # The take ends while there is no daemon.
        os.kill(processes_of(self.folder, "weft-recorder")[0], signal.SIGTERM)
        wait_for(lambda: not processes_of(self.folder, "weft-recorder"), "the recorder to end")
        os.remove(self.path("hold"))
        again = self.serve(port=server_port)
        self.start_daemon(*options)
        wait_for(lambda: len(again.taken) >= 2 and not self.waiting(), "all notices")
        for told in (again.notices(), self.told_program()):
            self.assertEqual({next(one[kind]["id"] for kind in ("job", "take") if kind in one) for one in told}, {job, take})
        count = len(again.taken), len(self.told_program())
        self.stop()
        self.start_daemon(*options)
        self.end_a_job()
        wait_for(lambda: len(again.taken) > count[0], "the next notice")
        self.assertEqual(again.notices()[-1]["job"]["state"], "JOB_STATE_DONE")
        self.assertEqual(len(again.taken), count[0] + 1, "delivered notices came again")

    def test_program_that_fails_or_hangs_is_named_and_the_next_notice_comes(self):
        write(self.program, "#!/bin/sh\necho no such table >&2\nexit 3\n")
        self.start_daemon("--on-end-command", self.program)
        self.end_a_job()
        wait_for(lambda: "exit status 3; it printed: no such table" in self.log(), "the failure in the log")
        write(self.program, "#!/bin/sh\nexec sleep 1000\n")
        self.stop()
        self.start_daemon("--on-end-command", self.program, "--on-end-timeout-s", 1)
        self.end_a_job()
        wait_for(lambda: "took more than 1 s and was ended" in self.log(), "the time-out in the log")
        self.assertEqual(self.waiting(), [])

    def test_redirects_are_not_followed(self):
        elsewhere = self.serve()
        server = self.serve(*[307] * 1000, location=f"http://127.0.0.1:{elsewhere.port}/")
        self.start_daemon("--on-end-url", f"http://127.0.0.1:{server.port}/")
        self.end_a_job()
        wait_for(lambda: "answers 307, and redirects are not followed" in self.log(), "the redirect in the log")
        self.assertEqual(elsewhere.taken, [])

    def test_secrets_of_the_url_stay_out_of_the_log(self):
        server = self.serve(500, echoes=True)
        self.start_daemon("--on-end-url", f"http://127.0.0.1:{server.port}/services/T0AAAA/SECRETPATHabcdef?key=0123456789")
        self.end_a_job()
        wait_for(lambda: "answers 500" in self.log(), "the refusal in the log")
        self.assertIn(f"http://127.0.0.1:{server.port}/[redacted]: answers 500", self.log())
        for secret in ("T0AAAA", "SECRETPATH", "0123456789"):
            self.assertNotIn(secret, self.log())

    def test_certificates_are_checked(self):
        key, certificate = self.path("key.pem"), self.path("cert.pem")
        subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-keyout",
                        key, "-out", certificate, "-days", "2", "-subj", "/CN=studio", "-addext",
                        "subjectAltName=IP:127.0.0.1"], check=True, capture_output=True, timeout=LONG_S)
        server = self.serve(tls=(certificate, key))
        url = ["--on-end-url", f"https://127.0.0.1:{server.port}/"]
        self.start_daemon(*url)
        self.end_a_job()
        wait_for(lambda: "certificate" in self.log(), "the refusal in the log")
        self.assertEqual(server.taken, [])
        self.stop()
        self.start_daemon(*url, "--on-end-ca", certificate)
        wait_for(lambda: server.taken, "the notice")

    def test_bad_options_are_refused(self):
        os.chmod(self.secret, 0o644)
        write(self.path("short"), "abc")
        for options, *words in ((["--on-end-command", "tell"], "--on-end-command", "absolute"),
                                (["--on-end-command", self.path("none")], "--on-end-command", "none"),
                                (["--on-end-url", "http://studio.example/"], "--on-end-url", "https"),
                                (["--on-end-url", "https://u:p@studio.example/"], "--on-end-url", "--on-end-secret"),
                                (["--on-end-url", "ftp://studio.example/"], "--on-end-url", "https"),
                                (["--on-end-url", "https://studio.example/", "--on-end-secret", self.secret],
                                 "--on-end-secret", "chmod go-rwx"),
                                (["--on-end-url", "https://studio.example/", "--on-end-ca", self.path("none")],
                                 "--on-end-ca", "none")):
            done = subprocess.run([os.path.join(BIN, "weftd"), "--state", self.path("state"), "--allow-path", self.folder, *options], capture_output=True,
                                  text=True, timeout=LONG_S, check=False)
            self.assertEqual(done.returncode, 2, done.stderr)
            for word in words:
                self.assertIn(word, done.stderr)


if __name__ == "__main__":
    enter_network()
    unittest.main()
