"""Debian's chromium, driven by playwright-core as the console's build installed it."""

import json
import os
import shutil
import subprocess
import unittest

from studio import BIN

SOURCE = os.environ["WEFT_SOURCE"]
BUILT = os.path.join(BIN, "..", "console")
PAGES = os.path.join(BUILT, "dist")
MODULES = os.path.abspath(os.path.join(BUILT, "node_modules"))


def why_no_browser():
    """Empty where there is one, and the console's pages were built."""
    if not os.path.exists("/usr/bin/chromium") or not shutil.which("node"):
        return "chromium or node is not installed"
    if not os.path.exists(os.path.join(PAGES, "index.html")) or not os.path.exists(os.path.join(MODULES, "playwright-core")):
        return "the console's pages were not built"
    return ""


def need_browser():
    """Skips tests where there is none."""
    if why_no_browser():
        raise unittest.SkipTest(why_no_browser())


class PageTest(unittest.TestCase):
    """Opens pages of files and reads what they show. Nothing of them may fail, or load anything."""

    @classmethod
    def setUpClass(cls):
        need_browser()
        super().setUpClass()
        cls.browser = Browser()
        cls.addClassCleanup(cls.browser.close)

    def show(self, path):
        """Its text, as it is seen."""
        self.browser.page("goto", f"file://{path}")
        return self.js("document.querySelector('main').innerText")

    def js(self, expression):
        return self.browser.evaluate(expression)

    def texts(self, selector):
        return self.js(f"[...document.querySelectorAll({json.dumps(selector)})].map(one => one.textContent)")

    def rows(self, selector):
        """Texts of the cells of a table's rows, white space as one blank."""
        return self.js(f"[...document.querySelectorAll({json.dumps(selector + ' tbody tr')})].map(row => "
                       "[...row.cells].map(cell => cell.textContent.replace(/\\s+/g, ' ').trim()))")

    def tearDown(self):
        self.assertEqual(self.browser.troubles(), [])
        super().tearDown()


class Browser:
    """One page. What is looked for is waited for, four minutes at most."""

    def __init__(self, width=1280, height=800):
        self.process = subprocess.Popen(
            ["node", os.path.join(SOURCE, "tests", "system", "readers", "drive_page.mjs"), str(width), str(height)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env={**os.environ, "WEFT_NODE_MODULES": MODULES})

    def order(self, **what):
        self.process.stdin.write(json.dumps(what) + "\n")
        self.process.stdin.flush()
        answer = json.loads(self.process.stdout.readline() or '{"error": "the browser ended"}')
        if "error" in answer:
            raise AssertionError(f"{what}: {answer['error']}")
        return answer["value"]

    def page(self, method, *args):
        return self.order(page=method, args=args)

    def press(self, *keys):
        for key in keys:
            self.order(keyboard="press", args=[key])

    def role(self, role, name, do="click", *args, exact=True):
        """Of what assistive technology calls a `role` with this name."""
        return self.order(find=["getByRole", role, {"name": name, "exact": exact}], do=do, args=args)

    def fill(self, label, text):
        self.order(find=["getByLabel", label, {"exact": True}], do="fill", args=[text])

    def css(self, selector, do, *args):
        return self.order(find=["locator", selector], do=do, args=args)

    def see(self, text, selector=None):
        """Until it is visible."""
        words = json.dumps(text)
        find = ["locator", f"{selector}:has-text({words}):visible" if selector else f":text({words}):visible"]
        self.order(find=find, do="waitFor", args=[])

    def see_no(self, text):
        self.order(find=["getByText", text], do="waitFor", args=[{"state": "hidden"}])

    def evaluate(self, script):
        return self.page("evaluate", script)

    def screenshot(self, path):
        self.page("screenshot", {"path": path})

    def serious(self):
        """What axe-core finds on the page as it stands that is serious or worse."""
        return [found for found in self.order(axe={"resultTypes": ["violations"]}) if found["impact"] in ("serious", "critical")]

    def troubles(self):
        return self.order(troubles=True)

    def close(self):
        self.process.stdin.close()
        self.process.wait(60)
        self.process.stdout.close()
