"""weftd under a service manager: its units, its file of options, what it tells systemd, what SIGHUP changes."""

import contextlib
import os
import re
import resource
import shutil
import signal
import socket
import sqlite3
import subprocess
import tempfile
import time
import unittest

from daemon_process import DaemonProcess
from studio import BIN, LONG_S, read, wait_for, weft, write

SOURCE = os.environ["WEFT_SOURCE"]
WATCHDOG_S = 3


class Manager:
    """The end of NOTIFY_SOCKET that systemd has otherwise."""

    def __init__(self, folder):
        self.path = os.path.join(folder, "notify")
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(self.path)
        self.environment = {"NOTIFY_SOCKET": self.path, "WATCHDOG_USEC": str(WATCHDOG_S * 1_000_000)}

    def hear(self, seconds):
        """What arrives within so long, as one text."""
        heard, end = "", time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            self.socket.settimeout(left)
            try:
                heard += self.socket.recv(65536).decode() + "\n"
            except TimeoutError:
                break
        return heard

    def wait_for(self, word):
        heard = ""

        def has_come():
            nonlocal heard
            heard += self.hear(0.1)
            return word in heard
        wait_for(has_come, f"{word} to be notified")
        return heard

    def close(self):
        self.socket.close()


class ServiceTest(DaemonProcess, unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="weft service ")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name


class Units(ServiceTest):
    def setUp(self):
        super().setUp()
        if not shutil.which("systemd-analyze"):
            self.skipTest("Debian package systemd is not installed")

    def test_unit_is_one_that_systemd_reads_without_a_word(self):
        unit = read(f"{SOURCE}/deploy/systemd/weftd.service")
        self.assertIn("ExecStart=/usr/bin/weftd --config /etc/weft/weftd.txtpb\n", unit)
        link = tempfile.mktemp(prefix="weftd-")  # a program of a unit has no space in its path
        os.symlink(os.path.join(BIN, "weftd"), link)
        self.addCleanup(os.remove, link)
        for name, text, words in (("weftd.service", unit, ""), ("broken.service", unit.replace("=notify", "=tell"), "tell")):
            write(self.path(name), text.replace("/usr/bin/weftd", link))
            done = subprocess.run(["systemd-analyze", "verify", "--man=no", self.path(name)], capture_output=True,
                                  text=True, timeout=LONG_S, check=False)
            said = "\n".join(line for line in done.stderr.splitlines() if name in line)
            if words:
                self.assertIn(words, said, done.stderr)
            else:
                self.assertEqual((said, done.returncode), ("", 0), done.stderr)

    def test_user_and_folders_are_made(self):
        if os.geteuid() != 0:
            self.skipTest("Debian's root is needed")
        root = self.path("root")
        os.makedirs(f"{root}/usr/share/weft/config")
        os.makedirs(f"{root}/etc")
        for folder in ("srv", "var/lib", "run"):
            os.makedirs(f"{root}/{folder}")
        write(f"{root}/etc/group", "video:x:44:\n")
        shutil.copy(f"{SOURCE}/config/weftd.txtpb", f"{root}/usr/share/weft/config")
        for program, file in (("systemd-sysusers", "weft.sysusers"), ("systemd-tmpfiles", "weft.tmpfiles")):
            more = ["--create"] if program == "systemd-tmpfiles" else []
            subprocess.run([program, f"--root={root}", *more, f"{SOURCE}/deploy/systemd/{file}"], check=True,
                           capture_output=True, timeout=LONG_S)
        self.assertRegex(read(f"{root}/etc/passwd"), r"(?m)^weft:")
        self.assertRegex(read(f"{root}/etc/group"), r"(?m)^video:.*weft")
        self.assertEqual(os.stat(f"{root}/var/lib/weft").st_mode & 0o777, 0o700)
        self.assertEqual(read(f"{root}/etc/weft/weftd.txtpb"), read(f"{SOURCE}/config/weftd.txtpb"))


