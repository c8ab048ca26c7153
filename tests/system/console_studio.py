"""A weftd whose console a browser shows."""

import os
import tempfile

from browser import Browser
from console_test import free_port
from daemon_process import DaemonProcess
from studio import weft

PICTURES = os.environ.get("WEFT_SCREENSHOTS")  # a folder for pictures of the pages, to be looked at
WIDE, TABLET = (1440, 900), (820, 1180)

# What a page may complain of while its daemon is killed: a request is refused, cut, or not answered, as the moment has it.
DAEMON_GONE = ["WebSocket", "ERR_CONNECTION_REFUSED", "ERR_CONNECTION_RESET", "ERR_EMPTY_RESPONSE"]


class ConsoleDaemon(DaemonProcess):
    """For a TestCase, before it."""

    def setUp(self):
        super().setUp()
        if not hasattr(self, "folder"):
            folder = tempfile.TemporaryDirectory(prefix="weft console ")
            self.addCleanup(folder.cleanup)
            self.folder = folder.name
        os.mkdir(self.path("state"), mode=0o700)
        self.port = free_port()

    def begin(self, *more):
        self.start_plainly("--console", f"127.0.0.1:{self.port}", "--workers", "1", *more)

    def token(self, name, role):
        return weft("access", "token", name, "--role", role, "--state", self.path("state"), check=0).stdout.strip()

    def browser(self, size=WIDE, expected=()):
        """A page that must not complain, and hears from nobody else. `expected`: words of what it may complain of."""
        browser = Browser(*size)

        def end():
            troubles = [text for text in browser.troubles() if not any(words in text for words in expected)]
            browser.close()
            self.assertEqual(troubles, [])
        self.addCleanup(end)
        browser.page("goto", f"http://127.0.0.1:{self.port}/")
        return browser

    def log_in(self, browser, token):
        browser.fill("Token", token)
        browser.press("Enter")
        browser.see("connected", ".connection")

    def look(self, browser, name):
        """Nothing serious for those who cannot see or use a mouse, and no sideways scrolling; pictures for those who look."""
        for size, ending in ((TABLET, "-tablet"), (WIDE, "")):
            browser.page("setViewportSize", {"width": size[0], "height": size[1]})
            self.assertEqual(browser.serious(), [], f"{name}{ending}")
            self.assertLessEqual(browser.evaluate("document.documentElement.scrollWidth - innerWidth"), 0, f"{name}{ending}")
            if PICTURES:
                browser.screenshot(os.path.join(PICTURES, f"{name}{ending}.png"))
