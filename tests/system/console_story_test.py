"""A shoot from a browser: cameras, a take with live registration, its ledger, and what is lost. See live_studio.py."""

import contextlib
import json
import os
import signal
import subprocess
import unittest

from browser import need_browser
from console_studio import DAEMON_GONE, ConsoleDaemon
from console_test import Page
from live_studio import enter_network, packet_loss, set_up_network
from studio import BIN, StudioTest, processes_of, read, wait_for, weft, write


def setUpModule():
    need_browser()
    set_up_network([])


class ConsoleStory(ConsoleDaemon, StudioTest):
    def setUp(self):
        super().setUp()
        self.session = self.path("session.json")
        self.cameras = subprocess.Popen([os.path.join(BIN, "weft"), "camera", "fake", "--pictures", self.take, "--fps", "2",
                                         "--session", self.session], stdout=subprocess.PIPE, text=True)
        self.addCleanup(self.cameras.communicate)
        self.addCleanup(self.cameras.terminate)
        self.cameras.stdout.readline()
        self.addCleanup(self.end_recorders)
        # For the frames of a set, because the machine may have other things to do.
        write(self.session, json.dumps({**json.loads(read(self.session)), "max_wait_ms": 5000}))
        self.begin()
        for kind, file in (("rig", "rig.json"), ("board", "board.json"), ("template", "template")):
            weft("library", "upload", kind, f"{self.take}/{file}", "--name", "shirt", "--server", self.addresses[0], check=0)

    def end_recorders(self):
        """They outlive their daemon, also that of a test that failed."""
        for process in processes_of(self.folder, "weft-recorder"):
            os.kill(process, signal.SIGKILL)

    @contextlib.contextmanager
    def small_disk(self, mib):
        """Of the takes."""
        takes = self.path("state", "takes")
        os.makedirs(takes, mode=0o700, exist_ok=True)
        subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={mib}m,mode=700", "tmpfs", takes], check=True)
        try:
            yield
        finally:
            subprocess.run(["umount", "--lazy", takes], check=True)

    def open_session(self, page):
        page.press("g", "c")
        page.press("n")
        page.order(find=["getByLabel", "From a file instead (session.json)", {"exact": True}], do="setInputFiles", args=[self.session])
        for label in ("Rig", "Board", "Template"):
            page.fill(label, "library:shirt")
        self.look(page, "open-session")
        page.css("dialog button.main", "click")

    def shows_pictures(self, page):
        """Whether each camera's canvas has a picture that is not of one colour."""
        return page.evaluate("""[...document.querySelectorAll('.picture canvas')].map(canvas => {
            const pixels = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data
            return new Set(pixels.filter((_, i) => i % 4 == 0)).size > 8 })""")

    def test_a_take_from_the_cameras_to_its_ledger(self):
        page = self.browser(expected=["401"])
        self.log_in(page, self.token("anna", "operator"))
        self.open_session(page)
        count = len(json.loads(read(self.session))["cameras"])
        wait_for(lambda: (shown := self.shows_pictures(page)) and len(shown) == count and all(shown), "pictures of all cameras", 0.5)
        page.see("focus", ".measures")
        self.look(page, "cameras")
        page.css(".picture", "click")
        page.see("ExposureTime", "dialog label")
        self.look(page, "camera")
        page.press("Escape")
        page.fill("Slate", "12A take 1")
        page.css("select", "selectOption", "10")
        page.role("button", "Start a take")
        page.css("[role=timer]", "waitFor")
        self.look(page, "countdown")
        page.see("sets", ".running")
        page.see("cloth seen", ".running")
        page.see("Mbit/s", ".measures")
        wait_for(lambda: float(page.css(".coverage progress", "getAttribute", "value")) > 0.2, "live meshes", 0.5)
        # The newest mesh, with what cameras saw of the cloth so far.
        page.see("Frame ", ".live-mesh")
        page.see("shown so far", ".live-mesh")
        page.see("in step", ".link-board")
        self.look(page, "recording")
        # What a take loses is seen and heard.
        page.evaluate("""window.beeps = 0
            const start = OscillatorNode.prototype.start
            OscillatorNode.prototype.start = function (...at) { ++window.beeps; return start.apply(this, at) }""")
        with packet_loss(0.7):
            wait_for(lambda: page.evaluate("window.beeps") >= 2, "a sound", 0.2)
            page.see("lost a frame", ".alarmed")
            self.look(page, "lost-frame")
        page.role("button", "Stop")
        page.role("button", "Start a take", "waitFor")
        self.assertEqual(page.evaluate("document.querySelector('.take-control input').value"), "12A take 2")
        page.press("g", "t")
        page.see("12A take 1", "a.row")
        page.press("j", "Enter")
        page.see("12A take 1", "h1")
        page.see("frame missing", "tr.bad")
        page.see("Sets with all cameras")
        self.look(page, "take-with-losses")
        page.press("g", "j")
        page.css("a.row", "waitFor")
        page.press("j", "Enter")
        page.see("Registration of take", "h1")
        ended = "/cancelled|done|degraded/.test(document.querySelector('.facts .badge')?.innerText)"
        if not page.evaluate(ended):  # a quick machine has registered all by now
            page.role("button", "Cancel")
            page.role("button", "Cancel the job")
        wait_for(lambda: page.evaluate(ended), "the job to end", 0.5)
        # What was recorded is registered, as far as a test has time.
        page.page("goBack")
        page.press("g", "t")
        page.see("12A take 1", "a.row")
        page.press("j", "Enter")
        page.role("button", "Register")
        page.fill("Frames, “0003:0010”; empty: all", ":0003")
        page.css("dialog button.main", "click")
        page.see("frames registered", ".verdict")
        page.css(".frame.done, .frame.degraded", "click")
        page.see("cells", "figcaption small")
        self.look(page, "job-of-the-take")
        self.compare(page)

    def compare(self, page):
        """The job's meshes, scrubbed, and beside those that were made while the take was recorded."""
        page.css("a:has-text('View in 3D')", "click")
        page.see("first frame after", ".player-stats")
        page.css(".player-scrub input", "focus")
        page.press("ArrowRight", "End", "Home")
        page.css("label:has-text('Compare with') select", "selectOption", {"index": 1})
        page.see("To the other job", ".player-difference")
        self.look(page, "difference")
        page.order(find=["getByLabel", "Side by side", {"exact": True}], do="check", args=[])
        self.look(page, "side-by-side")
        page.page("goBack")

    def test_failures_are_said_and_overcome(self):
        refused = ["401", *DAEMON_GONE, "409"]
        tokens = [self.token(name, "operator") for name in ("anna", "bert")]
        page = self.browser(expected=refused)
        self.log_in(page, tokens[0])
        self.open_session(page)
        page.see("focus", ".measures")
        page.css("select", "selectOption", "0")
        with self.small_disk(2700):  # recording stops at 2048
            page.role("button", "Start a take")
            page.see("disk nearly full")
            self.look(page, "disk-nearly-full")
        page.role("button", "Start a take")
        page.see("sets", ".running")
        # The daemon is killed: the recorder goes on, and so does the page when the next daemon is there.
        page.evaluate("window.stays = true")
        self.kill_daemon()
        page.see("connection lost", ".connection")
        self.look(page, "daemon-away")
        self.begin()
        page.see("connected", ".connection")
        page.see("sets", ".running")  # the new daemon says a little later what is recorded
        sets = "parseInt(document.querySelector('.running').innerText.match(/([\\d,]+) sets/)[1].replace(',', ''))"
        before = page.evaluate(sets)
        wait_for(lambda: page.evaluate(sets) > before, "further frame sets", 0.3)
        self.assertTrue(page.evaluate("window.stays"))
        # All cameras are unplugged.
        self.cameras.terminate()
        page.see("lost a frame", ".alarmed")
        self.look(page, "unplugged")
        page.role("button", "Stop")
        page.role("button", "Start a take", "waitFor")
        page.see("cannot be looked at")
        page.see("old picture", ".camera")
        self.look(page, "no-cameras")
        # Somebody else takes the cameras over.
        other = Page(self.port)
        other.log_in(tokens[1])
        status, opened = other.call("Sessions/OpenSession", {"cameras": json.loads(read(self.session)), "owner": "bert", "takeOver": True})
        self.assertEqual(status, 200, opened)
        page.see("This session has ended")
        page.see("bert", "td")
        self.look(page, "taken-over")


if __name__ == "__main__":
    enter_network()
    unittest.main()