class ServiceManager(ServiceTest):
    def setUp(self):
        super().setUp()
        self.manager = Manager(self.folder)
        self.addCleanup(self.manager.close)

    def start_watched(self, *more):
        self.start_plainly(*more, environment=self.manager.environment)

    def test_hears_of_start_life_reload_and_stop(self):
        self.start_watched()
        heard = self.manager.wait_for("WATCHDOG=1")
        self.assertLess(heard.index("READY=1"), heard.index("WATCHDOG=1"))
        self.assertIn(f"STATUS=listens on {self.addresses[0]}; jobs: 0 running, 0 queued", heard)
        self.daemon.send_signal(signal.SIGHUP)
        heard = self.manager.wait_for("READY=1")
        self.assertRegex(heard, r"RELOADING=1\nMONOTONIC_USEC=\d+")
        self.stop()
        self.assertIn("STOPPING=1", self.manager.hear(0.1))

    def assert_silent_while_held(self, hold):
        """The manager hears nothing while a context lasts, and then again."""
        self.manager.wait_for("WATCHDOG=1")
        with hold():
            self.wait_for_log("the daemon's own call over")
            self.manager.hear(0.1)
            self.assertEqual(self.manager.hear(2 * WATCHDOG_S).count("WATCHDOG=1"), 0)
        self.manager.wait_for("WATCHDOG=1")
        self.wait_for_log("answers its own calls again")

    def test_hears_nothing_while_nobody_is_let_in(self):
        self.start_watched()
        host, port = self.addresses[0].rsplit(":", 1)

        class Flood:
            """More connections of HTTP/2 than a peer may have, which stay."""
            def __enter__(self):
                self.held = []
                for _ in range(300):
                    one = socket.create_connection((host, int(port)), timeout=LONG_S)
                    one.sendall(b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + b"\0\0\0\4\0\0\0\0\0")
                    self.held.append(one)

            def __exit__(self, *_):
                for one in self.held:
                    one.close()
        self.assert_silent_while_held(Flood)

    def test_hears_nothing_while_all_descriptors_are_taken(self):
        self.start_watched()
        case = self

        class NoDescriptors:
            def __enter__(self):
                pid = case.daemon.pid
                self.before = resource.prlimit(pid, resource.RLIMIT_NOFILE)
                resource.prlimit(pid, resource.RLIMIT_NOFILE, (3, self.before[1]))

            def __exit__(self, *_):
                resource.prlimit(case.daemon.pid, resource.RLIMIT_NOFILE, self.before)
        self.assert_silent_while_held(NoDescriptors)


class Descriptors(ServiceTest):
    def soft_limit(self):
        return resource.prlimit(self.daemon.pid, resource.RLIMIT_NOFILE)[0]

    def test_daemon_takes_all_that_it_may_have(self):
        self.start_plainly(descriptors=(256, 4096))
        self.assertEqual(self.soft_limit(), 4096)
        self.assertNotIn("descriptors", self.log())

    def test_few_descriptors_mean_fewer_connections_and_a_word(self):
        self.start_plainly(descriptors=(300, 300))
        self.assertRegex(self.log(), r"only 300 descriptors: 32 connections at once instead of 1000.*LimitNOFILE")
        host, port = self.addresses[0].rsplit(":", 1)
        flood = [socket.create_connection((host, int(port)), timeout=LONG_S) for _ in range(100)]
        self.wait_for_log("refused: it has")
        self.assertNotIn("no connection can be accepted", self.log())
        for one in flood:
            one.close()
        wait_for(lambda: weft("job", "list", "--server", self.addresses[0]).returncode == 0, "the daemon to answer")

    def test_socket_goes_with_the_daemon(self):
        for listen in ([], ["--listen", "unix:" + self.path("own.sock")]):
            self.start(*listen, "--state", self.path("state"), "--allow-path", self.folder)
            path = self.addresses[0].removeprefix("unix:") if listen else self.path("state", "weftd.sock")
            self.assertTrue(os.path.exists(path))
            self.stop()
            self.assertFalse(os.path.exists(path))


