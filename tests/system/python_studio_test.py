"""The Python client of a studio: who may do what, sessions, takes, operations."""

import json
import os
import signal
import subprocess
import threading
import unittest

import studio
from python_client import ClientTest, example, weft
from studio import read, wait_for, write


class Access(ClientTest):
    def token(self, role):
        path = self.path(f"{role}.token")
        write(path, studio.weft("access", "token", role, "--role", role, "--state", self.path("state"), check=0).stdout)
        return weft.Identity(token_file=path)

    def openssl(self, *words):
        subprocess.run(["openssl", *words], cwd=self.folder, check=True, capture_output=True)

    def certificate(self, name, extension):
        """NAME.crt and NAME.key, of the authority ca.crt."""
        if not os.path.exists(self.path("ca.crt")):
            self.openssl("req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "2",
                         "-subj", "/CN=studio", "-keyout", "ca.key", "-out", "ca.crt")
        self.openssl("req", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-subj", f"/CN={name}",
                     "-keyout", f"{name}.key", "-out", f"{name}.csr")
        write(self.path("extension"), extension)
        self.openssl("x509", "-req", "-in", f"{name}.csr", "-CA", "ca.crt", "-CAkey", "ca.key", "-CAcreateserial", "-days", "2",
                     "-extfile", "extension", "-out", f"{name}.crt")

    @staticmethod
    def wait_to_be_known(client):
        def known():
            try:
                return client.server_info()
            except weft.Unauthenticated:
                return False
        wait_for(known, "the daemon to know the client")

    def test_by_token_is_as_its_role_says(self):
        self.start_daemon()
        viewer = self.client(identity=self.token("viewer"))
        self.wait_to_be_known(viewer)
        self.assertEqual(len(viewer.jobs.list().jobs), 0)
        with self.assertRaisesRegex(weft.PermissionDenied, "viewer"):
            viewer.jobs.submit(self.spec())
        with self.assertRaises(weft.PermissionDenied):
            viewer.library.upload("rig", f"{self.take}/rig.json")
        write(self.path("wrong.token"), "weft_" + "0" * 64)
        with self.assertRaisesRegex(weft.Unauthenticated, "unknown or was revoked"):
            self.client(identity=weft.Identity(token_file=self.path("wrong.token"))).server_info()
        with self.assertRaisesRegex(weft.NotFound, "WEFT_TOKEN_FILE: .*none.token"):
            self.client(identity=weft.Identity(token_file=self.path("none.token")))

    def test_by_tls(self):
        self.certificate("daemon", "subjectAltName=IP:127.0.0.1")
        self.certificate("anna", "extendedKeyUsage=clientAuth")
        # Addresses that no other machine reaches have no TLS.
        listening = self.start_daemon("--tls-cert", self.path("daemon.crt"), "--tls-key", self.path("daemon.key"),
                                      "--tls-client-ca", self.path("ca.crt"), listen="0.0.0.0:0")
        server = "127.0.0.1:" + listening.rpartition(":")[2]
        studio.weft("access", "certificate", "anna", "--role", "client", "--state", self.path("state"), check=0)
        ours = {"authority": self.path("ca.crt"), "certificate": self.path("anna.crt"), "key": self.path("anna.key")}
        anna = self.client(server, identity=weft.Identity(**ours))
        self.wait_to_be_known(anna)
        self.assertEqual(len(anna.jobs.list().jobs), 0)
        with self.assertRaisesRegex(weft.PermissionDenied, "client"):
            anna.takes.empty_all_trash()
        impatient = weft.RetryPolicy(patience_s=0)
        write(self.path("other.crt"), read(self.path("anna.crt")))
        for identity in (weft.Identity(), weft.Identity(authority=self.path("other.crt"))):  # plain text; no authority
            with self.assertRaisesRegex(weft.FailedPrecondition, server):
                self.client(server, identity=identity, calling=impatient).server_info()
        with self.assertRaisesRegex(weft.InvalidArgument, "a certificate needs its key"):
            self.client("studio:7411", identity=weft.Identity(certificate=ours["certificate"]))
        for wrong in ("studio", "studio:0", ":7411", "studio:http"):
            with self.assertRaisesRegex(weft.InvalidArgument, "is not HOST:PORT"):
                self.client(wrong)


