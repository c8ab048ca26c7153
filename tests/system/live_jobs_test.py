"""Registration of a take while it is recorded: meshes at once, and the files of a registration after the take."""

import json
import os
import subprocess
import unittest

from live_studio import enter_network, set_up_network
from studio import BIN, LONG_S, StudioTest, read, results, wait_for, weft, write


def setUpModule():
    set_up_network([])


class LiveJobs(StudioTest):
    def start(self, *command):
        """A process that ends with the test, and the first line that it prints."""
        process = subprocess.Popen([os.path.join(BIN, command[0]), *map(str, command[1:])], stdout=subprocess.PIPE, text=True)
        self.addCleanup(process.communicate)
        self.addCleanup(process.terminate)
        return process

    def test_gives_the_files_of_a_registration_after_the_take(self):
        session, address, walk = self.path("session.json"), self.path("address"), self.path("walk")
        self.start("weft", "camera", "fake", "--pictures", self.take, "--fps", 4, "--session", session).stdout.readline()
        # For the frames of a set, because the machine may have other things to do.
        write(session, json.dumps({**json.loads(read(session)), "max_wait_ms": 5000}))
        self.start("weftd", "--listen", "127.0.0.1:0", "--address-file", address, "--state", self.path("state"),
                   "--allow-path", self.folder, "--workers", 1)
        server = wait_for(lambda: os.path.exists(address) and read(address).strip(), "weftd to listen")
        recorder = self.start("weft", "take", "record", "--session", session, "--out", walk, "--seconds", 60, "--no-disk-test")
        wait_for(lambda: os.path.exists(f"{walk}/ledger.csv"), "the recorder to begin")
        arguments = self.register_arguments(dump=walk)
        job = weft(*arguments, "--server", server, "--live", 3, "--detach", check=0).stdout.strip()

        def shown():
            return json.loads(weft("job", "show", job, "--server", server, "--json", check=0).stdout)
        wait_for(lambda: shown()["job"]["frames"].get("done", 0) >= 2, "two meshes while the take is recorded", 0.3)
        live = shown()
        self.assertTrue(live["job"]["live"]["following"])
        for position, frame in enumerate(live["frames"]):
            done = frame["state"] == "FRAME_STATE_DONE"
            self.assertTrue(position % 3 == 0 or not done, frame)
            self.assertEqual(frame.get("latency_s", 0) > 0, done, frame)
            self.assertFalse(os.path.exists(f"{self.out}/{frame['frame']}/unrefined.ply"), frame)
        recorder.terminate()
        recorder.wait(LONG_S)
        done = weft("job", "watch", job, "--server", server)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        sets = int(json.loads(weft("take", "info", walk, "--json").stdout)["sets"])
        self.assertGreater(sets, 3)
        self.assertIn(f"{sets} of {sets} frames registered", done.stdout)
        self.assertEqual(shown()["job"].get("warnings", []), [])
        offline = self.path("offline")
        self.register(check=0, dump=walk, out=offline)
        self.assertEqual(results(self.out), results(offline))

    def test_needs_a_daemon(self):
        self.assert_refused(self.register("--live", 2), "--live", "--server")


if __name__ == "__main__":
    enter_network()
    unittest.main()