class ConfigFile(ServiceTest):
    def config(self, text):
        write(self.path("weftd.txtpb"), text)
        return self.path("weftd.txtpb")

    def run_weftd(self, *arguments):
        return subprocess.run([os.path.join(BIN, "weftd"), *arguments], capture_output=True, text=True, timeout=LONG_S,
                              check=False)

    def test_example_has_every_option_with_its_default(self):
        said = self.run_weftd("--state", "/var/lib/weft", "--allow-path", "/srv/weft", "--print-config")
        self.assertEqual(said.returncode, 0, said.stderr)
        self.assertEqual(read(f"{SOURCE}/config/weftd.txtpb"), said.stdout.replace(os.path.realpath(BIN), "/usr/bin"))
        options = set(re.findall(r"--([a-z-]+)", "\n".join(re.findall(r"(?m)^  (?:-\w,)?--.*$", self.run_weftd("--help").stdout))))
        self.assertIn("allow-path", options)
        for option in options - {"help", "version", "config", "print-config"}:
            self.assertRegex(said.stdout, rf"(?m)^(# )?{option.replace('-', '_')}: ", option)

    def test_every_option_of_the_example_is_read(self):
        example = read(f"{SOURCE}/config/weftd.txtpb")
        given = re.sub(r'(?m)^# (\w+: .*)$', r"\1", example.replace('# proto-', "#proto-"))
        given = re.sub(r'(?m)^(listen): ""$', r'\1: "127.0.0.1:0"', given)
        said = self.run_weftd("--config", self.config(given), "--print-config")
        self.assertEqual(said.returncode, 0, said.stderr)
        self.assertNotRegex(said.stdout, r"(?m)^# \w+: [^w]*$")
        self.assertIn("\nkeep_trash_days: 7\n", said.stdout)

    def test_daemon_runs_by_its_file_and_arguments_win(self):
        config = self.config(f'# ours\nlisten: "127.0.0.1:0"\nstate: "{self.path("state")}"\nallow_path: "{self.folder}"\n'
                             "workers: 3\nthreads_per_worker: 2\n")
        self.start("--config", config, "--workers", "1")
        self.wait_for_log("1 workers with 2 threads each")

    def test_mistakes_are_named_with_their_lines(self):
        for text, *words in (
                ("workers: 1\nwokers: 2\n", ":2: wokers: no such option", "--print-config"),
                ("state: \"s\"\n\nworkers: 5000\n", ":3: workers: ", "5000", "1024"),
                ("workers: \"many\"\n", ":1: ", "integer", "many"),
                ("log_level: \"loud\"\n", ":1: log_level: ", "loud", "debug"),
                ("keep_trash_days: -1\n", ":1: keep_trash_days: ", "-1"),
                ("workers: 1\nworkers: 2\n", ":2: ", "workers", "multiple times"),
                ("state: \"\\e[31m\n", ":1: ")):
            done = self.run_weftd("--config", self.config(text))
            self.assertEqual(done.returncode, 2, done.stderr)
            for word in (self.path("weftd.txtpb"), *words):
                self.assertIn(word, done.stderr)
        missing = self.run_weftd("--config", self.path("none.txtpb"))
        self.assertEqual(missing.returncode, 2)
        self.assertIn("none.txtpb", missing.stderr)
        empty = self.run_weftd("--config", self.config(""))
        self.assertEqual(empty.returncode, 2)
        self.assertIn("--state", empty.stderr)


class Reload(ServiceTest):
    def write_config(self, more):
        write(self.path("weftd.txtpb"), f'listen: "127.0.0.1:0"\nstate: "{self.path("state")}"\n'
              f'allow_path: "{self.folder}"\nworkers: 1\n{more}')

    def hang_up(self):
        self.daemon.send_signal(signal.SIGHUP)

    def test_takes_over_what_can_change_and_names_the_rest(self):
        self.write_config("")
        self.start("--config", self.path("weftd.txtpb"), "--threads-per-worker", "1")
        self.write_config('keep_takes_days: 3\nlog_level: "debug"\nthreads_per_worker: 2\n')
        write(self.path("weftd.txtpb"), read(self.path("weftd.txtpb")).replace("workers: 1", "workers: 2"))
        self.hang_up()
        self.wait_for_log("in force only after a restart: workers\n")
        self.assertIn("keep_takes_days is 3, was 0; log_level is debug, was info", self.log())
        weft("job", "list", "--server", self.addresses[0], check=0)

    def test_bad_file_leaves_the_settings(self):
        self.write_config('log_level: "warn"\n')
        self.start("--config", self.path("weftd.txtpb"))
        self.write_config('log_level: "debug"\nwokers: 1\n')
        self.hang_up()
        self.wait_for_log("wokers: no such option")
        self.assertIn("the settings stay as they were", self.log())
        self.write_config('log_level: "info"\nkeep_takes_days: 1\n')
        self.hang_up()
        self.wait_for_log("is read again: keep_takes_days is 1, was 0; log_level is info, was warn")
        self.assertEqual(self.log().count("is read again"), 1)
        weft("job", "list", "--server", self.addresses[0], check=0)

    def test_nothing_to_reload_without_a_file(self):
        self.start_plainly()
        self.hang_up()
        self.wait_for_log("without --config")
        weft("job", "list", "--server", self.addresses[0], check=0)


class Versions(ServiceTest):
    def test_state_of_a_newer_weft_is_refused_and_left_as_it_is(self):
        self.start_plainly()
        self.stop()
        path = self.path("state", "catalogue.sqlite")
        with contextlib.closing(sqlite3.connect(path)) as catalogue:
            catalogue.execute("PRAGMA user_version = 99")
        before = read(path, "rb")
        done = subprocess.run([os.path.join(BIN, "weftd"), "--listen", "127.0.0.1:0", "--state", self.path("state"),
                               "--allow-path", self.folder], capture_output=True, text=True, timeout=LONG_S, check=False)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("written by a newer Weft (schema 99", done.stderr)
        self.assertEqual(read(path, "rb"), before)


if __name__ == "__main__":
    unittest.main()