class Studio(ClientTest):
    """Takes of recorded cameras, which play as if they were live."""

    def setUp(self):
        super().setUp()
        self.addCleanup(self.kill_recorders)
        self.recorded = self.path("allowed", "recorded")
        studio.weft("take", "import", self.take, "--out", self.recorded, "--fps", "2", check=0)
        self.start_daemon()

    def kill_recorders(self):
        for process in studio.processes_of(self.folder, "weft-recorder"):
            os.kill(process, signal.SIGKILL)

    def session(self, speed=1.0):
        streams = sorted(name for name in os.listdir(f"{self.recorded}/streams") if name.endswith(".stream"))
        replay = weft.v1.ReplayCamera(take=self.recorded, speed=speed)
        return weft.v1.Session(fps=2, low_disk_gib=0.01, max_wait_ms=5000,
                               cameras=[weft.v1.SessionCamera(id=name.removesuffix(".stream"), replay=replay)
                                        for name in streams])

    def test_sessions_have_their_cameras_alone(self):
        client = self.client()
        camera = weft.v1.SessionCamera(id="c00", v4l2=weft.v1.V4l2Camera(device="/dev/video99"))
        request = weft.v1.OpenSessionRequest(cameras=weft.v1.Session(cameras=[camera]), owner="anna")
        with client.sessions.hold(request):
            with self.assertRaisesRegex(weft.FailedPrecondition, "anna"):
                client.sessions.open(request)
        with self.assertRaises(weft.FailedPrecondition), client.sessions.hold(request) as session:
            client.sessions.close(session.lease)  # as if it had been lost
            client.sessions.renew(session.lease)
        self.assertEqual({one.state for one in client.sessions.list().sessions}, {weft.v1.CAPTURE_SESSION_STATE_CLOSED})

    def test_takes_are_started_watched_and_kept(self):
        client = self.client()
        request = weft.v1.OpenSessionRequest(cameras=self.session(), owner="anna", lease_s=5)
        with client.sessions.hold(request) as session:
            self.assertEqual(client.sessions.get(session.id).owner, "anna")
            looks = list(client.cameras.look(lease=session.lease, width_px=64))
            self.assertEqual(len(looks), len(self.images))
            take = client.takes.start(lease=session.lease, no_disk_test=True)
            states = list(client.takes.watch(take.id))
        self.assertEqual(client.sessions.get(session.id).state, weft.v1.CAPTURE_SESSION_STATE_CLOSED)
        self.assertEqual(states[-1].state.phase, weft.v1.RECORDER_PHASE_ENDED)
        self.assertEqual(states[-1].state.sets_recorded, len(self.frames))
        self.assertEqual([event.event for state in states for event in state.events][-1], "end")
        client.takes.pin(take.id)
        with self.assertRaises(weft.FailedPrecondition):
            client.takes.delete(take.id)
        client.takes.pin(take.id, False)
        client.takes.delete(take.id)
        self.assertEqual([one.id for one in client.takes.list(trash=True).takes], [take.id])
        client.takes.restore(take.id)
        spec = weft.operation_spec("take info", {"take": f"take:{take.id}"})
        spec.json = True
        operation = client.operations.wait(client.operations.start(spec).id)
        self.assertEqual(int(json.loads(operation.output)["sets"]), len(self.frames))
        self.assertEqual([one.id for one in client.operations.list().operations], [operation.id])
        client.takes.delete(take.id)
        self.assertEqual(client.takes.empty_trash(take.id).takes, 1)
        self.assertIsInstance(list(client.cameras.list()), list)

    def test_take_is_watched_across_a_restart_of_the_daemon(self):
        client = self.client()
        take = client.takes.start(session=self.session(speed=0.001), no_disk_test=True)
        watch, events = client.takes.watch(take.id), []

        def follow(enough):
            for state in watch:
                events.extend(event.SerializeToString() for event in state.events)
                self.last = state
                if enough(state):
                    return
        follow(lambda state: state.state.phase == weft.v1.RECORDER_PHASE_RECORDING)
        self.end_daemon(signal.SIGKILL)
        self.start_daemon()
        follow(lambda _: True)
        self.end_daemon(signal.SIGTERM)
        self.start_daemon()
        client.takes.stop(take.id)
        follow(lambda _: False)
        self.assertEqual(self.last.state.phase, weft.v1.RECORDER_PHASE_ENDED)
        self.assertEqual(len(events), len(set(events)), "every event is told once")
        self.assertEqual(client.takes.wait(take.id).state.phase, weft.v1.RECORDER_PHASE_ENDED)

    def test_clients_wait_while_the_daemon_is_busy(self):
        take = self.client().takes.start(session=self.session(speed=0.001), no_disk_test=True)
        watches = []
        self.addCleanup(lambda: [watch.close() for watch in watches])
        with self.assertRaises(weft.ResourceExhausted) as caught:
            for _ in range(10):  # a connection carries no more than 100 calls
                impatient = self.client(watching=weft.RetryPolicy(busy_patience_s=0))
                for _ in range(50):
                    watches.append(impatient.takes.watch(take.id))
                    self.assertEqual(next(watches[-1]).id, take.id)
        self.assertGreater(caught.exception.retry_after_s, 0)
        release = threading.Timer(1, watches[0].close)
        release.start()
        self.addCleanup(release.join)
        with self.client().takes.watch(take.id) as watch:
            self.assertEqual(next(watch).id, take.id)
        self.client().takes.stop(take.id)

    def test_example_watches_the_newest_take(self):
        self.assertIn("has no take", example("watch_take.py", "--server", self.socket, check=1).stderr)
        take = self.client().takes.start(session=self.session(), no_disk_test=True)
        said = example("watch_take.py", "--server", self.socket).stdout
        self.assertIn("end sets", said)
        self.assertIn(f"{take.id}: ", said.splitlines()[-1])
        self.assertIn(f"{len(self.frames)} sets, 0 dropped", said)


if __name__ == "__main__":
    unittest.main()
