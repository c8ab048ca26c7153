"""A client that shares no folder with weftd: it uploads its inputs, and gets the meshes of a registration of its own."""

import json
import os
import signal
import socket
import subprocess
import threading
import unittest

from studio import BIN, StudioTest, read, results, wait_for, weft, write


class CuttingProxy:
    """TCP connections to a server, each cut after `cut_after` bytes from the client (0: none is)."""

    def __init__(self, server, cut_after=0):
        self.server, self.cut_after = server, cut_after
        self.connections = self.bytes_from_client = 0
        self.ends, self.threads = [], []
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self.listener.getsockname()[1]}"
        self.start(self.accept)

    def start(self, run, *arguments):
        self.threads.append(threading.Thread(target=run, args=arguments, daemon=True))
        self.threads[-1].start()

    def accept(self):
        while True:
            try:
                client, _ = self.listener.accept()
            except OSError:
                return
            host, port = self.server.split(":")
            server = socket.create_connection((host, int(port)))
            self.connections += 1
            self.ends += [client, server]
            self.start(self.forward, client, server, True)
            self.start(self.forward, server, client, False)

    def forward(self, source, target, is_client):
        passed = 0
        try:
            while data := source.recv(65536):
                target.sendall(data)
                if is_client:
                    passed += len(data)
                    self.bytes_from_client += len(data)
                    if self.cut_after and passed >= self.cut_after:
                        break
        except OSError:
            pass
        self.shut(source, target)

    @staticmethod
    def shut(*ends):
        for end in ends:
            try:
                end.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass

    def close(self):
        self.shut(self.listener)
        self.threads[0].join()
        self.shut(*self.ends)
        for thread in self.threads:
            thread.join()
        for end in (self.listener, *self.ends):
            end.close()


def fetched(folder):
    """Results but what stays with the daemon: the meshes from which a job is resumed."""
    return {name: content for name, content in results(folder).items() if os.path.basename(name) != "unrefined.ply"}


