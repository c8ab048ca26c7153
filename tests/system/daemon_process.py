"""A weftd of a test, whose folder is `self.folder`."""

import os
import resource
import signal
import subprocess

from studio import BIN, LONG_S, read, wait_for


class DaemonProcess:
    daemon = None

    def path(self, *names):
        return os.path.join(self.folder, *names)

    def kill_daemon(self):
        if self.daemon and self.daemon.poll() is None:
            self.daemon.kill()
            self.daemon.wait()

    def start(self, *arguments, environment=None, descriptors=None):
        address_file = self.path("address")
        if os.path.exists(address_file):
            os.remove(address_file)
        log = open(self.path("weftd.log"), "a")
        self.addCleanup(log.close)
        limit = (lambda: resource.setrlimit(resource.RLIMIT_NOFILE, descriptors)) if descriptors else None
        self.daemon = subprocess.Popen(
            [os.path.join(BIN, "weftd"), "--address-file", address_file, *map(str, arguments)], stdout=log, stderr=log,
            env={**os.environ, **(environment or {})}, preexec_fn=limit)
        self.addCleanup(self.kill_daemon)

        def listening():
            self.assertIsNone(self.daemon.poll(), self.log())
            return os.path.exists(address_file) and read(address_file).splitlines()
        self.addresses = wait_for(listening, "weftd to listen")

    def start_plainly(self, *more, **options):
        self.start("--listen", "127.0.0.1:0", "--state", self.path("state"), "--allow-path", self.folder, *more, **options)

    def stop(self):
        self.daemon.send_signal(signal.SIGTERM)
        self.assertEqual(self.daemon.wait(timeout=LONG_S), 0)

    def log(self):
        return read(self.path("weftd.log"))

    def wait_for_log(self, words):
        wait_for(lambda: words in self.log(), f"\"{words}\" in the log")
