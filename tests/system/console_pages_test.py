"""The console's pages in a browser, with a live daemon: who may come in, and what happens when the daemon goes."""

import gzip
import json
import os
import unittest

from browser import PAGES, need_browser
from console_studio import DAEMON_GONE, TABLET, ConsoleDaemon
from studio import read, wait_for, weft

MOST_COMPRESSED_BYTES = 500_000


def setUpModule():
    need_browser()


class ConsolePages(ConsoleDaemon, unittest.TestCase):
    def test_without_a_mouse_from_the_token_to_the_daemons_state(self):
        token = self.token("anna", "operator")
        self.begin()
        # 401 is the answer while nobody is logged in, and of a token that lets nobody in.
        browser = self.browser(expected=["401"])
        browser.see("Show your token once")
        self.look(browser, "login")
        browser.fill("Token", "weft_wrong")
        browser.press("Enter")
        browser.see("This token lets nobody in")
        self.log_in(browser, token)
        self.assertEqual(browser.evaluate("localStorage.length + document.cookie.length + sessionStorage.length") > 40, False)
        browser.press("g", "s")
        browser.see("Recording time left")
        browser.see("free", ".server-status")
        self.look(browser, "server")
        browser.press("?")
        browser.see("Go to Server")
        self.look(browser, "keys")
        browser.press("Escape")
        browser.press("d")
        self.assertEqual(browser.evaluate("document.documentElement.dataset.theme"), "light")
        self.look(browser, "server-light")
        # Its cookie stays when the page is loaded again, and not after the user left.
        browser.page("reload")
        browser.see("connected", ".connection")
        browser.role("button", "Log out", "press", "Enter")
        browser.see("Show your token once")
        self.assertNotIn(token, browser.page("url"))

    def test_goes_on_when_the_daemon_is_back(self):
        self.begin()
        browser = self.browser(TABLET, expected=["401", *DAEMON_GONE])
        self.log_in(browser, self.token("anna", "viewer"))
        browser.press("g", "s")
        browser.see("Recording time left")
        started = browser.css("dd:near(dt:text('Runs since'))", "textContent")
        browser.evaluate("window.stays = true")
        self.kill_daemon()
        browser.see("connection lost", ".connection")
        self.look(browser, "lost")
        self.begin()
        browser.see("connected", ".connection")
        wait_for(lambda: browser.css("dd:near(dt:text('Runs since'))", "textContent") != started, "the new daemon's state")
        self.assertTrue(browser.evaluate("window.stays"))
        self.look(browser, "server-back")

    def test_a_revoked_token_ends_in_the_form(self):
        self.begin()
        browser = self.browser(expected=["401", "WebSocket"])
        self.log_in(browser, self.token("anna", "viewer"))
        tokens = json.loads(weft("access", "list", "--json", "--state", self.path("state"), check=0).stdout)["tokens"]
        weft("access", "revoke", tokens[0]["id"], "--state", self.path("state"), check=0)
        browser.see("Your session is over")

    def test_the_first_page_is_small_and_loads_nothing_from_elsewhere(self):
        sizes = {}
        page = read(os.path.join(PAGES, "index.html"))
        for name in os.listdir(os.path.join(PAGES, "assets")):
            if name in page:
                sizes[name] = len(gzip.compress(read(os.path.join(PAGES, "assets", name), "rb")))
        self.assertTrue(any(name.endswith(".js") for name in sizes), sizes)
        self.assertLess(sum(sizes.values()) + len(page), MOST_COMPRESSED_BYTES, sizes)
        self.assertNotIn("<style", page)
        self.assertNotRegex(page, r"<script(?![^>]* src=)")
        self.assertNotRegex(page, r"https?://")


if __name__ == "__main__":
    unittest.main()