class Library(StudioTest):
    def setUp(self):
        super().setUp()
        self.daemon = None
        os.mkdir(self.path("allowed"))
        self.start_daemon()

    def start_daemon(self):
        address = self.path("address")
        self.log = open(self.path("weftd.log"), "a")
        self.addCleanup(self.log.close)
        self.daemon = subprocess.Popen(
            [os.path.join(BIN, "weftd"), "--listen", "127.0.0.1:0", "--address-file", address, "--state", self.path("state"),
             "--allow-path", self.path("allowed"), "--workers", "1"], stdout=self.log, stderr=self.log)
        self.addCleanup(self.kill_daemon)
        self.server = wait_for(lambda: os.path.exists(address) and read(address).strip(), "weftd to listen")

    def kill_daemon(self):
        self.daemon.kill()
        self.daemon.wait()

    def library(self, *words, server=None, check=0):
        return weft("library", words[0], "--server", server or self.server, *words[1:], check=check)

    def item(self, *words, **options):
        return json.loads(self.library(*words, "--json", **options).stdout)

    def proxy(self, cut_after):
        proxy = CuttingProxy(self.server, cut_after)
        self.addCleanup(proxy.close)
        return proxy

    def large_rig(self, size):
        """A rig.json of `size` bytes."""
        path, rig = self.path("rig.json"), read(f"{self.take}/rig.json")
        write(path, rig + " " * (size - len(rig)))
        return path

    def uploaded_bytes(self):
        found = 0
        for base, _, names in os.walk(self.path("state", "uploads")):
            found += sum(os.path.getsize(os.path.join(base, name)) for name in names if name != "upload.json")
        return found

    def test_gives_the_same_files_as_a_registration_without_it(self):
        self.assert_refused(self.register("--server", self.server), "--allow-path")
        self.register("--server", self.server, "--upload", "--observations", check=0)
        local = self.path("local")
        self.register("--observations", check=0, out=local)
        self.assertEqual(sum(name.endswith("mesh.ply") for name in fetched(local)), 3)
        self.assertEqual(fetched(self.out), fetched(local))
        job = json.loads(weft("job", "list", "--server", self.server, "--json", check=0).stdout)["jobs"][0]
        items = {item["kind"]: item["id"] for item in self.item("list")["items"]}
        self.assertEqual({name: item for name, item in job["items"].items() if item},
                         {name: items[f"ITEM_KIND_{kind}"] for name, kind in
                          (("dump", "DUMP"), ("rig", "RIG"), ("board", "BOARD"), ("garment", "TEMPLATE"))})

        again, proxy = self.path("again"), self.proxy(0)
        self.register("--server", proxy.address, "--upload", "--observations", check=0, out=again)
        self.assertEqual(fetched(again), fetched(local))
        sizes = sum(os.path.getsize(os.path.join(base, name)) for base, _, names in os.walk(self.take) for name in names)
        self.assertLess(proxy.bytes_from_client, sizes // 4)  # what is there is not sent again

        named = self.path("named")
        self.register("--server", self.server, "--observations", check=0, out=named, dump="library:take", rig="library:rig@1",
                      board="library:board", template="library:template")
        self.assertEqual(fetched(named), fetched(local))

    def test_upload_over_a_network_that_breaks_goes_on(self):
        size = 12 << 20
        proxy = self.proxy(4 << 20)  # no connection carries all of it
        item = self.item("upload", "rig", self.large_rig(size), server=proxy.address)
        self.assertEqual(int(item["bytes"]), size)
        self.assertGreaterEqual(proxy.connections, 4)
        self.assertEqual(read(self.path("state", "library", "rig", item["id"], "content", "rig.json")), read(self.path("rig.json")))

    def test_upload_of_a_killed_client_goes_on(self):
        size = 32 << 20
        path, proxy = self.large_rig(size), self.proxy(0)
        client = subprocess.Popen([os.path.join(BIN, "weft"), "library", "upload", "rig", path, "--server", proxy.address],
                                  stdout=subprocess.DEVNULL)
        wait_for(lambda: self.uploaded_bytes() > 8 << 20, "a part to arrive", pause_s=0.001)
        client.send_signal(signal.SIGKILL)
        client.wait()
        self.assertEqual(self.item("list").get("items", []), [])  # nothing half there
        there = self.uploaded_bytes()
        self.kill_daemon()
        os.remove(self.path("address"))
        self.start_daemon()
        again = self.proxy(0)
        self.assertEqual(int(self.item("upload", "rig", path, server=again.address)["bytes"]), size)
        self.assertLess(again.bytes_from_client, size - there + (1 << 20))
        self.assertEqual(os.listdir(self.path("state", "uploads")), [])

    def test_keeps_versions_and_gives_files_back(self):
        rig = self.path("rig.json")
        for spaces in ("", " "):
            write(rig, read(f"{self.take}/rig.json") + spaces)
            self.library("upload", "rig", rig, "--name", "studio")
        listing = self.library("list", "rig").stdout
        self.assertIn("studio@1", listing)
        self.assertIn("studio@2", listing)
        self.library("get", "rig", "studio", "--out", self.path("new"))
        self.assertEqual(read(self.path("new", "rig.json")), read(rig))
        self.library("get", "rig", "studio@1", "--out", self.path("old"))
        self.assertEqual(read(self.path("old", "rig.json")), read(f"{self.take}/rig.json"))
        self.library("upload", "template", f"{self.take}/template")
        self.library("get", "template", "template", "--out", self.path("shirt"))
        for name in os.listdir(f"{self.take}/template"):
            self.assertEqual(read(self.path("shirt", name), "rb"), read(f"{self.take}/template/{name}", "rb"))
        self.library("delete", "rig", "studio@2")
        self.assertNotIn("studio@2", self.library("list").stdout)
        self.assertIn("studio@1", self.library("get", "rig", "studio@3", check=2).stderr)

    def test_refuses_what_no_job_can_read(self):
        write(self.path("rig.json"), '{"cameras": 3}')
        done = self.library("upload", "rig", self.path("rig.json"), check=2)
        self.assertIn("rig.json", done.stderr)
        self.assertIn("cameras", done.stderr)
        self.assertIn("give rig, board, template, dump, avatar or garment", self.library("upload", "shoe", self.take, check=2).stderr)
        self.assertIn("HOST:PORT", self.register("--upload", check=2).stderr)
        self.assertEqual(self.item("list").get("items", []), [])

    def test_keeps_what_an_unfinished_job_uses(self):
        for frame in range(len(self.frames), 60):  # for a job that lasts a while
            os.mkdir(os.path.join(self.take, f"{frame:04}"))
            for image in self.images:
                os.link(self.image(frame % 3, self.images.index(image)), os.path.join(self.take, f"{frame:04}", image))
        job = self.register("--server", self.server, "--upload", "--detach", check=0).stdout.strip()
        for kind, name in (("dump", "take"), ("rig", "rig"), ("board", "board"), ("template", "template")):
            self.assertIn(job, self.library("delete", kind, name, check=2).stderr)
        self.kill_daemon()
        os.remove(self.path("address"))
        self.start_daemon()  # and still after a restart
        self.assertIn(job, self.library("delete", "dump", "take", check=2).stderr)
        weft("job", "cancel", job, "--server", self.server, check=0)
        self.library("delete", "dump", "take")
        self.assertFalse(os.listdir(self.path("state", "library", "dump")))


if __name__ == "__main__":
    unittest.main()
