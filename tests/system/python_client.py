"""The Python client of this source tree, installed for a test, and a daemon that it talks to."""

import atexit
import os
import shutil
import signal
import subprocess
import sys
import tempfile

import studio
from studio import BIN, StudioTest, read, wait_for

PACKAGE = os.path.join(os.environ["WEFT_SOURCE"], "clients", "python")
EXAMPLES = os.path.join(PACKAGE, "examples")


def tree(folder):
    return sorted(os.path.join(base, name) for base, _, names in os.walk(folder) for name in names)


def install(source, environment):
    """Into a new virtual environment, without an index; the path of its Python."""
    subprocess.run([sys.executable, "-m", "venv", "--system-site-packages", "--without-pip", environment], check=True)
    python = os.path.join(environment, "bin", "python")
    subprocess.run([python, "-m", "pip", "install", "--quiet", "--no-index", "--no-build-isolation",
                    "--disable-pip-version-check", "--root-user-action", "ignore", source], check=True)
    return python


# As users install it, for as long as this process lives.
_folder = tempfile.mkdtemp(prefix="weft python ")
atexit.register(shutil.rmtree, _folder)
_before = tree(PACKAGE)
PYTHON = install(PACKAGE, os.path.join(_folder, "environment"))
assert tree(PACKAGE) == _before, "an installation leaves the source tree as it was"
sys.path.insert(0, subprocess.run([PYTHON, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"],
                                  capture_output=True, text=True, check=True).stdout.strip())
import weft  # noqa: E402  # it is there only now


def example(name, *arguments, check=0):
    done = subprocess.run([PYTHON, os.path.join(EXAMPLES, name), *map(str, arguments)], capture_output=True, text=True,
                          timeout=studio.LONG_S, check=False)
    assert done.returncode == check, f"{name}: {done.returncode}\n{done.stdout}{done.stderr}"
    return done


class ClientTest(StudioTest):
    def setUp(self):
        super().setUp()
        self.daemon = None
        os.mkdir(self.path("allowed"))
        self.socket = f"unix:{self.path('weftd.sock')}"
        self.addCleanup(self.end_daemon, signal.SIGKILL)

    def start_daemon(self, *more, listen=None):
        address = self.path("address")
        if os.path.exists(address):
            os.remove(address)
        log = open(self.path("weftd.log"), "a")
        self.addCleanup(log.close)
        self.daemon = subprocess.Popen(
            [os.path.join(BIN, "weftd"), "--listen", listen or self.socket, "--address-file", address, "--state",
             self.path("state"), "--allow-path", self.path("allowed"), "--workers", "1", *more], stdout=log, stderr=log)

        def listening():
            self.assertIsNone(self.daemon.poll(), read(self.path("weftd.log")))
            return os.path.exists(address) and read(address).strip()
        return wait_for(listening, "weftd to listen")

    def end_daemon(self, how):
        if self.daemon and self.daemon.poll() is None:
            self.daemon.send_signal(how)
            self.daemon.wait()

    def client(self, server=None, **options):
        # Much longer than the daemon is away, however slow the machine is.
        patient = weft.RetryPolicy(patience_s=studio.LONG_S)
        client = weft.Client(server or self.socket, **{"calling": patient, "watching": patient, **options})
        self.addCleanup(client.close)
        return client

    def spec(self, **more):
        return weft.v1.RegistrationSpec(**{"dump": self.take, "rig": f"{self.take}/rig.json", "board": f"{self.take}/board.json",
                                           "garment": f"{self.take}/template", **more})

    def lengthen_take(self, frames):
        """Repeats the frames, for a job that lasts a while."""
        for frame in range(len(self.frames), frames):
            os.mkdir(os.path.join(self.take, f"{frame:04}"))
            for i, image in enumerate(self.images):
                os.link(self.image(frame % len(self.frames), i), os.path.join(self.take, f"{frame:04}", image))
