"""Takes that a daemon records: they outlive it, are recovered when their recorder dies, and are registered by name."""

import json
import os
import signal
import subprocess
import unittest

from live_studio import enter_network, set_up_network
from studio import BIN, LONG_S, StudioTest, processes_of, read, results, wait_for, weft, write

RECORDED = "RECORDER_PHASE_RECORDING"


def setUpModule():
    set_up_network([])


class Takes(StudioTest):
    def setUp(self):
        super().setUp()
        self.session, self.address = self.path("session.json"), self.path("address")
        self.addCleanup(self.kill_recorders)
        self.cameras_process = cameras = self.start("weft", "camera", "fake", "--pictures", self.take, "--fps", 5, "--session", self.session)
        cameras.stdout.readline()
        # For the frames of a set, because the machine may have other things to do.
        write(self.session, json.dumps({**json.loads(read(self.session)), "max_wait_ms": 5000}))
        self.start_daemon()

    def start(self, *command):
        process = subprocess.Popen([os.path.join(BIN, command[0]), *map(str, command[1:])], stdout=subprocess.PIPE, text=True)
        self.addCleanup(self.end, process)
        return process

    @staticmethod
    def end(process):
        process.kill()
        process.wait()
        process.stdout.close()

    def kill_recorders(self):
        for process in processes_of(self.folder, "weft-recorder"):
            os.kill(process, signal.SIGKILL)

    def start_daemon(self):
        if os.path.exists(self.address):
            os.remove(self.address)
        self.daemon = self.start("weftd", "--listen", "127.0.0.1:0", "--address-file", self.address, "--state",
                                 self.path("state"), "--allow-path", self.folder, "--workers", 1)
        self.server = wait_for(lambda: os.path.exists(self.address) and read(self.address).strip(), "weftd to listen")

    def kill_daemon(self):
        self.end(self.daemon)

    def take_command(self, *words, check=0):
        return weft("take", words[0], "--server", self.server, *words[1:], check=check)

    def start_take(self, *more):
        return self.take_command("start", "--session", self.session, "--no-disk-test", *more).stdout.strip()

    def shown(self, take):
        takes = json.loads(self.take_command("list", "--json").stdout)["takes"]
        return next(one for one in takes if one["id"] == take)

    def wait_for_sets(self, take, count):
        wait_for(lambda: int(self.shown(take)["state"].get("sets_recorded", 0)) >= count, f"{count} frame sets", 0.2)

    def recorder(self):
        processes = processes_of(self.folder, "weft-recorder")
        self.assertEqual(len(processes), 1)
        return processes[0]

    def test_go_on_while_the_daemon_is_drained(self):
        take = self.start_take()
        self.wait_for_sets(take, 1)
        weft("daemon", "drain", "--server", self.server, check=0)
        self.assertEqual(self.daemon.wait(timeout=LONG_S), 0)
        self.recorder()
        self.start_daemon()
        self.wait_for_sets(take, int(self.shown(take)["state"]["sets_recorded"]) + 2)

    def test_go_on_without_the_daemon(self):
        take = self.start_take()
        self.wait_for_sets(take, 3)
        self.assertEqual(os.getsid(self.recorder()), self.recorder(), "a session of its own")
        self.kill_daemon()
        before = len(read(f"{self.path('state')}/takes/{take}/take/ledger.csv").splitlines())
        self.start_daemon()
        shown = self.shown(take)
        self.assertEqual(shown["state"]["phase"], RECORDED)
        self.wait_for_sets(take, before + 3)
        refused = self.take_command("start", "--session", self.session, check=2)
        self.assertIn(f"films take {take}", refused.stderr)
        self.assertIn("recorder_lives", shown)
        stopped = self.take_command("stop", take)
        self.assertRegex(stopped.stdout, r"^ended +\d+ s  \d+ sets, 0 dropped, 0 frames missing")
        self.assertEqual(processes_of(self.folder, "weft-recorder"), [])
        weft("take", "verify", shown["folder"], check=0)
        # Registered by its name, as by its folder.
        arguments = self.register_arguments(dump=f"take:{take}")
        weft(*arguments, "--server", self.server, "--frames", "0:3", check=0)
        offline = self.path("offline")
        weft(*self.register_arguments(dump=shown["folder"], out=offline), "--frames", "0:3", check=0)
        self.assertEqual(results(self.out), results(offline))

    def test_of_a_recorder_that_dies_are_recovered(self):
        take = self.start_take("--seconds", LONG_S)
        self.wait_for_sets(take, 4)
        watcher = self.start("weft", "take", "watch", take, "--server", self.server)
        acknowledged = int(self.shown(take)["state"]["sets_recorded"])
        os.kill(self.recorder(), signal.SIGKILL)
        said, _ = watcher.communicate(timeout=LONG_S)
        self.assertEqual(watcher.returncode, 1)
        self.assertIn("recovered", said)
        shown = self.shown(take)
        self.assertEqual(shown["state"]["phase"], "RECORDER_PHASE_RECOVERED")
        weft("take", "verify", shown["folder"], check=0)
        sets = int(json.loads(weft("take", "info", shown["folder"], "--json").stdout)["sets"])
        self.assertGreaterEqual(sets, acknowledged)
        # The same while no daemon looks.
        take = self.start_take()
        self.wait_for_sets(take, 2)
        self.kill_daemon()
        os.kill(self.recorder(), signal.SIGKILL)
        self.start_daemon()
        wait_for(lambda: self.shown(take)["state"]["phase"] == "RECORDER_PHASE_RECOVERED", "the take to be recovered", 0.2)

    def test_without_their_cameras_fail_and_say_so(self):
        described = json.loads(read(self.session))
        described["cameras"][0]["gige"]["device"] = "127.0.0.99"
        write(self.session, json.dumps(described))
        begun = self.take_command("start", "--session", self.session, "--no-disk-test", check=2)
        self.assertIn("127.0.0.99", begun.stderr)
        take = begun.stdout.strip()
        failed = self.take_command("watch", take, check=1)
        self.assertIn("127.0.0.99", failed.stderr)
        self.assertIn("failed", self.take_command("list").stdout)
        unknown = self.take_command("stop", "20260101-000000-00000000", check=2)
        self.assertIn("no take", unknown.stderr)

    def open_session(self, *more):
        """In the foreground, as an operator does; returns its process and lease."""
        opened = self.start("weft", "session", "open", self.session, "--server", self.server, *more)
        return opened, opened.stdout.readline().strip()

    def sessions(self):
        listed = weft("session", "list", "--json", "--server", self.server, check=0)
        return json.loads(listed.stdout)["sessions"]

    def test_of_a_session_know_their_inputs(self):
        inputs = ["--rig", "library:studio", "--board", f"{self.take}/board.json", "--template", f"{self.take}/template"]
        unknown = weft("session", "open", self.session, *inputs, "--server", self.server, check=2)
        self.assertIn("rig: ", unknown.stderr)
        weft("library", "upload", "rig", f"{self.take}/rig.json", "--name", "studio", "--server", self.server, check=0)
        operator, lease = self.open_session("--owner", "anna", *inputs)
        refused = self.take_command("start", "--session", self.session, check=2)
        self.assertIn("of anna", refused.stderr)
        rival = weft("session", "open", self.session, "--server", self.server, check=2)
        self.assertIn("of anna", rival.stderr)
        take = self.take_command("start", "--lease", lease, "--no-disk-test").stdout.strip()
        self.wait_for_sets(take, 3)
        self.assertEqual(self.shown(take)["session_id"], self.sessions()[0]["id"])
        self.assertEqual(self.sessions()[0]["lease"], "", "nobody else sees it")
        operator.terminate()  # Ctrl-C closes the session; the take goes on
        operator.wait(LONG_S)
        self.assertEqual(self.sessions()[0]["state"], "CAPTURE_SESSION_STATE_CLOSED")
        self.assertEqual(self.shown(take)["state"]["phase"], RECORDED)
        self.take_command("stop", take)
        rig = json.loads(read(f"{self.take}/rig.json"))  # a newer version is for later sessions
        write(self.path("newer.json"), json.dumps({"cameras": rig["cameras"][1:]}))
        weft("library", "upload", "rig", self.path("newer.json"), "--name", "studio", "--server", self.server, check=0)
        weft("register", f"take:{take}", "--out", self.out, "--server", self.server, "--frames", "0:2", check=0)
        offline = self.path("offline")
        weft(*self.register_arguments(dump=self.shown(take)["folder"], out=offline), "--frames", "0:2", check=0)
        self.assertEqual(results(self.out), results(offline))
        unnamed = weft("register", self.take, "--out", self.out, "--server", self.server, check=2)
        self.assertIn("--rig, --board, --template are required", unnamed.stderr)

    def test_cameras_of_an_operator_who_is_gone_are_free(self):
        operator, _ = self.open_session("--lease-s", 5)
        operator.kill()
        wait_for(lambda: self.sessions()[0]["state"] == "CAPTURE_SESSION_STATE_EXPIRED", "the lease to end", 0.2)
        left = weft("session", "open", self.session, "--detach", "--server", self.server, check=0).stdout.strip()
        _, lease = self.open_session("--take-over")
        lost = weft("session", "renew", left, "--server", self.server, check=2)
        self.assertIn("was taken over", lost.stderr)
        weft("session", "close", lease, "--server", self.server, check=0)
        self.start_take("--seconds", 1)

    def test_go_to_the_trash_and_come_back(self):
        take = self.start_take("--seconds", 1)
        self.take_command("watch", take)
        self.take_command("pin", take)
        self.assertIn("is pinned", self.take_command("delete", take, check=2).stderr)
        self.take_command("pin", "--off", take)
        self.take_command("delete", take)
        self.assertNotIn(take, self.take_command("list").stdout)
        self.assertIn(take, self.take_command("list", "--trash").stdout)
        self.take_command("restore", take)
        weft("take", "verify", self.shown(take)["folder"], check=0)
        self.take_command("delete", take)
        self.assertIn("1 takes removed", self.take_command("empty-trash").stdout)
        self.assertEqual(os.listdir(f"{self.path('state')}/takes"), [])

    def cameras(self, server=None):
        return json.loads(weft("camera", "list", "--json", "--server", server or self.server, check=0).stdout)["cameras"]

    def look(self, *words, check=0, server=None):
        return weft("camera", "look", "--server", server or self.server, *words, "--out", self.path("pictures"), check=check)

    def test_cameras_are_seen_before_and_while_they_film(self):
        ids = [camera["id"] for camera in json.loads(read(self.session))["cameras"]]
        seen = self.look("--session", self.session).stdout.splitlines()
        self.assertEqual(len(seen), len(ids))
        self.assertRegex(seen[0], rf"^{ids[0]}  .*, \d+ x \d+, \w+, median \d+ of 255, .* focus 0\.\d+$")
        pictures = [f"{one}.jpg" for one in ids]
        self.assertEqual(sorted(os.listdir(self.path("pictures"))), sorted(pictures))
        with open(f"{self.path('pictures')}/{pictures[0]}", "rb") as picture:
            self.assertEqual(picture.read(2), b"\xff\xd8", "a JPEG file")
        self.assertEqual(os.listdir(f"{self.path('state')}/looks"), [])
        take = self.start_take()
        self.wait_for_sets(take, 2)
        self.assertIn(f"films take {take}", self.look("--session", self.session, check=2).stderr)
        one = json.loads(self.look("--take", take, "--camera", ids[1], "--json").stdout)
        self.assertEqual(one["camera"]["id"], ids[1])
        self.assertIn("PixelFormat", one["camera"]["settings"])
        self.assertGreaterEqual(int(one["set"]), 1)
        self.assertIn("has no camera", self.look("--take", take, "--camera", "none", check=2).stderr)
        self.assertTrue(all(camera["used_by"] == f"take {take}" for camera in self.cameras()), self.cameras())
        # Another daemon sees them, and that somebody else has them.
        other_address = self.path("other address")
        self.start("weftd", "--listen", "127.0.0.1:0", "--address-file", other_address, "--state",
                   self.path("other state"), "--allow-path", self.folder, "--workers", 1)
        other = wait_for(lambda: os.path.exists(other_address) and read(other_address).strip(), "weftd to listen")
        refused = self.look("--session", self.session, server=other, check=2)
        self.assertIn("another program", refused.stderr)
        self.assertTrue(all(camera["used_by"] == "another program" for camera in self.cameras(other)), self.cameras(other))
        stopped = self.take_command("stop", take)
        self.assertRegex(stopped.stdout, "0 dropped, 0 frames missing", "the other daemon disturbed nothing")
        self.assertTrue(all(camera["used_by"] == "" for camera in self.cameras(other)), self.cameras(other))

    def test_tell_watchers_what_is_lost_and_why(self):
        take = self.start_take()
        self.wait_for_sets(take, 3)
        watcher = subprocess.Popen([os.path.join(BIN, "weft"), "take", "watch", take, "--server", self.server],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.end(self.cameras_process)
        told = ""
        while "camera c00: disconnected" not in told:
            line = watcher.stderr.readline()
            self.assertTrue(line, told)
            told += line
        self.take_command("stop", take)
        watcher.communicate(timeout=LONG_S)
        self.assertRegex(told, r"(?m)^\d\d:\d\d:\d\d  camera c00: disconnected")

    def test_are_replayed_as_if_their_cameras_were_live(self):
        first = self.start_take()
        self.wait_for_sets(first, 4)
        self.take_command("stop", first)
        recorded = self.shown(first)["folder"]
        ids = [camera["id"] for camera in json.loads(read(self.session))["cameras"]]
        write(self.session, json.dumps({"fps": 5, "max_wait_ms": 5000, "cameras": [
            {"id": one, "replay": {"take": f"take:{first}"}} for one in ids]}))
        again = self.start_take()
        self.take_command("watch", again)
        shown = self.shown(again)
        self.assertEqual(shown["state"]["sets_recorded"], self.shown(first)["state"]["sets_recorded"])
        for take, out in ((recorded, "first"), (shown["folder"], "again")):
            weft("take", "export", take, "--out", self.path(out), check=0)
        pictures = [[read(f"{base}/{name}", "rb") for base, _, names in sorted(os.walk(self.path(out)))
                     for name in sorted(names)] for out in ("first", "again")]
        self.assertEqual(*pictures)
        for take, words in (("/etc", "outside the folders"), ("take:20260101-000000-00000000", "no such take")):
            write(self.session, json.dumps({"fps": 5, "cameras": [{"id": ids[0], "replay": {"take": take}}]}))
            refused = self.take_command("start", "--session", self.session, check=2)
            self.assertIn(words, refused.stderr)
            self.assertIn(f"recording.session.cameras.{ids[0]}.replay.take", refused.stderr)


if __name__ == "__main__":
    enter_network()
    unittest.main()
